"""Captures of Theia3D in C3D files: the axes and the origin of every segment, in the group ROTATION, and no points.

A segment's origin is the joint at its upper end.  Its axes are x right, y forward, z up where the skier stands with the
arms hanging and the palms forward.  So they are in the public sample of such a file, ``C3DRotationExample.c3d`` of
github.com/pyomeca/ezc3d-testFiles (Theia3D 2020.3, 21 segments).
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.motion_capture.c3d_points import Points
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, capture_of
from sssi_exudyn.importing.motion_capture.segment_axes import Places, check_axes, lengths_of
from sssi_exudyn.recording.instruments.bvh import Bvh

_SEGMENTS: Final = {"Hips": "pelvis", "Spine": "torso", "Head": "head"}
_SIDED: Final = {"UpLeg": "thigh", "Leg": "shank", "Foot": "foot", "Arm": "uarm", "ForeArm": "larm", "Hand": "hand"}
_LABEL: Final = "_4X4"
_BODY: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Forward, left and up (columns) in axes x right, y forward, z up."""
_LUMBAR: Final = 0.828
"""Height of the lumbar joint above the hips, in distances of these: that of Plug-in Gait."""
_WHOLE: Final = 0.01
"""Greatest difference of a segment's axes from a rotation's; the file has single precision."""


def capture_of_poses(path: Path, points: Points, height: float) -> Bvh:
    """Make a capture of segments' poses; ``height`` (m) is the skier's, for the hands and the top of the head.

    Frames in which a segment has no pose are gaps.  Raises InputError for missing segments, and a skier who does not
    stand up.
    """
    names = _names()
    missing = [label for label in names.values() if label not in points.poses]
    if missing:
        problem = f"missing segments: {one_line(', '.join(missing), 300)}"
        raise InputError(path, "ROTATION:LABELS", problem, "export Theia's whole skeleton")
    poses = {joint: points.poses[label] for joint, label in names.items()}
    whole = np.all([_is_rotation(pose[:, :3, :3]) for pose in poses.values()], axis=0)
    if np.count_nonzero(whole) < 3:
        raise InputError(path, "ROTATION", "no three frames have all segments", "export the capture again")
    up = _upright(path, poses["Spine"][whole, :3, 3] - poses["Hips"][whole, :3, 3])
    rotation = {joint: up @ pose[whole, :3, :3] @ _axes(joint) for joint, pose in poses.items()}
    joint = {name: pose[whole, :3, 3] @ up.T for name, pose in poses.items()}
    across = joint["LeftUpLeg"] - joint["RightUpLeg"]
    middle = 0.5 * (joint["LeftUpLeg"] + joint["RightUpLeg"])
    apart = float(np.median(np.linalg.norm(across, axis=1)))
    neck = points.poses.get(f"neck{_LABEL}", points.poses[f"torso{_LABEL}"])
    joint["Neck"], joint["Hips"] = neck[whole, :3, 3] @ up.T, middle
    joint["Spine"] = middle + rotation["Hips"] @ np.array([0.0, 0.0, _LUMBAR * apart])
    tips: Places = {}
    for side, word in SIDES:
        tips[f"{word}Foot"] = points.poses[f"{side}_toes{_LABEL}"][whole, :3, 3] @ up.T
        hand = np.asarray(average_geometry(height).segment_end[SEGMENT[f"hand_{side}"]])
        tips[f"{word}Hand"] = joint[f"{word}Hand"] + rotation[f"{word}Hand"] @ hand
    time = points.time[whole] - points.time[whole][0]
    check_axes(path, time, rotation)
    place, ends = lengths_of(rotation, joint, tips, height)
    lost = len(whole) - int(np.count_nonzero(whole))
    notes = (f"{path.name}: segments as Theia3D has them; a ski's edge angle is as good as its feet are",)
    gaps = (f"{path.name}: {lost} frame(s) in which a segment is lost are gaps",) if lost else ()
    return capture_of(path, time, rotation, place, ends, (*notes, *gaps))


def _names() -> dict[str, str]:
    """Return the file's labels by the joints of a recording."""
    sided = {f"{word}{ours}": f"{side}_{theirs}{_LABEL}" for side, word in SIDES for ours, theirs in _SIDED.items()}
    toes = {f"{word}ToeBase": f"{side}_toes{_LABEL}" for side, word in SIDES}
    return {joint: f"{segment}{_LABEL}" for joint, segment in _SEGMENTS.items()} | sided | toes


def _axes(joint: str) -> Array:
    """Return forward, left and up (columns) of the hanging posture, palms to the thighs, in a segment's axes."""
    if not joint.endswith(("ForeArm", "Hand")):
        return _BODY
    out = 1.0 if joint.startswith("Right") else -1.0  # the thumb points outwards where the palm is forward
    return np.array([[out, 0.0, 0.0], [0.0, out, 0.0], [0.0, 0.0, 1.0]])


def _is_rotation(axes: Array) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return which of the matrices (n, 3, 3) are rotations; lost segments are zeros or NaN."""
    finite = np.where(np.isfinite(axes), axes, 0.0)
    square = np.swapaxes(finite, -1, -2) @ finite
    return np.asarray((np.max(np.abs(square - np.eye(3)), axis=(1, 2)) < _WHOLE) & (np.linalg.det(finite) > 0.0))


def _upright(path: Path, trunk: Array) -> Array:
    """Return the rotation (3, 3) from the laboratory to a level frame with z up; laboratories have y or z up."""
    rise = np.mean(trunk, axis=0)
    axis = int(np.argmax(np.abs(rise)))
    if axis == 0 or rise[axis] < 0.7 * float(np.linalg.norm(rise)):
        raise InputError(path, "ROTATION", "the skier stands along neither y nor z", "export with y or z up")
    return np.eye(3) if axis == 2 else np.eye(3)[[2, 0, 1]]
