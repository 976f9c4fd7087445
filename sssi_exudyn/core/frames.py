"""Frames and their signs, defined in one place.

World  east-north-up (e, n, u), origin at the first GPS fix.
Slope  f down the fall line, l to the left when facing down, n normal and upwards; same origin.  Simulations run here.
Level  as Slope but not inclined: x along the fall line's azimuth, y left of it, z up against gravity.
Body   every segment: x forward, y left, z up when standing upright with the arms hanging (anatomical zero).
BVH    x left, y up, z forward; zero rotation is the T-pose.

Azimuths are clockwise from north; all angles in radians.  Rotation matrices map components in the named frame to the
outer one: ``v_outer = R @ v_inner``.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRAVITY: Final = 9.81
"""Acceleration of gravity, m/s²; the paper's latitude and height give 9.79 to 9.81."""

BODY_FROM_BVH: Final[Array] = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Rotation from (x left, y up, z forward) to (x forward, y left, z up); a cyclic permutation is a proper rotation."""


def rotation_from_bvh(rotation: Array) -> Array:
    """Convert rotations (…, 3, 3) from BVH axes to body axes."""
    return BODY_FROM_BVH @ rotation @ BODY_FROM_BVH.T


def level_to_enu(azimuth: float) -> Array:
    """Return the rotation (3, 3) from the level frame (x along ``azimuth``, y left, z up) to east-north-up."""
    s, c = np.sin(azimuth), np.cos(azimuth)
    return np.array([[s, -c, 0.0], [c, s, 0.0], [0.0, 0.0, 1.0]])


def slope_to_level(inclination: float) -> Array:
    """Return the rotation (3, 3) from the slope frame to the level frame.

    It turns by +inclination about y (left), so that f points downhill.
    """
    from scipy.spatial.transform import Rotation  # here: a process that only reads cells or markers starts without it

    return Rotation.from_euler("y", inclination).as_matrix()


def slope_to_enu(inclination: float, azimuth: float) -> Array:
    """Return the rotation (3, 3) from the slope frame to east-north-up."""
    return level_to_enu(azimuth) @ slope_to_level(inclination)


def gravity_in_slope(inclination: float) -> Array:
    """Return the acceleration of gravity (3,) m/s² in the slope frame (f, l, n)."""
    return GRAVITY * np.array([np.sin(inclination), 0.0, -np.cos(inclination)])


def up_in_slope(inclination: float) -> Array:
    """Return the unit vector (3,) against gravity in the slope frame (f, l, n)."""
    return -gravity_in_slope(inclination) / GRAVITY


def cross(a: Array, b: Array) -> Array:
    """Return a × b (…, 3) of vectors a, b (…, 3).

    The result is bit for bit that of ``np.cross``, in half of its time for some thousand vectors.
    """
    shape = a.shape if a.shape == b.shape else np.broadcast_shapes(a.shape, b.shape)  # as slow as a product
    product = np.empty(shape, np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return product
