"""Optical capture: the markers of the conventional gait model (Plug-in Gait's full body) in a C3D file.

Pelvis, hips, knees, ankles and trunk follow the model (Davis et al. 1991; Vicon, Plug-in Gait model details).  The
hips' centres follow Harrington et al. (2007), doi:10.1016/j.jbiomech.2006.02.003.  Feet point from heel to toe marker
and turn about the ankle's axis; upper arms turn about the axis that their bent elbow shows.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.c3d_points import Points
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, capture_of
from sssi_exudyn.importing.motion_capture.segment_axes import (
    Places,
    axes_x_y,
    axes_y_x,
    axes_z_x,
    axes_z_y,
    check_axes,
    lengths_of,
    unit,
    upright,
    whole_frames,
)
from sssi_exudyn.recording.instruments.bvh import Bvh

_TRUNK: Final = ("CLAV", "STRN", "C7", "T10", "LASI", "RASI", "LFHD", "RFHD", "LBHD", "RBHD")
_SIDED: Final = ("THI", "KNE", "TIB", "ANK", "HEE", "TOE", "SHO", "ELB", "WRA", "WRB", "FIN")
_MARKER: Final = 0.014
"""Usual diameter of a marker, m, where the file does not hold it."""
_SHOULDER: Final = 0.05
"""Distance from the acromion's marker down to the shoulder's centre, m: a usual "shoulder offset" of Plug-in Gait."""
_STRAIGHT: Final = 0.1
"""Sine of the elbow's flexion above which its axis comes from both bones rather than from the wrist."""
_WIDTHS: Final = (0.02, 0.2)
_CMU: Final = {
    f"{side}{theirs}": f"{side}{ours}"
    for side in "LR"
    for theirs, ours in (("FWT", "ASI"), ("BWT", "PSI"), ("SHN", "TIB"))
}
"""Labels of the same places in CMU's library (mocap.cs.cmu.edu; the 41 labels are explained in
www.cc.gatech.edu/classes/AY2003/cs4451a_fall/datadef.txt)."""
_USUAL_WIDTHS: Final = {"Knee": 0.105, "Ankle": 0.07}
"""Widths of joints, m, for CMU's library, whose files hold none: usual ones of adults.  A centimetre moves the joint by
half of that, and a thigh's or shank's axis by 0.7°.
"""


def is_plug_in_gait(points: Points) -> bool:
    """Return whether most of the model's markers have labels in a capture: it is of this model, or of none."""
    needed = (*_TRUNK, *(side + name for side in "LR" for name in _SIDED))
    return sum(name in _by_the_model(points).names for name in needed) > len(needed) // 2


def _by_the_model(points: Points) -> Points:
    """Return points whose labels are CMU's under those of the model."""
    return replace(points, names=tuple(_CMU.get(name, name) for name in points.names)) if _is_cmu(points) else points


def _is_cmu(points: Points) -> bool:
    return _CMU.keys() <= set(points.names) and not set(_CMU.values()) & set(points.names)


def capture_of_markers(path: Path, points: Points, height: float) -> Bvh:
    """Make a capture of markers; ``height`` (m) is the skier's, for the top of the head and the hands.

    Frames without all markers are gaps.  Raises InputError for missing markers, missing widths of knees and ankles, and
    a skier who does not stand up.
    """
    if _is_cmu(points):
        knee, ankle = (_USUAL_WIDTHS[part] for part in ("Knee", "Ankle"))
        usual = {f"{letter}{part}Width": width for letter in "LR" for part, width in _USUAL_WIDTHS.items()}
        points = replace(_by_the_model(points), sizes=usual | points.sizes)
        said = f"CMU's markers; widths of knees and ankles that the file does not hold are {knee:g} and {ankle:g} m"
        about: tuple[str, ...] = (f"{path.name}: {said}",)
    else:
        about = ()
    at, time, notes = _markers(path, points)
    at = upright(path, at, at["C7"], 0.5 * (at["LANK"] + at["RANK"]))
    reach = {part: _reach(path, points, part) for part in ("Knee", "Ankle")}
    rotation, joint = _trunk(at)
    tips: Places = {}
    for side, word in SIDES:
        _leg(at, side.upper(), word, reach, rotation, joint, tips)
        _arm(at, side.upper(), word, rotation, joint, tips)
    check_axes(path, time, rotation)
    place, ends = lengths_of(rotation, joint, tips, height)
    return capture_of(path, time, rotation, place, ends, (*about, *notes))


def _markers(path: Path, points: Points) -> tuple[Places, Array, tuple[str, ...]]:
    """Return places (n, 3) m of the needed markers, in the frames that have all of them, with times and notes."""
    back = ("SACR",) if "SACR" in points.names else ("LPSI", "RPSI")
    needed = [*_TRUNK, *back, *(side + name for side in "LR" for name in _SIDED)]
    missing = [name for name in needed if name not in points.names]
    if missing:
        raise InputError(
            path,
            "POINT:LABELS",
            f"missing markers: {', '.join(missing)}",
            "label them as Plug-in Gait does for the full body",
        )
    whole, notes = whole_frames(path, points, needed)
    at = {name: points.places[whole, points.names.index(name)] for name in needed}
    at["back"] = np.mean([at.pop(name) for name in back], axis=0)
    time = points.time[whole]
    return at, time - time[0], notes


def _reach(path: Path, points: Points, part: str) -> dict[str, float]:
    """Return the distance (m) from the marker's centre to the joint's, by side.

    It is half the joint's width and the marker's radius.
    """
    reach = {}
    for letter in "LR":
        name = f"{letter}{part}Width"
        width = points.sizes.get(name)
        if width is None or not _WIDTHS[0] < width < _WIDTHS[1]:
            problem = "is missing" if width is None else f"{width:.3g} m is no width of a joint"
            raise InputError(path, f"PROCESSING:{name}", problem, "measure it, and export it with the subject")
        reach[letter] = 0.5 * (width + points.sizes.get("MarkerDiameter", _MARKER))
    return reach


def _trunk(at: Places) -> tuple[Places, Places]:
    """Return rotations of pelvis, trunk and head, and the places of hips, lumbar joint and base of the neck."""
    front = 0.5 * (at["LASI"] + at["RASI"])
    pelvis = axes_y_x(at["LASI"] - at["RASI"], front - at["back"])
    width = float(np.median(np.linalg.norm(at["LASI"] - at["RASI"], axis=1)))
    depth = float(np.median(np.linalg.norm(front - at["back"], axis=1)))
    joint: Places = {}
    for left, word in ((1.0, "Left"), (-1.0, "Right")):
        hip = np.array([-0.24 * depth - 0.0099, left * (0.33 * width + 0.0073), -0.30 * width - 0.0109])
        joint[f"{word}UpLeg"] = front + pelvis @ hip
    middle = 0.5 * (joint["LeftUpLeg"] + joint["RightUpLeg"])
    apart = float(np.median(np.linalg.norm(joint["LeftUpLeg"] - joint["RightUpLeg"], axis=1)))
    joint["Hips"], joint["Spine"] = middle, middle + pelvis @ np.array([0.0, 0.0, 0.828 * apart])  # the model's L5
    upper, lower = 0.5 * (at["CLAV"] + at["C7"]), 0.5 * (at["STRN"] + at["T10"])
    forward = 0.5 * (at["CLAV"] + at["STRN"] - at["C7"] - at["T10"])
    joint["Neck"] = upper
    across = at["LFHD"] + at["LBHD"] - at["RFHD"] - at["RBHD"]
    ahead = at["LFHD"] + at["RFHD"] - at["LBHD"] - at["RBHD"]
    return {"Hips": pelvis, "Spine": axes_z_x(upper - lower, forward), "Head": axes_y_x(across, ahead)}, joint


def _leg(
    at: Places,
    letter: str,
    word: str,
    reach: dict[str, dict[str, float]],
    rotation: Places,
    joint: Places,
    tips: Places,
) -> None:
    hip, left = joint[f"{word}UpLeg"], 1.0 if letter == "L" else -1.0
    knee = _chord(hip, at[f"{letter}KNE"], at[f"{letter}THI"], reach["Knee"][letter])
    ankle = _chord(knee, at[f"{letter}ANK"], at[f"{letter}TIB"], reach["Ankle"][letter])
    shank = axes_z_y(knee - ankle, left * (at[f"{letter}ANK"] - ankle))
    rotation[f"{word}UpLeg"] = axes_z_y(hip - knee, left * (at[f"{letter}KNE"] - knee))
    rotation[f"{word}Leg"] = shank
    rotation[f"{word}Foot"] = axes_x_y(at[f"{letter}TOE"] - at[f"{letter}HEE"], shank[..., 1])
    joint[f"{word}Leg"], joint[f"{word}Foot"], tips[f"{word}Foot"] = knee, ankle, at[f"{letter}TOE"]


def _arm(at: Places, letter: str, word: str, rotation: Places, joint: Places, tips: Places) -> None:
    shoulder = at[f"{letter}SHO"] - _SHOULDER * rotation["Spine"][..., 2]
    elbow, wrist = at[f"{letter}ELB"], 0.5 * (at[f"{letter}WRA"] + at[f"{letter}WRB"])
    thumb = at[f"{letter}WRA"] - at[f"{letter}WRB"]  # forward when the arm hangs with the palm to the thigh
    forearm = axes_z_x(elbow - wrist, thumb)
    bent = np.cross(unit(wrist - elbow), unit(elbow - shoulder))  # to the left, on both sides
    rotation[f"{word}Arm"] = axes_z_y(shoulder - elbow, bent + _STRAIGHT * forearm[..., 1])
    rotation[f"{word}ForeArm"] = forearm
    rotation[f"{word}Hand"] = axes_z_x(wrist - at[f"{letter}FIN"], thumb)
    joint[f"{word}Arm"], joint[f"{word}ForeArm"], joint[f"{word}Hand"] = shoulder, elbow, wrist
    tips[f"{word}Hand"] = at[f"{letter}FIN"]


def _chord(inner: Array, marker: Array, wand: Array, reach: float) -> Array:
    """Return the joint's centre (n, 3) m, ``reach`` from its marker, at a right angle to the bone from ``inner``.

    It lies in the plane of inner centre, marker and wand, away from the wand; all are (n, 3) m.
    """
    bone = marker - inner
    length = np.maximum(np.linalg.norm(bone, axis=1, keepdims=True), 1e-9)
    along = bone / length
    arm = wand - inner
    outwards = unit(arm - np.sum(arm * along, axis=1, keepdims=True) * along)
    share = np.minimum(reach / length, 0.9)
    return np.asarray(marker - reach * (share * along + np.sqrt(1.0 - share**2) * outwards))
