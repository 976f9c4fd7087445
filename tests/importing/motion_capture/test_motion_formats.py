"""Captures of other formats: the same orientations and places as in the file, and broken files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mvnx_file import BEGAN, RATE, SEGMENTS, mvnx, orientations
from scipy.spatial.transform import Rotation
from tiny import Tiny

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, rotation_from_bvh
from sssi_exudyn.importing.motion_capture.bvh_writer import bvh_text
from sssi_exudyn.importing.motion_capture.motion_formats import read_motion
from sssi_exudyn.importing.motion_capture.mvnx import JOINT_OF_SEGMENT
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_positions, read_bvh, world_rotations

PLACES = {name: np.array(place) for name, _, _, place in SEGMENTS}
PARENTS = {name: parent for name, _, parent, _ in SEGMENTS}
XSENS = {
    "Spine": "Chest", "Spine1": "Chest2", "Spine2": "Chest3", "Spine3": "Chest4",
    **{
        side + ours: side + theirs
        for side in ("Right", "Left")
        for ours, theirs in (
            ("Shoulder", "Collar"), ("Arm", "Shoulder"), ("ForeArm", "Elbow"), ("Hand", "Wrist"),
            ("UpLeg", "Hip"), ("Leg", "Knee"), ("Foot", "Ankle"), ("ToeBase", "Toe"),
        )
    },
}  # fmt: skip


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def read_xsens(folder: Path, **how: list[int]) -> tuple[Bvh, Array]:
    """Read a capture through an MVNX file; return it and the orientations that were written."""
    count = len(how["index"]) if how else 90
    written = orientations(count)
    return read_motion(write(folder, "run.mvnx", mvnx(written, **how)), None)[0], written


def test_mvnx_keeps_orientations_and_places(tmp_path: Path) -> None:
    bvh, written = read_xsens(tmp_path)
    world = world_rotations(bvh)
    place = joint_positions(bvh, world)
    expected = {"Pelvis": np.zeros((len(written), 3))}
    for number, (name, *_) in enumerate(SEGMENTS):
        at = bvh.index(JOINT_OF_SEGMENT[name])
        # quaternions have six digits
        np.testing.assert_allclose(rotation_from_bvh(world[:, at]), written[:, number], atol=3e-6)
        if PARENTS[name]:
            parent = [segment for segment, *_ in SEGMENTS].index(PARENTS[name])
            expected[name] = expected[PARENTS[name]] + written[:, parent] @ PLACES[name]
        # a chain of seven segments of 0.4 m, each turned by 3e-6
        x, y, z = expected[name].T
        np.testing.assert_allclose(place[:, at], np.column_stack([y, z, x]), atol=1e-5)
    np.testing.assert_allclose(bvh.time, np.arange(90) / RATE, atol=1e-12)


def test_mvnx_says_when_it_began(tmp_path: Path) -> None:
    _, began = read_motion(write(tmp_path, "run.mvnx", mvnx(orientations(90))), None)
    assert began == pytest.approx(BEGAN, abs=6e-4)  # whole milliseconds in the file


def test_lost_frames_are_interpolated_and_noted(tmp_path: Path) -> None:
    whole = orientations(90)
    kept = [number for number in range(90) if number not in (40, 41)]
    path = write(tmp_path, "run.mvnx", mvnx(whole[kept], index=kept))
    bvh, _ = read_motion(path, None)
    assert len(bvh.time) == 90
    at = bvh.index("Hips")
    turned = rotation_from_bvh(bvh.rotations[:, at])[40:42]
    apart = Rotation.from_matrix(np.swapaxes(turned, -1, -2) @ whole[40:42, 0]).magnitude()
    # an acceleration of 0.5 rad · (4 rad/s)² in each axis over a gap of 0.05 s leaves 14 rad/s² · (0.05 s)²/8
    assert np.max(apart) < 0.005
    assert any("interpolated" in note for note in bvh.notes)


MVNX_FAULTS: dict[str, tuple[Callable[[str], str], str, str]] = {
    "truncated": (lambda t: t[: len(t) // 2], "line", "broken XML"),
    "entities": (
        lambda t: t.replace("<mvnx ", '<!DOCTYPE x [<!ENTITY a "b">]><mvnx ', 1),
        "",
        "DTD or entities are not accepted",
    ),
    "two skiers": (lambda t: t.replace("</mvnx>", '<subject frameRate="60"/></mvnx>'), "subject", "a second subject"),
    "no rate": (lambda t: t.replace('frameRate="60"', ""), "subject frameRate", "not 1 numbers"),
    "no leg": (lambda t: t.replace('label="RightFoot"', 'label="Right"'), "segments", "missing: RightFoot"),
    "no joint": (lambda t: t.replace("<connector1>Pelvis/jL5S1", "<connector1>x/jL5S1"), "joints", "nothing connects"),
    "text": (
        lambda t: t.replace("<position>0.000000", "<position>nothing"),
        "position",
        "not 69 numbers",
    ),
    "no quaternion": (
        lambda t: t.replace("<orientation>1.000000", "<orientation>2.000000"),
        "orientation",
        "not unit quaternions",
    ),
    "order": (lambda t: t.replace('index="40"', 'index="4"'), "frame 4", "out of order"),
    "no frames": (lambda t: t.replace('type="normal"', 'type="tpose"'), "frames", "0 frames are no motion"),
    "nested": (lambda t: t.replace("<frames>", "<frames>" + "<a>" * 100), "", "more elements"),
}


@pytest.mark.parametrize("fault", MVNX_FAULTS)
def test_broken_mvnx_is_one_clear_line(tmp_path: Path, fault: str) -> None:
    spoil, place, problem = MVNX_FAULTS[fault]
    rotations = orientations(90)
    rotations[0] = np.eye(3)  # so that the first quaternion is 1 0 0 0
    text = spoil(mvnx(rotations))
    path = write(tmp_path, "run.mvnx", text)
    with pytest.raises(InputError) as info:
        read_motion(path, None)
    assert info.value.file == str(path)
    assert place in info.value.place
    assert problem in info.value.problem
    assert info.value.fix


def test_written_bvh_reads_back(tmp_path: Path) -> None:
    bvh, _ = read_xsens(tmp_path)
    again = read_bvh(write(tmp_path, "again.bvh", bvh_text(bvh)))
    order = [again.index(name) for name in bvh.names]
    np.testing.assert_allclose(again.rotations[:, order], bvh.rotations, atol=3e-8)  # six digits of a degree
    np.testing.assert_allclose(again.offsets[order], bvh.offsets, atol=1e-8)  # six digits of a centimetre
    np.testing.assert_allclose(again.time, bvh.time, atol=1e-7)  # nine digits a step, 90 steps


def test_xsens_bvh_gets_the_recordings_names_and_loses_its_t_pose(tmp_path: Path) -> None:
    whole, _ = read_xsens(tmp_path)
    text = bvh_text(whole)
    for ours in sorted(XSENS, key=len, reverse=True):
        text = text.replace(f" {ours}\n", f" {XSENS[ours]}!\n")
    path = write(tmp_path, "run.bvh", text.replace("!", ""))
    with pytest.raises(InputError, match="let sssi import rename them"):
        read_bvh(path)
    bvh, began = read_motion(path, None)
    assert began is None
    assert set(bvh.names) == set(whole.names)
    order = [bvh.index(name) for name in whole.names]
    np.testing.assert_allclose(bvh.rotations[:, order], whole.rotations[1:], atol=3e-8)  # six digits of a degree
    assert bvh.time[0] == 0.0
    assert any("T-pose" in note for note in bvh.notes)


@pytest.mark.parametrize("prefix", ["Robot_", "mixamorig:", "skier1:"])
def test_a_common_prefix_of_joints_goes(tmp_path: Path, prefix: str) -> None:
    text = Tiny().bvh().replace("ROOT ", f"ROOT {prefix}").replace("JOINT ", f"JOINT {prefix}")
    bvh, _ = read_motion(write(tmp_path, "run.bvh", text), None)
    assert bvh.names == read_bvh(write(tmp_path, "plain.bvh", Tiny().bvh())).names


def test_unknown_suffix_names_those_that_are_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no reader for '\.fbx'.*\.bvh.*\.mvnx"):
        read_motion(write(tmp_path, "run.fbx", "x"), None)
