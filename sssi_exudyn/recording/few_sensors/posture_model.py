"""A skier's posture from few coordinates: the skis' heading, their edge angles, and the lean of the body in balance.

Few sensors measure a skier's heading, at best also the edge angles and the trunk's lean.  The rest follows from how
people ski.  Skis lie on the snow.  The boots let a leg bend in the foot's own plane only.  The hips stay a hip's width
apart across the shins.  The longer leg, the outside one, has an ordinary flexion.  The body balances in roll: the line
from the point where the load acts to the centre of mass points along the force that the snow must give.  That point
lies between the skis, nearer to the outside one.  The trunk's lean remains, and is solved for this balance.

Angles about the direction of travel are positive to the right, in the frame of the snow: forward (in the snow's plane),
left of it, normal.  Masses: Winter, Biomechanics and Motor Control of Human Movement (2009), table 4.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array
from sssi_exudyn.recording.instruments.bvh import Bvh

_HAT, _THIGH, _SHANK, _FOOT = 0.678, 0.100, 0.0465, 0.0145
"""Shares of the body's mass: head, arms and trunk; each thigh, shank and foot."""
_HAT_PLACE: Final = 0.626
"""Position of the centre of mass of head, arms and trunk, as a share of the line from hips to shoulders."""
_THIGH_PLACE, _SHANK_PLACE = 0.433, 0.433
"""Positions of the centres of mass, as a share of the line from the upper to the lower joint."""

FLEXION: Final = float(np.radians(45.0))
"""Knee flexion in the outside leg, rad; recreational skiers show 30 to 60°."""
_OUTSIDE_SHARE: Final = 0.8
"""Share of the load that the outside ski carries in a turn: 0.80 to 0.99 in the published runs."""
_OUTSIDE_LOWER: Final = 0.012
"""Depth of the outside ski below the inside one, m.  On snow of 5·10³ N/m^1.5 at each of 50 points of an edge, four
fifths and one fifth of 900 N press 20 and 8 mm deep.
"""
CLEAR_LEAN: Final = float(np.radians(10.0))
"""Lean at which a skier stands on the outside ski, not on both, rad."""
_HIPS_BEHIND: Final = 0.05
"""Distance of the hips behind the ankles over body height: an upright stance, boots' cuffs lean 15 to 20° forward."""
_PELVIS_SHARE: Final = 0.5
"""Share of the edge angle that the pelvis rolls along with the legs."""
_BEND: Final = float(np.radians(35.0))
"""Largest sideways bend of the trunk against the pelvis, rad (range of motion of thoracic and lumbar spine)."""
_LARGEST_TRUNK_LEAN: Final = float(np.radians(70.0))
_ARM_FLEXION, _ARM_ABDUCTION, _ELBOW = np.radians([40.0, 25.0, 60.0])
"""Angles of arms that hold the poles in front, rad."""

_TREE: Final = (
    ("Hips", ""),
    ("RightUpLeg", "Hips"),
    ("RightLeg", "RightUpLeg"),
    ("RightFoot", "RightLeg"),
    ("LeftUpLeg", "Hips"),
    ("LeftLeg", "LeftUpLeg"),
    ("LeftFoot", "LeftLeg"),
    ("Spine", "Hips"),
    ("Spine1", "Spine"),
    ("Spine2", "Spine1"),
    ("Neck", "Spine2"),
    ("Head", "Neck"),
    ("RightShoulder", "Spine2"),
    ("RightArm", "RightShoulder"),
    ("RightForeArm", "RightArm"),
    ("RightHand", "RightForeArm"),
    ("LeftShoulder", "Spine2"),
    ("LeftArm", "LeftShoulder"),
    ("LeftForeArm", "LeftArm"),
    ("LeftHand", "LeftForeArm"),
)
"""Joints of a capture and their parents."""
JOINTS: Final = tuple(name for name, _ in _TREE)
_CHAIN: Final = {"UpLeg": "femur", "Leg": "tibia", "Foot": "talus", "Arm": "humerus", "ForeArm": "ulna", "Hand": "hand"}


@dataclass(frozen=True)
class Coordinates:
    """The coordinates that determine a posture at n instants.

    snow : (n, 3, 3) forward, left and normal of the skis' path on the snow → level frame
    edge : (n, 2) rad, left and right ski's turn about the direction of travel
    lean : (n,) rad of the force that the snow must give, against its normal
    trunk : (n,) rad of the trunk's turn about the direction of travel where it was measured; None: solved for balance
    """

    snow: Array
    edge: Array
    lean: Array
    trunk: Array | None = None


@dataclass(frozen=True)
class Body:
    """A skier's lengths (m) and masses (kg) as the posture needs them."""

    height: float
    mass: float
    gear: float
    """Mass of one boot with its ski, kg."""
    ankle_to_ski_base: float


@dataclass(frozen=True)
class SkiingPosture:
    """The solved posture: rotations (n, 3, 3) of the segments to the snow's frame, feet and legs (left, right).

    trunk_lean : (n,) rad, the trunk's roll
    unbalanced : (n,) m by which the force's line through the centre of mass misses the load's point, to the left
    """

    pelvis: Array
    torso: Array
    thigh: Array
    shank: Array
    foot: Array
    trunk_lean: Array
    unbalanced: Array


def solve_posture(at: Coordinates, body: Body) -> SkiingPosture:
    """Solve for the posture that has these coordinates and balances as well as its joints allow."""
    lengths = _lengths(body.height)
    mean = at.edge.mean(axis=1)
    roll = _PELVIS_SHARE * mean
    behind = -_HIPS_BEHIND * body.height
    # from ankle to hip along the foot's own up axis: the longer leg is as bent as the outside leg is
    straight = np.sqrt(
        lengths.thigh**2 + lengths.shank**2 + 2.0 * lengths.thigh * lengths.shank * np.cos(FLEXION) - behind**2
    )
    above = np.array([1.0, -1.0]) * 0.5 * lengths.hips * np.sin(roll)[:, None]
    turning = np.tanh(at.lean / CLEAR_LEAN)
    sole = np.outer(turning, 0.5 * _OUTSIDE_LOWER * np.array([-1.0, 1.0]))
    # hips stand middle ± half a hip's width over the snow, ankles on the foot's own axis over the sole
    middle = np.min((straight + body.ankle_to_ski_base) * np.cos(at.edge) + sole - above, axis=1)
    along = (middle[:, None] + above - sole) / np.cos(at.edge) - body.ankle_to_ski_base
    thigh_pitch, shank_pitch = _leg_pitch(along, behind, lengths)
    foot = _about("x", at.edge)
    shank, thigh = foot @ _about("y", shank_pitch), foot @ _about("y", thigh_pitch)
    forward = _trunk_pitch(body, lengths, straight, behind)
    pelvis = _about("x", roll) @ _about("y", np.full(len(roll), 0.5 * forward))
    legs = _Legs(pelvis, thigh, shank, foot)
    left_share = 0.5 + (_OUTSIDE_SHARE - 0.5) * turning
    share = np.stack([left_share, 1.0 - left_share], axis=1)

    def miss(trunk: Array) -> Array:
        com = _centre(legs, _torso(trunk, forward), share, lengths, body)
        return np.asarray(com[:, 1] + com[:, 2] * np.tan(at.lean))

    if at.trunk is not None:
        lean = np.clip(at.trunk, roll - _BEND, roll + _BEND)
    else:
        low, high = (np.clip(roll + side * _BEND, -_LARGEST_TRUNK_LEAN, _LARGEST_TRUNK_LEAN) for side in (-1.0, 1.0))
        for _ in range(40):  # bisection to 1e-10 rad: leaning right moves the centre of mass right
            lean = 0.5 * (low + high)
            left = miss(lean) > 0.0
            low, high = np.where(left, lean, low), np.where(left, high, lean)
    return SkiingPosture(pelvis, _torso(lean, forward), thigh, shank, foot, lean, miss(lean))


def capture_from_posture(posture: SkiingPosture, snow: Array, time: Array, height: float) -> Bvh:
    """Return the posture as a motion capture of an average skier of ``height`` (m) would show it.

    The capture's +z axis is the level frame's forward one.

    snow : (n, 3, 3) snow's frame → level frame;  time : (n,) s
    """
    world: dict[str, Array] = {"Hips": snow @ posture.pelvis}
    torso = snow @ posture.torso
    world |= dict.fromkeys(("Spine", "Spine1", "Spine2", "Neck", "Head"), torso)
    for side, (word, left) in enumerate((("Left", 1.0), ("Right", -1.0))):
        world[word + "UpLeg"] = snow @ posture.thigh[:, side]
        world[word + "Leg"] = snow @ posture.shank[:, side]
        world[word + "Foot"] = snow @ posture.foot[:, side]
        world[word + "Shoulder"] = torso
        hanging = Rotation.from_euler("x", left * np.pi / 2).as_matrix().T  # a capture counts from the T-pose
        upper = Rotation.from_euler("xy", [left * _ARM_ABDUCTION, -_ARM_FLEXION]).as_matrix()
        fore = upper @ Rotation.from_euler("y", -_ELBOW).as_matrix()
        world[word + "Arm"] = torso @ upper @ hanging
        world[word + "ForeArm"] = world[word + "Hand"] = torso @ fore @ hanging
    local = [world[name] if not parent else np.swapaxes(world[parent], -1, -2) @ world[name] for name, parent in _TREE]
    rotations = BODY_FROM_BVH.T @ np.stack(local, axis=1) @ BODY_FROM_BVH
    parents = tuple(JOINTS.index(parent) if parent else -1 for _, parent in _TREE)
    offsets, ends = _offsets(height)
    return Bvh(JOINTS, parents, offsets, ends, time, rotations, np.zeros((len(time), 3)))


@dataclass(frozen=True)
class _Lengths:
    thigh: float
    shank: float
    hips: float
    lumbar: float
    shoulder: float


@dataclass(frozen=True)
class _Legs:
    pelvis: Array
    thigh: Array
    shank: Array
    foot: Array


def _lengths(height: float) -> _Lengths:
    chain = average_geometry(height)
    lumbar = float(chain.joint_in_parent[SEGMENT["torso"], 2])
    return _Lengths(
        thigh=chain.length("femur_l"),
        shank=chain.length("tibia_l"),
        hips=2.0 * float(chain.joint_in_parent[SEGMENT["femur_l"], 1]),
        lumbar=lumbar,
        shoulder=lumbar + float(chain.joint_in_parent[SEGMENT["humerus_l"], 2]),
    )


def _leg_pitch(along: Array, behind: float, lengths: _Lengths) -> tuple[Array, Array]:
    """Return the pitch (n, 2) of thigh and shank in the foot's plane, forward positive.

    They bring the hip ``along`` m up and ``behind`` m forward of the ankle; a leg that does not reach is straight.
    """
    thigh, shank = lengths.thigh, lengths.shank
    reach = np.hypot(along, behind)
    flexion = np.arccos(np.clip((reach**2 - thigh**2 - shank**2) / (2.0 * thigh * shank), -1.0, 1.0))
    shank_pitch = np.arctan2(behind, along) + np.arctan2(thigh * np.sin(flexion), shank + thigh * np.cos(flexion))
    return shank_pitch - flexion, shank_pitch


def _torso(roll: Array, forward: float) -> Array:
    return _about("x", roll) @ _about("y", np.full(len(roll), forward))


def _trunk_pitch(body: Body, lengths: _Lengths, straight: float, behind: float) -> float:
    """Return the trunk's forward lean, rad, at which the centre of mass of a straight skier is over the ankles.

    The ankles are over the middle of the skis.
    """
    thigh, shank = _leg_pitch(np.full((1, 2), straight), behind, lengths)
    foot = np.tile(np.eye(3), (1, 2, 1, 1))
    low, high = 0.0, float(np.radians(80.0))
    for _ in range(40):
        pitch = 0.5 * (low + high)
        legs = _Legs(_about("y", np.array([0.5 * pitch])), foot @ _about("y", thigh), foot @ _about("y", shank), foot)
        back = _centre(legs, _torso(np.zeros(1), pitch), np.full((1, 2), 0.5), lengths, body)[0, 0] < 0.0
        low, high = (pitch, high) if back else (low, pitch)
    return 0.5 * (low + high)


def _centre(legs: _Legs, torso: Array, share: Array, lengths: _Lengths, body: Body) -> Array:
    """Return the centre of mass (n, 3) m of skier, boots and skis from the point of the load between both soles.

    ``share`` (n, 2) of the load acts on each sole.
    """
    up = np.array([0.0, 0.0, 1.0])
    side = legs.pelvis @ np.array([0.0, 0.5 * lengths.hips, 0.0])
    hip = np.stack([side, -side], axis=1)
    knee = hip - lengths.thigh * (legs.thigh @ up)
    ankle = knee - lengths.shank * (legs.shank @ up)
    sole = ankle - body.ankle_to_ski_base * (legs.foot @ up)
    lumbar = lengths.lumbar * (legs.pelvis @ up)
    hat = lumbar + (_HAT_PLACE * lengths.shoulder - lengths.lumbar) * (torso @ up)
    of_legs = (
        _THIGH * (hip + _THIGH_PLACE * (knee - hip)) + _SHANK * (knee + _SHANK_PLACE * (ankle - knee)) + _FOOT * ankle
    )
    moment = body.mass * (_HAT * hat + of_legs.sum(axis=1)) + body.gear * sole.sum(axis=1)
    return np.asarray(moment / (body.mass + 2.0 * body.gear) - np.einsum("ns,nsi->ni", share, sole))


def _about(axis: str, angles: Array) -> Array:
    """Return rotations (…, 3, 3) about an axis by angles (…)."""
    flat = Rotation.from_euler(axis, np.ravel(angles)[:, None]).as_matrix()
    return np.asarray(flat.reshape(*np.shape(angles), 3, 3))


def rotation_about_x(angles: Array) -> Array:
    """Return rotations (n, 3, 3) about the forward axis by ``angles`` (n,), to the right when positive."""
    return _about("x", angles)


def _offsets(height: float) -> tuple[Array, dict[str, Array]]:
    """Return OFFSETs (J, 3) m and End Sites of the average skeleton, in BVH axes, arms sideways."""
    chain = average_geometry(height)
    to_bvh = BODY_FROM_BVH.T
    offsets = np.zeros((len(JOINTS), 3))
    ends: dict[str, Array] = {}
    torso, head = SEGMENT["torso"], SEGMENT["head"]
    third = chain.joint_in_parent[head] / 3.0
    offsets[JOINTS.index("Spine")] = to_bvh @ chain.joint_in_parent[torso]
    for name in ("Spine1", "Spine2", "Neck"):
        offsets[JOINTS.index(name)] = to_bvh @ third
    ends["Head"] = to_bvh @ chain.segment_end[head]
    for word, side, left in (("Left", "l", 1.0), ("Right", "r", -1.0)):
        for joint, segment in _CHAIN.items():
            place = chain.joint_in_parent[SEGMENT[f"{segment}_{side}"]]
            if joint in ("ForeArm", "Hand"):  # hanging in the chain, sideways in the T-pose
                place = np.array([0.0, -left * place[2], 0.0])
            offsets[JOINTS.index(word + joint)] = to_bvh @ place
        shoulder = chain.joint_in_parent[SEGMENT[f"humerus_{side}"]] - 2.0 * third
        collar = shoulder * np.array([1.0, 0.2, 1.0])
        offsets[JOINTS.index(word + "Shoulder")] = to_bvh @ collar
        offsets[JOINTS.index(word + "Arm")] = to_bvh @ (shoulder - collar)
        ends[word + "Foot"] = to_bvh @ chain.joint_in_parent[SEGMENT[f"toes_{side}"]]
        ends[word + "Hand"] = to_bvh @ np.array([0.0, -left * chain.segment_end[SEGMENT[f"hand_{side}"]][2], 0.0])
    return offsets, ends
