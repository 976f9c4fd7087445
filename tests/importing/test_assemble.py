"""From files to a recording's folder: the options that are required, and that a failed import leaves nothing behind."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fix_files import START, gpx, nmea
from mvnx_file import SEGMENTS, mvnx
from tiny import ANSWERS, OFFSET, Tiny

from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import rotation_from_bvh
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.defaults import read_defaults
from sssi_exudyn.importing.motion_capture.mvnx import JOINT_OF_SEGMENT
from sssi_exudyn.recording.instruments.bvh import read_bvh, world_rotations
from sssi_exudyn.recording.instruments.gps import read_gps
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.uncertainty import Uncertainty

FILES = ("motion.bvh", "gps.csv", "insoles.csv")


def files(folder: Path, tiny: Tiny | None = None) -> list[Path]:
    written = (tiny or Tiny()).write(folder / "raw")
    return [written / name for name in FILES]


def test_imported_recording_is_the_recording(tmp_path: Path) -> None:
    sources = files(tmp_path)
    made = import_recording(sources, tmp_path / "out", ANSWERS)
    original, imported = read_recording(tmp_path / "raw"), read_recording(tmp_path / "out")
    assert (imported.skier, imported.equipment, imported.slope) == (original.skier, original.equipment, original.slope)
    assert imported.heading.value == original.heading.value
    assert made.folder == tmp_path / "out"
    order = [imported.bvh.index(name) for name in original.bvh.names]
    np.testing.assert_allclose(
        imported.bvh.rotations[:, order], original.bvh.rotations, atol=3e-8
    )  # six digits of a degree
    assert imported.gps is not None
    assert original.gps is not None
    np.testing.assert_allclose(imported.gps.enu, original.gps.enu, atol=1e-4)  # nine digits of a degree
    assert imported.insoles is not None
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*FILES, "recording.toml", ".lock"}


def test_forces_of_poles_are_known_by_the_files_name(tmp_path: Path) -> None:
    sources = files(tmp_path)
    time = np.arange(0.0, 3.0, 0.02)
    pressed = np.where((time > 1.0) & (time < 1.3), 80.0, 0.5)
    rows = [f"{t:.2f},{pressed[i]:.1f},{0.4 + 0.1 * (i % 2):.1f}" for i, t in enumerate(time)]
    poles = tmp_path / "Poles_run1.csv"
    poles.write_text("time_s,left_N,right_N\n" + "\n".join(rows) + "\n", encoding="utf-8")
    imported = import_recording([*sources, poles], tmp_path / "out", ANSWERS)
    assert imported.poles is not None
    assert imported.insoles is not None
    assert imported.poles.left.max() == pytest.approx(79.5)  # counted from rest
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*FILES, "poles.csv", "recording.toml", ".lock"}
    poles.write_text("time_s,left_N,right_N\n0.0,x,1.0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"Poles_run1\.csv"):
        import_recording([*sources, poles], tmp_path / "other", ANSWERS)


@pytest.mark.long
def test_unstated_facts_are_assumed_and_reported_as_assumed(tmp_path: Path) -> None:
    imported = import_recording(files(tmp_path), tmp_path / "out", Answers(mass_kg=70.0))
    (words,) = [notice for notice in imported.notices if notice.startswith("assumed")]
    for name in ("the skier is 1.75 m tall", "the skis are slalom_165", "at the joint Spine2", "exact to 3.0 m"):
        assert name in words
    assert "the skier weighs" not in words
    assert imported.uncertainty.antenna == 0.15  # a place that was not measured
    assert imported.uncertainty.mass == Uncertainty().mass
    again = read_recording(tmp_path / "out")
    assert again.notices == imported.notices
    with pytest.raises(SystemExit) as end:
        main(["inspect", str(tmp_path / "out"), "--json"])
    assert end.value.code == 0


def test_a_list_of_assumptions_that_names_nothing_is_refused(tmp_path: Path) -> None:
    import_recording(files(tmp_path), tmp_path / "out", Answers())
    path = tmp_path / "out" / "recording.toml"
    text = path.read_text(encoding="utf-8")
    for wrong in ("skier.mass_pounds", "skier", "owner.mass_kg"):
        path.write_text(text.replace('"skier.mass_kg"', f'"{wrong}"'), encoding="utf-8")
        with pytest.raises(InputError, match="is nowhere in this file"):
            read_recording(tmp_path / "out")


def test_defaults_come_before_what_is_usual_and_answers_before_defaults(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    usual = tmp_path / "club.toml"
    usual.write_text('mass_kg = 81\nheight_m = 1.81\nantenna_offset_m = [0, 0, 0]\nsex = "female"\n')
    command = ["import", *map(str, files(tmp_path)), "--out", str(tmp_path / "out"), "--defaults", str(usual)]
    with pytest.raises(SystemExit) as end:
        main([*command, "--height-m", "1.66"])
    assert end.value.code == 0
    assert "assumed" in capsys.readouterr().out
    imported = read_recording(tmp_path / "out")
    assert (imported.skier.mass, imported.skier.height, imported.skier.sex) == (81.0, 1.66, "female")
    assert imported.gps is not None
    assert not np.any(imported.gps.offset)
    assert imported.uncertainty.antenna == Uncertainty().antenna


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mass = 81", "did you mean 'mass_kg'"),
        ('mass_kg = "81"', "not a number"),
        ("skis = 3", "not a text"),
        ("antenna_offset_m = [1, 2]", "not three numbers"),
    ],
)
def test_faulty_defaults_are_one_clear_line(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "defaults.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words):
        read_defaults(path)


def test_notes_of_the_readers_are_kept(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps["satellites"] = np.full(len(tiny.gps["time_s"]), 9.0)
    made = tiny.write(tmp_path / "tiny")
    imported = import_recording([made / "motion.bvh", made / "gps.csv"], tmp_path / "out", ANSWERS)
    assert any("columns not used: satellites" in notice for notice in imported.notices)
    assert any("satellites" in notice for notice in read_recording(tmp_path / "out").notices)


def test_a_folder_of_runs_becomes_recordings_and_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    season = tmp_path / "season"
    for name in ("a", "b"):
        made = Tiny().write(season / name)
        (made / "recording.toml").unlink()
        (made / "photo.jpg").write_bytes(b"")
        (made / "film.mp4").write_bytes(b"of the skier")
        (made / "notes.txt").write_text("icy", encoding="utf-8")
    shutil.copy(season / "a" / "motion.bvh", season / "c.bvh")  # a run of files in the folder itself, without fixes
    command = ["import", str(season), "--out", str(tmp_path / "out"), "--mass-kg", "70", "--height-m", "1.65"]
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == 1
    said = capsys.readouterr()
    assert "1 of 3 runs could not be imported" in said.err
    assert said.out.count("imported") == 2
    table = pd.read_csv(tmp_path / "out" / "recordings.csv", keep_default_na=False)
    assert table["recording"].tolist() == ["a", "b", "c"]
    assert table["status"].tolist() == ["imported", "imported", "failed"]
    assert "--slope-deg" in table["error"][2]
    assert "the skis are slalom_165" in table["assumed"][0]
    assert read_recording(tmp_path / "out" / "b").name == "b"
    with pytest.raises(SystemExit) as end:
        main([*command, "--slope-deg", "16", "--fall-line-deg", "70", "--heading-deg", "25"])
    assert end.value.code == 0
    table = pd.read_csv(tmp_path / "out" / "recordings.csv")
    assert table["status"].tolist() == ["there already", "there already", "imported"]
    (tmp_path / "nothing").mkdir()
    with pytest.raises(SystemExit) as end:
        main(["import", str(tmp_path / "nothing"), "--out", str(tmp_path / "out2")])
    assert end.value.code == 2


def test_without_fixes_slope_and_heading_are_asked_for(tmp_path: Path) -> None:
    answers = replace(ANSWERS, slope_deg=None, fall_line_deg=None, heading_deg=None)
    with pytest.raises(InputError, match="--slope-deg, --fall-line-deg, --heading-deg"):
        import_recording(files(tmp_path)[:1], tmp_path / "out", answers)


def test_errors_name_the_file_that_was_given_and_nothing_is_left(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps["latitude_deg"][40:70] = 95.0
    sources = files(tmp_path, tiny)
    with pytest.raises(InputError) as info:
        import_recording(sources, tmp_path / "out", ANSWERS)
    assert info.value.file == str(sources[1])
    assert info.value.place == "line 42"
    assert not list((tmp_path / "out").glob("*.*"))


def test_what_only_the_whole_recording_shows_names_the_given_file_too(tmp_path: Path) -> None:
    sources = files(tmp_path)
    with pytest.raises(InputError) as info:
        import_recording(sources, tmp_path / "out", replace(ANSWERS, height_m=1.0))
    assert info.value.file == str(sources[0])
    assert "legs" in info.value.place
    with pytest.raises(InputError, match=r"mass_kg.*outside"):
        import_recording(sources, tmp_path / "out", replace(ANSWERS, mass_kg=700.0))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {".lock"}


def test_what_is_too_short_for_a_run_says_how_long_it_must_be(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.rotations = {name: angles[:36] for name, angles in tiny.rotations.items()}
    motion, fixes, _ = files(tmp_path / "capture", tiny)
    with pytest.raises(InputError, match=r"0\.58 s are too short for a run.*at least 1 s") as info:
        import_recording([motion, fixes], tmp_path / "out", ANSWERS)
    assert info.value.file == str(motion)
    tiny = Tiny()
    tiny.gps = {name: column[:9] for name, column in tiny.gps.items()}
    motion, fixes, _ = files(tmp_path / "fixes", tiny)
    with pytest.raises(InputError, match=r"0\.8 s are too short for a run.*at least 1 s") as info:
        import_recording([motion, fixes], tmp_path / "out", ANSWERS)
    assert info.value.file == str(fixes)


def test_an_unknown_ski_is_refused_with_the_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tiny = Tiny().write(tmp_path / "tiny")
    answers = replace(ANSWERS, skis="slalom")
    with pytest.raises(InputError, match=r"no ski is called 'slalom'; use one of .*slalom_165"):
        import_recording([tiny / "motion.bvh", tiny / "gps.csv"], tmp_path / "out", answers)
    assert not (tmp_path / "out" / "recording.toml").exists()
    described = tiny / "recording.toml"
    described.write_text(described.read_text(encoding="utf-8").replace("slalom_165", "slalom"), encoding="utf-8")
    with pytest.raises(SystemExit) as end:
        main(["inspect", str(tiny)])
    assert end.value.code == 2
    assert "slalom_165" in capsys.readouterr().err


def test_a_recording_is_not_written_over(tmp_path: Path) -> None:
    sources = files(tmp_path)
    with pytest.raises(InputError, match="there is a recording already"):
        import_recording(sources, tmp_path / "raw", ANSWERS)


def test_two_of_a_kind_and_no_motion(tmp_path: Path) -> None:
    sources = files(tmp_path)
    with pytest.raises(InputError, match="a second file of fixes"):
        import_recording([*sources, sources[1]], tmp_path / "out", ANSWERS)
    with pytest.raises(InputError, match="no file holds a motion capture"):
        import_recording(sources[1:], tmp_path / "out", ANSWERS)


@pytest.mark.parametrize("name", ["track.txt", "track.log", "track.csv"])
def test_sentences_are_known_by_their_content(name: str, tmp_path: Path) -> None:
    motion, _, _ = files(tmp_path)
    log = tmp_path / name
    log.write_text(nmea(Tiny().gps), encoding="utf-8")
    made = import_recording([motion, log], tmp_path / "out", replace(ANSWERS, gps_sigma_m=None, gps_offset_s=0.25))
    assert made.gps is not None


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        (
            "dot.csv",
            "sep=,\nPacketCounter,Euler_X,Status\n1,2.5,0\n",
            "none of fixes.*: PacketCounter, Euler_X, Status;",
        ),
        ("notes.txt", "fresh snow, minus four degrees\n", "no log of NMEA or GnssLogger"),
        ("receiver.log", "started\n", "no log of NMEA or GnssLogger"),
    ],
)
def test_a_file_that_no_reader_knows_is_named_itself(name: str, text: str, words: str, tmp_path: Path) -> None:
    motion, fixes, _ = files(tmp_path)
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    for given in ([motion, path, fixes], [motion, fixes, path]):
        with pytest.raises(InputError, match=words) as info:
            import_recording(given, tmp_path / "out", ANSWERS)
        assert info.value.file == str(path)
        assert f"pocket={name}" in info.value.fix


@pytest.mark.parametrize("place", ["", "pocket=", "insoles="])
def test_a_workbook_is_to_be_exported(place: str, tmp_path: Path) -> None:
    motion, fixes, _ = files(tmp_path)
    path = tmp_path / "dot.xlsx"
    path.write_bytes(b"PK\x03\x04\x14\x00\x06\x00\xff\xfe")
    with pytest.raises(InputError, match=r"it is a workbook.*export its sheet as CSV") as info:
        import_recording([motion, fixes, Path(f"{place}{path}")], tmp_path / "out", ANSWERS)
    assert info.value.file == str(path)


def test_clocks_that_files_do_not_share_are_asked_for(tmp_path: Path) -> None:
    motion, csv, _ = files(tmp_path)
    log = tmp_path / "track.nmea"
    log.write_text(nmea(Tiny().gps), encoding="utf-8")
    answers = replace(ANSWERS, gps_sigma_m=None)  # the log has it
    with pytest.raises(InputError, match="no file holds --gps-offset-s;"):
        import_recording([motion, log], tmp_path / "out", answers)
    import_recording([motion, log], tmp_path / "out", replace(answers, gps_offset_s=0.25))
    imported, original = read_recording(tmp_path / "out"), read_gps(csv, segment="Spine2", offset=OFFSET, sigma=0.02)
    assert imported.gps is not None
    np.testing.assert_allclose(imported.gps.time, original.time + 0.25, atol=1e-6)  # microseconds are written
    np.testing.assert_allclose(imported.gps.enu, original.enu, atol=1.5e-3)  # the log's altitude has millimetres


def test_clocks_that_files_share_are_aligned(tmp_path: Path) -> None:
    motion, csv, _ = files(tmp_path)
    tiny = read_bvh(motion)
    ours = [JOINT_OF_SEGMENT[name].replace("Spine3", "Spine2").replace("ToeBase", "Foot") for name, *_ in SEGMENTS]
    world = rotation_from_bvh(world_rotations(tiny)[:, [tiny.index(name) for name in ours]])
    capture, log = tmp_path / "run.mvnx", tmp_path / "track.nmea"
    log.write_text(nmea(Tiny().gps), encoding="utf-8")
    capture.write_text(mvnx(world, began=START.timestamp() - 0.25), encoding="utf-8")
    answers = replace(ANSWERS, gps_sigma_m=None)  # the log has it
    import_recording([capture, log], tmp_path / "out", answers)
    imported, original = read_recording(tmp_path / "out"), read_gps(csv, segment="Spine2", offset=OFFSET, sigma=0.02)
    assert imported.gps is not None
    np.testing.assert_allclose(
        imported.gps.time, original.time + 0.25, atol=6e-4
    )  # the capture's clock has milliseconds

    capture.write_text(mvnx(world, began=START.timestamp() - 1e8), encoding="utf-8")
    with pytest.raises(InputError, match=r"fixes begin 1157 days after the capture; give --gps-offset-s"):
        import_recording([capture, log], tmp_path / "other", answers)


def test_command_line_names_its_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["import", str(files(tmp_path)[0]), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as info:
        main(command)
    assert info.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    options = ["--slope-deg", "16", "--fall-line-deg", "70", "--heading-deg", "25"]
    assert all(option in said for option in options if option.startswith("--"))
    options += ["--mass-kg", "70", "--height-m", "1.65", "--skis", "slalom_165", "--ski-mass-kg", "2.4"]
    options += ["--boot-mass-kg", "1.9", "--ankle-to-ski-base-m", "0.13"]
    with pytest.raises(SystemExit) as info:
        main([*command, *options])
    assert info.value.code == 0
    assert "motion" in capsys.readouterr().out
    assert read_recording(tmp_path / "out").skier.mass == 70.0


def test_the_run_is_kept_of_a_track_with_a_lift(tmp_path: Path) -> None:
    sources = files(tmp_path)
    run = Tiny().gps
    up = {name: column[::-1][:60] for name, column in run.items()}
    up["time_s"] = np.arange(60.0)
    late = run["time_s"] + 90.0
    day = {name: np.concatenate([up[name], late if name == "time_s" else run[name]]) for name in run}
    track = tmp_path / "day.gpx"
    track.write_text(gpx(day), encoding="utf-8")
    made = import_recording([sources[0], track], tmp_path / "out", replace(ANSWERS, gps_offset_s=-90.0))
    assert made.gps is not None
    assert (made.gps.time[0], made.gps.time[-1]) == pytest.approx((0.0, 8.0))
    assert [notice for notice in made.notices if "the others are left out: 0.00 to 59.00 s" in notice]


def test_a_t_pose_at_the_start_moves_the_zero_of_time(tmp_path: Path) -> None:
    tiny = Tiny()
    for angles in tiny.rotations.values():
        angles[:2] = 0.0
    sources = files(tmp_path, tiny)
    made = import_recording(sources[:2], tmp_path / "out", replace(ANSWERS, gps_offset_s=0.0))
    assert made.bvh.time[0] == 0.0
    assert len(made.bvh.time) == 479
    assert [notice for notice in made.notices if "2 of 481 frame(s) without movement" in notice]


def test_what_was_left_out_is_told_at_every_later_reading(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps["altitude_m"][20:23] = 0.0
    sources = files(tmp_path, tiny)
    import_recording(sources, tmp_path / "out", ANSWERS)
    words = "3 of 81 height(s) that no skier reaches from the others not used (first: line 22)"
    assert [notice for notice in read_recording(tmp_path / "out").notices if words in notice]
