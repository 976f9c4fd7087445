"""From files to a recording's folder: what is asked for, and that nothing is left of an import that fails."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fix_files import START, nmea
from mvnx_file import SEGMENTS, mvnx
from tiny import ANSWERS, OFFSET, Tiny

from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import rotation_from_bvh
from sssi_exudyn.importing.assemble import Answers, import_recording
from sssi_exudyn.importing.mvnx import JOINT_OF_SEGMENT
from sssi_exudyn.recording.instruments.bvh import read_bvh, world_rotations
from sssi_exudyn.recording.instruments.gps import read_gps
from sssi_exudyn.recording.read import read_recording

FILES = ("motion.bvh", "gps.csv", "insoles.csv")


def files(folder: Path, tiny: Tiny | None = None) -> list[Path]:
    written = (tiny or Tiny()).write(folder / "raw")
    return [written / name for name in FILES]


def test_imported_recording_is_the_recording(tmp_path: Path) -> None:
    sources = files(tmp_path)
    made = import_recording(sources, tmp_path / "out", ANSWERS)
    asked, found = read_recording(tmp_path / "raw"), read_recording(tmp_path / "out")
    assert (found.skier, found.equipment, found.slope) == (asked.skier, asked.equipment, asked.slope)
    assert found.heading.value == asked.heading.value
    assert made.folder == tmp_path / "out"
    order = [found.bvh.index(name) for name in asked.bvh.names]
    np.testing.assert_allclose(found.bvh.rotations[:, order], asked.bvh.rotations, atol=3e-8)  # six digits of a degree
    assert found.gps is not None
    assert asked.gps is not None
    np.testing.assert_allclose(found.gps.enu, asked.gps.enu, atol=1e-4)  # nine digits of a degree
    assert found.insoles is not None
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*FILES, "recording.toml", ".lock"}


def test_everything_unknown_is_asked_for_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as info:
        import_recording(files(tmp_path), tmp_path / "out", Answers(mass_kg=70.0))
    assert "--height-m" in info.value.problem
    assert "--antenna-offset-m" in info.value.problem
    assert "--gps-sigma-m" in info.value.problem
    assert "--mass-kg" not in info.value.problem
    assert "--slope-deg" not in info.value.problem  # estimated


def test_without_fixes_slope_and_heading_are_asked_for(tmp_path: Path) -> None:
    answers = replace(ANSWERS, slope_deg=None, fall_line_deg=None, heading_deg=None)
    with pytest.raises(InputError, match="--slope-deg, --fall-line-deg, --heading-deg"):
        import_recording(files(tmp_path)[:1], tmp_path / "out", answers)


def test_errors_name_the_file_that_was_given_and_nothing_is_left(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps["latitude_deg"][40] = 46.9
    sources = files(tmp_path, tiny)
    with pytest.raises(InputError) as info:
        import_recording(sources, tmp_path / "out", ANSWERS)
    assert info.value.file == str(sources[1])
    assert info.value.place == "line 42"
    assert {path.name for path in (tmp_path / "out").iterdir()} == {".lock"}


def test_what_only_the_whole_recording_shows_names_the_given_file_too(tmp_path: Path) -> None:
    sources = files(tmp_path)
    with pytest.raises(InputError) as info:
        import_recording(sources, tmp_path / "out", replace(ANSWERS, height_m=1.0))
    assert info.value.file == str(sources[0])
    assert "legs" in info.value.place
    with pytest.raises(InputError, match=r"mass_kg.*outside"):
        import_recording(sources, tmp_path / "out", replace(ANSWERS, mass_kg=700.0))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {".lock"}


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


def test_clocks_that_files_do_not_share_are_asked_for(tmp_path: Path) -> None:
    motion, csv, _ = files(tmp_path)
    log = tmp_path / "track.nmea"
    log.write_text(nmea(Tiny().gps), encoding="utf-8")
    answers = replace(ANSWERS, gps_sigma_m=None)  # the log has it
    with pytest.raises(InputError, match="no file holds --gps-offset-s;"):
        import_recording([motion, log], tmp_path / "out", answers)
    import_recording([motion, log], tmp_path / "out", replace(answers, gps_offset_s=0.25))
    found, asked = read_recording(tmp_path / "out"), read_gps(csv, segment="Spine2", offset=OFFSET, sigma=0.02)
    assert found.gps is not None
    np.testing.assert_allclose(found.gps.time, asked.time + 0.25, atol=1e-6)  # microseconds are written
    np.testing.assert_allclose(found.gps.enu, asked.enu, atol=1.5e-3)  # the log's altitude has millimetres


def test_clocks_that_files_share_are_laid_on_each_other(tmp_path: Path) -> None:
    motion, csv, _ = files(tmp_path)
    tiny = read_bvh(motion)
    ours = [JOINT_OF_SEGMENT[name].replace("Spine3", "Spine2").replace("ToeBase", "Foot") for name, *_ in SEGMENTS]
    world = rotation_from_bvh(world_rotations(tiny)[:, [tiny.index(name) for name in ours]])
    capture, log = tmp_path / "run.mvnx", tmp_path / "track.nmea"
    log.write_text(nmea(Tiny().gps), encoding="utf-8")
    capture.write_text(mvnx(world, began=START.timestamp() - 0.25), encoding="utf-8")
    answers = replace(ANSWERS, gps_sigma_m=None)  # the log has it
    import_recording([capture, log], tmp_path / "out", answers)
    found, asked = read_recording(tmp_path / "out"), read_gps(csv, segment="Spine2", offset=OFFSET, sigma=0.02)
    assert found.gps is not None
    np.testing.assert_allclose(found.gps.time, asked.time + 0.25, atol=6e-4)  # the capture's clock has milliseconds

    capture.write_text(mvnx(world, began=START.timestamp() - 1e8), encoding="utf-8")
    with pytest.raises(InputError, match=r"fixes begin 1157 days after the capture; give --gps-offset-s"):
        import_recording([capture, log], tmp_path / "other", answers)


def test_command_line_names_its_options(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["import", *map(str, files(tmp_path)), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as info:
        main(command)
    assert info.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    options = ["--mass-kg", "70", "--height-m", "1.65", "--skis", "slalom_165", "--ski-mass-kg", "2.4"]
    options += ["--boot-mass-kg", "1.9", "--ankle-to-ski-base-m", "0.13", "--antenna-joint", "Spine2"]
    options += ["--antenna-offset-m", "0", "0.1", "-0.16", "--gps-sigma-m", "0.02"]
    assert all(option in said for option in options if option.startswith("--"))
    with pytest.raises(SystemExit) as info:
        main([*command, *options])
    assert info.value.code == 0
    assert "motion" in capsys.readouterr().out
    assert read_recording(tmp_path / "out").skier.mass == 70.0
