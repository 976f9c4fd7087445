"""What joints carry and what moments they need, of a movement and all forces that act on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssi_exudyn.bodies.skier.chain import FEET, HANDS, PARENT, SEGMENT, Poses, Rates, forward_kinematics, jacobians
from sssi_exudyn.bodies.skier.chain import rates as segment_rates
from sssi_exudyn.bodies.skier.inverse_dynamics import joint_loads
from sssi_exudyn.contact.maths import ArrayMath, Number
from sssi_exudyn.contact.term import BodyState, PlaceState, SegmentState, air_velocity, body_force, segment_force
from sssi_exudyn.core.frames import Array, gravity_in_slope
from sssi_exudyn.motion.hands import pole_forces
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_numpy import six_of


@dataclass(frozen=True)
class Movement:
    """A skier's movement at n instants, slope frame, and the snow's forces.

    time : (n,) s;  q, rates, accelerations : (n, 31) of the chain's coordinates
    com, com_velocity : (n, 3) m, m/s of all that moves
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


def joint_forces(parts: Parts, movement: Movement) -> Array:
    """(n, 21, 3) N in the pelvis' axes that each segment gets from its parent, and the pelvis from nobody: nothing,
    where the movement follows from the forces.

    What beyond the joint has to be accelerated and supported against gravity, less all other forces there: each ski's
    snow force without what its own mass takes of it, the air's on every segment, and what the model lets act on the
    centre of mass (unexplained forces), which segments bear by their masses, as the joints' moments have it; poles'
    forces act at the hands.
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
    """(n, 28) N m of the prescribed coordinates; what turns the skis themselves, a few N m, is left out.

    feet, snow_moment : (n, 2, 3) m and N m: the points of the soles that the snow's forces act at, and their moment
        about these
    """
    _, moments = _under_gravity(parts, movement)
    poses = forward_kinematics(parts.motion.geometry, movement.q, parts.model.inclination)
    places = poses.origin + np.stack([poses.rotation[:, i] @ part.com for i, part in enumerate(parts.inertias)], axis=1)
    _, linear = jacobians(poses, range(len(SEGMENT)), places)
    moments = moments - np.einsum("nsck,nsc->nk", linear[..., 3:], _outer(parts, movement, poses))
    turning, linear = (found[..., 3:] for found in jacobians(poses, list(FEET), feet))
    moments -= np.einsum("nsck,nsc->nk", linear, _on_feet(parts, movement))
    return np.asarray(moments - np.einsum("nsck,nsc->nk", turning, snow_moment))


def _under_gravity(parts: Parts, movement: Movement) -> tuple[Array, Array]:
    """``joint_loads`` of the movement, were there no other forces than gravity."""
    given = (movement.q, movement.rates, movement.accelerations)
    inclination = parts.model.inclination
    return joint_loads(parts.motion.geometry, parts.inertias, inclination, gravity_in_slope(inclination), *given)


def _outer(parts: Parts, movement: Movement, poses: Poses) -> Array:
    """(n, 21, 3) N on the segments, but for the snow's."""
    moving = segment_rates(poses, movement.rates, movement.accelerations)
    return _from_air(parts, movement, poses, moving) + _on_body(parts, movement)


def _on_feet(parts: Parts, movement: Movement) -> Array:
    """(n, 2, 3) N of the skis on the feet."""
    gravity = gravity_in_slope(parts.model.inclination)
    return np.asarray(movement.snow - 0.5 * (parts.mass - parts.body_mass) * (movement.ski_acceleration - gravity))


def _from_air(parts: Parts, movement: Movement, poses: Poses, moving: Rates) -> Array:
    """(n, 21, 3) N of the air on the segments."""
    math, terms = ArrayMath(), parts.model.terms
    at, found = movement.q[:, :3], np.zeros_like(poses.origin)
    wind = air_velocity(math, terms, PlaceState(movement.time, at[:, 0], at[:, 1]))
    shown = parts.facing(movement.time)
    for k, (name, area) in enumerate(parts.areas.items()):
        i = SEGMENT[name]
        arm = poses.rotation[:, i] @ parts.inertias[i].com
        speed = moving.velocity[:, i] + np.cross(moving.angular_velocity[:, i], arm)
        state = SegmentState(tuple(speed.T), wind, area, six_of(shown[:, k]))
        found[:, i] = _vectors(segment_force(math, terms, state), len(at))
    return found


def _on_body(parts: Parts, movement: Movement) -> Array:
    """(n, 21, 3) N of what acts on the centre of mass, shared out by mass, and of poles at the hands."""
    com = movement.com
    state = BodyState(movement.time, com[:, 0], com[:, 1], tuple(movement.com_velocity.T))
    force = _vectors(body_force(ArrayMath(), parts.model.terms, state), len(com))
    held = pole_forces(parts.model.terms, movement.time, com, movement.com_velocity)
    share = np.array([part.mass for part in parts.inertias]) / parts.body_mass
    found = share[:, None] * (force - held.sum(axis=1))[:, None]
    found[:, list(HANDS)] += held
    return np.asarray(found)


def _vectors(columns: Sequence[Number], count: int) -> Array:
    """(n, 3) of three columns that are arrays (n,) or numbers."""
    return np.stack([np.broadcast_to(column, count) for column in columns], axis=1)
