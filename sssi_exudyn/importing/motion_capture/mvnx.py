"""Motion capture in Xsens MVNX files: segments' orientations as quaternions, joints' places in the segments.

Xsens's segment frames are x forward, y left, z up in its T-pose (MVN User Manual, "Segment coordinate systems").  So
they are this project's body frames, and the T-pose is BVH's zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array
from sssi_exudyn.importing.motion_capture.resample import even_frames
from sssi_exudyn.io.bounds import MAX_JOINTS, check_samples
from sssi_exudyn.io.markup import elements, local_name, text_below
from sssi_exudyn.recording.instruments.bvh import Bvh

_SIDED: Final = {
    "Shoulder": "Shoulder", "UpperArm": "Arm", "ForeArm": "ForeArm", "Hand": "Hand",
    "UpperLeg": "UpLeg", "LowerLeg": "Leg", "Foot": "Foot", "Toe": "ToeBase",
}  # fmt: skip
JOINT_OF_SEGMENT: Final = {
    "Pelvis": "Hips", "L5": "Spine", "L3": "Spine1", "T12": "Spine2", "T8": "Spine3", "Neck": "Neck", "Head": "Head",
    **{f"{side}{xsens}": f"{side}{ours}" for side in ("Right", "Left") for xsens, ours in _SIDED.items()},
}  # fmt: skip
"""Joint, under a recording's name, at which each of Xsens's segments begins."""
_ENDS: Final = {
    "Head": "pTopOfHead", "RightHand": "pRightTopOfHand", "LeftHand": "pLeftTopOfHand",
    "RightToe": "pRightToe", "LeftToe": "pLeftToe",
}  # fmt: skip
_LATEST: Final = 10**14
"""Latest time, ms since 1970, beyond the year 5000."""
_RATES: Final = (20.0, 2000.0)


@dataclass
class _Parts:
    """The content of the file that has been read so far."""

    rate: float = 0.0
    segments: list[str] = field(default_factory=list)
    points: dict[str, Array] = field(default_factory=dict)
    joints: list[tuple[str, str]] = field(default_factory=list)
    index: list[int] = field(default_factory=list)
    orientations: list[Array] = field(default_factory=list)
    roots: list[Array] = field(default_factory=list)
    began: float | None = None


def read_mvnx(path: Path) -> tuple[Bvh, float | None]:
    """Read a capture of one subject; time counts from the first frame.

    Returns the capture and the UTC of its first frame (s since 1970; None where the file does not have it).

    Raises InputError for XML that ``elements`` refuses, missing segments, joints or frames, quaternions that are not of
    unit length, and frames out of order.
    """
    parts = _Parts()
    for element in elements(path, ("segment", "joint", "frame"), heads=("subject",)):
        match local_name(element):
            case "subject":
                _add_subject(path, parts, element)
            case "segment":
                _add_segment(path, parts, element)
            case "joint":
                ends = text_below(element, "connector1"), text_below(element, "connector2")
                parts.joints.append((ends[0] or "", ends[1] or ""))
            case "frame" if element.get("type", "normal") == "normal":
                _add_frame(path, parts, element)
    return _assemble(path, parts), parts.began


def _add_subject(path: Path, parts: _Parts, element: Element) -> None:
    if parts.rate:
        raise InputError(path, "subject", "a second subject", "export one skier alone")
    (parts.rate,) = _floats(path, "subject frameRate", element.get("frameRate"), 1)
    if not _RATES[0] <= parts.rate <= _RATES[1]:
        raise InputError(path, "subject frameRate", f"{parts.rate:g} Hz is no capture's", "export the capture again")


def _add_segment(path: Path, parts: _Parts, element: Element) -> None:
    label = element.get("label", "")
    parts.segments.append(label)
    if len(parts.segments) > MAX_JOINTS:
        raise InputError(path, f"segment {label}", "more segments than any skier has", "export one skier alone")
    for point in element.iter():
        if local_name(point) != "point":
            continue
        place = text_below(point, "pos_b") or text_below(point, "pos_s")  # version 4; version 3 and before
        if place:
            name = f"{label}/{point.get('label')}"
            parts.points[name] = _floats(path, f"point {name}", place, 3)


def _add_frame(path: Path, parts: _Parts, element: Element) -> None:
    number = len(parts.index)
    place = f"frame {element.get('index', number)}"
    try:
        index, moment = int(element.get("index", number)), int(element.get("ms", 0))
        if max(abs(index), abs(moment)) > _LATEST:
            raise ValueError
    except ValueError:
        raise InputError(path, place, "index or ms is no whole number", "export the capture again") from None
    parts.index.append(index)
    check_samples(path, place, len(parts.index), 7 * len(parts.segments))
    if number == 0 and moment > 0:
        parts.began = moment / 1000.0
    wide = 4 * len(parts.segments)
    parts.orientations.append(_floats(path, f"{place}, orientation", text_below(element, "orientation"), wide))
    parts.roots.append(_floats(path, f"{place}, position", text_below(element, "position"), wide // 4 * 3)[:3])


def _assemble(path: Path, parts: _Parts) -> Bvh:
    missing = [name for name in JOINT_OF_SEGMENT if name not in parts.segments]
    if missing:
        raise InputError(
            path,
            "segments",
            f"missing: {', '.join(missing)}",
            "export a full-body capture as MVNX 3 or 4, all segments",
        )
    if len(parts.index) < 3 or not parts.rate:
        raise InputError(path, "frames", f"{len(parts.index)} frames are no motion", "export the whole run")
    steps = np.diff(parts.index)
    if np.any(steps <= 0):
        raise InputError(
            path, f"frame {parts.index[int(np.argmax(steps <= 0)) + 1]}", "frames are out of order", "export them again"
        )
    names, parents, offsets, ends = _tree(path, parts)
    quaternions = np.array(parts.orientations).reshape(len(parts.index), -1, 4)
    norms = np.linalg.norm(quaternions, axis=-1)
    if np.max(np.abs(norms - 1.0)) > 0.01:  # six digits are written; a hundredth is no rounding
        frame = int(np.argmax(np.max(np.abs(norms - 1.0), axis=1)))
        raise InputError(path, f"frame {parts.index[frame]}, orientation", "not unit quaternions", "export it again")
    flat = Rotation.from_quat(quaternions.reshape(-1, 4), scalar_first=True).as_matrix()
    body = flat.reshape(*quaternions.shape[:2], 3, 3)[:, [parts.segments.index(name) for name in names]]
    world = BODY_FROM_BVH.T @ body @ BODY_FROM_BVH
    local = np.stack(
        [world[:, j] if p < 0 else np.swapaxes(world[:, p], -1, -2) @ world[:, j] for j, p in enumerate(parents)],
        axis=1,
    )
    time = (np.array(parts.index) - parts.index[0]) / parts.rate
    root = np.array(parts.roots) @ BODY_FROM_BVH
    time, local, root, notes = even_frames(path, time, local, root)
    return Bvh(tuple(JOINT_OF_SEGMENT[name] for name in names), parents, offsets, ends, time, local, root, notes)


def _tree(path: Path, parts: _Parts) -> tuple[list[str], tuple[int, ...], Array, dict[str, Array]]:
    """Return segments, parents before children, with the index of each parent, offsets (J, 3) m and end sites.

    Vectors are in BVH axes.
    """
    names, parents, offsets = ["Pelvis"], [-1], [np.zeros(3)]
    pending = [ends for ends in parts.joints if ends[1].partition("/")[0] in JOINT_OF_SEGMENT]
    while pending:
        ready = [ends for ends in pending if ends[0].partition("/")[0] in names]
        if not ready:
            break
        for inner, outer in ready:
            parent, child = inner.partition("/")[0], outer.partition("/")[0]
            if child in names or inner not in parts.points or outer not in parts.points:
                raise InputError(path, f"joint {inner} – {outer}", "it does not belong to a tree", "export it again")
            names.append(child)
            parents.append(names.index(parent))
            offsets.append(parts.points[inner] - parts.points[outer])
        pending = [ends for ends in pending if ends not in ready]
    if len(names) != len(JOINT_OF_SEGMENT):
        lost = [name for name in JOINT_OF_SEGMENT if name not in names]
        raise InputError(path, "joints", f"nothing connects {', '.join(lost)}", "export the capture with its joints")
    ends = {
        JOINT_OF_SEGMENT[name]: parts.points[f"{name}/{point}"] @ BODY_FROM_BVH
        for name, point in _ENDS.items()
        if f"{name}/{point}" in parts.points
    }
    return names, tuple(parents), np.array(offsets) @ BODY_FROM_BVH, ends


def _floats(path: Path, place: str, text: str | None, count: int) -> Array:
    """Return ``count`` finite numbers; raises InputError otherwise."""
    try:
        values = np.array((text or "").split(None, count)[: count + 1], dtype=float)
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not np.all(np.isfinite(values)):
        raise InputError(path, place, f"not {count} numbers", "export the capture again")
    return values
