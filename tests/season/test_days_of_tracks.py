"""A season of tracks without any sensor: runs are listed, and those of one descent are compared all the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from a_season import compared_descents
from fix_files import gpx, tcx
from tiny import Columns

import sssi_exudyn
from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.season.descent import TRACK, track_of_fixes
from sssi_exudyn.season.listed import listed_tracks
from sssi_exudyn.season.page_descents import about_together, bound_of, sentences_of, together
from sssi_exudyn.season.shared_descents import compare_descents

DROP, LENGTH, LIFT = 100.0, 700.0, 240.0
"""m, m over ground, s."""


def day(seconds: tuple[float, ...]) -> Columns:
    """Return fixes, one a second, of runs down one plane at steady speeds that take so many seconds, and lifts."""
    place = []
    for duration in seconds:
        place += [
            np.linspace(0.0, 1.0, int(duration), endpoint=False),
            np.linspace(1.0, 0.0, int(LIFT), endpoint=False),
        ]
    share = np.concatenate([*place, np.zeros(30)])
    wander = 1e-7 * np.sin(np.arange(len(share)))  # a centimetre: no receiver repeats a place
    return {
        "time_s": np.arange(0.0, len(share)),
        "latitude_deg": 46.8 - share * LENGTH / 111_195.0 + wander,
        "longitude_deg": 9.8 + 1e-4 * share,
        "altitude_m": 1900.0 - DROP * share,
    }


@pytest.fixture
def tracks(tmp_path: Path) -> Path:
    """Import a day of four runs of which one is slower, and a file that no run is in."""
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "watch.gpx").write_text(gpx(day((80.0, 85.0, 120.0, 82.0))), encoding="utf-8")
    with pytest.raises(SystemExit):  # no run has a recording
        main(["import", str(tmp_path / "files"), "--out", str(tmp_path / "runs"), "--quiet"])
    return tmp_path / "runs"


def test_listed_runs_keep_their_fixes(tracks: Path) -> None:
    kept = dict(listed_tracks(tracks))
    assert list(kept) == [f"watch/run_{number:02d}" for number in range(1, 5)]
    track = track_of_fixes(kept["watch/run_03"]).to_pandas()
    assert track.columns.tolist() == list(TRACK)
    assert np.ptp(track["altitude_m"]) == pytest.approx(DROP, abs=2.0)
    assert np.median(track["speed_mps"]) == pytest.approx(LENGTH / 120.0, rel=0.02)


@pytest.mark.long(seconds=3)
def test_a_season_of_tracks_alone_compares_the_runs_of_a_descent(tracks: Path, tmp_path: Path) -> None:
    season = sssi_exudyn.run_season(tracks, tmp_path / "out", workers=1)
    assert season.counts["runs"] == 0
    assert season.table["place"].tolist() == ["A"] * 4
    (descent,) = season.descents
    assert [run.run for run in descent.runs] == season.table["run"].tolist()
    # at a steady speed all that is not lost in the air is lost on the snow: drop over way less k v²/g of the slower one
    expected = DROP / LENGTH - 0.0031 * 8.0**2 / 9.81
    assert descent.friction.low < expected < descent.friction.high
    assert sum(stretch.drop_m for stretch in descent.stretches) == pytest.approx(DROP * 0.93, rel=0.03)
    # all end as fast as they begin: slower ones lose less in the air and more on the snow, 0.01 of it
    assert descent.runs[2].more.value > max(run.more.value for run in descent.runs if run.run != "watch/run_03")
    assert abs(descent.runs[2].more.value) < descent.runs[2].seen
    assert not descent.differences
    page = season.page.read_text(encoding="utf-8")
    assert "The runs of a descent together" in page
    assert "No run is known to differ from the others" in page
    origin = json.loads((tmp_path / "out" / "season.json").read_text(encoding="utf-8"))
    assert set(origin["provenance"]["inputs"]) == {f"watch/run_{number:02d}.csv" for number in range(1, 5)}
    assert sssi_exudyn.load_season(tmp_path / "out").descents == season.descents
    del origin["descents"]  # as earlier versions wrote it
    (tmp_path / "out" / "season.json").write_text(json.dumps(origin), encoding="utf-8")
    assert sssi_exudyn.load_season(tmp_path / "out").descents == ()


def test_speeds_that_contradict_places_are_not_believed(tmp_path: Path) -> None:
    (tmp_path / "day.tcx").write_text(tcx(day((80.0, 85.0)), speed=3.0), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["import", str(tmp_path / "day.tcx"), "--out", str(tmp_path / "day"), "--quiet"])
    track = track_of_fixes(tmp_path / "day" / "run_01.csv").to_pandas()
    assert np.median(track["speed_mps"]) == pytest.approx(LENGTH / 80.0, rel=0.03)


def test_a_name_in_the_imports_table_leads_nowhere_else(tracks: Path, tmp_path: Path) -> None:
    (tmp_path / "secret.csv").write_text("time_s\n", encoding="utf-8")
    table = tracks / "recordings.csv"
    table.write_text(table.read_text(encoding="utf-8").replace("watch/run_01", "../secret"), encoding="utf-8")
    assert "../secret" not in dict(listed_tracks(tracks))


def test_a_folder_without_recordings_and_tracks_is_no_season(tmp_path: Path) -> None:
    (tmp_path / "runs" / "empty").mkdir(parents=True)
    with pytest.raises(InputError, match=r"no folder in it holds a recording\.toml"):
        sssi_exudyn.run_season(tmp_path / "runs", tmp_path / "out", workers=1)


def test_tracks_that_are_too_coarse_are_left_out(tracks: Path) -> None:
    frames = {name: track_of_fixes(path).to_pandas() for name, path in listed_tracks(tracks)}
    frames["watch/run_02"] = frames["watch/run_02"].iloc[::5]
    rows = pd.DataFrame({"run": list(frames), "place": "A", "skier": "Ada"})
    (descent,) = compare_descents(rows, frames)
    assert descent.left_out == ("watch/run_02",)
    assert len(descent.runs) == 3
    assert compare_descents(rows.assign(place=""), frames) == ()


def test_sentences_name_the_run_the_stretch_and_what_would_not_be_seen() -> None:
    descents = compared_descents()
    (descent,) = descents
    said = " ".join(sentences_of(descent))
    assert "pocket_2026-01-10_01 had 0.0" in said
    assert "more friction" in said
    assert "on all stretches alike (probability" in said
    assert "pocket_2026-01-10_00 alone had 0.1" in said
    assert "from 200 to 300 m (probability" in said
    assert "In all runs there was more friction than on the other stretches from 100 to 200 m (+0.0" in said
    assert "may not be noticed" in bound_of(descent)
    assert about_together(descents) == (
        "Of 3 runs, 1 had another friction than the others all along, and 1 on a stretch."
    )
    assert together(()) == ()
