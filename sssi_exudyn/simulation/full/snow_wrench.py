"""Force and moment of the snow on each ski, found from the generalised forces on the skis' nodes.

A pass of the forces puts on the nodes of a ski the snow's forces, the structural damping, which has no resultant, and
weight and inertia but for the pelvis' own acceleration.  Weight and inertia follow from the states alone; what remains
is the snow's.
"""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.posture_table import PostureTable


def torque_on_quaternion(quaternion: Array, general: Array) -> Array:
    """Return the torque (…, 3) N m that acts on unit quaternions (…, 4) as the generalised force (…, 4).

    A torque τ acts as g = 2 Eᵀ τ, so τ = ½ E g; the part of g along the quaternion itself, the norm's, drops out.
    """
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    matrix = np.stack([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])  # E(q)
    return np.asarray(0.5 * np.einsum("ij...,...j->...i", matrix, general))


def wrench_on_nodes(general: Array, coordinates: Array) -> Array:
    """Return (t, 2, 6) N and N m: resultant of the generalised forces on each ski's nodes about the foot's place.

    Parameters
    ----------
    general, coordinates : (t, 2·7·(n + 1)) of both skis' nodes at t instants, in the frames of their feet
    """
    shape = len(general), 2, general.shape[1] // (2 * NODE), NODE
    forces, nodes = general.reshape(shape), coordinates.reshape(shape)
    torque = torque_on_quaternion(nodes[..., 3:], forces[..., 3:])
    moment = np.sum(cross(nodes[..., :3], forces[..., :3]) + torque, axis=2)
    return np.concatenate([forces[..., :3].sum(axis=2), moment], axis=-1)


def weight_and_inertia(
    posture: PostureTable, nodes: Array, rates: Array, mass: tuple[Array, Array], gravity: Array
) -> Array:
    """Return (n, 2, 6) N and N m: weight and forces of inertia of the skis about the feet's places, in their frames.

    The pelvis' own acceleration is left out, as in ``forces_kernel.ski_inertia``.

    Parameters
    ----------
    posture : at the n instants
    nodes, rates : (n, 2, k, 3) m, m/s of the nodes in the feet's frames
    mass : (k,) kg and (k, 3) kg m² of a ski's nodes
    gravity : (3,) m/s² in the slope frame
    """
    kilograms, moment = mass
    into = np.swapaxes(posture.foot_rotation, -1, -2)
    fall, spin, spin_rate = (
        np.einsum("nsij,nsj->nsi", into, vector)[:, :, None]
        for vector in (gravity - posture.foot_acceleration, posture.foot_spin, posture.foot_spin_rate)
    )
    swing = cross(spin, cross(spin, nodes) + 2.0 * rates)
    force = kilograms[:, None] * (fall - cross(spin_rate, nodes) - swing)
    torque = -moment * spin_rate - cross(spin, moment * spin)
    return np.concatenate([force.sum(axis=2), np.sum(cross(nodes, force) + torque, axis=2)], axis=-1)
