"""From a day's files to a recording of every run, and their table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from a_day_out import write_day
from fix_files import gpx, tcx
from strapped import LAG
from tiny import Columns, Tiny

import sssi_exudyn
from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.days.day import TABLE
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLE = Path(__file__).parents[3] / "examples" / "intermediate"


@pytest.fixture(scope="module")
def whole() -> Recording:
    return read_recording(EXAMPLE)


def watch(runs: int) -> Columns:
    """Return fixes of runs of 130 m down in 90 s, and of lifts of 300 s, one a second."""
    time = np.arange(0.0, runs * 390.0 + 60.0, 1.0)
    phase = time % 390.0
    share = np.where(phase < 300.0, phase / 300.0, 1.0 - (phase - 300.0) / 90.0)
    share[time >= runs * 390.0] = 0.0
    degrees = 0.007 * share + 2e-7 * np.sin(time)
    return {
        "time_s": time,
        "latitude_deg": 46.8 + degrees,
        "longitude_deg": 9.8 + 0.1 * degrees,
        "altitude_m": 1800.0 + 130.0 * share,
    }


def table_of(folder: Path) -> list[dict[str, str]]:
    with (folder / TABLE).open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.long
def test_a_telephones_day_becomes_a_recording_of_every_run(
    whole: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    begins = write_day(whole, tmp_path / "export")
    with pytest.raises(SystemExit) as end:
        main(["import", str(tmp_path / "export"), "--out", str(tmp_path / "day"), "--mass-kg", "84", "--quiet"])
    assert not end.value.code
    shown = capsys.readouterr().out
    assert "Location.csv holds 2 runs" in shown
    assert "--run N" in shown
    rows = table_of(tmp_path / "day")
    runs = [row for row in rows if row["kind"] == "run"]
    assert [row["recording"] for row in runs] == ["run_01", "run_02"]
    assert {row["kind"] for row in rows} == {"run", "lift", "pause"}
    for row, began in zip(runs, begins, strict=True):
        assert float(row["start_s"]) == pytest.approx(began, abs=5.0)  # the skier of the example starts slowly
        made = read_recording(tmp_path / "day" / row["recording"])
        assert made.completed is not None
        assert made.completed.lag is not None
        assert made.completed.lag.value == pytest.approx(LAG, abs=0.5)  # as of the few sensors' own files
        assert made.skier.mass == 84.0
        assert "of the track, 2023-11-14" in made.note
        assert any("in a pocket" in notice for notice in made.notices)
        assert made.stop - made.start == pytest.approx(float(row["duration_s"]), abs=6.0)
    again = sssi_exudyn.import_day(tmp_path / "export", tmp_path / "day")
    assert [piece.status for piece in again if piece.run] == ["there already"] * 2


@pytest.mark.long
def test_one_run_of_a_day_is_that_of_the_day(whole: Recording, tmp_path: Path) -> None:
    write_day(whole, tmp_path / "export", split=False)
    alone = sssi_exudyn.import_files(tmp_path / "export", tmp_path / "alone", 2)
    pieces = sssi_exudyn.import_day(tmp_path / "export", tmp_path / "day")
    assert [piece.status for piece in pieces if piece.run] == ["imported"] * 2
    of_day = read_recording(tmp_path / "day" / "run_02")
    assert alone.completed is not None
    assert of_day.completed is not None
    np.testing.assert_array_equal(alone.completed.edge, of_day.completed.edge)
    with pytest.raises(InputError, match=r"the track holds 2 run\(s\), and none of number 3"):
        sssi_exudyn.import_files(tmp_path / "export", tmp_path / "third", 3)


@pytest.mark.parametrize("name", ["day.tcx", "day.gpx"])
def test_runs_of_a_watch_alone_are_listed_with_what_is_missing(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text((tcx if name.endswith("tcx") else gpx)(watch(4)), encoding="utf-8")
    with pytest.raises(SystemExit) as end:
        main(["import", str(tmp_path / name), "--out", str(tmp_path / "day"), "--quiet"])
    assert end.value.code != 0
    said = capsys.readouterr()
    assert f"lists the 4 runs of {name}; a recording needs the skier's motion too" in said.err
    assert said.err.count("\n") == 1
    assert said.out.count("listed") == 4
    rows = [row for row in table_of(tmp_path / "day") if row["run"]]
    assert [row["run"] for row in rows] == ["1", "2", "3", "4"]
    for row in rows:
        assert float(row["vertical_m"]) == pytest.approx(130.0, abs=5.0)
        assert float(row["duration_s"]) == pytest.approx(90.0, abs=5.0)
        assert float(row["length_m"]) == pytest.approx(np.hypot(0.007 * 111_200.0, 130.0), rel=0.03)
        assert row["file"] == name
        assert len(row["sha256"]) == 64
    assert rows[0]["start_utc"].startswith("2026-02-02T00:04:5")  # 300 s after three seconds before midnight
    assert not (tmp_path / "day" / "run_01").exists()


def test_a_run_of_a_track_needs_a_sensor_and_no_capture(tmp_path: Path) -> None:
    track = tmp_path / "day.gpx"
    track.write_text(gpx(watch(2)), encoding="utf-8")
    with pytest.raises(InputError, match="no file holds a motion capture or a sensor"):
        sssi_exudyn.import_files(track, tmp_path / "out", 1)
    folder = Tiny().write(tmp_path / "tiny")
    with pytest.raises(InputError, match="a motion capture covers one run"):
        sssi_exudyn.import_files([folder / "motion.bvh", track], tmp_path / "out", 1)
    with pytest.raises(InputError, match="a motion capture covers one run"):
        sssi_exudyn.import_day([folder / "motion.bvh", track], tmp_path / "out")
    with pytest.raises(InputError, match="no file holds fixes"):
        sssi_exudyn.import_day([folder / "insoles.csv"], tmp_path / "out")


@pytest.mark.long
def test_a_log_that_is_longer_than_any_run_is_cut_to_the_one_descent(
    whole: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_day(whole, tmp_path / "export", runs=1, split=False)
    monkeypatch.setattr("sssi_exudyn.importing.days.day.MAX_SENSOR", 3000)  # as if it were of hours
    made = sssi_exudyn.import_files(tmp_path / "export", tmp_path / "out")
    assert "run 1 of 1 of the track" in made.note
    assert made.completed is not None
    assert made.stop - made.start < 25.0
    write_day(whole, tmp_path / "two", runs=2, split=False)
    with pytest.raises(
        InputError, match=r"samples are more than any run has, and the track has 2; take one with --run"
    ):
        sssi_exudyn.import_files(tmp_path / "two", tmp_path / "none")


def test_what_no_day_has_is_refused(tmp_path: Path) -> None:
    time = 5.0 * np.arange(3000.0)
    up = np.where(np.arange(3000) % 12 < 6, 1.0, 0.0) * 60.0
    columns = {"time_s": time, "latitude_deg": 46.8 + 5e-4 * np.arange(3000.0), "longitude_deg": 9.8 + 1e-5 * time,
               "altitude_m": 1800.0 + up}  # fmt: skip
    (tmp_path / "day.gpx").write_text(gpx(columns), encoding="utf-8")
    with pytest.raises(InputError, match="runs are more than any day has"):
        sssi_exudyn.import_day(tmp_path / "day.gpx", tmp_path / "day")


def test_one_run_of_a_folder_of_runs_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["import", str(tmp_path), "--out", str(tmp_path / "out"), "--run", "2"])
    assert end.value.code == 2
    assert "it takes a run of a track, not of a folder" in capsys.readouterr().err


@pytest.mark.long
def test_runs_that_no_sensor_covers_are_listed(whole: Recording, tmp_path: Path) -> None:
    begins = write_day(whole, tmp_path / "export")
    for name in ("Gyroscope", "Accelerometer", "Gravity"):
        path = tmp_path / "export" / f"{name}.csv"
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        late = [row for row in rows if float(row.split(",")[1]) > begins[1] + 3.0]
        path.write_text("\n".join([head, *late]) + "\n", encoding="utf-8")
    pieces = sssi_exudyn.import_day(tmp_path / "export", tmp_path / "day")
    assert [(piece.status, piece.why) for piece in pieces if piece.run] == [
        ("listed", "no sensor covers it"),
        ("imported", ""),
    ]
