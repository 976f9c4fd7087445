"""Joint moments from a movement that is known: recursive Newton-Euler over the skier's chain.

It serves runs without the skeleton's tree: there no constraint holds the posture, so no multiplier gives the moments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sssi_exudyn.bodies.skier.anthropometry import SegmentInertia
from sssi_exudyn.bodies.skier.chain import (
    COORDINATE,
    COORDINATES,
    JOINTS,
    PARENT,
    Geometry,
    Poses,
    Rates,
    forward_kinematics,
    rates,
)
from sssi_exudyn.core.frames import Array, cross

_STRETCH = 256
"""Number of instants computed at once: every segment's frames for a whole run would be larger than the result."""


def joint_moments(
    geometry: Geometry,
    inertias: Sequence[SegmentInertia],
    inclination: float,
    gravity: Array,
    q: Array,
    qd: Array,
    qdd: Array,
) -> Array:
    """Return the moments (n, 28) N m of the prescribed coordinates that the bodies' movement needs under gravity alone.

    Parameters
    ----------
    inertias : in chain order
    inclination : of the slope, rad;  gravity : (3,) m/s² in the slope frame
    q, qd, qdd : (n, 31) coordinates of the chain, their rates and accelerations
    """
    return joint_loads(geometry, inertias, inclination, gravity, q, qd, qdd)[1]


def joint_loads(
    geometry: Geometry,
    inertias: Sequence[SegmentInertia],
    inclination: float,
    gravity: Array,
    q: Array,
    qd: Array,
    qdd: Array,
) -> tuple[Array, Array]:
    """Return the forces at the joints and the moments of ``joint_moments``, whose arguments it takes.

    The forces (n, 21, 3) N, slope frame, are those that each segment gets at its joint from its parent so that all
    segments beyond move as given under gravity alone.
    """
    stretches = np.array_split(np.arange(len(q)), max(1, -(-len(q) // _STRETCH)))
    parts = [_recursion(geometry, inertias, inclination, gravity, q[rows], qd[rows], qdd[rows]) for rows in stretches]
    forces, moments = zip(*parts, strict=True)
    return np.concatenate(forces), np.concatenate(moments)


def segment_loads(
    poses: Poses, moving: Rates, inertias: Sequence[SegmentInertia], gravity: Array
) -> tuple[Array, Array]:
    """Return the force and the moment that each segment alone needs to move as given under gravity.

    Force (n, 21, 3) N and moment about the segment's own joint (n, 21, 3) N m, both in the slope frame.
    """
    force, moment = np.empty_like(poses.origin), np.empty_like(poses.origin)
    for i, body in enumerate(inertias):
        omega, alpha = moving.angular_velocity[:, i], moving.angular_acceleration[:, i]
        turn = poses.rotation[:, i]
        arm = turn @ body.com
        specific_force = moving.acceleration[:, i] + cross(alpha, arm) + cross(omega, cross(omega, arm)) - gravity
        inertia = turn @ body.inertia @ np.swapaxes(turn, 1, 2)
        spin = np.einsum("nij,nj->ni", inertia, omega)
        force[:, i] = body.mass * specific_force
        moment[:, i] = np.einsum("nij,nj->ni", inertia, alpha) + cross(omega, spin) + cross(arm, force[:, i])
    return force, moment


def _recursion(
    geometry: Geometry,
    inertias: Sequence[SegmentInertia],
    inclination: float,
    gravity: Array,
    q: Array,
    qd: Array,
    qdd: Array,
) -> tuple[Array, Array]:
    """Compute the movement outwards, then force F and moment M about each segment's joint inwards.

    F = m (a_c − g) + Σ F_child, M = I α + ω × I ω + r_c × m (a_c − g) + Σ (M_child + r_child × F_child); a coordinate's
    moment is M along its axis.
    """
    poses = forward_kinematics(geometry, q, inclination)
    force, moment = segment_loads(poses, rates(poses, qd, qdd), inertias, gravity)
    coordinate_moment = np.empty((len(q), len(COORDINATES) - 3))
    for i in reversed(range(len(JOINTS))):
        for name, _ in JOINTS[i].rotations:
            c = COORDINATE[name]
            coordinate_moment[:, c - 3] = np.sum(poses.axes[:, c] * moment[:, i], axis=1)
        p = PARENT[i]
        if p >= 0:
            arm = poses.origin[:, i] - poses.origin[:, p]
            moment[:, p] += moment[:, i] + cross(arm, force[:, i])
            force[:, p] += force[:, i]
    return force, coordinate_moment
