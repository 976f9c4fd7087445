"""Markers of optical capture: the posture that placed them comes back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from c3d_file import marker_places, write_c3d
from scipy.spatial.transform import Rotation
from swinging import COUNT, HEIGHT, RATE, chain_coordinates

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses, average_geometry, forward_kinematics
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.motion_formats import read_motion
from sssi_exudyn.motion.capture_to_chain import Capture, capture_in_body_axes

SEGMENTS = {
    "LeftUpLeg": "femur_l", "RightUpLeg": "femur_r", "LeftLeg": "tibia_l", "RightLeg": "tibia_r",
    "LeftFoot": "calcn_l", "RightFoot": "calcn_r", "Spine2": "torso", "Head": "head",
    "LeftArm": "humerus_l", "RightArm": "humerus_r", "LeftForeArm": "radius_l", "RightHand": "hand_r",
}  # fmt: skip


@pytest.fixture(scope="module")
def poses() -> Poses:
    q = chain_coordinates()
    return forward_kinematics(average_geometry(HEIGHT), q, 0.0)


def read(path: Path) -> Capture:
    return capture_in_body_axes(read_motion(path, HEIGHT)[0])


def worst_deg(one: Array, other: Array) -> float:
    return float(np.rad2deg(np.max(Rotation.from_matrix(np.swapaxes(one, -1, -2) @ other).magnitude())))


def test_posture_comes_back(tmp_path: Path, poses: Poses) -> None:
    write_c3d(tmp_path / "run.c3d", marker_places(poses, HEIGHT), RATE, prefix="skier:")
    capture = read(tmp_path / "run.c3d")
    pelvis = poses.rotation[:, 0]
    assert worst_deg(capture.pelvis, pelvis) < 0.01  # single precision in the file: 1e-7 of a metre on 0.2 m
    for joint, segment in SEGMENTS.items():
        of = SEGMENT[segment]
        relative = np.swapaxes(pelvis, -1, -2) @ poses.rotation[:, of]
        # an upper arm's turn about itself is seen through the elbow and, by a tenth, through the forearm
        assert worst_deg(capture.rotation[:, capture.bvh.index(joint)], relative) < (8.0 if "Arm" in joint else 0.01), (
            joint
        )
    for joint, segment in (("LeftLeg", "tibia_l"), ("RightFoot", "talus_r")):
        hips = 0.5 * (poses.origin[:, SEGMENT["femur_l"]] + poses.origin[:, SEGMENT["femur_r"]])
        place = np.einsum("nji,nj->ni", pelvis, poses.origin[:, SEGMENT[segment]] - hips)
        np.testing.assert_allclose(capture.place[:, capture.bvh.index(joint)], place, atol=1e-5)  # single precision


def test_laboratories_with_y_up(tmp_path: Path, poses: Poses) -> None:
    places = marker_places(poses, HEIGHT)
    write_c3d(tmp_path / "z.c3d", places, RATE)
    write_c3d(tmp_path / "y.c3d", {name: place[:, [1, 2, 0]] for name, place in places.items()}, RATE)
    np.testing.assert_allclose(read(tmp_path / "y.c3d").pelvis, read(tmp_path / "z.c3d").pelvis, atol=1e-6)


def test_lost_markers_are_gaps(tmp_path: Path, poses: Poses) -> None:
    places = marker_places(poses, HEIGHT)
    places["LTOE"][50:54] = np.nan
    write_c3d(tmp_path / "run.c3d", places, RATE)
    bvh, _ = read_motion(tmp_path / "run.c3d", HEIGHT)
    assert len(bvh.time) == COUNT
    assert any("4 frame(s) in which a marker is lost" in note for note in bvh.notes)
    assert any("interpolated" in note for note in bvh.notes)


def fails(path: Path, height: float | None = HEIGHT) -> str:
    with pytest.raises(InputError) as info:
        read_motion(path, height)
    assert info.value.file == str(path)
    assert info.value.fix
    return f"{info.value.place}: {info.value.problem}"


def test_what_is_missing_is_named(tmp_path: Path, poses: Poses) -> None:
    places, path = marker_places(poses, HEIGHT), tmp_path / "run.c3d"
    write_c3d(path, places, RATE)
    assert "--height-m" in fails(path, None)
    write_c3d(path, places, RATE, sizes=False)
    assert "PROCESSING:LKneeWidth: is missing" in fails(path)
    write_c3d(path, {name: place for name, place in places.items() if name != "LKNE"}, RATE)
    assert "missing markers: LKNE" in fails(path)
    write_c3d(path, places | {"LWRA": places["LWRB"]}, RATE)
    assert "LeftForeArm: markers coincide" in fails(path)


def test_damaged_files_are_one_clear_line(tmp_path: Path, poses: Poses) -> None:
    path = tmp_path / "run.c3d"
    write_c3d(path, marker_places(poses, HEIGHT), RATE)
    data = path.read_bytes()
    for damaged in (data[:700], b"x" * 5000, data[:2] + b"\xff" * 30 + data[32:]):
        path.write_bytes(damaged)
        assert "damaged" in fails(path)
