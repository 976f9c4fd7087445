"""Where a ski touches the snow, and how its mass is lumped: what all force back ends are given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class Sections:
    """Contact sections and lumped masses of a ski, the same for both skis.

    element, share, length : (m,) element index, share of the way to its second node, length of edge (m)
    offset : (m, 2, 3) left and right edge in the section's frame, m
    damping : (n, 3) structural damping of each element against relative spin about its own axes, N m s
    node_mass, node_moment : (n + 1,) kg and (n + 1, 3) kg m² of each node, about the foot's axes
    """

    element: Any
    share: Array
    offset: Array
    length: Array
    damping: Array
    node_mass: Array
    node_moment: Array
