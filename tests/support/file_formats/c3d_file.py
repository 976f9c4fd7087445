"""Plug-in Gait's markers on a skier of known posture, and Theia's segments of one, in C3D files."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import SEGMENT, Poses
from sssi_exudyn.core.frames import Array

KNEE, ANKLE, DIAMETER = 0.11, 0.08, 0.014
"""Widths of knee and ankle, and diameter of a marker, m."""


def marker_places(poses: Poses, height: float) -> dict[str, Array]:
    """Return the place (n, 3) m of every marker, where the model's formulas put the chain's joints."""

    def at(segment: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
        i = SEGMENT[segment]
        return np.asarray(poses.origin[:, i] + poses.rotation[:, i] @ np.array([x, y, z]))

    width, depth = (0.0535 * height - 0.0073) / 0.33, 0.15  # of the pelvis: Harrington's hips are the chain's
    front, high = 0.24 * depth + 0.0099, 0.30 * width + 0.0109
    places = {
        "C7": at("torso", -0.09, 0.0, 0.42),
        "CLAV": at("torso", 0.07, 0.0, 0.40),
        "STRN": at("torso", 0.09, 0.0, 0.22),
        "T10": at("torso", -0.11, 0.0, 0.24),
    }
    for side, letter, left in (("l", "L", 1.0), ("r", "R", -1.0)):
        thigh, shank = (-float(np.linalg.norm(poses.origin[0, SEGMENT[a]] - poses.origin[0, SEGMENT[b]])) for a, b in (
            (f"femur_{side}", f"tibia_{side}"), (f"tibia_{side}", f"talus_{side}")))  # fmt: skip
        knee, ankle = left * (KNEE + DIAMETER) / 2.0, left * (ANKLE + DIAMETER) / 2.0
        places |= {
            f"{letter}ASI": at("pelvis", front, left * width / 2.0, high),
            f"{letter}PSI": at("pelvis", front - depth, left * 0.05, high),
            f"{letter}THI": at(f"femur_{side}", 0.0, left * 0.12, 0.6 * thigh),
            f"{letter}KNE": at(f"femur_{side}", 0.0, knee, thigh),
            f"{letter}TIB": at(f"tibia_{side}", 0.0, left * 0.10, 0.6 * shank),
            f"{letter}ANK": at(f"tibia_{side}", 0.0, ankle, shank),
            f"{letter}HEE": at(f"calcn_{side}", -0.05, 0.0, -0.06),
            f"{letter}TOE": at(f"calcn_{side}", 0.13, 0.0, -0.06),
            f"{letter}FHD": at("head", 0.10, left * 0.07, 0.15),
            f"{letter}BHD": at("head", -0.10, left * 0.07, 0.15),
            f"{letter}ELB": at(f"ulna_{side}"),
            f"{letter}WRA": at(f"hand_{side}") + 0.03 * poses.rotation[:, SEGMENT[f"radius_{side}"], :, 0],
            f"{letter}WRB": at(f"hand_{side}") - 0.03 * poses.rotation[:, SEGMENT[f"radius_{side}"], :, 0],
            f"{letter}FIN": at(f"hand_{side}", 0.0, 0.0, -0.09),
        }
        places[f"{letter}SHO"] = at(f"humerus_{side}") + 0.05 * poses.rotation[:, SEGMENT["torso"], :, 2]
    return places


def write_c3d(path: Path, places: dict[str, Array], rate: float, *, sizes: bool = True, prefix: str = "") -> None:
    """Write the file, in millimetres."""
    file = ezc3d.c3d()
    points = np.stack(list(places.values()))  # markers, frames, xyz
    data = np.ones((4, *points.shape[:2]))
    data[:3] = 1000.0 * np.moveaxis(points, -1, 0)
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = tuple(prefix + name for name in places)
    file["data"]["points"] = data
    if sizes:
        for name, size in (("KneeWidth", KNEE), ("AnkleWidth", ANKLE)):
            for letter in "LR":
                file.add_parameter("PROCESSING", letter + name, [1000.0 * size])
        file.add_parameter("PROCESSING", "MarkerDiameter", [1000.0 * DIAMETER])
    file.write(str(path))


def write_theia(path: Path, poses: Poses, rate: float, *, y_up: bool = False, lost: int = 0, without: str = "") -> Path:
    """Write the segments' poses as Theia3D does: no points, axes x right, y forward, z up, origins in mm.

    Labels are those of ``C3DRotationExample.c3d`` of github.com/pyomeca/ezc3d-testFiles.
    """
    count = len(poses.origin)
    axes = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # right, forward, up in body axes
    segments = {"pelvis": ("pelvis", axes), "torso": ("torso", axes), "head": ("head", axes), "neck": ("torso", axes)}
    origins = {"neck": "head", "torso": "head"}
    for side, left in (("l", 1.0), ("r", -1.0)):
        for name, segment in (("thigh", "femur"), ("shank", "tibia"), ("foot", "calcn"), ("uarm", "humerus")):
            segments[f"{side}_{name}"] = (f"{segment}_{side}", axes)
        palms = Rotation.from_euler("z", -90.0 * left, degrees=True).as_matrix() @ axes  # thumbs outwards
        segments |= {f"{side}_larm": (f"radius_{side}", palms), f"{side}_hand": (f"hand_{side}", palms)}
        segments[f"{side}_toes"] = (f"calcn_{side}", axes)
        origins |= {f"{side}_larm": f"ulna_{side}", f"{side}_foot": f"talus_{side}", f"{side}_toes": f"toes_{side}"}
    file = ezc3d.c3d()
    labels = [name for name in ("worldbody", *segments) if name != without]
    rotations = np.tile(np.eye(4)[:, :, None, None], (1, 1, len(labels), count))
    swapped = np.eye(3)[[1, 2, 0]] if y_up else np.eye(3)
    for index, name in enumerate(labels):
        if name == "worldbody":
            continue
        segment, turned = segments[name]
        rotations[:3, :3, index] = np.moveaxis(swapped @ poses.rotation[:, SEGMENT[segment]] @ turned, 0, -1)
        origin = poses.origin[:, SEGMENT[origins.get(name, segment)]]
        rotations[:3, 3, index] = 1000.0 * swapped @ origin.T
    rotations[:, :, 1, :lost] = 0.0
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.ones((4, 0, count))
    file["data"]["rotations"] = rotations
    file.add_parameter("ROTATION", "LABELS", [f"{name}_4X4" for name in labels])
    file.add_parameter("ROTATION", "RATE", [rate])
    file.write(str(path))
    return path
