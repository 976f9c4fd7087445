"""The skier's kinematic chain: 21 segments, 31 coordinates, pure geometry without mass.

The chain is the full-body lumbar spine model's (paper 2.2.1): the pelvis floats, hips, shoulders and the lumbar joint
turn about three axes, elbow and forearm about one each, knees, ankles and wrists about one; subtalar and toe joints
are fixed by the boots, the head is fixed to the torso and the wrist does not deviate.  `JOINTS` declares all of it
once; the forward kinematics below and the multibody tree are both built from that table.

Positive coordinates follow the paper's Fig. 5: hip flexion, adduction and internal rotation, ankle dorsiflexion, pelvis
backward tilt, right list and left rotation, lumbar extension, right bending and left rotation; arms: flexion,
adduction, internal rotation, elbow flexion, pronation, wrist flexion (towards the palm).  The knee is stored as flexion
positive.

Segment frames are the body frames of `frames`: x forward, y left, z up in anatomical zero (standing, arms hanging,
palms to the thighs), where all segments are parallel.  A segment's origin is its joint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.frames import Array, cross, slope_to_level

Axis = tuple[float, float, float]
_LONGEST: Final = 10.0
"""m; longest segment in a file, and largest number of a rotation."""
_FORWARD: Final[Axis] = (1.0, 0.0, 0.0)
_BACKWARD: Final[Axis] = (-1.0, 0.0, 0.0)
_LEFT: Final[Axis] = (0.0, 1.0, 0.0)
_RIGHT: Final[Axis] = (0.0, -1.0, 0.0)
_UP: Final[Axis] = (0.0, 0.0, 1.0)
_DOWN: Final[Axis] = (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class Joint:
    """The joint that carries ``segment`` on ``parent`` (None: the slope frame).

    ``rotations`` are intrinsic and in order: (coordinate, axis); each axis is fixed in the frame that the rotations
    before it have reached.  No rotations means a fixed joint.
    """

    segment: str
    parent: str | None
    rotations: tuple[tuple[str, Axis], ...] = ()


def _leg(side: str) -> tuple[Joint, ...]:
    medial, inwards = (_FORWARD, _UP) if side == "r" else (_BACKWARD, _DOWN)
    hip = ((f"hip_flexion_{side}", _RIGHT), (f"hip_adduction_{side}", medial), (f"hip_rotation_{side}", inwards))
    return (
        Joint(f"femur_{side}", "pelvis", hip),
        Joint(f"tibia_{side}", f"femur_{side}", ((f"knee_angle_{side}", _LEFT),)),
        Joint(f"talus_{side}", f"tibia_{side}", ((f"ankle_angle_{side}", _RIGHT),)),
        Joint(f"calcn_{side}", f"talus_{side}"),
        Joint(f"toes_{side}", f"calcn_{side}"),
    )


def _arm(side: str) -> tuple[Joint, ...]:
    medial, inwards = (_FORWARD, _UP) if side == "r" else (_BACKWARD, _DOWN)
    shoulder = ((f"arm_flex_{side}", _RIGHT), (f"arm_add_{side}", medial), (f"arm_rot_{side}", inwards))
    return (
        Joint(f"humerus_{side}", "torso", shoulder),
        Joint(f"ulna_{side}", f"humerus_{side}", ((f"elbow_flex_{side}", _RIGHT),)),
        Joint(f"radius_{side}", f"ulna_{side}", ((f"pro_sup_{side}", inwards),)),
        Joint(f"hand_{side}", f"radius_{side}", ((f"wrist_flex_{side}", medial),)),
    )


JOINTS: Final[tuple[Joint, ...]] = (
    Joint("pelvis", None, (("pelvis_rotation", _UP), ("pelvis_list", _FORWARD), ("pelvis_tilt", _RIGHT))),
    *_leg("r"),
    *_leg("l"),
    Joint("torso", "pelvis", (("lumbar_extension", _RIGHT), ("lumbar_bending", _FORWARD), ("lumbar_rotation", _UP))),
    Joint("head", "torso"),
    *_arm("r"),
    *_arm("l"),
)
"""The chain, parents before children."""

SEGMENTS: Final[tuple[str, ...]] = tuple(joint.segment for joint in JOINTS)
TRANSLATIONS: Final[tuple[str, ...]] = ("pelvis_f", "pelvis_l", "pelvis_n")
"""Place of the pelvis' origin in the slope frame (m): free."""
PRESCRIBED: Final[tuple[str, ...]] = tuple(name for joint in JOINTS for name, _ in joint.rotations)
"""Names of the 28 angles (rad), prescribed by the motion."""
COORDINATES: Final[tuple[str, ...]] = TRANSLATIONS + PRESCRIBED
"""Names of all 31 coordinates q, in order."""

SEGMENT: Final[dict[str, int]] = {name: i for i, name in enumerate(SEGMENTS)}
"""Index of a segment by name."""
COORDINATE: Final[dict[str, int]] = {name: i for i, name in enumerate(COORDINATES)}
"""Index of a coordinate in q by name."""
PARENT: Final[tuple[int, ...]] = tuple(-1 if joint.parent is None else SEGMENT[joint.parent] for joint in JOINTS)
"""Index of each segment's parent; -1 for the pelvis."""
FEET: Final[tuple[int, int]] = (SEGMENT["calcn_l"], SEGMENT["calcn_r"])
"""Segments that carry the skis: left, right."""
WHOLE: Final[tuple[int, ...]] = tuple(range(len(SEGMENTS)))
"""All segments, parents before children."""
HANDS: Final[tuple[int, int]] = (SEGMENT["hand_l"], SEGMENT["hand_r"])
"""Segments that hold the poles: left, right."""


@dataclass(frozen=True, eq=False)  # hashed by its identity: what follows from it is computed once
class Geometry:
    """Lengths of one skier's chain, metres, all in segment frames at anatomical zero.

    joint_in_parent : (21, 3) each segment's origin (its joint) in the parent's frame; zero for the pelvis
    segment_end : (21, 3) each segment's far end in its own frame: the next joint outwards, the toe tip, the finger tip,
        the vertex of the head, the base of the neck for the torso, the lumbar joint for the pelvis
    ankle_to_ski_base : from the ankle joint down to the ski's running surface along the foot's -z
    attitude_in_parent : (21, 3, 3) constant rotation of the joint's own frame in the parent's, before the joint turns;
        identity where the axes of joint and parent are parallel.  The ankle's and the subtalar joint's differ from
        that: no skier's knee and ankle turn about exactly parallel axes
    """

    joint_in_parent: Array
    segment_end: Array
    ankle_to_ski_base: float
    attitude_in_parent: Array = field(default_factory=lambda: np.tile(np.eye(3), (len(SEGMENTS), 1, 1)))

    def length(self, segment: str) -> float:
        """Return the distance from the segment's joint to its far end (m)."""
        return float(np.linalg.norm(self.segment_end[SEGMENT[segment]]))


def geometry_to_dict(geometry: Geometry) -> dict[str, Any]:
    """Return the lengths for a file: plain lists, each with its unit in its name; segments in chain order."""
    return {
        "segments": list(SEGMENTS),
        "joint_in_parent_m": geometry.joint_in_parent.tolist(),
        "segment_end_m": geometry.segment_end.tolist(),
        "attitude_in_parent": geometry.attitude_in_parent.tolist(),
        "ankle_to_ski_base_m": geometry.ankle_to_ski_base,
    }


def geometry_from_dict(table: Mapping[str, Any]) -> Geometry:
    """Read what ``geometry_to_dict`` wrote.  Raises ValueError for other segments, missing keys or wrong shapes."""
    if table.get("segments") != list(SEGMENTS):
        raise ValueError("not the segments of this skeleton")
    n = len(SEGMENTS)
    shapes = {"joint_in_parent_m": (n, 3), "segment_end_m": (n, 3), "attitude_in_parent": (n, 3, 3)}
    shapes["ankle_to_ski_base_m"] = ()
    try:
        values = {key: np.asarray(table.get(key), dtype=np.float64) for key in shapes}
    except TypeError as error:
        raise ValueError(f"not numbers ({error})") from None
    for key, shape in shapes.items():
        if values[key].shape != shape or not np.all(np.abs(values[key]) <= _LONGEST):
            raise ValueError(f"{key} is not {shape} numbers of a skier")
    return Geometry(
        joint_in_parent=values["joint_in_parent_m"],
        segment_end=values["segment_end_m"],
        ankle_to_ski_base=float(values["ankle_to_ski_base_m"]),
        attitude_in_parent=values["attitude_in_parent"],
    )


@dataclass(frozen=True)
class Poses:
    """Places and orientations of the segments, in the slope frame.

    rotation : (…, 21, 3, 3) segment frame → slope frame
    origin : (…, 21, 3) the segments' joints, m
    axes : (…, 31, 3) unit vectors along which a coordinate moves (translations) or about which it turns (angles)
    """

    rotation: Array
    origin: Array
    axes: Array


@dataclass(frozen=True)
class Rates:
    """Velocities and accelerations of the segments, in the slope frame: arrays (…, 21, 3).

    angular_velocity rad/s, velocity m/s of the origins, angular_acceleration rad/s², acceleration m/s² of the origins
    """

    angular_velocity: Array
    velocity: Array
    angular_acceleration: Array
    acceleration: Array


def rotate_about_own(rotation: Array, axis: Axis, angle: Array) -> Array:
    """Turn ``rotation`` (…, 3, 3) by ``angle`` (…) about ``axis``, one of its own three or against it: the two others
    turn in their plane.
    """
    i = _along(axis)
    first, second = rotation[..., i - 2], rotation[..., i - 1]
    sine, cosine = axis[i] * np.sin(angle)[..., None], np.cos(angle)[..., None]
    turned = np.array(rotation)
    turned[..., i - 2] = cosine * first + sine * second
    turned[..., i - 1] = cosine * second - sine * first
    return turned


def _along(axis: Axis) -> int:
    """Return the index of the frame's axis that ``axis`` points along or against."""
    return [abs(component) for component in axis].index(1.0)


def joint_rotation(joint: Joint, angles: Array) -> Array:
    """Return the joint's rotation (…, 3, 3), segment frame → joint frame, for its own angles (…, k) in joint order."""
    rotation = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for column, (_, axis) in enumerate(joint.rotations):
        rotation = rotate_about_own(rotation, axis, angles[..., column])
    return rotation


def path_to(segment: int) -> tuple[int, ...]:
    """Return the segments from the pelvis to ``segment``, both included."""
    path = [segment]
    while PARENT[path[-1]] >= 0:
        path.append(PARENT[path[-1]])
    return tuple(reversed(path))


def forward_kinematics(geometry: Geometry, q: Array, inclination: float, segments: Sequence[int] = WHOLE) -> Poses:
    """Compute the segments' poses in the slope frame for coordinates q (…, 31) on a slope of ``inclination`` (rad).

    Of all segments, or of those in ``segments``, parents before children; the others are NaN then.

    The pelvis angles count from the level frame (x along the fall line's azimuth, z against gravity); the slope frame
    is inclined against it, so a constant rotation stands first.
    """
    shape = q.shape[:-1]
    rotation = np.full((*shape, len(SEGMENTS), 3, 3), np.nan)
    origin = np.full((*shape, len(SEGMENTS), 3), np.nan)
    axes = np.full((*shape, len(COORDINATES), 3), np.nan)
    axes[..., :3, :] = np.eye(3)
    slope_from_level = slope_to_level(inclination).T
    for i in segments:
        if PARENT[i] < 0:
            current = np.broadcast_to(slope_from_level, (*shape, 3, 3))
            origin[..., i, :] = q[..., :3]
        else:
            parent = rotation[..., PARENT[i], :, :]
            origin[..., i, :] = origin[..., PARENT[i], :] + parent @ geometry.joint_in_parent[i]
            current = parent @ geometry.attitude_in_parent[i]
        for name, axis in JOINTS[i].rotations:
            along = _along(axis)
            axes[..., COORDINATE[name], :] = axis[along] * current[..., along]
            current = rotate_about_own(current, axis, q[..., COORDINATE[name]])
        rotation[..., i, :, :] = current
    return Poses(rotation, origin, axes)


def rates(poses: Poses, qd: Array, qdd: Array, segments: Sequence[int] = WHOLE) -> Rates:
    """Compute the velocities and accelerations of the segments for coordinate rates qd, qdd (…, 31), exactly and
    recursively; ``segments`` are those that ``poses`` has.

    About each axis e of a joint in turn: ω ← ω + e q̇, α ← α + e q̈ + ω × e q̇; along a segment from its joint to the
    next, by r: v ← v + ω × r, a ← a + α × r + ω × (ω × r).
    """
    omega, velocity, alpha, acceleration = (np.full_like(poses.origin, np.nan) for _ in range(4))
    for i in segments:
        p = PARENT[i]
        if p < 0:
            w = a = np.zeros((*qd.shape[:-1], 3))
            velocity[..., i, :], acceleration[..., i, :] = qd[..., :3], qdd[..., :3]
        else:
            w, a = omega[..., p, :], alpha[..., p, :]
            r = poses.origin[..., i, :] - poses.origin[..., p, :]
            swing = cross(w, r)
            velocity[..., i, :] = velocity[..., p, :] + swing
            acceleration[..., i, :] = acceleration[..., p, :] + cross(a, r) + cross(w, swing)
        for name, _ in JOINTS[i].rotations:
            c = COORDINATE[name]
            spin = poses.axes[..., c, :] * qd[..., c, None]
            a = a + poses.axes[..., c, :] * qdd[..., c, None] + cross(w, spin)
            w = w + spin
        omega[..., i, :], alpha[..., i, :] = w, a
    return Rates(omega, velocity, alpha, acceleration)


def _moving_coordinates() -> Array:
    """Return (21, 31), True where the coordinate moves the segment: it belongs to the segment's joint or to an
    ancestor's.
    """
    moved = np.zeros((len(SEGMENTS), len(COORDINATES)), dtype=bool)
    for i, joint in enumerate(JOINTS):
        moved[i] = moved[PARENT[i]] if PARENT[i] >= 0 else False
        moved[i, [COORDINATE[name] for name, _ in joint.rotations]] = True
        moved[i, :3] = True
    return moved


_MOVED_BY: Final = _moving_coordinates()
_CARRIER: Final = np.array([0, 0, 0] + [i for i, joint in enumerate(JOINTS) for _ in joint.rotations])
"""Index of the segment at whose origin each coordinate's axis passes."""


def jacobians(poses: Poses, segments: Sequence[int], points: Array) -> tuple[Array, Array]:
    """Compute the angular and the linear Jacobian, each (…, k, 3, 31), of ``points`` (…, k, 3) m fixed in ``segments``.

    They give ω = J_w q̇ (rad/s) and v = J_v q̇ (m/s).

    An angle turns every segment beyond it about its axis e through the point o of its joint:
    J_w = e, J_v = e × (x − o).
    """
    mask = _MOVED_BY[list(segments), :, None].astype(np.float64)
    angular = mask * poses.axes[..., None, :, :]
    angular[..., :3, :] = 0.0
    arm = points[..., :, None, :] - poses.origin[..., None, _CARRIER, :]
    linear = cross(angular, arm)
    linear[..., :3, :] = np.eye(3)
    return np.swapaxes(angular, -1, -2), np.swapaxes(linear, -1, -2)


def mean_jacobian(poses: Poses, weights: Array, points: Array) -> Array:
    """Compute the Jacobian (…, 3, 31) of the weighted mean Σ w x of the segments' points: its velocity at unit rates.

    The weights (21,) sum to 1; ``points`` (…, 21, 3) m holds a point of each segment.  J = e × Σ w (x − o) over the
    segments beyond the angle.
    """
    mask = _MOVED_BY.astype(np.float64)
    first = np.swapaxes(mask, 0, 1) @ (weights[:, None] * points)
    beyond = (weights @ mask)[:, None]
    linear = cross(poses.axes, first - beyond * poses.origin[..., _CARRIER, :])
    linear[..., :3, :] = np.eye(3)
    return np.swapaxes(linear, -1, -2)


def average_geometry(height: float) -> Geometry:
    """Return the chain of an average adult of ``height`` (m), for models without a recording.

    Segment lengths after Drillis & Contini (1966, in Winter 2009, fig. 4.1); the hips are joint centres, 0.0535 of
    height from the middle, not the skin's width.
    """
    joint = np.zeros((len(SEGMENTS), 3))
    end = np.zeros_like(joint)
    thigh, shank, ankle, foot = 0.245, 0.246, 0.039, 0.152
    upper_arm, forearm, hand, shoulder_half = 0.186, 0.146, 0.108, 0.129
    lumbar = 0.055
    neck = 0.870 - (ankle + shank + thigh) - lumbar
    shoulder_up = 0.818 - (ankle + shank + thigh) - lumbar
    joint[SEGMENT["torso"], 2] = end[SEGMENT["pelvis"], 2] = lumbar
    joint[SEGMENT["head"], 2] = end[SEGMENT["torso"], 2] = neck
    end[SEGMENT["head"], 2] = 0.130
    for side, left in (("r", -1.0), ("l", 1.0)):
        joint[SEGMENT[f"femur_{side}"]] = (0.0, 0.0535 * left, 0.0)
        joint[SEGMENT[f"tibia_{side}"], 2] = end[SEGMENT[f"femur_{side}"], 2] = -thigh
        joint[SEGMENT[f"talus_{side}"], 2] = end[SEGMENT[f"tibia_{side}"], 2] = -shank
        joint[SEGMENT[f"toes_{side}"]] = end[SEGMENT[f"calcn_{side}"]] = (0.55 * foot, 0.0, -ankle)
        end[SEGMENT[f"toes_{side}"], 0] = 0.2 * foot
        joint[SEGMENT[f"humerus_{side}"]] = (0.0, shoulder_half * left, shoulder_up)
        joint[SEGMENT[f"ulna_{side}"], 2] = end[SEGMENT[f"humerus_{side}"], 2] = -upper_arm
        end[SEGMENT[f"ulna_{side}"], 2] = end[SEGMENT[f"radius_{side}"], 2] = -forearm
        joint[SEGMENT[f"hand_{side}"], 2] = -forearm
        end[SEGMENT[f"hand_{side}"], 2] = -hand
    return Geometry(joint * height, end * height, ankle_to_ski_base=0.13)
