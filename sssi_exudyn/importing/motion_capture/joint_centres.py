"""Captures of joints' centres, as markerless systems write them; ``marker_sets.toml`` says which labels are which.

Long axes of segments point along the bones.  The axis of a bent knee is the normal of thigh and shank; straight knees
and, where nothing else is known, ankles turn about the foot's own axis.  Points at both sides of a knee or an ankle
show its axis, and those of the pelvis its tilt; without them the pelvis tilts as the trunk does.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.motion_capture.c3d_points import Points
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, capture_of
from sssi_exudyn.importing.motion_capture.segment_axes import (
    Places,
    axes_x_y,
    axes_y_x,
    axes_z_y,
    check_axes,
    lengths_of,
    unit,
    upright,
    whole_frames,
)
from sssi_exudyn.io.settings import Settings, check_keys, read_toml
from sssi_exudyn.recording.instruments.bvh import Bvh

SETS: Final = Path(__file__).with_name("marker_sets.toml")
OWN: Final = "markers.toml"
_SIDED: Final = ("hip", "knee", "ankle", "heel", "toe", "shoulder", "elbow", "wrist")
_NEEDED: Final = tuple(f"{side}_{name}" for side in ("left", "right") for name in _SIDED)
_AXES: Final = tuple(
    f"{side}_{name}_{place}"
    for side in ("left", "right")
    for name in ("knee", "ankle")
    for place in ("inside", "outside")
)
_OPTIONAL: Final = ("neck", "head", "pelvis_front", "pelvis_back", *_AXES)
_STRAIGHT: Final = 0.1
"""Sine of a joint's flexion above which its axis comes from both bones rather than from the next segment."""
_LUMBAR: Final = 0.828
"""Height of the lumbar joint above the hips, in distances of these: that of Plug-in Gait."""


def capture_of_joint_centres(path: Path, points: Points, height: float) -> Bvh:
    """Make a capture of joints' centres; ``height`` (m) is the skier's, for the top of the head and the hands.

    Frames without all points are gaps.  Raises InputError where no set of labels fits, for a faulty set, and for a
    skier who does not stand up.
    """
    name, labels = _set_of(path, points)
    whole, notes = whole_frames(path, points, sorted({label for row in labels.values() for label in row}))
    column = {label: points.places[whole, points.names.index(label)] for row in labels.values() for label in row}
    at = {point: np.mean([column[label] for label in row], axis=0) for point, row in labels.items()}
    at.setdefault("neck", 0.5 * (at["left_shoulder"] + at["right_shoulder"]))
    at = upright(path, at, at["neck"], 0.5 * (at["left_ankle"] + at["right_ankle"]))
    rotation, joint = _trunk(at)
    tips: Places = {}
    for side, word in SIDES:
        _leg(at, word, rotation, joint, tips)
        _arm(at, side, word, rotation, joint, tips, height)
    time = points.time[whole] - points.time[whole][0]
    check_axes(path, time, rotation)
    place, ends = lengths_of(rotation, joint, tips, height)
    said = (
        f"{path.name}: joints' centres by the labels of {name}; a ski's edge angle is as good as knees and ankles are"
    )
    return capture_of(path, time, rotation, place, ends, (said, *notes))


def _set_of(path: Path, points: Points) -> tuple[str, dict[str, tuple[str, ...]]]:
    """Return the name and the labels of the first set that a capture has whole; those of ``markers.toml`` come first.

    Raises InputError where none fits.
    """
    own = path.with_name(OWN)
    sets = _sets(own) if own.is_file() else {}
    sets |= {name: labels for name, labels in _sets(SETS).items() if name not in sets}
    there = set(points.names)
    for name, labels in sets.items():
        if all(there >= set(row) for row in labels.values()):
            return name, labels

    def lacking(name: str) -> list[str]:
        return sorted({label for row in sets[name].values() for label in row} - there)

    nearest = min(sets, key=lambda name: len(lacking(name)))
    problem = f"no set of labels fits; of {nearest}, the nearest, it lacks {one_line(', '.join(lacking(nearest)), 300)}"
    raise InputError(path, "labels", problem, f"write a set of its labels into {OWN} next to it (see marker_sets.toml)")


def _sets(path: Path) -> dict[str, dict[str, tuple[str, ...]]]:
    """Read the sets of labels of a file.  Raises InputError for a faulty one."""
    sets = {}
    for name, table in read_toml(path).items():
        if not isinstance(table, dict):
            raise InputError(path, name, "this is no table of labels", f"write [{name}], and a line for each point")
        check_keys(table, (*_NEEDED, *_OPTIONAL), path, f"[{name}]")
        missing = [point for point in _NEEDED if point not in table]
        if missing:
            raise InputError(path, f"[{name}]", f"missing: {', '.join(missing)}", "name the labels of every point")
        sets[name] = {point: _labels(path, table, name, point) for point in table}
    return sets


def _labels(path: Path, table: Settings, name: str, point: str) -> tuple[str, ...]:
    row = table[point]
    if not isinstance(row, list) or not row or not all(isinstance(label, str) for label in row):
        raise InputError(path, f"[{name}] {point}", "this is no list of labels", f'write {point} = ["label"]')
    return tuple(row)


def _trunk(at: Places) -> tuple[Places, Places]:
    """Return rotations of pelvis, trunk and head, and the places of hips, lumbar joint and base of the neck."""
    left, right = at["left_hip"], at["right_hip"]
    middle, across = 0.5 * (left + right), left - right
    spine = axes_z_y(at["neck"] - middle, at["left_shoulder"] - at["right_shoulder"])
    forward = spine[..., 0]
    if "pelvis_front" in at and "pelvis_back" in at:
        forward = at["pelvis_front"] - at["pelvis_back"]
    pelvis = axes_y_x(across, forward)
    apart = float(np.median(np.linalg.norm(across, axis=1)))
    joint = {"LeftUpLeg": left, "RightUpLeg": right, "Hips": middle, "Neck": at["neck"]}
    joint["Spine"] = middle + pelvis @ np.array([0.0, 0.0, _LUMBAR * apart])
    head = axes_z_y(at["head"] - at["neck"], spine[..., 1]) if "head" in at else spine
    return {"Hips": pelvis, "Spine": spine, "Head": head}, joint


def _leg(at: Places, word: str, rotation: Places, joint: Places, tips: Places) -> None:
    side, left = word.lower(), 1.0 if word == "Left" else -1.0
    hip, knee, ankle = (at[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    foot = at[f"{side}_toe"] - at[f"{side}_heel"]
    bent = np.cross(unit(knee - hip), unit(ankle - knee))  # to the left, on both sides
    hinge = bent + _STRAIGHT * unit(np.cross(knee - ankle, foot))
    of = {
        name: left * (at[f"{side}_{name}_outside"] - at[f"{side}_{name}_inside"])
        for name in ("knee", "ankle")
        if f"{side}_{name}_outside" in at and f"{side}_{name}_inside" in at
    }
    shank = axes_z_y(knee - ankle, of.get("ankle", hinge))
    rotation[f"{word}UpLeg"], rotation[f"{word}Leg"] = axes_z_y(hip - knee, of.get("knee", hinge)), shank
    rotation[f"{word}Foot"] = axes_x_y(foot, shank[..., 1])
    joint[f"{word}Leg"], joint[f"{word}Foot"], tips[f"{word}Foot"] = knee, ankle, at[f"{side}_toe"]


def _arm(at: Places, side: str, word: str, rotation: Places, joint: Places, tips: Places, height: float) -> None:
    """Add an arm, whose hand goes on straight from the forearm."""
    shoulder, elbow, wrist = (at[f"{word.lower()}_{name}"] for name in ("shoulder", "elbow", "wrist"))
    bent = np.cross(unit(wrist - elbow), unit(elbow - shoulder))  # to the left, on both sides
    hinge = bent + _STRAIGHT * rotation["Spine"][..., 1]
    forearm = axes_z_y(elbow - wrist, hinge)
    rotation[f"{word}Arm"], rotation[f"{word}ForeArm"] = axes_z_y(shoulder - elbow, hinge), forearm
    rotation[f"{word}Hand"] = forearm
    joint[f"{word}Arm"], joint[f"{word}ForeArm"], joint[f"{word}Hand"] = shoulder, elbow, wrist
    tips[f"{word}Hand"] = wrist + forearm @ np.asarray(average_geometry(height).segment_end[SEGMENT[f"hand_{side}"]])
