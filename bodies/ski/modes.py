"""Small vibrations of a ski held at the boot centre: the reduced model's ski, and the time constant of its damping.

The model is a spatial frame of straight Timoshenko elements along the nodes of a ``BeamMesh``.  It includes camber and
shovel: a raised shovel slows twisting by several per cent.  Coordinates at a node: displacement (3), small rotation
(3), in the ski's frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.core.frames import Array

_DAMPED: Final = 2
"""Number of slowest vibrations at whose mean frequency the ski's damping ratio is met."""
_GIVING: Final = (2, 4)
"""Coordinates of the node at the boot centre that are on springs where what holds it gives: up and pitch."""


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
    held: Array
    """(k, 2) m, rad: how far the held node rises and pitches, > 0 tip down, a unit of the mode; zero where fixed"""
    rigid: Array
    """(6, 6) mass matrix of the ski that moves as one with the held node: kg, kg m, kg m²"""


@lru_cache(maxsize=16)  # as ``mesh``: an estimate asks for those of one ski again and again
def modal_ski(mesh: BeamMesh, modes: int = 12, give: tuple[float, float] | None = None) -> ModalSki:
    """Compute the ``modes`` slowest vibrations: bending up and down, sideways, and twisting.

    give : N/m, N m/rad of the springs that hold the boot centre up and in pitch; None where it is held fast.
        ``damping_ratio`` treats the springs as the ski's material: it gives a spring k a damper ``damping_time``·k.

    Raises ValueError when the mesh has fewer.
    """
    stiffness, mass = frame_matrices(mesh)
    free = _free(mesh)
    if give is not None:
        springs = 6 * mesh.clamped + np.array(_GIVING)
        stiffness[springs, springs] += np.array(give)
        free = np.sort(np.concatenate([free, springs]))
    if not 0 < modes <= len(free):
        raise ValueError(f"the mesh has {len(free)} modes")
    most = max(modes, _DAMPED)
    squares, vectors = eigh(stiffness[np.ix_(free, free)], mass[np.ix_(free, free)], subset_by_index=[0, most - 1])
    shape = np.zeros((modes, len(mass)))
    shape[:, free] = vectors.T[:modes]
    omega = np.sqrt(squares[:modes])
    nodal, rigid = shape.reshape(modes, -1, 6), _rigid_motions(mesh)
    tau = _damping_time(mesh, squares) if give is None else damping_time(mesh)
    return ModalSki(
        frequency=omega / (2.0 * np.pi),
        damping_ratio=0.5 * tau * omega,
        shape=nodal,
        contact_shape=_contact_shape(mesh, nodal),
        participation=shape @ mass @ rigid,
        held=nodal[:, mesh.clamped, list(_GIVING)],
        rigid=rigid.T @ mass @ rigid,
    )


@lru_cache(maxsize=16)
def damping_time(mesh: BeamMesh) -> float:
    """Return the time constant τ (s) of viscous damping in proportion to stiffness, D = τK, so that ζ = τω/2.

    The ski's damping ratio is met at the mean of the two slowest vibrations of the ski held at the boot centre: the
    first bending of its front and of its back.
    """
    stiffness, mass = frame_matrices(mesh)
    held = np.ix_(_free(mesh), _free(mesh))
    squares = eigh(stiffness[held], mass[held], eigvals_only=True, subset_by_index=[0, _DAMPED - 1])
    return _damping_time(mesh, squares)


def _damping_time(mesh: BeamMesh, squares: Array) -> float:
    """Return τ (s) from the squares of the slowest vibrations' angular frequencies (rad²/s²)."""
    return 2.0 * mesh.ski.damping_ratio / float(np.mean(np.sqrt(squares[:_DAMPED])))


def _free(mesh: BeamMesh) -> NDArray[np.int64]:
    """Return the indices of the coordinates that the binding does not hold."""
    return np.delete(np.arange(6 * len(mesh.node_s)), np.arange(6 * mesh.clamped, 6 * mesh.clamped + 6))


def frame_matrices(mesh: BeamMesh) -> tuple[Array, Array]:
    """Return stiffness and consistent mass (6(n + 1), 6(n + 1)) of the free ski."""
    along = np.diff(mesh.node_position, axis=0) / mesh.element_length[:, None]
    left = np.broadcast_to([0.0, 1.0, 0.0], along.shape)  # over a straight line: no sideways curve
    axes = np.stack([along, left, np.cross(along, left)], axis=1)
    return (
        _assembled(axes, _element_stiffness(mesh.element_length, mesh.stiffness)),
        _assembled(axes, _element_mass(mesh.element_length, mesh.element_mass, mesh.section_inertia)),
    )


def _assembled(axes: Array, elements: Array) -> Array:
    """Assemble (6(n + 1), 6(n + 1)) in the ski's frame from element matrices (n, 12, 12) in own axes (n, 3, 3)."""
    count = len(elements)
    turned = np.einsum("eia,epiqj,ejb->epaqb", axes, elements.reshape(count, 4, 3, 4, 3), axes, optimize=True)
    matrix = np.zeros((6 * count + 6, 6 * count + 6))
    for e, element in enumerate(turned.reshape(count, 12, 12)):
        matrix[6 * e : 6 * e + 12, 6 * e : 6 * e + 12] += element
    return matrix


_AXIAL, _TORSION = [0, 6], [3, 9]
_UP = [2, 4, 8, 10]  # w and rotation about y at both ends
_SIDE = [1, 5, 7, 11]  # v and rotation about z
_SLOPE_DOWN = np.outer([1.0, -1.0, 1.0, -1.0], [1.0, -1.0, 1.0, -1.0])  # rotation about y is −dw/dx


def _element_stiffness(length: Array, section: Array) -> Array:
    """Return (n, 12, 12) in the elements' own axes, x along them, for the sections (EA, GA_y, GA_z, GJ, EI_y, EI_z)."""
    axial, shear_y, shear_z, torsion, bend_y, bend_z = section.T
    rod = np.array([[1.0, -1.0], [-1.0, 1.0]]) / length[:, None, None]
    return _element(
        axial[:, None, None] * rod,
        torsion[:, None, None] * rod,
        _bending_stiffness(length, bend_y, shear_z),
        _bending_stiffness(length, bend_z, shear_y),
    )


def _element_mass(length: Array, mass: Array, inertia: Array) -> Array:
    """Return the mass (n, 12, 12) consistent with linear shapes along and about the axis and cubic ones across it."""
    rod = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    return _element(
        mass[:, None, None] * rod,
        (inertia[:, 0] * length)[:, None, None] * rod,
        _bending_mass(length, mass, inertia[:, 1]),
        _bending_mass(length, mass, inertia[:, 2]),
    )


def _element(axial: Array, torsion: Array, up: Array, side: Array) -> Array:
    """Assemble (n, 12, 12) from its parts (n, 2, 2) along and about the axis and (n, 4, 4) up and sideways."""
    matrix = np.zeros((len(axial), 12, 12))
    for places, part in ((_AXIAL, axial), (_TORSION, torsion), (_UP, _SLOPE_DOWN * up), (_SIDE, side)):
        matrix[:, np.array(places)[:, None], places] = part
    return matrix


def _bending_stiffness(length: Array, bending: Array, shear: Array) -> Array:
    """Return the stiffness (n, 4, 4) over (w, dw/dx) at both ends: exact for a uniform element loaded at its ends.

    Przemieniecki, "Theory of Matrix Structural Analysis" (1968), 5.6, with Φ = 12 EI/(κGA L²).
    """
    phi = 12.0 * bending / (shear * length**2)
    a, b, c, d = np.full_like(length, 12.0), 6.0 * length, (4.0 + phi) * length**2, (2.0 - phi) * length**2
    rows = np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])
    return np.moveaxis(bending / ((1.0 + phi) * length**3) * rows, -1, 0)


def _bending_mass(length: Array, mass: Array, rotary: Array) -> Array:
    """Return the mass (n, 4, 4) over (w, dw/dx) at both ends for cubic shapes, with sectional rotary inertia (kg m).

    Przemieniecki (1968), 11.3, without the shear terms.
    """
    one, m = np.ones_like(length), length
    lift = np.array(
        [
            [156.0 * one, 22.0 * m, 54.0 * one, -13.0 * m],
            [22.0 * m, 4.0 * m**2, 13.0 * m, -3.0 * m**2],
            [54.0 * one, 13.0 * m, 156.0 * one, -22.0 * m],
            [-13.0 * m, -3.0 * m**2, -22.0 * m, 4.0 * m**2],
        ]
    )
    turn = np.array(
        [
            [36.0 * one, 3.0 * m, -36.0 * one, 3.0 * m],
            [3.0 * m, 4.0 * m**2, -3.0 * m, -(m**2)],
            [-36.0 * one, -3.0 * m, 36.0 * one, -3.0 * m],
            [3.0 * m, -(m**2), -3.0 * m, 4.0 * m**2],
        ]
    )
    return np.moveaxis(mass / 420.0 * lift + rotary / (30.0 * m) * turn, -1, 0)


def _rigid_motions(mesh: BeamMesh) -> Array:
    """Return node coordinates (6(n + 1), 6) of unit translations and of unit rotations about the boot centre's node."""
    arm = mesh.node_position - mesh.node_position[mesh.clamped]
    field = np.zeros((len(arm), 6, 6))
    for axis, unit in enumerate(np.eye(3)):
        field[:, :3, axis] = unit
        field[:, :3, 3 + axis] = np.cross(unit, arm)
        field[:, 3:, 3 + axis] = unit
    return field.reshape(-1, 6)


def edge_turning(mesh: BeamMesh, ski: ModalSki) -> Array:
    """Return the change (k, m, 2, 3) of ``BeamMesh.edge_tangents`` a unit of each mode.

    The sections turn, and an edge that lies aside of the axis rises or falls along a ski that twists.
    """
    pair = np.stack([mesh.contact_element, mesh.contact_element + 1], axis=1)
    weight = np.stack([1.0 - mesh.contact_weight, mesh.contact_weight], axis=1)
    turns = ski.shape[:, pair, 3:]
    turned = np.einsum("mk,cmki->cmi", weight, turns)
    rate = (turns[:, :, 1] - turns[:, :, 0]) / mesh.element_length[mesh.contact_element, None]
    half = 0.5 * mesh.ski.width(mesh.contact_s)
    aside = half[:, None, None] * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    return np.asarray(np.cross(turned[:, :, None], mesh.edge_tangents) + np.cross(rate[:, :, None], aside))


def _contact_shape(mesh: BeamMesh, nodal: Array) -> Array:
    """Return the displacement of the contact points: the derivative of ``BeamMesh.contact_positions``."""
    pair = np.stack([mesh.contact_element, mesh.contact_element + 1], axis=1)
    weight = np.stack([1.0 - mesh.contact_weight, mesh.contact_weight], axis=1)
    arms = np.einsum("mkij,mekj->mkei", mesh.node_rotation[pair], mesh.contact_offset)
    moved = nodal[:, pair, None, :3] + np.cross(nodal[:, pair, None, 3:], arms)
    result: Array = np.einsum("mk,cmkei->cmei", weight, moved)
    return result
