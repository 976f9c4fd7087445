"""Motion as joint angles of a full-body OpenSim model (``.mot``), made into a capture of a skier of average build.

Coordinates are named and turned as in Rajagopal's, Hamner's and the full-body lumbar spine models: OpenSim's ground is
x forward, y up, z right; the pelvis turns about z (tilt), x (list) and y (rotation) in this order.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import (
    COORDINATE,
    COORDINATES,
    SEGMENT,
    Geometry,
    average_geometry,
    forward_kinematics,
)
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.motion_capture.capture_tree import SIDES, capture_of, trunk_places
from sssi_exudyn.importing.sensors.opensense import is_orientations
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.storage import GROUND_FROM_LEVEL, read_storage
from sssi_exudyn.io.table import check_time
from sssi_exudyn.recording.instruments.bvh import Bvh

_PELVIS: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
_KNEES: Final = ("knee_angle_r", "knee_angle_l")
_HIPS: Final = ("hip_flexion_r", "hip_flexion_l")
_LEAST_BENT: Final = float(np.pi)
"""Angle (of whatever unit) between the largest of a skier's legs in radians, and in degrees: no knee bends by π rad,
and one of the hips and knees always bends by more than 3°.
"""
_NEEDED: Final = (
    *_PELVIS,
    *(f"hip_{movement}_{side}" for side, _ in SIDES for movement in ("flexion", "adduction", "rotation")),
    *_KNEES,
    *(f"ankle_angle_{side}" for side, _ in SIDES),
    *(f"lumbar_{movement}" for movement in ("extension", "bending", "rotation")),
)
_LARGEST: Final = 20.0
"""Largest angle, rad; a skier's angles stay below three turns."""

_SEGMENT: Final = {
    "Hips": "pelvis",
    "Spine": "torso",
    "Head": "head",
    **{
        f"{word}{joint}": f"{segment}_{side}"
        for side, word in SIDES
        for joint, segment in (
            ("UpLeg", "femur"), ("Leg", "tibia"), ("Foot", "calcn"),
            ("Arm", "humerus"), ("ForeArm", "radius"), ("Hand", "hand"),
        )
    },
}  # fmt: skip
"""Segment of the chain that moves with each joint."""


def read_joint_angles(path: Path, height: float | None) -> Bvh:
    """Read a table of coordinates; lengths are those of an average adult of ``height`` (m).

    Raises InputError for a missing height, whatever ``read_storage`` refuses, missing coordinates of legs, pelvis and
    trunk, angles beyond three turns, and time that stands still or runs back.
    """
    if height is None:
        raise InputError(path, "", "no file holds --height-m, and angles have no lengths", "give this option")
    text = read_text(path)
    if is_orientations(text):
        problem = "it holds the orientations of sensors, not the angles of joints"
        fix = "give it without other sensors, or run OpenSense's inverse kinematics and give its .mot"
        raise InputError(path, "DataType", problem, fix)
    table = read_storage(path, text)
    at = {name.rsplit("/", 2)[-2] if name.endswith("/value") else name: i for i, name in enumerate(table.columns)}
    missing = [name for name in _NEEDED if name not in at]
    if missing:
        raise InputError(
            path,
            "columns",
            f"missing coordinates: {', '.join(missing)}",
            "export the coordinates of a full-body model with these names",
        )
    values = table.values
    if len(values) < 3 or not np.all(np.isfinite(values)):
        raise InputError(path, "table", "less than three rows, or not all numbers", "export the whole motion")
    written = {name: values[:, at[name]] for name in COORDINATES if name in at}
    in_degrees = _in_degrees(path, written)
    scale = np.pi / 180.0 if in_degrees else 1.0
    angles = {name: scale * column for name, column in written.items()}
    done: tuple[str, ...] = ()
    if in_degrees != table.in_degrees:
        said, used = ("degrees", "radians") if table.in_degrees else ("radians", "degrees")
        done = (f"{path.name}: by its header angles are in {said}, but a skier's legs turn like that in {used} only",)
    worst = max(angles, key=lambda name: float(np.max(np.abs(angles[name]))))
    if np.max(np.abs(angles[worst])) > _LARGEST:
        raise InputError(path, f"column {worst}", "the angles are beyond three turns", "export the angles in degrees")
    time = values[:, 0]
    check_time(path, time, tuple(f"row {row}" for row in range(1, len(time) + 1)))
    q, notes = _chain_coordinates(path, angles, len(time))
    geometry = average_geometry(height)
    poses = forward_kinematics(geometry, q, 0.0)
    rotation = {name: poses.rotation[:, SEGMENT[segment]] for name, segment in _SEGMENT.items()}
    return capture_of(path, time - time[0], rotation, *_lengths(geometry), (*done, *notes))


def _in_degrees(path: Path, written: dict[str, Array]) -> bool:
    """Return whether angles are in degrees, by those of hips and knees.

    In degrees a skier's legs bend by more than ``_LEAST_BENT``, in radians by less.  Raises InputError for legs that
    hardly bend in either unit.
    """
    bent = max(float(np.percentile(np.abs(written[name]), 99.0)) for name in (*_KNEES, *_HIPS))
    if bent < np.radians(_LEAST_BENT):
        problem = f"hips and knees bend by {bent:.2g} at most: in degrees or radians, that is no skier"
        raise InputError(path, "column knee_angle_r", problem, "export the coordinates of the run")
    return bent > _LEAST_BENT


def _chain_coordinates(path: Path, angles: dict[str, Array], count: int) -> tuple[Array, tuple[str, ...]]:
    """Return the chain's coordinates (n, 31), and the assumptions in words."""
    q = np.zeros((count, len(COORDINATES)))
    for name, values in angles.items():
        q[:, COORDINATE[name]] = values
    notes = []
    absent = [name for name in COORDINATES[3:] if name not in angles]
    if absent:
        notes.append(f"{path.name}: {', '.join(absent)} not there: taken as zero")
    if np.mean([angles[name] for name in _KNEES]) < 0.0:  # skiers bend their knees: this model extends positive
        for name in _KNEES:
            q[:, COORDINATE[name]] *= -1.0
    ground = Rotation.from_euler("ZXY", np.column_stack([angles[name] for name in _PELVIS])).as_matrix()
    level = GROUND_FROM_LEVEL.T @ ground @ GROUND_FROM_LEVEL
    rotation, list_, tilt = Rotation.from_matrix(level).as_euler("ZXY").T
    for name, values in (("pelvis_rotation", rotation), ("pelvis_list", list_), ("pelvis_tilt", -tilt)):
        q[:, COORDINATE[name]] = values
    return q, tuple(notes)


def _lengths(geometry: Geometry) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return the places of the joints in the segments that carry them, and far ends of the segments (m)."""
    of = {name: np.asarray(geometry.joint_in_parent[i]) for name, i in SEGMENT.items()}
    end = {name: np.asarray(geometry.segment_end[i]) for name, i in SEGMENT.items()}
    place, ends = {"Spine": of["torso"], **trunk_places(of["head"])}, {"Head": end["head"]}
    for side, word in SIDES:
        place |= {
            f"{word}UpLeg": of[f"femur_{side}"],
            f"{word}Leg": of[f"tibia_{side}"],
            f"{word}Foot": of[f"talus_{side}"],
            f"{word}Arm": of[f"humerus_{side}"] - of["head"],
            f"{word}ForeArm": of[f"ulna_{side}"],
            f"{word}Hand": of[f"hand_{side}"],
        }
        ends |= {f"{word}Foot": of[f"toes_{side}"], f"{word}Hand": end[f"hand_{side}"]}
    return place, ends
