"""The BVH reader: rotations in any channel order, both Axis Studio skeletons, and broken files."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiny import LEG, SKELETON, SPINE2, Tiny

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.bvh import joint_positions, read_bvh, world_rotations

ORDERS = ["".join(order) for order in itertools.permutations("XYZ")]


def write(folder: Path, text: str) -> Path:
    path = folder / "motion.bvh"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("order", ORDERS)
def test_rotation_is_the_product_of_channels_in_their_order(tmp_path: Path, order: str) -> None:
    text = Tiny().bvh()
    old = "Yrotation Xrotation Zrotation"
    new = " ".join(f"{axis}rotation" for axis in order)
    tiny = Tiny()
    read = read_bvh(write(tmp_path, text.replace(old, new)))
    for name in ("Hips", "LeftFoot"):
        expected = Rotation.from_euler(order, tiny.rotations[name], degrees=True).as_matrix()
        # the file has five digits of a degree
        np.testing.assert_allclose(read.rotations[:, read.index(name)], expected, atol=2e-7)


def test_positions_after_rotations_and_six_channels_everywhere(tmp_path: Path) -> None:
    tiny = Tiny()
    six = "CHANNELS 6 Zrotation Xrotation Yrotation Xposition Yposition Zposition"
    text = tiny.bvh().replace("CHANNELS 3 Yrotation Xrotation Zrotation", six)
    head, frames = text.split("Frame Time:")
    step, *rows = frames.strip().split("\n")
    rotations = np.loadtxt(rows)[:, 3:].reshape(len(rows), -1, 3)
    positions = np.broadcast_to(np.array([offset for _, _, offset in SKELETON]), rotations.shape).copy()
    positions[:, 8, 1] += 0.5
    # Hips keeps its own order (positions first); the others have rotations first
    first = np.hstack([positions[:, 0] * 0.0 + [1.0, 2.0, 3.0], rotations[:, 0]])
    others = np.concatenate([rotations, positions], axis=2)[:, 1:].reshape(len(rows), -1)
    body = "\n".join(" ".join(f"{value:.5f}" for value in row) for row in np.hstack([first, others]))
    read = read_bvh(write(tmp_path, f"{head}Frame Time:{step}\n{body}\n"))
    expected = Rotation.from_euler("ZXY", tiny.rotations["RightLeg"], degrees=True).as_matrix()
    np.testing.assert_allclose(read.rotations[:, read.index("RightLeg")], expected, atol=2e-7)
    np.testing.assert_allclose(read.root_position[5], [0.01, 0.02, 0.03])
    np.testing.assert_allclose(read.offsets[read.index("Spine1")], [0.0, 0.17, 0.0])
    assert any("Spine1" in note and "OFFSET" in note for note in read.notes)


def test_lengths_are_metres_and_time_is_offset(tmp_path: Path) -> None:
    read = read_bvh(write(tmp_path, Tiny().bvh()), time_offset=2.0)
    upright = np.broadcast_to(np.eye(3), read.rotations.shape)
    places = joint_positions(read, upright)
    np.testing.assert_allclose(places[0, read.index("LeftFoot")], [0.09, -LEG, 0.0])
    np.testing.assert_allclose(places[0, read.index("Spine2")], [0.0, SPINE2, 0.0])
    np.testing.assert_allclose(read.end_offsets["LeftFoot"], [0.0, 0.05, 0.0])
    assert read.time[0] == 2.0
    assert np.allclose(np.diff(read.time), 1.0 / 60.0, atol=1e-8)  # the frame time has eight digits


def test_world_rotation_accumulates_from_parent_to_child(tmp_path: Path) -> None:
    read = read_bvh(write(tmp_path, Tiny().bvh()))
    world = world_rotations(read)
    chain = [read.index(name) for name in ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot")]
    expected = np.eye(3)
    for joint in chain:
        expected = expected @ read.rotations[7, joint]
    np.testing.assert_allclose(world[7, chain[-1]], expected, atol=1e-14)  # rounding of three products


def test_tree_without_neck1_and_with_spine3_and_fingers(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.skeleton = tuple(
        (name, "Spine3" if above == "Spine2" else "Neck" if above == "Neck1" else above, offset)
        for name, above, offset in SKELETON
        if name != "Neck1"
    ) + (("Spine3", "Spine2", (0.0, 10.0, 0.0)), ("LeftHandThumb1", "LeftHand", (3.0, 0.0, 3.0)))
    tiny.rotations["Spine3"] = tiny.rotations["Spine1"]
    tiny.rotations["LeftHandThumb1"] = np.zeros_like(tiny.rotations["Spine1"])
    # the writer goes depth first, so the columns have to follow the tree
    order = depth_first(tiny.skeleton, "")
    tiny.skeleton = tuple(sorted(tiny.skeleton, key=lambda joint: order.index(joint[0])))
    read = read_bvh(write(tmp_path, tiny.bvh()))
    assert read.parents[read.index("Neck")] == read.index("Spine3")
    assert "Neck1" not in read.names
    assert read.notes == ()  # a resting finger is no fault


def depth_first(skeleton: tuple[tuple[str, str, tuple[float, float, float]], ...], above: str) -> list[str]:
    return [one for name, parent, _ in skeleton if parent == above for one in [name, *depth_first(skeleton, name)]]


def cut_rows(text: str, count: int) -> str:
    return "\n".join(text.rstrip("\n").split("\n")[:-count]) + "\n"


def spoil(text: str, row: int, word: str) -> str:
    lines = text.split("\n")
    words = lines[row].split()
    words[5] = word
    lines[row] = " ".join(words)
    return "\n".join(lines)


FAULTS = {
    "frames missing": (lambda t: cut_rows(t, 60), "line", "truncated"),
    "cut in the hierarchy": (lambda t: t[:900], "line", "truncated"),
    "cut after MOTION": (lambda t: t[: t.index("Frame Time")], "line", "truncated"),
    "too many frames": (lambda t: t.replace("Frames: 481", "Frames: 480"), "line", "480 frames, 481 are there"),
    "no frames": (lambda t: t.replace("Frames: 481", "Frames: 0"), "line", "no motion"),
    "NaN": (lambda t: spoil(t, 200, "nan"), "line 201, column 6", "'nan' is not a number"),
    "infinity": (lambda t: spoil(t, 200, "inf"), "line 201, column 6", "'inf' is not a number"),
    "text": (lambda t: spoil(t, 200, "n/a"), "line 201, column 6", "'n/a' is not a number"),
    "milliseconds": (lambda t: t.replace("Frame Time: 0.01666667", "Frame Time: 16.67"), "Frame Time", "16.67"),
    "zero frame time": (lambda t: t.replace("Frame Time: 0.01666667", "Frame Time: 0"), "Frame Time", "outside"),
    "other names": (lambda t: t.replace("JOINT LeftLeg", "JOINT LeftShin"), "HIERARCHY", "missing joints: LeftLeg"),
    "other root": (lambda t: t.replace("ROOT Hips", "ROOT Pelvis"), "HIERARCHY", "missing joints: Hips"),
    "z up": (lambda t: t.replace("OFFSET 0.0 -40.0 0.0", "OFFSET 0.0 0.0 -40.0"), "OFFSET", "axes"),
    "mirrored": (lambda t: t.replace("OFFSET 9.0", "OFFSET -9.5"), "OFFSET", "left one at +x"),
    "a channel less": (
        lambda t: t.replace("CHANNELS 3 Yrotation Xrotation Zrotation", "CHANNELS 2 Yrotation Xrotation", 1),
        "joint RightUpLeg",
        "2 rotation channels",
    ),
    "unknown channel": (lambda t: t.replace("Zrotation", "Wrotation", 1), "line 5", "cannot understand"),
    "offset of two": (lambda t: t.replace("OFFSET 9.0 0.0 0.0", "OFFSET 9.0 0.0"), "line", "three numbers"),
    "two skiers": (lambda t: t.replace("JOINT LeftUpLeg", "ROOT Hips2"), "line", "second root"),
    "twice": (lambda t: t.replace("JOINT LeftLeg", "JOINT RightLeg"), "line", "appears twice"),
    "no BVH": (lambda t: "time,x\n" + t, "line 1", "starts with HIERARCHY"),
    "garbage": (lambda t: t.replace("CHANNELS 3", "CHANELS 3", 1), "line", "is not BVH"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_broken_files_are_named_with_place_and_fix(tmp_path: Path, fault: str) -> None:
    change, place, problem = FAULTS[fault]
    text = Tiny().bvh()
    assert change(text) != text
    path = write(tmp_path, change(text))
    with pytest.raises(InputError) as caught:
        read_bvh(path)
    assert str(path) in str(caught.value)
    assert place in caught.value.place
    assert problem in caught.value.problem
    assert caught.value.fix
    assert "\n" not in str(caught.value)


def test_dead_sensor_at_the_skis_is_an_error_elsewhere_a_note(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.rotations["LeftHand"] = np.zeros_like(tiny.rotations["LeftHand"])
    tiny.rotations["RightLeg"][:, 1] = 12.0
    notes = read_bvh(write(tmp_path, tiny.bvh())).notes
    assert any("LeftHand" in note for note in notes)
    assert any("RightLeg: xrotation is constant" in note for note in notes)
    tiny.rotations["RightLeg"][:] = 12.0
    with pytest.raises(InputError, match="joint RightLeg: its rotation is constant"):
        read_bvh(write(tmp_path, tiny.bvh()))
