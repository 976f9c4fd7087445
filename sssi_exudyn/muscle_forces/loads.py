"""Loads and moments of the joints in a movement under all its forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.skier.chain import FEET, HANDS, PARENT, SEGMENT, Poses, Rates, forward_kinematics, jacobians
from sssi_exudyn.bodies.skier.chain import rates as segment_rates
from sssi_exudyn.bodies.skier.inverse_dynamics import joint_loads
from sssi_exudyn.contact.maths import ArrayMath, Number
from sssi_exudyn.contact.term import BodyState, PlaceState, SegmentState, air_velocity, body_force, segment_force
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.motion.hands import pole_forces
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_numpy import six_of
from sssi_exudyn.simulation.reduced.prepared import ReducedRun


@dataclass(frozen=True)
class Movement:
    """A skier's movement at n instants, slope frame, and the snow's forces.

    time : (n,) s;  q, rates, accelerations : (n, 31) of the chain's coordinates
    com, com_velocity : (n, 3) m, m/s of everything that moves
    snow : (n, 2, 3) N on the left and the right ski;  ski_acceleration : (n, 2, 3) m/s²
    """

    time: Array
    q: Array
    rates: Array
    accelerations: Array
    com: Array
    com_velocity: Array
    snow: Array
    ski_acceleration: Array


def movement_of(parts: Parts, run: ReducedRun, rows: NDArray[np.intp]) -> Movement:
    """Return the movement of a reduced run at n of its instants."""
    posture, rates, accelerations = parts.motion.evaluate(run.time[rows])
    pull = np.gradient(run.pelvis_velocity, run.time, axis=0)
    return Movement(
        time=run.time[rows],
        q=np.hstack([run.pelvis[rows], posture]),
        rates=np.hstack([run.pelvis_velocity[rows], rates]),
        accelerations=np.hstack([pull[rows], accelerations]),
        com=run.com[rows],
        com_velocity=run.com_velocity[rows],
        snow=run.snow_force[rows],
        ski_acceleration=np.gradient(run.foot_velocity, run.time, axis=0)[rows],
    )


def joint_forces(parts: Parts, movement: Movement) -> Array:
    """Return the forces (n, 21, 3) N, in the pelvis' axes, that each segment gets from its parent.

    The pelvis has no parent; its force is zero where the movement follows from the forces.

    The segments beyond a joint have to be accelerated and supported against gravity, less all other forces there.
    These are each ski's snow force without the part for its own mass, the air's force on every segment, and the model's
    forces on the centre of mass (unexplained forces).  Segments bear the latter by their masses, as in the joints'
    moments; poles' forces act at the hands.
    """
    force, _ = _under_gravity(parts, movement)
    poses = forward_kinematics(parts.motion.geometry, movement.q, parts.model.inclination)
    outer = _outer(parts, movement, poses)
    outer[:, list(FEET)] += _on_feet(parts, movement)
    for i in reversed(range(len(SEGMENT))):
        force[:, i] -= outer[:, i]
        if PARENT[i] >= 0:
            outer[:, PARENT[i]] += outer[:, i]
    return np.asarray(force @ poses.rotation[:, 0])


def joint_moments(parts: Parts, movement: Movement, feet: Array, snow_moment: Array) -> Array:
    """Return the moments (n, 28) N m of the prescribed coordinates; the moments that turn the skis, a few N m, are left
    out.

    feet, snow_moment : (n, 2, 3) m and N m: the points of the soles at which the snow's forces act, and their moment
        about these
    """
    _, moments = _under_gravity(parts, movement)
    poses = forward_kinematics(parts.motion.geometry, movement.q, parts.model.inclination)
    places = poses.origin + np.stack([poses.rotation[:, i] @ part.com for i, part in enumerate(parts.inertias)], axis=1)
    _, linear = jacobians(poses, range(len(SEGMENT)), places)
    moments = moments - np.einsum("nsck,nsc->nk", linear[..., 3:], _outer(parts, movement, poses))
    turning, linear = (jacobian[..., 3:] for jacobian in jacobians(poses, list(FEET), feet))
    moments -= np.einsum("nsck,nsc->nk", linear, _on_feet(parts, movement))
    return np.asarray(moments - np.einsum("nsck,nsc->nk", turning, snow_moment))


def _under_gravity(parts: Parts, movement: Movement) -> tuple[Array, Array]:
    """Compute ``joint_loads`` of the movement for gravity alone."""
    motion = (movement.q, movement.rates, movement.accelerations)
    inclination = parts.model.inclination
    return joint_loads(parts.motion.geometry, parts.inertias, inclination, gravity_in_slope(inclination), *motion)


def _outer(parts: Parts, movement: Movement, poses: Poses) -> Array:
    """Return the forces (n, 21, 3) N on the segments, without the snow's."""
    moving = segment_rates(poses, movement.rates, movement.accelerations)
    return _from_air(parts, movement, poses, moving) + _on_body(parts, movement)


def _on_feet(parts: Parts, movement: Movement) -> Array:
    """Return the forces (n, 2, 3) N of the skis on the feet."""
    gravity = gravity_in_slope(parts.model.inclination)
    return np.asarray(movement.snow - 0.5 * (parts.mass - parts.body_mass) * (movement.ski_acceleration - gravity))


def _from_air(parts: Parts, movement: Movement, poses: Poses, moving: Rates) -> Array:
    """Return the forces (n, 21, 3) N of the air on the segments."""
    math, terms = ArrayMath(), parts.model.terms
    place, force = movement.q[:, :3], np.zeros_like(poses.origin)
    wind = air_velocity(math, terms, PlaceState(movement.time, place[:, 0], place[:, 1]))
    facing = parts.facing(movement.time)
    for k, (name, area) in enumerate(parts.areas.items()):
        i = SEGMENT[name]
        arm = poses.rotation[:, i] @ parts.inertias[i].com
        speed = moving.velocity[:, i] + np.cross(moving.angular_velocity[:, i], arm)
        state = SegmentState(tuple(speed.T), wind, area, six_of(facing[:, k]))
        force[:, i] = _vectors(segment_force(math, terms, state), len(place))
    return force


def _on_body(parts: Parts, movement: Movement) -> Array:
    """Return forces (n, 21, 3) N: those on the centre of mass, shared by mass, and of poles at the hands."""
    com = movement.com
    state = BodyState(movement.time, com[:, 0], com[:, 1], tuple(movement.com_velocity.T))
    force = _vectors(body_force(ArrayMath(), parts.model.terms, state), len(com))
    pole_force = pole_forces(parts.model.terms, movement.time, com, movement.com_velocity)
    share = np.array([part.mass for part in parts.inertias]) / parts.body_mass
    shared = share[:, None] * (force - pole_force.sum(axis=1))[:, None]
    shared[:, list(HANDS)] += pole_force
    return np.asarray(shared)


def _vectors(columns: Sequence[Number], count: int) -> Array:
    """Stack three columns, arrays (n,) or numbers, to (n, 3)."""
    return np.stack([np.broadcast_to(column, count) for column in columns], axis=1)
