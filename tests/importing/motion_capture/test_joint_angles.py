"""Joint angles of an OpenSim model: the chain's own angles come back, with either sign of the knee."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from swinging import HEIGHT, chain_coordinates, mot

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, average_geometry, forward_kinematics
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.motion_capture.bvh_writer import bvh_text
from sssi_exudyn.importing.motion_capture.motion_formats import read_motion
from sssi_exudyn.motion.capture_to_chain import capture_in_body_axes
from sssi_exudyn.recording.instruments.bvh import read_bvh


def write(folder: Path, text: str) -> Path:
    path = folder / "run.mot"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("degrees", "extends"), [(True, False), (False, True)])
def test_segments_stand_as_the_chain_has_them(tmp_path: Path, degrees: bool, extends: bool) -> None:
    q = chain_coordinates()
    bvh, _ = read_motion(write(tmp_path, mot(q, degrees=degrees, extends=extends)), HEIGHT)
    (tmp_path / "again.bvh").write_text(bvh_text(bvh), encoding="utf-8")
    capture = capture_in_body_axes(read_bvh(tmp_path / "again.bvh"))
    poses = forward_kinematics(average_geometry(HEIGHT), q, 0.0)
    pelvis, origin = poses.rotation[:, 0], poses.origin[:, 0]
    for name, segment in (("LeftFoot", "calcn_l"), ("RightLeg", "tibia_r"), ("Head", "head"), ("LeftHand", "hand_l")):
        at, of = capture.bvh.index(name), SEGMENT[segment]
        relative = np.swapaxes(pelvis, -1, -2) @ poses.rotation[:, of]
        # ten digits of the table, six digits of a degree in each of at most six joints
        np.testing.assert_allclose(capture.rotation[:, at], relative, atol=2e-7)
        place = np.einsum("nji,nj->ni", pelvis, poses.origin[:, of] - origin)
        np.testing.assert_allclose(capture.place[:, at], place, atol=1e-6)
    np.testing.assert_allclose(capture.pelvis, pelvis, atol=2e-7)


HEADERS: dict[str, tuple[bool, Callable[[str], str], bool]] = {
    "degrees by a sentence": (True, lambda t: t.replace("inDegrees=yes", "\nAngles are in degrees.\n"), False),
    "radians by a sentence": (False, lambda t: t.replace("inDegrees=no", "\nAngles are in radians.\n"), False),
    "nothing stated": (True, lambda t: t.replace("inDegrees=yes\n", ""), True),
    "radians called degrees": (False, lambda t: t.replace("inDegrees=no", "inDegrees=yes"), True),
    "degrees called radians": (True, lambda t: t.replace("inDegrees=yes", "inDegrees=no"), True),
}


@pytest.mark.parametrize("kind", HEADERS)
def test_the_unit_is_that_in_which_a_skier_bends(tmp_path: Path, kind: str) -> None:
    degrees, change, contradicts = HEADERS[kind]
    bvh, _ = read_motion(write(tmp_path, change(mot(chain_coordinates(), degrees=degrees))), HEIGHT)
    expected, _ = read_motion(write(tmp_path, mot(chain_coordinates())), HEIGHT)
    np.testing.assert_allclose(bvh.rotations, expected.rotations, atol=1e-8)  # ten digits of the table
    assert [note for note in bvh.notes if "by its header" in note] == list(bvh.notes[:1]) * contradicts


def test_a_skier_who_stands_tall_in_degrees(tmp_path: Path) -> None:
    q = 0.25 * chain_coordinates(seed=8)  # knees of 9 to 18 degrees
    bvh, _ = read_motion(write(tmp_path, mot(q).replace("inDegrees=yes\n", "")), HEIGHT)
    knee = bvh.rotations[:, bvh.index("LeftLeg")]
    bent = np.arccos(0.5 * (np.trace(knee, axis1=1, axis2=2) - 1.0))
    assert np.degrees(np.max(bent)) < 20.0


def test_legs_that_never_bend_are_no_skier(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="that is no skier"):
        read_motion(write(tmp_path, mot(0.001 * chain_coordinates(), degrees=False)), HEIGHT)


def test_arms_may_be_missing_and_it_is_noted(tmp_path: Path) -> None:
    arms = tuple(name for name in PRESCRIBED if name.startswith(("arm", "elbow", "pro_sup", "wrist")))
    bvh, _ = read_motion(write(tmp_path, mot(chain_coordinates(), without=arms)), HEIGHT)
    assert any("arm_flex_r" in note and "taken as zero" in note for note in bvh.notes)


FAULTS: dict[str, tuple[Callable[[str], str], str]] = {
    "no header": (lambda t: t.replace("endheader", ""), "endheader"),
    "other names": (lambda t: t.replace("hip_flexion_r", "RHipFlex"), "missing coordinates: hip_flexion_r"),
    "text": (lambda t: t[:-5] + "x\n", "not a number"),
    "nan": (lambda t: t.replace("\t" + t.split("\t")[-1], "\tnan\n"), "not a number"),
    "beyond all angles": (lambda t: t.replace("\n0.05\t", "\n0.05\t99"), "beyond three turns"),
    "time stands still": (lambda t: t.replace("\n0.05\t", "\n0.03333333333333\t"), "time stands still"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_broken_tables_are_one_clear_line(tmp_path: Path, fault: str) -> None:
    spoil, problem = FAULTS[fault]
    path = write(tmp_path, spoil(mot(chain_coordinates())))
    with pytest.raises(InputError) as info:
        read_motion(path, HEIGHT)
    assert info.value.file == str(path)
    assert problem in info.value.problem
    assert info.value.fix


def test_lengths_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--height-m"):
        read_motion(write(tmp_path, mot(chain_coordinates())), None)


def test_a_storage_of_angles_is_read_and_one_of_orientations_is_refused(tmp_path: Path) -> None:
    text = mot(chain_coordinates())
    for name in ("run.mot", "run.sto"):
        (tmp_path / name).write_text(text, encoding="utf-8")
    one, other = (read_motion(tmp_path / name, HEIGHT)[0] for name in ("run.mot", "run.sto"))
    np.testing.assert_array_equal(one.rotations, other.rotations)
    (tmp_path / "imu.sto").write_text(
        "DataRate=100\nDataType=Quaternion\nendheader\ntime\tpelvis_imu\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match="orientations of sensors, not the angles of joints; give it without other"):
        read_motion(tmp_path / "imu.sto", HEIGHT)
