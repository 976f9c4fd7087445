"""Motion as joint angles of a full-body OpenSim model (``.mot``), made into a capture of a skier of average build.

Coordinates are named and turned as in Rajagopal's, Hamner's and the full-body lumbar spine models: OpenSim's ground is
x forward, y up, z right; the pelvis turns about z (tilt), x (list) and y (rotation) in this order.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.anatomy import hanging_from_t_pose
from sssi_exudyn.bvh import Bvh
from sssi_exudyn.chain import COORDINATE, COORDINATES, SEGMENT, Geometry, average_geometry, forward_kinematics
from sssi_exudyn.errors import InputError
from sssi_exudyn.files import read_text
from sssi_exudyn.frames import BODY_FROM_BVH, Array
from sssi_exudyn.opensim_files import GROUND_FROM_LEVEL, read_storage
from sssi_exudyn.resample import even_frames
from sssi_exudyn.table import check_time

_SIDES: Final = (("r", "Right"), ("l", "Left"))
_PELVIS: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
_KNEES: Final = ("knee_angle_r", "knee_angle_l")
_NEEDED: Final = (
    *_PELVIS,
    *(f"hip_{way}_{side}" for side, _ in _SIDES for way in ("flexion", "adduction", "rotation")),
    *_KNEES,
    *(f"ankle_angle_{side}" for side, _ in _SIDES),
    *(f"lumbar_{way}" for way in ("extension", "bending", "rotation")),
)
_LARGEST: Final = 20.0
"""rad; angles beyond three turns are no angles of a skier."""

_TREE: Final[tuple[tuple[str, str, str], ...]] = (
    ("Hips", "", "pelvis"),
    *(
        row
        for side, word in _SIDES
        for row in (
            (f"{word}UpLeg", "Hips", f"femur_{side}"),
            (f"{word}Leg", f"{word}UpLeg", f"tibia_{side}"),
            (f"{word}Foot", f"{word}Leg", f"calcn_{side}"),
        )
    ),
    ("Spine", "Hips", "torso"),
    ("Spine1", "Spine", "torso"),
    ("Spine2", "Spine1", "torso"),
    ("Neck", "Spine2", "torso"),
    ("Head", "Neck", "head"),
    *(
        row
        for side, word in _SIDES
        for row in (
            (f"{word}Shoulder", "Spine2", "torso"),
            (f"{word}Arm", f"{word}Shoulder", f"humerus_{side}"),
            (f"{word}ForeArm", f"{word}Arm", f"radius_{side}"),
            (f"{word}Hand", f"{word}ForeArm", f"hand_{side}"),
        )
    ),
)
"""Joint, the joint that carries it, and the chain's segment that moves with it."""


def read_joint_angles(path: Path, height: float | None) -> Bvh:
    """Read a table of coordinates; lengths are those of an average adult of ``height`` (m).

    Raises InputError for a missing height, whatever ``read_storage`` refuses, missing coordinates of legs, pelvis and
    trunk, angles beyond reason, and time that stands still or runs back.
    """
    if height is None:
        raise InputError(path, "", "no file says --height-m, and angles have no lengths", "give this option")
    table = read_storage(path, read_text(path))
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
    scale = np.pi / 180.0 if table.in_degrees else 1.0
    angles = {name: scale * values[:, at[name]] for name in COORDINATES if name in at}
    worst = max(angles, key=lambda name: float(np.max(np.abs(angles[name]))))
    if np.max(np.abs(angles[worst])) > _LARGEST:
        raise InputError(
            path, f"column {worst}", "the angles are beyond three turns", "correct inDegrees in the header"
        )
    time = values[:, 0]
    check_time(path, time, tuple(f"row {row}" for row in range(1, len(time) + 1)))
    q, notes = _chain_coordinates(path, angles, len(time))
    geometry = average_geometry(height)
    rotation = forward_kinematics(geometry, q, 0.0).rotation
    root = np.zeros((len(time), 3))
    time, local, root, said = even_frames(path, time - time[0], _local(rotation), root)
    names = tuple(name for name, _, _ in _TREE)
    parents = tuple(names.index(parent) if parent else -1 for _, parent, _ in _TREE)
    offsets, ends = _lengths(geometry)
    return Bvh(names, parents, offsets, ends, time, local, root, (*notes, *said))


def _chain_coordinates(path: Path, angles: dict[str, Array], count: int) -> tuple[Array, tuple[str, ...]]:
    """(n, 31) coordinates of the chain, and what was assumed."""
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


def _local(rotation: Array) -> Array:
    """(n, J, 3, 3) local rotations of the tree's joints in BVH axes, from the segments' (n, 21, 3, 3)."""
    world = {
        name: BODY_FROM_BVH.T @ rotation[:, SEGMENT[segment]] @ hanging_from_t_pose(name).T @ BODY_FROM_BVH
        for name, _, segment in _TREE
    }
    return np.stack(
        [np.swapaxes(world[parent], -1, -2) @ world[name] if parent else world[name] for name, parent, _ in _TREE],
        axis=1,
    )


def _lengths(geometry: Geometry) -> tuple[Array, dict[str, Array]]:
    """(J, 3) m offsets of the tree's joints and the end sites, in BVH axes, arms spread."""

    def of(segment: str) -> Array:
        return np.asarray(geometry.joint_in_parent[SEGMENT[segment]])

    neck = of("head")
    place = {"Spine": of("torso"), "Spine1": neck / 3.0, "Spine2": neck / 3.0, "Neck": neck / 3.0}
    ends = {"Head": geometry.segment_end[SEGMENT["head"]]}
    for side, word in _SIDES:
        collar = np.array([0.0, 0.0, neck[2] / 3.0])
        place |= {
            f"{word}UpLeg": of(f"femur_{side}"),
            f"{word}Leg": of(f"tibia_{side}"),
            f"{word}Foot": of(f"talus_{side}"),
            f"{word}Shoulder": collar,
            f"{word}Arm": of(f"humerus_{side}") - 2.0 * neck / 3.0 - collar,
            f"{word}ForeArm": of(f"ulna_{side}"),
            f"{word}Hand": of(f"hand_{side}"),
        }
        ends |= {
            f"{word}Foot": of(f"toes_{side}"),
            f"{word}Hand": geometry.segment_end[SEGMENT[f"hand_{side}"]],
        }
    spread = {f"{word}{part}": f"{word}Arm" for _, word in _SIDES for part in ("ForeArm", "Hand")}
    offsets = [
        BODY_FROM_BVH.T @ hanging_from_t_pose(spread.get(name, "Hips")) @ place.get(name, np.zeros(3))
        for name, _, _ in _TREE
    ]
    turned = {name: BODY_FROM_BVH.T @ hanging_from_t_pose(name) @ end for name, end in ends.items()}
    return np.array(offsets), turned
