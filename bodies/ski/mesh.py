"""A ski cut into beam elements and contact points: numbers only, in the ski's own frame.

The ski's frame: x forward from the boot centre, y left, z up from the straight line on which the unloaded ski rests.
The beam's axis is taken on the running surface: its distance from the mid-plane (9 mm at most) is neglected.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.ski import Ski, integrate_pieces
from sssi_exudyn.core.frames import Array

CONTACTS: Final = 50
"""Contact points on each edge (paper 2.2.3)."""

_SHOVEL: Final = 0.2
"""Share of the ski at its tip where a cutting edge enters the snow, and reaches its depth within 0.1 m."""
_SHOVEL_POINTS: Final = 0.4
"""Share of the contact points that lie there on a ski that cuts."""


@dataclass(frozen=True, eq=False)  # hashed by its identity: what follows from it is computed once
class BeamMesh:
    """n elements between n + 1 nodes from tail to tip, and m contact points on each edge."""

    ski: Ski
    node_s: Array
    """(n + 1,) places of the nodes along the ski, 0 to 1"""
    node_position: Array
    """(n + 1, 3) m, unloaded"""
    node_rotation: Array
    """(n + 1, 3, 3) section frames unloaded: x along the running surface, y left"""
    element_length: Array
    """(n,) m, the distance of its nodes"""
    element_mass: Array
    """(n,) kg"""
    section_inertia: Array
    """(n, 3) kg m: the section's moments of inertia a metre about its own x, y, z"""
    stiffness: Array
    """(n, 6): EA, GA_y, GA_z (N), GJ, EI_y (up and down), EI_z (sideways) (N m²)"""
    contact_s: Array
    """(m,) places of the contact points along the ski, 0 to 1"""
    contact_element: NDArray[np.int64]
    """(m,) index of the element it lies in"""
    contact_weight: Array
    """(m,) share of the element's second node, 0 to 1"""
    contact_offset: Array
    """(m, 2, 2, 3) m: point, edge (left, right), node (first, second), components in that node's frame"""
    contact_length: Array
    """(m,) m of edge that a point stands for"""

    @property
    def clamped(self) -> int:
        """Index of the node at the boot centre, which the binding holds."""
        return int(np.argmin(np.abs(self.node_position[:, 0])))

    @property
    def edge_tangents(self) -> Array:
        """Unit vectors (m, 2, 3) forward along the edges (left, right) at the contact points, unloaded.

        The sidecut turns an edge by half the change of the width along the ski.
        """
        ski, s = self.ski, self.contact_s
        rise, widening = ski.height.slope(s) / ski.length, ski.width.slope(s) / ski.length
        pitch = np.arctan(rise)
        forward = np.stack([np.cos(pitch), np.zeros_like(s), np.sin(pitch)], axis=1)
        sideways = 0.5 * widening[:, None, None] * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
        along = forward[:, None] + sideways
        return np.asarray(along / np.linalg.norm(along, axis=2, keepdims=True))

    def contact_positions(self, position: Array, rotation: Array) -> Array:
        """Return where the contact points are, (m, 2, 3) m by edge.

        ``position`` (n + 1, 3) m and ``rotation`` (n + 1, 3, 3) are those of the nodes.

        A place is Σ over the element's two nodes of weight · (position + frame · offset).  Its derivative hands a force
        on the point to the nodes by the same weights, so the work of forces is exact.
        """
        pair = np.stack([self.contact_element, self.contact_element + 1], axis=1)
        weight = np.stack([1.0 - self.contact_weight, self.contact_weight], axis=1)
        arms = np.einsum("mkij,mekj->meki", rotation[pair], self.contact_offset)
        result: Array = np.einsum("mk,meki->mei", weight, position[pair][:, None] + arms)
        return result


@lru_cache(maxsize=16)  # an estimate asks a hundred times for that of one ski
def mesh(ski: Ski, elements: int = 50, contacts: int = CONTACTS, *, cutting: bool = False) -> BeamMesh:
    """Cut a ski into ``elements`` pieces, with ``contacts`` points on each edge.

    The pieces are of equal straight length behind and ahead of the boot centre, where a node lies.  The points are at
    equal distances; closer together at the tip, where the edge of a ski that is ``cutting`` enters the snow.

    An element has the mass of its piece and the stiffness that gives the same end displacements under the same end
    loads at first order: the inverse of the mean compliance.  Raises ValueError for fewer than two elements, which
    would leave no node to clamp.
    """
    if elements < 2 or contacts < 1:
        raise ValueError("elements must be at least 2, contacts at least 1")
    boot = float(ski.s_of_x(0.0))
    behind = int(np.clip(round(elements * boot), 1, elements - 1))
    s = np.concatenate([np.linspace(0.0, boot, behind + 1), np.linspace(boot, 1.0, elements - behind + 1)[1:]])
    position = np.stack([ski.x_of_s(s), np.zeros_like(s), ski.height(s)], axis=1)
    pitch = -np.arctan(ski.height.slope(s) / ski.length)  # turning about y (left) by + lowers the tip
    rotation = Rotation.from_rotvec(pitch[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    length = np.linalg.norm(np.diff(position, axis=0), axis=1)

    def mass_moments(r: Array) -> Array:
        w, t, density = ski.width(r), ski.thickness(r), ski.mass_per_length(r)
        about = [np.ones_like(r), (w**2 + t**2) / 12.0, t**2 / 12.0, w**2 / 12.0]
        return np.stack(about) * density * ski.length

    moments = integrate_pieces(ski, s, mass_moments)
    shear = ski.shear_stiffness
    laws = [ski.axial_stiffness, shear, shear, ski.torsional_stiffness, ski.bending_stiffness, ski.lateral_stiffness]
    compliance = integrate_pieces(ski, s, lambda r: np.stack([1.0 / law(r) for law in laws]))
    stiffness = np.diff(s) / compliance

    contact_s = (np.arange(contacts) + 0.5) / contacts
    contact_length = np.full(contacts, ski.length / contacts)
    if cutting:
        contact_s, share = _cutting_points(contacts)
        contact_length = share * ski.length
    element = np.clip(np.searchsorted(s, contact_s, side="right") - 1, 0, elements - 1).astype(np.int64)
    weight = (contact_s - s[element]) / np.diff(s)[element]
    return BeamMesh(
        ski=ski,
        node_s=s,
        node_position=position,
        node_rotation=rotation,
        element_length=length,
        element_mass=moments[0],
        section_inertia=(moments[1:] / length).T,
        stiffness=stiffness.T,
        contact_s=contact_s,
        contact_element=element,
        contact_weight=weight,
        contact_offset=_contact_offsets(ski, contact_s, element, weight, position, rotation),
        contact_length=contact_length,
    )


def _cutting_points(contacts: int) -> tuple[Array, Array]:
    """Return the contact points of a ski that cuts, (m,), and the share of its length that each stands for, (m,)."""
    ahead = int(np.clip(round(_SHOVEL_POINTS * contacts), 1, contacts - 1))
    behind = np.linspace(0.0, 1.0 - _SHOVEL, contacts - ahead + 1)
    border = np.concatenate([behind, np.linspace(1.0 - _SHOVEL, 1.0, ahead + 1)[1:]])
    return 0.5 * (border[1:] + border[:-1]), np.diff(border)


def _contact_offsets(
    ski: Ski, s: Array, element: NDArray[np.int64], weight: Array, position: Array, rotation: Array
) -> Array:
    """Return offsets that put the weighted mean of both nodes' points on the edge of the unloaded ski, exactly."""
    pair = np.stack([element, element + 1], axis=1)
    chord = (1.0 - weight)[:, None] * position[pair[:, 0]] + weight[:, None] * position[pair[:, 1]]
    half = 0.5 * ski.width(s)
    left = np.stack([ski.x_of_s(s), half, ski.height(s)], axis=1)
    edges = np.stack([left, left * [1.0, -1.0, 1.0]], axis=1)
    arms = edges - chord[:, None]
    offsets: Array = np.einsum("mkji,mej->meki", rotation[pair], arms)
    return offsets
