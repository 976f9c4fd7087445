"""The prescribed posture as numbers at given times: all that the models need to know of the skier's movement.

Everything is relative to the pelvis' origin and in the slope frame.  Since all rotations are prescribed, the absolute
motion follows by adding the pelvis' translation, the only thing the dynamics has to find.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssi_exudyn.bodies.anthropometry import SegmentInertia
from sssi_exudyn.chain import FEET, SEGMENT, forward_kinematics, jacobians, rates
from sssi_exudyn.frames import Array
from sssi_exudyn.motion import Motion


@dataclass(frozen=True)
class Posture:
    """The skier's posture at n times; feet are (left, right), exposed segments in the order they were asked for.

    time : (n,) s
    angles, rates, accelerations : (n, 28) of the prescribed coordinates
    foot_place, foot_velocity, foot_acceleration : (n, 2, 3) the point of the running surface under the ankle, m, m/s,
        m/s²
    foot_rotation : (n, 2, 3, 3) foot frame → slope frame
    foot_spin, foot_spin_rate : (n, 2, 3) angular velocity and acceleration, rad/s, rad/s²
    foot_jacobian : (n, 2, 3, 28) velocity of that point a unit rate of each prescribed coordinate
    foot_turning : (n, 2, 3, 28) the feet's angular velocity a unit rate of each prescribed coordinate
    com_place, com_velocity, com_acceleration : (n, 3) centre of mass of skier, boots and bindings (skis apart)
    com_jacobian : (n, 3, 28)
    kinetic : (n,) kinetic energy of the same in the pelvis' frame of translation, J
    exposed_velocity : (n, k, 3) of the exposed segments' centres of mass, m/s
    exposed_jacobian : (n, k, 3, 28)
    """

    time: Array
    angles: Array
    rates: Array
    accelerations: Array
    foot_place: Array
    foot_velocity: Array
    foot_acceleration: Array
    foot_rotation: Array
    foot_spin: Array
    foot_spin_rate: Array
    foot_jacobian: Array
    foot_turning: Array
    com_place: Array
    com_velocity: Array
    com_acceleration: Array
    com_jacobian: Array
    kinetic: Array
    exposed_velocity: Array
    exposed_jacobian: Array


def posture_at(motion: Motion, inertias: Sequence[SegmentInertia], exposed: Sequence[str], time: Array) -> Posture:
    """The posture at ``time`` (n,); ``inertias`` in chain order, ``exposed`` the segments that the air meets."""
    angles, speeds, accelerations = motion.evaluate(time)
    free = np.zeros((len(time), 3))
    poses = forward_kinematics(motion.geometry, np.hstack([free, angles]), motion.inclination)
    moving = rates(poses, np.hstack([free, speeds]), np.hstack([free, accelerations]))
    angular, linear = jacobians(poses)

    def point(segment: int, place: Array) -> tuple[Array, Array, Array, Array]:
        """Place, velocity, acceleration (n, 3) and Jacobian (n, 3, 28) of a point fixed in a segment."""
        arm = poses.rotation[:, segment] @ place
        spin, spin_rate = moving.angular_velocity[:, segment], moving.angular_acceleration[:, segment]
        swing = np.cross(spin, arm)
        columns = np.swapaxes(angular[:, segment, :, 3:], 1, 2)
        jacobian = linear[:, segment, :, 3:] + np.swapaxes(np.cross(columns, arm[:, None, :]), 1, 2)
        return (
            poses.origin[:, segment] + arm,
            moving.velocity[:, segment] + swing,
            moving.acceleration[:, segment] + np.cross(spin_rate, arm) + np.cross(spin, swing),
            jacobian,
        )

    feet = list(FEET)
    sole = np.array([0.0, 0.0, -motion.geometry.ankle_to_ski_base])
    # the ankle, from which the sole is measured along the foot's axes, is the talus' origin
    heel = [motion.geometry.attitude_in_parent[foot].T @ motion.geometry.joint_in_parent[foot] for foot in feet]
    ankle = [sole - place for place in heel]
    foot_parts = [np.stack(parts, axis=1) for parts in zip(*map(point, feet, ankle), strict=True)]
    mass = np.array([body.mass for body in inertias])
    body_parts = [point(i, body.com) for i, body in enumerate(inertias)]
    com_parts = [np.tensordot(mass / mass.sum(), np.stack(parts), axes=1) for parts in zip(*body_parts, strict=True)]
    spin = np.einsum("nsji,nsj->nsi", poses.rotation, moving.angular_velocity)
    inertia = np.stack([body.inertia for body in inertias])
    kinetic = 0.5 * np.einsum("nsi,sij,nsj->n", spin, inertia, spin)
    kinetic += 0.5 * sum(m * np.sum(parts[1] ** 2, axis=1) for m, parts in zip(mass, body_parts, strict=True))
    shown = [SEGMENT[name] for name in exposed]
    return Posture(
        time=time,
        angles=angles,
        rates=speeds,
        accelerations=accelerations,
        foot_place=foot_parts[0],
        foot_velocity=foot_parts[1],
        foot_acceleration=foot_parts[2],
        foot_rotation=poses.rotation[:, feet],
        foot_spin=moving.angular_velocity[:, feet],
        foot_spin_rate=moving.angular_acceleration[:, feet],
        foot_jacobian=foot_parts[3],
        foot_turning=angular[:, feet, :, 3:],
        com_place=com_parts[0],
        com_velocity=com_parts[1],
        com_acceleration=com_parts[2],
        com_jacobian=com_parts[3],
        kinetic=kinetic,
        exposed_velocity=np.stack([body_parts[i][1] for i in shown], axis=1),
        exposed_jacobian=np.stack([body_parts[i][3] for i in shown], axis=1),
    )
