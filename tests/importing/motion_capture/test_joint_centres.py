"""Joints' centres in TRC and C3D files: the posture that placed them comes back, whatever their labels."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from c3d_file import write_c3d
from scipy.spatial.transform import Rotation
from swinging import COUNT, HEIGHT, RATE, chain_coordinates
from trc_file import joint_places, mediapipe, opencap, pose2sim, trc

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses, average_geometry, forward_kinematics
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.joint_centres import SETS
from sssi_exudyn.importing.motion_capture.motion_formats import read_motion
from sssi_exudyn.motion.capture_to_chain import Capture, capture_in_body_axes

LEGS = {
    "LeftUpLeg": "femur_l", "RightUpLeg": "femur_r", "LeftLeg": "tibia_l", "RightLeg": "tibia_r",
    "LeftFoot": "calcn_l", "RightFoot": "calcn_r",
}  # fmt: skip


@pytest.fixture(scope="module")
def poses() -> Poses:
    return forward_kinematics(average_geometry(HEIGHT), chain_coordinates(), 0.0)


@pytest.fixture(scope="module")
def places(poses: Poses) -> dict[str, Array]:
    return joint_places(poses)


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def read(path: Path) -> Capture:
    return capture_in_body_axes(read_motion(path, HEIGHT)[0])


def worst_deg(one: Array, other: Array) -> float:
    return float(np.rad2deg(np.max(Rotation.from_matrix(np.swapaxes(one, -1, -2) @ other).magnitude())))


def turned(capture: Capture, joint: str) -> Array:
    """Return the rotation (n, 3, 3) of a joint's segment in space."""
    return capture.pelvis @ capture.rotation[:, capture.bvh.index(joint)]


def test_points_at_both_sides_of_joints_show_all_of_the_legs(
    tmp_path: Path, poses: Poses, places: dict[str, Array]
) -> None:
    capture = read(write(tmp_path / "run.trc", trc(opencap(places), RATE)))
    assert worst_deg(capture.pelvis, poses.rotation[:, 0]) < 0.01  # seven decimals of a metre on 0.2 m
    for joint, segment in LEGS.items():
        assert worst_deg(turned(capture, joint), poses.rotation[:, SEGMENT[segment]]) < 0.01, joint


@pytest.mark.parametrize("labels", [pose2sim, mediapipe])
def test_joints_alone_show_bones_and_bent_knees(
    labels: Callable[[dict[str, Array]], dict[str, Array]], tmp_path: Path, poses: Poses, places: dict[str, Array]
) -> None:
    capture = read(write(tmp_path / "run.trc", trc(labels(places), RATE, "mm")))
    for joint, segment in LEGS.items():
        rotation, true = turned(capture, joint), poses.rotation[:, SEGMENT[segment]]
        # knees and ankles of this skier are hinges, whose axis thigh and shank show; seven decimals of a metre
        assert worst_deg(rotation, true) < 0.01, joint
    where = capture.place[:, capture.bvh.index("LeftFoot")]
    assert np.linalg.norm(where, axis=1).max() < 1.0


def test_c3d_and_both_directions_of_up_give_the_same(tmp_path: Path, places: dict[str, Array]) -> None:
    write_c3d(tmp_path / "run.c3d", pose2sim(places), RATE, sizes=False)
    one = read(tmp_path / "run.c3d")
    other = read(write(tmp_path / "z.trc", trc(pose2sim(places), RATE, y_up=False)))
    np.testing.assert_allclose(one.pelvis, other.pelvis, atol=1e-5)  # single precision in the file


def test_a_set_of_ones_own_stands_next_to_the_capture(tmp_path: Path, places: dict[str, Array]) -> None:
    own = {f"my_{label}": place for label, place in pose2sim(places).items()}
    path = write(tmp_path / "run.trc", trc(own, RATE))
    with pytest.raises(
        InputError, match=r"no set of labels fits; of .*write a set of its labels into markers.toml next to it"
    ):
        read(path)
    text = SETS.read_text(encoding="utf-8").split("[pose2sim]")[1].split("[mediapipe]")[0]
    write(tmp_path / "markers.toml", "[mine]" + text.replace('["', '["my_'))
    capture = read(path)
    assert any("by the labels of mine" in note for note in capture.bvh.notes)
    for old, new, words in (
        ("left_hip =", "left_hips =", "left_hips"),
        ('left_hip = ["my_LHip"]', "", "missing: left_hip"),
        ('["my_LHip"]', "3", "no list of labels"),
    ):
        write(tmp_path / "markers.toml", "[mine]" + text.replace('["', '["my_').replace(old, new))
        with pytest.raises(InputError, match=words) as caught:
            read(path)
        assert caught.value.file.endswith("markers.toml")


def test_lost_points_and_frames_are_gaps(tmp_path: Path, places: dict[str, Array]) -> None:
    lost = {label: place.copy() for label, place in pose2sim(places).items()}
    lost["LKnee"][50:53] = np.nan
    lost["RHeel"][80] = [0.0, 1e300, 0.0]
    lost["RHeel"][85] = 0.0
    lines = trc(lost, RATE).split("\n")
    del lines[30:32]
    lines[100] = lines[100][:60]
    bvh, _ = read_motion(write(tmp_path / "run.trc", "\n".join(lines)), HEIGHT)
    assert len(bvh.time) == COUNT
    assert any("1 of 118 line(s) that are torn" in note and "line 101" in note for note in bvh.notes)
    assert any("8 frame(s) in which a marker is lost" in note for note in bvh.notes)


def test_texts_that_are_no_capture_are_one_clear_line(tmp_path: Path, places: dict[str, Array]) -> None:
    text = trc(pose2sim(places), RATE)
    for content, words in (
        ("hello\n", "no TRC file"),
        (text.replace("\tm\t", "\tfathoms\t"), "'fathoms' is no unit of length"),
        (text.replace("Units", "Unit"), "it names no units"),
        ("\n".join(text.split("\n")[:8]), "2 frames at 0 Hz are no capture"),
        ("\n".join([*text.split("\n")[:6], *reversed(text.split("\n")[6:])]), "stands still or runs back"),
        (text.replace("\t", ";"), "0 points are no capture|no line begins"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            read_motion(write(tmp_path / "run.trc", content), HEIGHT)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="--height-m"):
        read_motion(write(tmp_path / "run.trc", text), None)
