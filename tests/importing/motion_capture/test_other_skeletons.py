"""Captures of CMU's library, Rokoko and Theia: the posture that was written comes back, whatever names and axes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bvh_file import SEGMENTS, cmu, from_t_pose, rokoko
from c3d_file import marker_places, write_c3d, write_theia
from scipy.spatial.transform import Rotation
from swinging import COUNT, HEIGHT, RATE, chain_coordinates

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses, average_geometry, forward_kinematics
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.bvh_writer import bvh_text
from sssi_exudyn.importing.motion_capture.motion_formats import read_motion
from sssi_exudyn.motion.capture_to_chain import Capture, capture_in_body_axes
from sssi_exudyn.recording.instruments.bvh import read_bvh, world_rotations


@pytest.fixture(scope="module")
def poses() -> Poses:
    return forward_kinematics(average_geometry(HEIGHT), chain_coordinates(), 0.0)


@pytest.fixture(scope="module")
def world(poses: Poses) -> dict[str, Array]:
    return from_t_pose(poses)


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def worst_deg(one: Array, other: Array) -> float:
    return float(np.rad2deg(np.max(Rotation.from_matrix(np.swapaxes(one, -1, -2) @ other).magnitude())))


Text = Callable[[dict[str, Array], float], str]
SKELETONS: dict[str, Text] = {
    "CMU by bones": cmu,
    "CMU by joints": lambda world, rate: cmu(world, rate, by_joints=True),
    "Rokoko": rokoko,
}


@pytest.mark.parametrize("kind", SKELETONS)
def test_posture_of_another_skeleton_comes_back(tmp_path: Path, kind: str, world: dict[str, Array]) -> None:
    path = write(tmp_path / "run.bvh", SKELETONS[kind](world, RATE))
    bvh, _ = read_motion(path, HEIGHT)
    assert len(bvh.time) == COUNT
    read = world_rotations(bvh)
    for joint in SEGMENTS:
        assert worst_deg(read[:, bvh.index(joint)], world[joint]) < 1e-4, joint  # six digits of a degree
    thigh = float(np.linalg.norm(bvh.offsets[bvh.index("LeftLeg")]))
    # 7 of CMU's units, which are inches over 0.45; 43.2 cm
    assert thigh == pytest.approx(0.432 if kind == "Rokoko" else 7.0 * 0.0254 / 0.45, abs=1e-4)
    assert any(f"{kind.split()[0]}'s skeleton" in note for note in bvh.notes)
    assert len(read_bvh(write(tmp_path / "again.bvh", bvh_text(bvh))).time) == COUNT  # as a recording holds it


@pytest.mark.parametrize("kind", SKELETONS)
def test_another_skeleton_needs_a_height_and_all_joints(tmp_path: Path, kind: str, world: dict[str, Array]) -> None:
    text = SKELETONS[kind](world, RATE)
    with pytest.raises(InputError, match="--height-m"):
        read_motion(write(tmp_path / "run.bvh", text), None)
    lost = "Wrist" if "joints" in kind else "Hand"
    with pytest.raises(InputError, match=r"missing joints: (Left|Right)"):
        read_motion(write(tmp_path / "run.bvh", text.replace(f" Left{lost}\n", " Thing\n")), HEIGHT)


def captured(path: Path) -> Capture:
    return capture_in_body_axes(read_motion(path, HEIGHT)[0])


@pytest.mark.parametrize("y_up", [False, True])
def test_theias_segments_come_back(tmp_path: Path, poses: Poses, y_up: bool) -> None:
    capture = captured(write_theia(tmp_path / "run.c3d", poses, RATE, y_up=y_up))
    pelvis = poses.rotation[:, 0]
    assert worst_deg(capture.pelvis, pelvis) < 0.01  # single precision
    for joint, segment in SEGMENTS.items():
        relative = np.swapaxes(pelvis, -1, -2) @ poses.rotation[:, SEGMENT[segment]]
        assert worst_deg(capture.rotation[:, capture.bvh.index(joint)], relative) < 0.01, joint
    for joint, segment in (("LeftLeg", "tibia_l"), ("RightFoot", "talus_r")):
        hips = 0.5 * (poses.origin[:, SEGMENT["femur_l"]] + poses.origin[:, SEGMENT["femur_r"]])
        place = np.einsum("nji,nj->ni", pelvis, poses.origin[:, SEGMENT[segment]] - hips)
        np.testing.assert_allclose(capture.place[:, capture.bvh.index(joint)], place, atol=1e-5)  # single precision


def test_lost_and_missing_segments(tmp_path: Path, poses: Poses) -> None:
    bvh, _ = read_motion(write_theia(tmp_path / "lost.c3d", poses, RATE, lost=4), HEIGHT)
    assert len(bvh.time) == COUNT - 4
    assert any("4 frame(s) in which a segment is lost" in note for note in bvh.notes)
    with pytest.raises(InputError, match="missing segments: l_shank_4X4; export Theia's whole skeleton"):
        read_motion(write_theia(tmp_path / "missing.c3d", poses, RATE, without="l_shank"), HEIGHT)


def test_cmus_markers_are_those_of_plug_in_gait(tmp_path: Path, poses: Poses) -> None:
    names = {"ASI": "FWT", "PSI": "BWT", "TIB": "SHN"}
    places = {
        f"{label[0]}{names[label[1:]]}" if label[1:] in names else label: place
        for label, place in marker_places(poses, HEIGHT).items()
    }
    write_c3d(tmp_path / "run.c3d", places, RATE, prefix="subject:", sizes=False)
    bvh, _ = read_motion(tmp_path / "run.c3d", HEIGHT)
    assert any("widths of knees and ankles that the file does not hold are 0.105 and 0.07 m" in n for n in bvh.notes)
    capture = capture_in_body_axes(bvh)
    assert worst_deg(capture.pelvis, poses.rotation[:, 0]) < 0.01  # single precision
    for joint in ("LeftUpLeg", "LeftLeg", "RightLeg", "RightFoot"):
        relative = np.swapaxes(poses.rotation[:, 0], -1, -2) @ poses.rotation[:, SEGMENT[SEGMENTS[joint]]]
        # the skier's knees are 5 mm wider than assumed, on bones of 0.4 m: half of it over the bone is 0.4°
        assert worst_deg(capture.rotation[:, capture.bvh.index(joint)], relative) < 1.2, joint
