"""A ski's edges as the kernels take them, and the kernels of snow that edges cut."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sssi_exudyn.bodies.ski.mesh import BeamMesh
from sssi_exudyn.bodies.ski.modes import ModalSki, edge_turning
from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.simulation.assembly import CUTTING_POINTS
from sssi_exudyn.simulation.reduced import (
    air_tangents,
    carved_steps_kernel,
    carved_tangents_kernel,
    heading_tangents,
    newmark,
)
from sssi_exudyn.simulation.ski_on_snow import backward_differences, edge_point, heading_kernel, point
from sssi_exudyn.simulation.ski_on_snow import edge as edge_kernel
from sssi_exudyn.simulation.ski_on_snow import groove as groove_kernel
from sssi_exudyn.simulation.ski_on_snow import ground as ground_kernel
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeSki
from sssi_exudyn.simulation.turns import turn_kernel

MODES: Final = 20
"""Vibrations of the ski that are kept; 40 change the radius by 0.2 % where 12 change it by 7 %."""
POINTS: Final = CUTTING_POINTS


def bending_edges(cut: BeamMesh, modal: ModalSki) -> EdgeSki:
    """Return the same of a ski whose vibrations are known."""
    ski = cut.ski
    points, tangents = cut.contact_positions(cut.node_position, cut.node_rotation), cut.edge_tangents
    heave, pitch = modal.held.T[..., None, None, None]
    left, up = np.eye(3)[1:]
    shape = modal.contact_shape - heave * up - pitch * np.cross(left, points - cut.node_position[cut.clamped])
    turning = edge_turning(cut, modal) - pitch * np.cross(left, tangents)
    return EdgeSki(
        points=np.ascontiguousarray(points),
        tangents=np.ascontiguousarray(tangents),
        shape=np.ascontiguousarray(np.moveaxis(shape, 0, 3)),
        turning=np.ascontiguousarray(np.moveaxis(turning, 0, 3)),
        give=np.ascontiguousarray(modal.held.T),
        width=ski.width(cut.contact_s),
        length=cut.contact_length,
        station=ski.x_of_s(cut.contact_s),
        omega=2.0 * np.pi * modal.frequency,
        ratio=modal.damping_ratio,
    )


def carving_module() -> Any:
    """Return the compiled functions of skis on snow that edges cut, alone and under a skier: those that are called."""
    return compile_kernel(
        point,
        edge_point,
        newmark,
        backward_differences,
        ground_kernel,
        groove_kernel,
        heading_kernel,
        edge_kernel,
        turn_kernel,
        carved_steps_kernel,
        air_tangents,
        heading_tangents,
        carved_tangents_kernel,
    )
