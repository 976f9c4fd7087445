"""Small vibrations of a ski held at its middle node: the reduced model's ski, and the time constant of its damping.

Bending up and down (Timoshenko elements, exact for end loads) and twisting about the long axis, on the elements of a
``BeamMesh``; the running surface's rise at the tip and tail is left out, as it couples them only at second order.
Held in the middle, the halves before and behind the boot vibrate each by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from sssi_exudyn.bodies.ski_mesh import BeamMesh
from sssi_exudyn.frames import Array

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class ModalSki:
    """k free vibrations of the ski, held at its middle node, each scaled to a modal mass of 1 kg."""

    frequency: Array
    """(k,) Hz, rising"""
    damping_ratio: Array
    """(k,) of critical: in proportion to frequency, as the beam's rotational dampers give it"""
    lift: Array
    """(k, m) upward displacement at the contact sections, m a unit of the mode"""
    twist: Array
    """(k, m) rotation about x (forward; left edge up) at the contact sections, rad a unit of the mode"""
    tips: Array
    """(k, 2) upward displacement of tip and tail, m a unit of the mode"""
    participation: Array
    """(k, 3) ∫ φ·(rigid field) dm about the middle node, for the base's accelerations a_z (kg m), α_x and α_y (kg m²):
    the mode's equation is q̈ + 2ζω q̇ + ω² q = modal force − participation · (a_z, α_x, α_y)"""


def modal_ski(mesh: BeamMesh, modes: int = 8) -> ModalSki:
    """The ``modes`` slowest vibrations, bending and twisting of both halves together."""
    found: list[tuple[Array, ...]] = []
    for half in _halves(mesh):
        found += [_bending(mesh, half, modes), _torsion(mesh, half, modes)]
    omega, lift, twist, tips, participation = (np.concatenate(parts) for parts in zip(*found, strict=True))
    if modes > len(omega):
        raise ValueError(f"the mesh has {len(omega)} modes")
    order = np.argsort(omega)[:modes]
    return ModalSki(
        frequency=omega[order] / (2.0 * np.pi),
        damping_ratio=0.5 * damping_time(mesh) * omega[order],
        lift=lift[order],
        twist=twist[order],
        tips=tips[order],
        participation=participation[order],
    )


def damping_time(mesh: BeamMesh) -> float:
    """Time constant τ (s) of viscous damping in proportion to stiffness, D = τK, so that ζ = τω/2.

    The ski's damping ratio is met at the mean of both halves' first bending frequencies.
    """
    first = [_bending(mesh, half, 1)[0][0] for half in _halves(mesh)]
    return 2.0 * mesh.ski.damping_ratio / float(np.mean(first))


def _halves(mesh: BeamMesh) -> list[Indices]:
    """Element indices of the half in front and the half behind, each counted outwards from the middle."""
    n = len(mesh.element_length)
    return [np.arange(mesh.middle, n, dtype=np.int64), np.arange(mesh.middle - 1, -1, -1, dtype=np.int64)]


def _bending(mesh: BeamMesh, half: Indices, modes: int) -> tuple[Array, ...]:
    """Circular frequencies and fields of one half's bending, in (upward displacement, slope dw/dx) at each node.

    The coordinate along a half is the straight distance from the middle node, outwards.
    """
    outwards = 1.0 if half[0] == mesh.middle else -1.0
    n = len(half)
    stiffness, mass = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    for i, e in enumerate(half):
        place = slice(2 * i, 2 * i + 4)
        length, bending, shear = mesh.element_length[e], mesh.stiffness[e, 4], mesh.stiffness[e, 2]
        stiffness[place, place] += _timoshenko_stiffness(length, bending, shear)
        mass[place, place] += _hermite_mass(length, mesh.element_mass[e], mesh.section_inertia[e, 1])
    omega, shape = _clamped_modes(stiffness, mass, 2, modes)
    count = len(omega)
    nodes = np.concatenate([[half[0] + (outwards < 0)], half + (outwards > 0)])
    arm = np.abs(mesh.node_position[nodes, 0] - mesh.node_position[mesh.middle, 0])
    rigid_lift, rigid_pitch = np.zeros(2 * n + 2), np.zeros(2 * n + 2)
    rigid_lift[0::2] = 1.0
    rigid_pitch[0::2], rigid_pitch[1::2] = -outwards * arm, -outwards  # z = −α_y·x
    participation = np.zeros((count, 3))
    participation[:, 0], participation[:, 2] = shape.T @ mass @ rigid_lift, shape.T @ mass @ rigid_pitch
    lift = np.zeros((count, len(mesh.contact_s)))
    for i, e in enumerate(half):
        for p in np.flatnonzero(mesh.contact_element == e):
            xi = mesh.contact_weight[p] if outwards > 0 else 1.0 - mesh.contact_weight[p]
            lift[:, p] = _hermite(xi, mesh.element_length[e]) @ shape[2 * i : 2 * i + 4]
    tips = np.zeros((count, 2))
    tips[:, 0 if outwards > 0 else 1] = shape[-2]
    return omega, lift, np.zeros_like(lift), tips, participation


def _torsion(mesh: BeamMesh, half: Indices, modes: int) -> tuple[Array, ...]:
    """Circular frequencies and fields of one half's twisting."""
    n = len(half)
    stiffness, mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for i, e in enumerate(half):
        place = slice(i, i + 2)
        length = mesh.element_length[e]
        stiffness[place, place] += mesh.stiffness[e, 3] / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
        mass[place, place] += mesh.section_inertia[e, 0] * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    omega, shape = _clamped_modes(stiffness, mass, 1, modes)
    count = len(omega)
    participation = np.zeros((count, 3))
    participation[:, 1] = shape.T @ mass @ np.ones(n + 1)
    twist = np.zeros((count, len(mesh.contact_s)))
    for i, e in enumerate(half):
        for p in np.flatnonzero(mesh.contact_element == e):
            xi = mesh.contact_weight[p] if half[0] == mesh.middle else 1.0 - mesh.contact_weight[p]
            twist[:, p] = (1.0 - xi) * shape[i] + xi * shape[i + 1]
    return omega, np.zeros_like(twist), twist, np.zeros((count, 2)), participation


def _clamped_modes(stiffness: Array, mass: Array, held: int, modes: int) -> tuple[Array, Array]:
    """Lowest circular frequencies (rad/s) and mass-normalised shapes with the first ``held`` coordinates fixed."""
    count = min(modes, len(mass) - held)
    squares, free = eigh(stiffness[held:, held:], mass[held:, held:], subset_by_index=[0, count - 1])
    return np.sqrt(squares), np.vstack([np.zeros((held, count)), free])


def _timoshenko_stiffness(length: float, bending: float, shear: float) -> Array:
    """Stiffness over (w, w') at both ends: exact for a uniform element loaded at its ends.

    Przemieniecki, "Theory of Matrix Structural Analysis" (1968), 5.6, with Φ = 12 EI/(κGA L²).
    """
    phi = 12.0 * bending / (shear * length**2)
    a, b, c, d = 12.0, 6.0 * length, (4.0 + phi) * length**2, (2.0 - phi) * length**2
    rows = np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])
    return bending / ((1.0 + phi) * length**3) * rows


def _hermite_mass(length: float, mass: float, rotary: float) -> Array:
    """Consistent mass over (w, w') at both ends for cubic shapes, with the sections' rotary inertia (kg m)."""
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


def _hermite(xi: float, length: float) -> Array:
    """Cubic shape functions at ξ (0 to 1) over (w, w') at both ends: (4,)."""
    return np.array(
        [
            1.0 - 3.0 * xi**2 + 2.0 * xi**3,
            length * (xi - 2.0 * xi**2 + xi**3),
            3.0 * xi**2 - 2.0 * xi**3,
            length * (xi**3 - xi**2),
        ]
    )
