"""Orientations of OpenSense: their sensors become those of a recording, with the rates that they turn at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pymap3d
import pytest
from fix_files import gpx
from scipy.spatial.transform import Rotation
from strapped import LAG, strapped, truth

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array, level_to_enu
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.sensors.app_exports import with_places
from sssi_exudyn.importing.sensors.opensense import places_in, read_orientations
from sssi_exudyn.recording.instruments.bvh import world_rotations
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLE = Path(__file__).parents[3] / "examples" / "intermediate"
JOINTS = {"calcn_l_imu": "LeftFoot", "calcn_r_imu": "RightFoot", "femur_l_imu": "LeftUpLeg"}


@pytest.fixture(scope="module")
def whole() -> Recording:
    return read_recording(EXAMPLE)


def storage(recording: Recording) -> str:
    """Return the orientations of sensors with a random mounting on both feet and a thigh."""
    to_enu = level_to_enu(recording.heading.value) @ BODY_FROM_BVH
    world = world_rotations(recording.bvh)
    columns: list[Array] = []
    for seed, joint in enumerate(JOINTS.values()):
        turned = Rotation.from_matrix(to_enu @ world[:, recording.bvh.index(joint)] @ BODY_FROM_BVH.T)
        columns.append((turned * Rotation.random(random_state=seed).inv()).as_quat(scalar_first=True))
    rows = [
        "\t".join([f"{t:.6f}", *(",".join(f"{part:.8f}" for part in column[i]) for column in columns)])
        for i, t in enumerate(recording.bvh.time)
    ]
    head = ["DataRate=60.000000", "DataType=Quaternion", "version=3", "OpenSimVersion=4.4", "endheader"]
    return "\n".join([*head, "\t".join(["time", *JOINTS]), *rows]) + "\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_sensors_have_the_places_of_their_columns(whole: Recording, tmp_path: Path) -> None:
    path = write(tmp_path / "run.sto", storage(whole))
    assert places_in(path) == ("left_boot", "right_boot")
    assert with_places([path])[0] == [Path(f"left_boot={path}"), Path(f"right_boot={path}")]
    assert places_in(write(tmp_path / "angles.sto", "inDegrees=yes\nendheader\ntime\tknee_angle_r\n0\t1\n")) == ()


def test_rates_are_those_of_a_gyroscope(whole: Recording, tmp_path: Path) -> None:
    table = read_orientations(write(tmp_path / "run.sto", storage(whole)), "left_boot")
    gyroscope = strapped(whole, "left_ski", 0)  # of the same foot, in the same mounting
    rates = np.column_stack([table.columns[f"rate_{axis}_radps"] for axis in "xyz"])
    for axis in range(3):
        assert np.corrcoef(rates[:, axis], gyroscope.rate[:, axis])[0, 1] > 0.99
    # a bias of half a degree a second, and noise of 0.005 rad/s, are the gyroscope's
    assert np.sqrt(np.mean((rates - gyroscope.rate) ** 2)) < 0.15 * np.std(gyroscope.rate)


@pytest.mark.long
def test_orientations_and_fixes_make_a_recording(whole: Recording, tmp_path: Path) -> None:
    gps = whole.gps
    assert gps is not None
    latitude, longitude, altitude = pymap3d.enu2geodetic(*gps.enu[::2].T, *gps.origin)
    fixes = {"time_s": gps.time[::2], "latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": altitude}
    track = write(tmp_path / "run.gpx", gpx(fixes))
    files = [write(tmp_path / "run.sto", storage(whole)), track]
    answers = Answers(gps_sigma_m=0.02, height_m=1.8, mass_kg=84.0)
    with pytest.raises(InputError, match="--gps-offset-s"):
        import_recording(files, tmp_path / "asked", answers)
    made = import_recording(files, tmp_path / "made", replace(answers, gps_offset_s=float(gps.time[0]) + LAG))
    assert made.completed is not None
    assert made.completed.steered
    assert made.completed.lag is not None
    assert made.completed.lag.value == pytest.approx(LAG, abs=0.5)  # as of sensors with a gyroscope
    time = made.bvh.time
    roll = truth(made, "LeftFoot", time)[1] - truth(whole, "LeftFoot", time)[1]
    assert np.degrees(np.std(roll)) < 3.0  # as of loggers' tables: a constant is the mounting


def test_torn_lines_cost_themselves_and_other_files_are_refused(whole: Recording, tmp_path: Path) -> None:
    lines = storage(whole).split("\n")
    lines[20], lines[30] = lines[20][:30], lines[30].replace(",", ";")
    table = read_orientations(write(tmp_path / "torn.sto", "\n".join(lines)), "right_boot")
    assert len(table.lines) == len(whole.bvh.time) - 2
    assert "2 of" in table.notes[0]
    assert "line 21" in table.notes[0]
    text = storage(whole)
    for content, words in (
        (text.replace("calcn_", "foot_"), "no sensor is on calcn_l, calcn_r, torso, pelvis"),
        (text.replace("endheader", "end"), "no line 'endheader'"),
        (text.replace("time\t", "t\t"), "the first column is not time"),
    ):
        with pytest.raises(InputError, match=words):
            places_in(write(tmp_path / "other.sto", content))
    with pytest.raises(InputError, match="no sensor is at chest; it has left_boot, right_boot"):
        read_orientations(write(tmp_path / "run.sto", text), "chest")
    doubled = "\n".join(line.replace("0.", "3.") for line in text.split("\n"))
    with pytest.raises(InputError, match="torn"):
        read_orientations(write(tmp_path / "long.sto", doubled), "left_boot")
