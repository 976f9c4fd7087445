"""What the skier's segments show the air in a posture: ellipsoids of three areas each, and what others shield of them.

An ellipsoid that shows areas A_x, A_y, A_z along its axes shows √(û·M û) along a direction û,

    M = R diag(A_x², A_y², A_z²) Rᵀ,   R its attitude,

exactly, as its shadow is an ellipse.  What of it stands in the shadow of segments ahead, seen along the skis' mean
direction, is taken off: the share of its shadow's points that lie in others', smoothly, so that drag does not jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.anthropometry import SegmentInertia
from sssi_exudyn.bodies.skier.chain import FEET, SEGMENT, Poses
from sssi_exudyn.core.frames import Array

_POINTS: Final = 37
"""Points of an ellipse that are looked at, each for as much of it."""
_EDGE: Final = 0.15
"""Half the width, in an ellipse's quadratic form, over which its edge is smooth."""
_BEHIND: Final = 0.05
"""m over which a segment comes to stand behind another."""


def facing(poses: Poses, inertias: tuple[SegmentInertia, ...], areas: Mapping[str, Array]) -> Array:
    """Return M (n, k, 3, 3) m⁴ of each segment of ``areas`` in the slope frame, less what others shield of it.

    areas : (3,) m² that each segment shows along its own axes
    """
    at = [SEGMENT[name] for name in areas]
    size = np.stack(list(areas.values()))
    turn = poses.rotation[:, at]
    whole = np.einsum("nkij,kj,nklj->nkil", turn, size**2, turn)
    centre = poses.origin[:, at] + np.einsum("nkij,kj->nki", turn, np.stack([inertias[i].com for i in at]))
    forward = poses.rotation[:, list(FEET)][..., 0].mean(axis=1)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    # half axes: the area along one is π times the other two
    half = np.sqrt(np.prod(size, axis=1, keepdims=True) / np.pi) / size
    shape = np.einsum("nkij,kj,nklj->nkil", turn, half**2, turn)
    seen = _unshielded(centre, shape, forward)
    return np.asarray(seen[..., None, None] ** 2 * whole)


def _unshielded(centre: Array, shape: Array, forward: Array) -> Array:
    """Return the share (n, k) of each ellipsoid's shadow that lies in no other's, of those ahead of it.

    centre : (n, k, 3) m;  shape : (n, k, 3, 3) m², Σ half axes squared;  forward : (n, 3)
    """
    aside = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    plane = np.stack([aside, np.cross(aside, forward)], axis=1)  # (n, 2, 3)
    flat = np.einsum("nai,nki->nka", plane, centre)
    ellipse = np.einsum("nai,nkij,nbj->nkab", plane, shape, plane)  # a point p of its edge: pᵀ E⁻¹ p = 1
    ahead = np.einsum("ni,nki->nk", forward, centre)
    golden = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(_POINTS)
    radius = np.sqrt((np.arange(_POINTS) + 0.5) / _POINTS)
    disc = radius[:, None] * np.stack([np.cos(golden), np.sin(golden)], axis=1)
    points = flat[:, :, None] + np.einsum("nkab,pb->nkpa", np.linalg.cholesky(ellipse), disc)
    inverse = np.linalg.inv(ellipse)
    free = np.ones(points.shape[:3])
    for j in range(centre.shape[1]):
        from_j = points - flat[:, None, None, j]
        inside = np.einsum("nkpa,nab,nkpb->nkp", from_j, inverse[:, j], from_j)
        covers = _smooth((1.0 + _EDGE - inside) / (2.0 * _EDGE))
        covers *= _smooth(0.5 + (ahead[:, j, None] - ahead) / _BEHIND)[..., None]
        covers[:, j] = 0.0
        free *= 1.0 - covers
    return np.asarray(free.mean(axis=2))


def _smooth(x: Array) -> Array:
    """Return a step from 0 at 0 to 1 at 1 without a kink."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
