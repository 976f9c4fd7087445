"""The forces of poles, which act at the hands and not on the centre of mass.

A skier whose posture is prescribed moves the same wherever a force acts on him.  The place of the force changes the
moments of his joints, the moment about his pelvis and the force's power.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssi_exudyn.bodies.skier.anthropometry import GRIP
from sssi_exudyn.bodies.skier.chain import HANDS, jacobians
from sssi_exudyn.contact.maths import ArrayMath
from sssi_exudyn.contact.term import BodyState, BodyTerm, Term, hand_forces
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.motion.motion import Motion, relative_poses


@dataclass(frozen=True)
class Hands:
    """Both hands, left and right, where they grip the poles, at n instants, relative to the pelvis, slope frame.

    place, velocity : (n, 2, 3) m, m/s;  jacobian : (n, 2, 3, 28) m/rad by each prescribed coordinate
    """

    place: Array
    velocity: Array
    jacobian: Array


def use_poles(terms: Sequence[Term]) -> bool:
    """Return whether a force acts at a hand."""
    return any(isinstance(term, BodyTerm) and any(term.at_hands()) for term in terms)


def hands_at(motion: Motion, time: Array) -> Hands:
    """Return the hands of a posture at ``time`` (n,) s."""
    poses, moving = relative_poses(motion, time)
    grips = np.stack([GRIP * motion.geometry.segment_end[hand] for hand in HANDS])
    at = list(HANDS)
    arm = np.einsum("nkij,kj->nki", poses.rotation[:, at], grips)
    place = poses.origin[:, at] + arm
    velocity = moving.velocity[:, at] + cross(moving.angular_velocity[:, at], arm)
    return Hands(place, velocity, jacobians(poses, at, place)[1][..., 3:])


def pole_forces(terms: Sequence[Term], time: Array, com: Array, com_velocity: Array) -> Array:
    """Return the forces (n, 2, 3) N of the poles on the hands.

    The centre of mass is at ``com`` (n, 3) m with ``com_velocity`` (n, 3) m/s.
    """
    state = BodyState(time, com[:, 0], com[:, 1], tuple(com_velocity.T))
    forces = np.zeros((len(time), 2, 3))
    for hand, force in enumerate(hand_forces(ArrayMath(), terms, state)):
        for axis, part in enumerate(force):
            forces[:, hand, axis] = part
    return forces
