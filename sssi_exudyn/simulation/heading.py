"""The skier's heading on snow that edges cut: the whole posture turned about gravity, with the inertia that it has.

With Ψ the turn to the left from the captured heading, I of skier and skis about the vertical through their centre of
mass, and L the angular momentum that the captured posture has about it,

    d/dt (I Ψ̇ + L) = M − k Ψ − c Ψ̇

where M is the moment of snow and air.  Places relative to the pelvis turn with Ψ; where the pelvis goes then follows
from the forces, as ever.  The skis count as clamped to the feet: that the skier turns the other way, by some 5 % of
what a ski yaws below him, is left out.  Forces of poles count as at the centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.core.rotations import rotations_about

HEADING: Final = PRESCRIBED.index("pelvis_rotation")
"""The prescribed coordinate that turns the whole posture about gravity."""


@dataclass(frozen=True)
class RigidSki:
    """A ski as the foot carries it.

    mass : kg;  com : (3,) m of its centre of mass, in the foot's frame;  inertia : (3, 3) kg m² about it
    """

    mass: float
    com: Array
    inertia: Array


class Posture(Protocol):
    """What ``posture_table.MovementTable`` and ``prepared.Prepared`` both have of a posture at n times."""

    @property
    def foot_place(self) -> Array: ...
    @property
    def foot_velocity(self) -> Array: ...
    @property
    def foot_acceleration(self) -> Array: ...
    @property
    def foot_rotation(self) -> Array: ...
    @property
    def foot_spin(self) -> Array: ...
    @property
    def foot_spin_rate(self) -> Array: ...
    @property
    def com_place(self) -> Array: ...
    @property
    def com_velocity(self) -> Array: ...
    @property
    def com_acceleration(self) -> Array: ...
    @property
    def com_inertia(self) -> Array: ...
    @property
    def com_momentum(self) -> Array: ...
    @property
    def exposed_facing(self) -> Array: ...


@dataclass(frozen=True)
class WholeBody:
    """Skier and skis as one, n times.

    place, velocity : (n, 3) m, m/s of the centre of mass, relative to the pelvis
    inertia, momentum : (n, 3, 3) kg m², (n, 3) N m s about it
    """

    place: Array
    velocity: Array
    inertia: Array
    momentum: Array


def whole_body(posture: Posture, body_mass: float, ski: RigidSki) -> WholeBody:
    """Return the skier (``body_mass`` kg without skis) and both skis as one."""
    frame, spin = posture.foot_rotation, posture.foot_spin
    arm = frame @ ski.com
    places = np.concatenate([posture.com_place[:, None], posture.foot_place + arm], axis=1)
    speeds = np.concatenate([posture.com_velocity[:, None], posture.foot_velocity + cross(spin, arm)], axis=1)
    mass = np.array([body_mass, ski.mass, ski.mass])
    share = mass / mass.sum()
    place, velocity = share @ places, share @ speeds
    of_skis = frame @ ski.inertia @ np.swapaxes(frame, 2, 3)
    apart = places - place[:, None]
    inertia = posture.com_inertia + of_skis.sum(axis=1) + spread_inertia(mass, apart)
    momentum = posture.com_momentum + np.einsum("nsij,nsj->ni", of_skis, spin)
    momentum += mass @ cross(apart, speeds - velocity[:, None])
    return WholeBody(place, velocity, inertia, momentum)


def spread_inertia(mass: Array, arm: Array) -> Array:
    """Return (n, 3, 3) kg m² of points of ``mass`` (k,) kg at ``arm`` (n, k, 3) m from their centre."""
    weighted = np.sqrt(mass)[:, None] * arm
    spread = np.swapaxes(weighted, 1, 2) @ weighted
    return np.asarray(np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3) - spread)


@dataclass(frozen=True)
class Turn:
    """A turn of a whole posture about gravity to the left, n times.

    up : (3,) against gravity;  angle, rate, acceleration : (n,) rad, rad/s, rad/s²
    """

    up: Array
    angle: Array
    rate: Array
    acceleration: Array

    @classmethod
    def of(cls, up: Array, heading: Array) -> Turn:
        """Make it of a heading, its rate and its acceleration (n, 3)."""
        return cls(up, *np.ascontiguousarray(heading.T))

    def matrices(self) -> Array:
        """Return the rotation matrices (n, 3, 3)."""
        return rotations_about(self.up, self.angle)

    def distinct_matrices(self) -> Array:
        """Return the same, but one (1, 3, 3) where it serves all instants: with it products are one of large arrays."""
        constant = len(self.angle) > 0 and np.all(self.angle == self.angle[0])
        return rotations_about(self.up, self.angle[:1]) if constant else self.matrices()

    @property
    def _is_still(self) -> bool:
        return not (np.any(self.rate) or np.any(self.acceleration))

    def spin(self, vectors: Array) -> Array:
        """Return the spin (n, …, 3) rad/s, with as many axes as ``vectors`` (n, …, 3)."""
        return np.asarray(self._along(self.rate, vectors))

    def velocity(self, place: Array, velocity: Array) -> Array:
        """Return the velocity (n, …, 3) m/s of what is at a place and moves before it is turned; its direction is not
        turned yet.
        """
        return velocity if self._is_still else np.asarray(velocity + cross(self.spin(place), place))

    def pull(self, place: Array, velocity: Array, acceleration: Array) -> Array:
        """Return the acceleration (n, …, 3) m/s² of the same."""
        if self._is_still:
            return acceleration
        moving = velocity + self.velocity(place, velocity)
        pulled = acceleration + cross(self.spin(place), moving)
        return np.asarray(pulled + cross(self._along(self.acceleration, place), place))

    def spin_rate(self, spin: Array, spin_rate: Array) -> Array:
        """Return the rate (n, …, 3) rad/s² of a spin, from the spin and its rate before it is turned."""
        if self._is_still:
            return spin_rate
        return np.asarray(spin_rate + cross(self.spin(spin), spin) + self._along(self.acceleration, spin))

    def of_posture(self, at: Posture) -> dict[str, Array]:
        """Return all numbers of a ``Posture``, turned, by their names."""
        matrices = self.distinct_matrices()
        vectors = {
            "foot_place": at.foot_place,
            "foot_velocity": self.velocity(at.foot_place, at.foot_velocity),
            "foot_acceleration": self.pull(at.foot_place, at.foot_velocity, at.foot_acceleration),
            "foot_spin": at.foot_spin + self.spin(at.foot_spin),
            "foot_spin_rate": self.spin_rate(at.foot_spin, at.foot_spin_rate),
            "com_place": at.com_place,
            "com_velocity": self.velocity(at.com_place, at.com_velocity),
            "com_acceleration": self.pull(at.com_place, at.com_velocity, at.com_acceleration),
            "com_momentum": at.com_momentum + np.einsum("nij,nj->ni", at.com_inertia, self.spin(at.com_momentum)),
        }
        return {
            **{name: turned(matrices, vector) for name, vector in vectors.items()},
            "foot_rotation": turned_frames(matrices, at.foot_rotation),
            "com_inertia": turned_frames(matrices, turned(matrices, at.com_inertia)),
            "exposed_facing": turned_frames(matrices, turned(matrices, at.exposed_facing)),
        }

    def _along(self, amount: Array, vectors: Array) -> Array:
        shape = (len(amount),) + (1,) * (vectors.ndim - 1)
        return np.asarray(amount.reshape(shape) * self.up)


def turned(turn: Array, vectors: Array) -> Array:
    """Turn vectors (n, …, 3) by rotations (n, 3, 3), or by one (1, 3, 3); they are contiguous."""
    back = np.swapaxes(turn, 1, 2)
    return np.ascontiguousarray((vectors.reshape(len(turn), -1, 3) @ back).reshape(vectors.shape))


def turned_frames(turn: Array, frames: Array) -> Array:
    """Turn frames (n, …, 3, 3), whose axes are columns, in the same way."""
    return np.ascontiguousarray(np.swapaxes(turned(turn, np.swapaxes(frames, -1, -2)), -1, -2))
