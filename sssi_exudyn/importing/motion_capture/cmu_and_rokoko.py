"""BVH files of other skeletons than a recording has: joints' names, axes and units of CMU's library and of Rokoko.

Their bones do not point along y where all rotations are zero.  So each joint's axes are turned to those that it has in
the T-pose, from where its bone points.  Names and axes are those of published files: CMU's library in the conversion
of B. Hahne (cgspeed.com; github.com/una-dinosauria/cmu-mocap) and with names of joints (``examples/bvh/cmu1`` of
github.com/facebookresearch/AnimatedDrawings); Rokoko Studio's in ``examples/bvh/rokoko`` there.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array, rotation_from_bvh
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, capture_of
from sssi_exudyn.importing.motion_capture.segment_axes import lengths_of
from sssi_exudyn.motion.capture_to_chain import hanging_from_t_pose
from sssi_exudyn.recording.instruments.bvh import (
    Bvh,
    joint_bones,
    joint_positions,
    read_foreign_bvh,
    world_rotations,
)

_WORDS: Final = ("Left", "Right")
_CMU_UNIT: Final = 0.0254 / 0.45
"""Unit of length of CMU's skeletons, m: inches times 0.45 (mocap.cs.cmu.edu, FAQ)."""
_CMU_SIDED: Final = {
    "Hip": "UpLeg", "Knee": "Leg", "Ankle": "Foot", "Toe": "ToeBase",
    "Collar": "Shoulder", "Shoulder": "Arm", "Elbow": "ForeArm", "Wrist": "Hand",
}  # fmt: skip
_CMU_BY_JOINTS: Final = {
    "Chest": "Spine", "Chest2": "Spine2",
    **{f"{word}{theirs}": f"{word}{ours}" for word in _WORDS for theirs, ours in _CMU_SIDED.items()},
}  # fmt: skip
_CMU_BY_BONES: Final = {"Spine1": "Spine2", "Neck": "LowerNeck", "Neck1": "Neck"}
"""A recording's names by those of the two conversions of CMU's library; names that are not here stay."""
_NEEDED: Final = (
    "Spine", "Spine2", "Neck", "Head",
    *(word + part for word in _WORDS for part in ("Arm", "ForeArm", "Hand", "ToeBase")),
)  # fmt: skip
_BONES: Final = (("UpLeg", "Leg"), ("Leg", "Foot"), ("Arm", "ForeArm"), ("ForeArm", "Hand"))
"""Joints of a limb, and the joint at the far end of each one's bone."""


def other_skeleton(bones: Mapping[str, tuple[float, ...]]) -> str | None:
    """Return ``"CMU"`` or ``"Rokoko"`` for the joints of a BVH file; None for a recording's own or an unknown skeleton.

    ``bones`` is the OFFSET of each joint (empty for a faulty one), by its name in a recording's words where it has one.
    """
    if {"LHipJoint", "RHipJoint"} <= bones.keys():
        return "CMU"
    shank = bones.get("LeftLeg") or (0.0, 0.0, 0.0)
    if shank[0] > 0.9 * float(np.linalg.norm(shank)) > 0.0 and set(_NEEDED) <= bones.keys():
        return "Rokoko"
    return None


def read_other_skeleton(path: Path, kind: str, renamed: Mapping[str, str], height: float) -> Bvh:
    """Read a BVH file of CMU's library or of Rokoko as a recording's capture.

    Parameters
    ----------
    kind : as ``other_skeleton`` returns it
    renamed : names in a recording's words, by those in the file, where they differ
    height : m, the skier's, for the hands and the top of the head

    Raises InputError for missing joints, and for whatever ``read_foreign_bvh`` refuses.
    """
    names = [name for name, _ in joint_bones(path)]
    if kind == "CMU":
        table = _CMU_BY_JOINTS if "Chest" in names else _CMU_BY_BONES
        renamed = {name: table[name] for name in names if name in table}
    ours = {renamed.get(name, name) for name in names}
    missing = [name for name in _NEEDED if name not in ours]
    if missing:
        raise InputError(path, "HIERARCHY", f"missing joints: {', '.join(missing)}", "export the whole skeleton")
    bvh = read_foreign_bvh(path, renamed)
    world = world_rotations(bvh)
    scale = 100.0 * _CMU_UNIT if kind == "CMU" else 1.0
    places = scale * joint_positions(bvh, world) @ BODY_FROM_BVH.T
    rotation = {joint: _in_body_axes(bvh, world, name, joint, kind) for name, joint in _segments()}
    joint = {name: places[:, bvh.index(name)] for name in ("Hips", "Spine", "Neck", *_sided())}
    tips = {f"{word}Foot": places[:, bvh.index(f"{word}ToeBase")] for word in _WORDS}
    for side, word in SIDES:
        hand = np.asarray(average_geometry(height).segment_end[SEGMENT[f"hand_{side}"]])
        tips[f"{word}Hand"] = joint[f"{word}Hand"] + rotation[f"{word}Hand"] @ hand
    place, ends = lengths_of(rotation, joint, tips, height)
    said = f"names, axes and unit are those of {kind}'s skeleton; its trunk is one piece that turns as the chest"
    note = f"{path.name}: {said}"
    return capture_of(path, bvh.time - bvh.time[0], rotation, place, ends, (*bvh.notes, note))


def _sided() -> list[str]:
    """Return the joints of both sides whose segments are used."""
    return [f"{word}{part}" for word in _WORDS for part in ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")]


def _segments() -> list[tuple[str, str]]:
    """Return the joints whose segments are used, in the file and in the capture."""
    return [("Hips", "Hips"), ("Spine2", "Spine"), ("Head", "Head"), *((name, name) for name in _sided())]


def _in_body_axes(bvh: Bvh, world: Array, name: str, joint: str, kind: str) -> Array:
    """Return a segment's rotation (n, 3, 3) in body axes, zero when standing with the arms hanging."""
    turned = world[:, bvh.index(name)] @ _t_pose_axes(bvh, name, kind)
    return rotation_from_bvh(turned) @ hanging_from_t_pose(joint)


def _t_pose_axes(bvh: Bvh, name: str, kind: str) -> Array:
    """Return left, up and forward of the T-pose, as columns (3, 3) in the axes that a joint has in the file."""
    if name in ("Hips", "Head"):
        return np.eye(3)
    if name == "Spine2":
        return _turn(np.array([0.0, 1.0, 0.0]), bvh.offsets[bvh.index("Neck")] if kind == "Rokoko" else np.zeros(3))
    word = "Left" if name.startswith("Left") else "Right"
    out = np.array([1.0 if word == "Left" else -1.0, 0.0, 0.0])
    if name.endswith("Foot"):
        if kind == "CMU":  # feet are turned as shanks are, where all rotations are zero
            return _t_pose_axes(bvh, f"{word}Leg", kind)
        # the sole lies as the toes do, x forward and y up; the foot's own bone slopes to the ball
        level = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        toes = bvh.rotations[:, bvh.index(f"{word}ToeBase")]
        return np.asarray(Rotation.from_matrix(toes).mean().as_matrix() @ level)
    children = {f"{word}{one}": f"{word}{other}" for one, other in _BONES}
    if name.endswith("Hand"):  # it goes on from the forearm
        return _t_pose_axes(bvh, f"{word}ForeArm", kind)
    along = np.array([0.0, -1.0, 0.0]) if name.endswith("Leg") else out
    return _turn(along, bvh.offsets[bvh.index(children[name])])


def _turn(direction: Array, bone: Array) -> Array:
    """Return the smallest rotation (3, 3) of a direction to where the bone points; about y where they are opposite."""
    length = float(np.linalg.norm(bone))
    if length == 0.0:
        return np.eye(3)
    bone = bone / length
    axis, cosine = np.cross(direction, bone), float(direction @ bone)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-6:
        return np.eye(3) if cosine > 0.0 else np.diag([-1.0, 1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(np.arctan2(sine, cosine) * axis / sine).as_matrix())
