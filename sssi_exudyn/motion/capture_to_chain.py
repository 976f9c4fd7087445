"""From a captured skeleton (BVH) to the chain: the joints' places, and the angles that reproduce the captured pose.

The capture has three angles in every joint, the chain only those that a skier in boots has.  So the chain's angles are
a weighted least-squares fit (`limb_angles`).  The foot's orientation and place relative to the pelvis come first, since
they move the ski: the standard deviations below weigh the deviations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.skier.chain import JOINTS, SEGMENT, SEGMENTS, Axis, Geometry, Joint
from sssi_exudyn.core.frames import BODY_FROM_BVH, Array, rotation_from_bvh
from sssi_exudyn.core.rotations import nearest_rotation
from sssi_exudyn.motion.limb_angles import Limb, ball_joint_angles, fit_angles, turn_about
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_positions, world_rotations

_SIDES: Final = (("r", "Right", -1.0), ("l", "Left", 1.0))

CAPTURED_BY: Final[dict[str, str]] = {
    "pelvis": "Hips",
    "torso": "Spine2",
    "head": "Head",
    **{
        f"{segment}_{side}": f"{word}{joint}"
        for side, word, _ in _SIDES
        for segment, joint in (
            ("femur", "UpLeg"),
            ("tibia", "Leg"),
            ("calcn", "Foot"),
            ("humerus", "Arm"),
            ("radius", "ForeArm"),
            ("hand", "Hand"),
        )
    },
}
"""Captured joint that moves with each segment (``Spine3`` is the torso's where the tree has one)."""

_FOOT_SIGMA: Final[Array] = np.radians([0.1, 0.1, 0.03])
"""Roll (edge angle), pitch, yaw of the foot, rad.  The edge angle needs 0.1°.  Yaw is held closer, since 0.1° of a
ski's heading steers a run of 150 m 0.3 m aside.
"""
_PLACE_SIGMA: Final = 0.001
"""Standard deviation of the foot's place, m; at a depth of 2 cm 1 mm changes a ski's load by 7 %, F ~ depth^1.5."""
_LEG_SIGMA: Final[Array] = np.radians([3.0, 3.0, 3.0])
"""Standard deviations of thigh and shank, rad, only to keep a straight leg's angles determined."""
_ARM_SIGMA: Final[Array] = np.radians([1.0, 1.0, 1.0])
"""Standard deviations of upper arm, forearm and hand, rad, equal because they carry mass and little else."""
_UNMEASURED: Final[Array] = np.full(3, np.inf)
_LUMBAR_SIGMA: Final = 0.05
"""Distance, m, of the functional lumbar joint from the anatomical one where the motion does not determine it."""
_TOE_LENGTH: Final = 0.2 * 0.152
"""Length of the toes over body height: a foot of 0.152 (Drillis & Contini 1966), of which the toes are a fifth."""


@dataclass(frozen=True)
class Capture:
    """A captured motion in body axes, as the chain has them.

    pelvis : (n, 3, 3) pelvis → the capture's level frame (x along its heading, z up)
    rotation : (n, J, 3, 3) each joint's segment → pelvis; the arms count from hanging, not from the T-pose
    place : (n, J, 3) m, each joint in the pelvis' frame
    """

    bvh: Bvh
    pelvis: Array
    rotation: Array
    place: Array

    def joint(self, segment: str) -> int:
        """Return the index of the captured joint that moves with the segment."""
        return self.bvh.index(_captured_by(self.bvh, segment))

    def point(self, joint: str, offset: Array) -> Array:
        """Return the point (n, 3) m in the pelvis' frame, ``offset`` (3,) m from a captured joint in its BVH axes."""
        at = self.bvh.index(joint)
        arm = hanging_from_t_pose(joint).T @ BODY_FROM_BVH @ offset
        return np.asarray(self.place[:, at] + self.rotation[:, at] @ arm)


def _captured_by(bvh: Bvh, segment: str) -> str:
    return "Spine3" if segment == "torso" and "Spine3" in bvh.names else CAPTURED_BY[segment]


def segment_of_joint(bvh: Bvh, joint: str) -> str:
    """Return the segment that a captured joint, also a finger, a collar bone or a vertebra, moves with.

    Raises KeyError for a joint that the tree does not have.
    """
    segments = {_captured_by(bvh, segment): segment for segment in CAPTURED_BY}
    at = bvh.index(joint)
    while bvh.names[at] not in segments:
        if bvh.names[at].startswith("Spine"):
            return "torso"
        at = bvh.parents[at]
    return segments[bvh.names[at]]


def hanging_from_t_pose(name: str) -> Array:
    """Return the rotation (3, 3) from anatomical axes to T-pose axes.

    A hanging arm is a right angle below the T-pose; for other joints it is the identity.
    """
    for _, word, left in _SIDES:
        if name.startswith(word) and any(part in name for part in ("Arm", "ForeArm", "Hand")):
            return np.asarray(Rotation.from_euler("x", left * np.pi / 2).as_matrix())
    return np.eye(3)


def capture_in_body_axes(bvh: Bvh) -> Capture:
    """Return the capture's segments relative to its pelvis; the root's position (dead reckoning) is left out."""
    world_bvh = world_rotations(bvh)
    world = rotation_from_bvh(world_bvh)
    place = joint_positions(bvh, world_bvh) @ BODY_FROM_BVH.T
    pelvis = world[:, 0]
    to_pelvis = np.swapaxes(pelvis, -1, -2)[:, None]
    zero = np.stack([hanging_from_t_pose(name) for name in bvh.names])
    return Capture(bvh, pelvis, to_pelvis @ world @ zero, (to_pelvis @ place[..., None])[..., 0])


def _far_end(bvh: Bvh, joint: int) -> Array:
    """Return the farthest point (3,) m beyond a joint in the zero pose, in body axes.

    It is a finger tip, the vertex or the ball of the foot.
    """
    reach = np.zeros((len(bvh.names), 3))
    ends = [np.zeros(3)]
    beyond = {joint}
    for at in range(joint, len(bvh.names)):
        if bvh.parents[at] in beyond and at != joint:
            beyond.add(at)
            reach[at] = reach[bvh.parents[at]] + bvh.offsets[at]
        if at in beyond:
            ends += [reach[at], reach[at] + bvh.end_offsets.get(bvh.names[at], np.zeros(3))]
    return np.asarray(BODY_FROM_BVH @ max(ends, key=lambda end: float(end @ end)))


def mean_in(rotation: Array, origin: Array, place: Array) -> Array:
    """Return the mean place (3,) of points (n, 3), seen from a moving frame."""
    return np.asarray(np.mean(np.swapaxes(rotation, -1, -2) @ (place - origin)[..., None], axis=0)[:, 0])


def lumbar_joint(capture: Capture) -> Array:
    """Return the place (3,) m in the pelvis of the one lumbar joint that best represents the captured spine.

    The spine's top moves as p = j + R s, R the torso's rotation against the pelvis; j and s (3,) m are the
    least-squares solution over the run (a functional joint centre), with the anatomical lumbosacral joint as prior.
    """
    bvh, top = capture.bvh, capture.joint("torso")
    prior_joint = BODY_FROM_BVH @ bvh.offsets[bvh.index("Spine")]
    prior_top = -prior_joint
    at = top
    while at > 0:
        prior_top = prior_top + BODY_FROM_BVH @ bvh.offsets[at]
        at = bvh.parents[at]
    frames = len(bvh.time)
    moving = np.concatenate([np.broadcast_to(np.eye(3), (frames, 3, 3)), capture.rotation[:, top]], axis=-1)
    weight = _PLACE_SIGMA / _LUMBAR_SIGMA
    matrix = np.concatenate([moving.reshape(-1, 6), weight * np.eye(6)])
    right = np.concatenate([capture.place[:, top].ravel(), weight * np.concatenate([prior_joint, prior_top])])
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    return np.asarray(solution[:3])


def skier_geometry(capture: Capture, height: float, ankle_to_ski_base: float) -> Geometry:
    """Return the skier's lengths.

    Limbs come from the capture's offsets, points on the torso from their mean place over the run.

    Shoulders and head move a little on the captured torso (collar bones, neck); the chain fixes them at their mean
    place.  The capture may bend knees and ankles constantly out of their hinges' plane (crooked shanks, askew sensors).
    This bend becomes the constant attitude of ankle and subtalar joint; without it the feet would be wrong by some
    degrees and centimetres.  The chain's hinges cannot follow its changes.

    height, ankle_to_ski_base : m
    """
    bvh = capture.bvh
    joint, end = np.zeros((len(SEGMENTS), 3)), np.zeros((len(SEGMENTS), 3))
    attitude = np.tile(np.eye(3), (len(SEGMENTS), 1, 1))
    lumbar = lumbar_joint(capture)
    joint[SEGMENT["torso"]] = end[SEGMENT["pelvis"]] = lumbar
    torso = capture.rotation[:, capture.joint("torso")]
    neck, head = bvh.index("Neck"), capture.joint("head")
    joint[SEGMENT["head"]] = end[SEGMENT["torso"]] = mean_in(torso, lumbar, capture.place[:, neck])
    vertex = capture.place[:, head] + capture.rotation[:, head] @ _far_end(bvh, head)
    end[SEGMENT["head"]] = mean_in(torso, capture.place[:, neck], vertex)
    for side, word, _ in _SIDES:
        thigh, shank, foot = (capture.rotation[:, bvh.index(word + name)] for name in ("UpLeg", "Leg", "Foot"))
        ankle = attitude[SEGMENT[f"talus_{side}"]] = _hinge_attitude(_hinge(f"tibia_{side}"), thigh, shank)
        attitude[SEGMENT[f"calcn_{side}"]] = _hinge_attitude(_hinge(f"talus_{side}"), shank, foot)
        for segment, name in (("femur", "UpLeg"), ("tibia", "Leg"), ("talus", "Foot")):
            joint[SEGMENT[f"{segment}_{side}"]] = BODY_FROM_BVH @ bvh.offsets[bvh.index(word + name)]
        joint[SEGMENT[f"talus_{side}"]] = ankle @ joint[SEGMENT[f"talus_{side}"]]  # the tibia's frame is its knee's
        ball = _far_end(bvh, bvh.index(word + "Foot"))
        joint[SEGMENT[f"toes_{side}"]] = end[SEGMENT[f"calcn_{side}"]] = ball
        end[SEGMENT[f"toes_{side}"]] = (_TOE_LENGTH * height, 0.0, 0.0)
        shoulder = capture.place[:, bvh.index(word + "Arm")]
        joint[SEGMENT[f"humerus_{side}"]] = mean_in(torso, lumbar, shoulder)
        hanging = hanging_from_t_pose(word + "Arm").T @ BODY_FROM_BVH
        joint[SEGMENT[f"ulna_{side}"]] = hanging @ bvh.offsets[bvh.index(word + "ForeArm")]
        joint[SEGMENT[f"hand_{side}"]] = hanging @ bvh.offsets[bvh.index(word + "Hand")]
        tip = _far_end(bvh, bvh.index(word + "Hand"))
        end[SEGMENT[f"hand_{side}"]] = hanging @ BODY_FROM_BVH.T @ tip
        for segment, beyond in (("femur", "tibia"), ("tibia", "talus"), ("humerus", "ulna")):
            end[SEGMENT[f"{segment}_{side}"]] = joint[SEGMENT[f"{beyond}_{side}"]]
        end[SEGMENT[f"ulna_{side}"]] = end[SEGMENT[f"radius_{side}"]] = joint[SEGMENT[f"hand_{side}"]]
    return Geometry(joint, end, ankle_to_ski_base, attitude)


def _hinge_attitude(axis: Axis, inner: Array, outer: Array) -> Array:
    """Return the constant (3, 3) that a hinge leaves between captured segments: inner⁻¹ outer = turn · constant.

    It is the mean, over the run, of the joint's rotation (n, 3, 3) without the part about the hinge's axis.
    """
    relative = np.swapaxes(inner, -1, -2) @ outer
    turn = Rotation.from_rotvec(turn_about(axis, relative)[:, None] * np.array(axis)).as_matrix()
    return nearest_rotation(np.mean(np.swapaxes(turn, -1, -2) @ relative, axis=0))


def _hinge(segment: str) -> Axis:
    ((_, axis),) = JOINTS[SEGMENT[segment]].rotations
    return axis


def _joints(*segments: str) -> tuple[Joint, ...]:
    return tuple(JOINTS[SEGMENT[segment]] for segment in segments)


def _leg(capture: Capture, geometry: Geometry, side: str) -> Limb:
    joints = _joints(f"femur_{side}", f"tibia_{side}", f"talus_{side}", f"calcn_{side}")
    at = [SEGMENT[joint.segment] for joint in joints]
    thigh, shank, foot = (capture.rotation[:, capture.joint(f"{name}_{side}")] for name in ("femur", "tibia", "calcn"))
    ankle, subtalar = geometry.attitude_in_parent[at[2:]]
    return Limb(
        joints=joints,
        offset=geometry.joint_in_parent[at],
        attitude=geometry.attitude_in_parent[at],
        # Shank and talus are captured but for the constant rotation between their own frame and the next joint's.
        rotation=np.stack([thigh, shank @ ankle.T, foot @ subtalar.T, foot], axis=1),
        rotation_sigma=np.stack([_LEG_SIGMA, _LEG_SIGMA, _UNMEASURED, _FOOT_SIGMA]),
        place=capture.place[:, capture.joint(f"calcn_{side}")],
        place_sigma=_PLACE_SIGMA,
    )


def _arm(capture: Capture, side: str) -> Limb:
    joints = _joints(f"humerus_{side}", f"ulna_{side}", f"radius_{side}", f"hand_{side}")
    measured = [capture.joint(f"{segment}_{side}") for segment in ("humerus", "radius", "radius", "hand")]
    to_torso = np.swapaxes(capture.rotation[:, capture.joint("torso")], -1, -2)[:, None]
    # The capture has one forearm, compared with the radius; the ulna, before pronation, is not compared.
    return Limb(
        joints=joints,
        offset=np.zeros((len(joints), 3)),
        attitude=np.tile(np.eye(3), (len(joints), 1, 1)),
        rotation=to_torso @ capture.rotation[:, measured],
        rotation_sigma=np.stack([_ARM_SIGMA, _UNMEASURED, _ARM_SIGMA, _ARM_SIGMA]),
    )


def chain_angles(capture: Capture, geometry: Geometry, level_from_capture: Array) -> Array:
    """Return the 28 prescribed angles (n, 28) rad, in the order of `chain.PRESCRIBED`, continuous over time.

    level_from_capture : (3, 3) the capture's level frame → level frame along the fall line
    """
    by_segment: dict[str, Array] = {
        "pelvis": ball_joint_angles(JOINTS[SEGMENT["pelvis"]], level_from_capture @ capture.pelvis),
        "torso": ball_joint_angles(JOINTS[SEGMENT["torso"]], capture.rotation[:, capture.joint("torso")]),
    }
    for side, _, _ in _SIDES:
        for limb in (_leg(capture, geometry, side), _arm(capture, side)):
            by_segment |= limb.by_segment(fit_angles(limb))
    return np.concatenate([by_segment[joint.segment] for joint in JOINTS if joint.rotations], axis=-1)
