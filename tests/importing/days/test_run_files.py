"""Which files of a season are one run, and what belongs to none."""

from __future__ import annotations

from pathlib import Path

import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.days.run_files import find_run_files


def write(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("time_s\n", encoding="utf-8")
    return folder


def names_of(folder: Path) -> dict[str, list[str]]:
    runs, _ = find_run_files(folder, folder / "out")
    return {run.name: sorted(path.name for path in run.files) for run in runs}


def test_a_folder_of_one_of_each_kind_is_a_run_and_of_several_is_many(tmp_path: Path) -> None:
    write(tmp_path, "one/run.bvh", "one/track.gpx", "many/a.bvh", "many/a.gpx", "many/b.bvh", "top.tcx")
    assert names_of(tmp_path) == {
        "one": ["run.bvh", "track.gpx"], "many/a": ["a.bvh", "a.gpx"], "many/b": ["b.bvh"], "top": ["top.tcx"],
    }  # fmt: skip


def test_parts_of_a_run_are_found_by_the_last_word_of_their_names(tmp_path: Path) -> None:
    write(
        tmp_path,
        "Mon_1_imu.csv",
        "Mon_1_gnss.csv",
        "Mon_2_left_ski.csv",
        "Mon_2_gps.gpx",
        "alone_gps.gpx",
        "a_track.gpx",
    )
    assert names_of(tmp_path) == {
        "Mon_1": ["Mon_1_gnss.csv", "Mon_1_imu.csv"], "Mon_2": ["Mon_2_gps.gpx", "Mon_2_left_ski.csv"],
        "a_track": ["a_track.gpx"], "alone_gps": ["alone_gps.gpx"],
    }  # fmt: skip
    runs, _ = find_run_files(tmp_path, tmp_path / "out")
    assert [str(path).partition("=")[0] for run in runs for path in run.files if "=" in str(path)] == ["left_ski"]


def test_folders_within_folders_exports_and_archives_are_read(tmp_path: Path) -> None:
    write(
        tmp_path, "january/ada/phone/Gyroscope.csv", "january/ada/phone/Location.csv", "january/ada/phone/Metadata.csv"
    )
    write(tmp_path, "january/bo/export.zip", "out/old.gpx", ".hidden/run.gpx")
    assert names_of(tmp_path) == {
        "january/ada/phone": ["Gyroscope.csv", "Location.csv"], "january/bo/export": ["export.zip"],
    }  # fmt: skip


def test_what_belongs_to_no_run_is_listed_and_what_lies_next_to_one_is_noted(tmp_path: Path) -> None:
    write(tmp_path, "day/run.bvh", "day/photo.jpg", "list.xlsx", "made/recording.toml", "made/gps.csv")
    (tmp_path / "loop").symlink_to(tmp_path)
    runs, unread = find_run_files(tmp_path, tmp_path / "out")
    assert [(run.name, run.others) for run in runs] == [("day", ["photo.jpg"])]
    assert {entry.name: entry.why.split(" ")[0] for entry in unread} == {"list.xlsx": "no", "made": "a", "loop": "a"}


def test_of_texts_of_anything_those_with_sentences_are_tracks(tmp_path: Path) -> None:
    write(tmp_path, "day/run.bvh", "day/install.log", "day/notes.txt", "next/run.bvh")
    for name in ("day/receiver.log", "next/receiver.txt"):
        (tmp_path / name).write_text("$GPGSA,A,3,08,29,27,28,26,24,,,,,,,3.2,1.7,2.7*3E\n", encoding="utf-8")
    assert names_of(tmp_path) == {"day": ["receiver.log", "run.bvh"], "next": ["receiver.txt", "run.bvh"]}


def test_work_is_bounded(tmp_path: Path) -> None:
    write(tmp_path, "/".join("abcdefghij") + "/run.gpx")
    with pytest.raises(InputError, match="more than 8 folders within folders"):
        find_run_files(tmp_path, tmp_path / "out")
