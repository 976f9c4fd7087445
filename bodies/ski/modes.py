"""Small vibrations of a ski held at the boot centre: the reduced model's ski, and the time constant of its damping.

A spatial frame of straight Timoshenko elements along the nodes of a ``BeamMesh``, so that camber and shovel are in it:
a raised shovel slows twisting by several per cent.  Coordinates at a node: displacement (3), small rotation (3), in the
ski's frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag, eigh

from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class ModalSki:
    """k free vibrations of the ski, held at the boot centre, each scaled to a modal mass of 1 kg.

    With the held node accelerating by a (m/s², gravity taken off) and turning by α (rad/s²), in the ski's frame:
    q̈ + 2ζω q̇ + ω² q = Σ shape · force − participation · (a, α)
    """

    frequency: Array
    """(k,) Hz, rising"""
    damping_ratio: Array
    """(k,) of critical: in proportion to frequency, as the beam's rotational dampers give it"""
    shape: Array
    """(k, n + 1, 6) displacement and rotation of the nodes, a unit of the mode"""
    contact_shape: Array
    """(k, m, 2, 3) displacement of the contact points by edge (left, right), a unit of the mode"""
    participation: Array
    """(k, 6) mode's mass coupling with translation (kg) and rotation about the held node (kg m)"""


def modal_ski(mesh: BeamMesh, modes: int = 12) -> ModalSki:
    """The ``modes`` slowest vibrations: bending up and down, sideways, and twisting.

    Raises ValueError when the mesh has fewer.
    """
    stiffness, mass = frame_matrices(mesh)
    free = np.delete(np.arange(len(mass)), np.arange(6 * mesh.clamped, 6 * mesh.clamped + 6))
    if not 0 < modes <= len(free):
        raise ValueError(f"the mesh has {len(free)} modes")
    squares, vectors = eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)], subset_by_index=[0, modes - 1])
    shape = np.zeros((modes, len(mass)))
    shape[:, free] = vectors.T
    omega = np.sqrt(squares)
    nodal = shape.reshape(modes, -1, 6)
    return ModalSki(
        frequency=omega / (2.0 * np.pi),
        damping_ratio=0.5 * damping_time(mesh) * omega,
        shape=nodal,
        contact_shape=_contact_shape(mesh, nodal),
        participation=shape @ mass @ _rigid_motions(mesh),
    )


def damping_time(mesh: BeamMesh) -> float:
    """Time constant τ (s) of viscous damping in proportion to stiffness, D = τK, so that ζ = τω/2.

    The ski's damping ratio is met at the mean of the two slowest vibrations of the ski held at the boot centre: the
    first bending of its front and of its back.
    """
    stiffness, mass = frame_matrices(mesh)
    free = np.delete(np.arange(len(mass)), np.arange(6 * mesh.clamped, 6 * mesh.clamped + 6))
    squares = eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)], eigvals_only=True, subset_by_index=[0, 1])
    return 2.0 * mesh.ski.damping_ratio / float(np.mean(np.sqrt(squares)))


def frame_matrices(mesh: BeamMesh) -> tuple[Array, Array]:
    """Stiffness and consistent mass (6(n + 1), 6(n + 1)) of the free ski."""
    size = 6 * len(mesh.node_s)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for e, length in enumerate(mesh.element_length):
        along = (mesh.node_position[e + 1] - mesh.node_position[e]) / length
        left = np.array([0.0, 1.0, 0.0])  # the running surface lies over a straight line: no sideways curve
        axes = np.stack([along, left, np.cross(along, left)])
        turn = block_diag(axes, axes, axes, axes)
        place = slice(6 * e, 6 * e + 12)
        stiffness[place, place] += turn.T @ _element_stiffness(length, mesh.stiffness[e]) @ turn
        mass[place, place] += turn.T @ _element_mass(length, mesh.element_mass[e], mesh.section_inertia[e]) @ turn
    return stiffness, mass


_UP = np.array([2, 4, 8, 10])  # w and rotation about y at both ends
_SIDE = np.array([1, 5, 7, 11])  # v and rotation about z
_SLOPE_DOWN = np.diag([1.0, -1.0, 1.0, -1.0])  # rotation about y is −dw/dx


def _element_stiffness(length: float, section: Array) -> Array:
    """(12, 12) in the element's own axes, x along it, for the section (EA, GA_y, GA_z, GJ, EI_y, EI_z)."""
    axial, shear_y, shear_z, torsion, bend_y, bend_z = section
    matrix = np.zeros((12, 12))
    rod = np.array([[1.0, -1.0], [-1.0, 1.0]]) / length
    matrix[np.ix_([0, 6], [0, 6])] = axial * rod
    matrix[np.ix_([3, 9], [3, 9])] = torsion * rod
    matrix[np.ix_(_UP, _UP)] = _SLOPE_DOWN @ _bending_stiffness(length, bend_y, shear_z) @ _SLOPE_DOWN
    matrix[np.ix_(_SIDE, _SIDE)] = _bending_stiffness(length, bend_z, shear_y)
    return matrix


def _element_mass(length: float, mass: float, inertia: Array) -> Array:
    """(12, 12) consistent with linear shapes along and about the axis and cubic ones across it."""
    matrix = np.zeros((12, 12))
    rod = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    matrix[np.ix_([0, 6], [0, 6])] = mass * rod
    matrix[np.ix_([3, 9], [3, 9])] = inertia[0] * length * rod
    matrix[np.ix_(_UP, _UP)] = _SLOPE_DOWN @ _bending_mass(length, mass, inertia[1]) @ _SLOPE_DOWN
    matrix[np.ix_(_SIDE, _SIDE)] = _bending_mass(length, mass, inertia[2])
    return matrix


def _bending_stiffness(length: float, bending: float, shear: float) -> Array:
    """Stiffness over (w, dw/dx) at both ends: exact for a uniform element loaded at its ends.

    Przemieniecki, "Theory of Matrix Structural Analysis" (1968), 5.6, with Φ = 12 EI/(κGA L²).
    """
    phi = 12.0 * bending / (shear * length**2)
    a, b, c, d = 12.0, 6.0 * length, (4.0 + phi) * length**2, (2.0 - phi) * length**2
    rows = np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])
    return bending / ((1.0 + phi) * length**3) * rows


def _bending_mass(length: float, mass: float, rotary: float) -> Array:
    """Mass over (w, dw/dx) at both ends for cubic shapes, with the sections' rotary inertia (kg m).

    Przemieniecki (1968), 11.3, without the shear terms.
    """
    m = length
    lift = np.array(
        [
            [156.0, 22.0 * m, 54.0, -13.0 * m],
            [22.0 * m, 4.0 * m**2, 13.0 * m, -3.0 * m**2],
            [54.0, 13.0 * m, 156.0, -22.0 * m],
            [-13.0 * m, -3.0 * m**2, -22.0 * m, 4.0 * m**2],
        ]
    )
    turn = np.array(
        [
            [36.0, 3.0 * m, -36.0, 3.0 * m],
            [3.0 * m, 4.0 * m**2, -3.0 * m, -(m**2)],
            [-36.0, -3.0 * m, 36.0, -3.0 * m],
            [3.0 * m, -(m**2), -3.0 * m, 4.0 * m**2],
        ]
    )
    result: Array = mass / 420.0 * lift + rotary / (30.0 * m) * turn
    return result


def _rigid_motions(mesh: BeamMesh) -> Array:
    """(6(n + 1), 6) node coordinates of unit translations and of unit rotations about the node at the boot centre."""
    arm = mesh.node_position - mesh.node_position[mesh.clamped]
    field = np.zeros((len(arm), 6, 6))
    for axis, unit in enumerate(np.eye(3)):
        field[:, :3, axis] = unit
        field[:, :3, 3 + axis] = np.cross(unit, arm)
        field[:, 3:, 3 + axis] = unit
    return field.reshape(-1, 6)


def _contact_shape(mesh: BeamMesh, nodal: Array) -> Array:
    """Displacement of the contact points: the derivative of ``BeamMesh.contact_positions``."""
    pair = np.stack([mesh.contact_element, mesh.contact_element + 1], axis=1)
    weight = np.stack([1.0 - mesh.contact_weight, mesh.contact_weight], axis=1)
    arms = np.einsum("mkij,mekj->mkei", mesh.node_rotation[pair], mesh.contact_offset)
    moved = nodal[:, pair, None, :3] + np.cross(nodal[:, pair, None, 3:], arms)
    result: Array = np.einsum("mk,cmkei->cmei", weight, moved)
    return result
