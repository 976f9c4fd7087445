"""The prescribed posture as numbers at given times: all that the models need to know of the skier's movement.

Everything is relative to the pelvis' origin and in the slope frame.  Since all rotations are prescribed, the absolute
motion follows by adding the pelvis' translation, the only thing the dynamics has to find.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.skier.anthropometry import SegmentInertia
from sssi_exudyn.bodies.skier.boot import seat_of_ski
from sssi_exudyn.bodies.skier.chain import FEET, SEGMENT, Poses, forward_kinematics, jacobians, mean_jacobian, rates
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.heading import HEADING, Turn, spread_inertia, turned


@dataclass(frozen=True)
class FeetAndBody:
    """How feet (left, right) and the centre of mass move against the pelvis at n times.

    foot_place, foot_velocity, foot_acceleration : (n, 2, 3) the point of the running surface under the boot's centre,
        m, m/s, m/s²
    foot_rotation : (n, 2, 3, 3) the ski's frame, as the foot carries it → slope frame
    foot_spin, foot_spin_rate : (n, 2, 3) angular velocity and acceleration, rad/s, rad/s²
    com_place, com_velocity, com_acceleration : (n, 3) centre of mass of skier, boots and bindings (skis apart)
    com_inertia, com_momentum : (n, 3, 3) kg m², (n, 3) N m s of the same about its centre of mass
    """

    foot_place: Array
    foot_velocity: Array
    foot_acceleration: Array
    foot_rotation: Array
    foot_spin: Array
    foot_spin_rate: Array
    com_place: Array
    com_velocity: Array
    com_acceleration: Array
    com_inertia: Array
    com_momentum: Array


@dataclass(frozen=True)
class MovementTable(FeetAndBody):
    """How the skier moves at n times; exposed segments are in the order they were asked for.

    time : (n,) s
    angles, rates, accelerations : (n, 28) of the prescribed coordinates
    kinetic : (n,) kinetic energy of skier, boots and bindings in the pelvis' frame of translation, J
    exposed_place, exposed_velocity : (n, k, 3) of the exposed segments' centres of mass, m, m/s
    exposed_facing : (n, k, 3, 3) m⁴, what they show the air and others do not shield (``facing``); zero where no law
        asks for it
    """

    time: Array
    angles: Array
    rates: Array
    accelerations: Array
    kinetic: Array
    exposed_place: Array
    exposed_velocity: Array
    exposed_facing: Array


@dataclass(frozen=True)
class PostureTable(MovementTable):
    """The same with what each prescribed coordinate moves, a unit of its rate.

    foot_jacobian : (n, 2, 3, 28) velocity of the feet's points
    foot_turning : (n, 2, 3, 28) the feet's angular velocity
    com_jacobian : (n, 3, 28)
    exposed_jacobian : (n, k, 3, 28)
    """

    foot_jacobian: Array
    foot_turning: Array
    com_jacobian: Array
    exposed_jacobian: Array

    def rows(self, rows: NDArray[np.intp]) -> PostureTable:
        """Return the posture at some of the times; at times that follow each other its arrays are parts of these."""
        consecutive = len(rows) > 0 and bool(np.all(np.diff(rows) == 1))
        at = slice(int(rows[0]), int(rows[-1]) + 1) if consecutive else rows
        return PostureTable(**{entry.name: getattr(self, entry.name)[at] for entry in fields(self)})

    def turn(self, turn: Turn, body_mass: float) -> PostureTable:
        """Return the same posture turned about gravity; ``body_mass`` (kg) is what has ``kinetic`` energy."""
        matrices, up = turn.distinct_matrices(), turn.up
        changed = turn.of_posture(self)
        swung = self.exposed_velocity + turn.rate[:, None, None] * cross(up, self.exposed_place)
        changed["exposed_velocity"] = turned(matrices, swung)
        changed["exposed_place"] = turned(matrices, self.exposed_place)
        for name in ("foot_jacobian", "foot_turning", "exposed_jacobian"):
            changed[name] = np.ascontiguousarray(matrices[:, None] @ getattr(self, name))
        changed["com_jacobian"] = matrices @ self.com_jacobian
        for name, more in (("angles", turn.angle), ("rates", turn.rate), ("accelerations", turn.acceleration)):
            changed[name] = getattr(self, name).copy()
            changed[name][:, HEADING] += more
        swing = cross(up, self.com_place)
        momentum = self.com_momentum @ up + body_mass * np.sum(swing * self.com_velocity, axis=1)
        inertia = self.com_inertia @ up @ up + body_mass * np.sum(swing**2, axis=1)
        changed["kinetic"] = self.kinetic + turn.rate * (momentum + 0.5 * turn.rate * inertia)
        return replace(self, **changed)


@dataclass(frozen=True)
class Carried:
    """What the chain carries.

    inertias : in chain order
    exposed : the segments that the air meets
    boot_centre : m from the ankle forward along the ski to the middle of the boot's sole, on the ski's mark
    ramp_angle : rad by which the foot's toes point down against the ski
    """

    inertias: Sequence[SegmentInertia]
    exposed: Sequence[str]
    boot_centre: float = 0.0
    ramp_angle: float = 0.0


def posture_at(motion: Motion, carried: Carried, time: Array) -> PostureTable:
    """Return the posture at ``time`` (n,)."""
    movement, poses = _move(motion, carried, time)
    shown = [SEGMENT[name] for name in carried.exposed]
    outer = np.concatenate([movement.foot_place, movement.exposed_place], axis=1)
    angular, linear = (jacobian[..., 3:] for jacobian in jacobians(poses, [*FEET, *shown], outer))
    place = np.einsum("nsij,sj->nsi", poses.rotation, np.stack([body.com for body in carried.inertias]))
    mass = np.array([body.mass for body in carried.inertias])
    return PostureTable(
        **{entry.name: getattr(movement, entry.name) for entry in fields(movement)},
        foot_jacobian=linear[:, :2],
        foot_turning=angular[:, :2],
        com_jacobian=mean_jacobian(poses, mass / mass.sum(), poses.origin + place)[..., 3:],
        exposed_jacobian=linear[:, 2:],
    )


def movement_at(motion: Motion, carried: Carried, time: Array) -> MovementTable:
    """Return the movement at ``time`` (n,)."""
    return _move(motion, carried, time)[0]


def _move(motion: Motion, carried: Carried, time: Array) -> tuple[MovementTable, Poses]:
    inertias = carried.inertias
    angles, speeds, accelerations = motion.evaluate(time)
    free = np.zeros((len(time), 3))
    poses = forward_kinematics(motion.geometry, np.hstack([free, angles]), motion.inclination)
    moving = rates(poses, np.hstack([free, speeds]), np.hstack([free, accelerations]))

    def points(segments: Sequence[int], places: Array) -> tuple[Array, Array, Array]:
        """Return place, velocity, acceleration (n, k, 3) of points fixed at ``places`` (k, 3) in segments."""
        at = list(segments)
        arm = np.einsum("nkij,kj->nki", poses.rotation[:, at], places)
        spin, spin_rate = moving.angular_velocity[:, at], moving.angular_acceleration[:, at]
        swing = cross(spin, arm)
        return (
            poses.origin[:, at] + arm,
            moving.velocity[:, at] + swing,
            moving.acceleration[:, at] + cross(spin_rate, arm) + cross(spin, swing),
        )

    feet = list(FEET)
    soles, ramps = zip(
        *(seat_of_ski(motion.geometry, foot, carried.boot_centre, carried.ramp_angle) for foot in feet), strict=True
    )
    foot_place, foot_velocity, foot_acceleration = points(feet, np.stack(soles))
    place, velocity, acceleration = points(range(len(inertias)), np.stack([body.com for body in inertias]))
    mass = np.array([body.mass for body in inertias])
    share = mass / mass.sum()
    spin = np.einsum("nsji,nsj->nsi", poses.rotation, moving.angular_velocity)
    inertia = np.stack([body.inertia for body in inertias])
    kinetic = 0.5 * np.einsum("nsi,sij,nsj->n", spin, inertia, spin)
    kinetic += 0.5 * np.einsum("s,nsi,nsi->n", mass, velocity, velocity)
    arm, pace = place - (share @ place)[:, None], velocity - (share @ velocity)[:, None]
    com_inertia = np.einsum("nsij,sjk,nslk->nil", poses.rotation, inertia, poses.rotation, optimize=True)
    com_inertia += spread_inertia(mass, arm)
    com_momentum = np.einsum("nsij,sjk,nsk->ni", poses.rotation, inertia, spin, optimize=True)
    com_momentum += mass @ cross(arm, pace)
    shown = [SEGMENT[name] for name in carried.exposed]
    movement = MovementTable(
        time=time,
        angles=angles,
        rates=speeds,
        accelerations=accelerations,
        foot_place=foot_place,
        foot_velocity=foot_velocity,
        foot_acceleration=foot_acceleration,
        foot_rotation=poses.rotation[:, feet] @ np.stack(ramps),
        foot_spin=moving.angular_velocity[:, feet],
        foot_spin_rate=moving.angular_acceleration[:, feet],
        com_place=share @ place,
        com_velocity=share @ velocity,
        com_acceleration=share @ acceleration,
        com_inertia=com_inertia,
        com_momentum=com_momentum,
        kinetic=kinetic,
        exposed_place=place[:, shown],
        exposed_velocity=velocity[:, shown],
        exposed_facing=np.zeros((len(time), len(shown), 3, 3)),
    )
    return movement, poses
