"""A snow surface: heights over the slope's plane on a regular grid, and a bicubic spline through them.

The spline's coefficients are SciPy's (``scipy.ndimage.spline_filter``), mirrored at the borders.  Beyond them the
surface continues level, at the border's height.  Contact uses the surface's second-order patch about the middle of each
ski: height, two slopes, three curvatures.  Over waves of 5 m and more the patch is within 0.2 mm of height for every
metre of a ski of 1.65 m (tests/terrain/test_surface.py).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from scipy.ndimage import spline_filter

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.runtime.jit import njit

PATCH = 6
"""Count of the numbers of a patch: h (m), ∂h/∂f, ∂h/∂l (1), ∂²h/∂f², ∂²h/∂f∂l, ∂²h/∂l² (1/m)."""
MOST_MODES: Final = 240
"""Maximum number of modes, a plane's tilt included.  A hill of 180 m has more that are noticed together; with half as
many the others disturbed the loads as much as insoles are off.
"""


@njit(cache=True, error_model="numpy")
def weights(t):
    """Return the four cubic B-splines that reach a place between two nodes, 0 ≤ t ≤ 1, and their derivatives by t."""
    s = 1.0 - t
    value = (
        s * s * s / 6.0,
        (4.0 - 3.0 * t * t * (2.0 - t)) / 6.0,
        (4.0 - 3.0 * s * s * (2.0 - s)) / 6.0,
        t * t * t / 6.0,
    )
    slope = (-0.5 * s * s, 0.5 * t * (3.0 * t - 4.0), -0.5 * s * (3.0 * s - 4.0), 0.5 * t * t)
    curvature = (s, 3.0 * t - 2.0, 3.0 * s - 2.0, t)
    return value, slope, curvature


@njit(cache=True, error_model="numpy")
def cell(count, x):
    """Locate a place x (nodes) among ``count`` nodes.

    Returns the node before it, the share of the distance to the next, and whether the place is within the borders.
    """
    inside = 0.0 < x < count - 1.0
    x = min(max(x, 0.0), count - 1.0)
    i = min(int(x), count - 2)
    return i, x - i, inside


@njit(cache=True, error_model="numpy")
def grid_patch(coefficients, origin, spacing, f, l):  # noqa: E741  the slope frame's name of the axis
    """Return height, slopes and curvatures at one place of a spline: ``PATCH`` numbers.

    coefficients : (nf + 2, nl + 2), with one mirrored row or column beyond each border
    """
    i, u, inside_u = cell(coefficients.shape[0] - 2, (f - origin[0]) / spacing)
    j, w, inside_w = cell(coefficients.shape[1] - 2, (l - origin[1]) / spacing)
    a, a1, a2 = weights(u)
    b, b1, b2 = weights(w)
    h, h_f, h_l, h_ff, h_fl, h_ll = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for m in range(4):
        c, c1, c2 = 0.0, 0.0, 0.0
        for n in range(4):
            node = coefficients[i + m, j + n]
            c += b[n] * node
            c1 += b1[n] * node
            c2 += b2[n] * node
        h += a[m] * c
        h_f += a1[m] * c
        h_l += a[m] * c1
        h_ff += a2[m] * c
        h_fl += a1[m] * c1
        h_ll += a[m] * c2
    by_f = 1.0 / spacing if inside_u else 0.0
    by_l = 1.0 / spacing if inside_w else 0.0
    return h, h_f * by_f, h_l * by_l, h_ff * by_f * by_f, h_fl * by_f * by_l, h_ll * by_l * by_l


@njit(cache=True, error_model="numpy")
def patch_under(surface, f, l):  # noqa: E741
    """Return the patch about a place, with the place: (f, l, h, ∂h/∂f, ∂h/∂l, ∂²h/∂f², ∂²h/∂f∂l, ∂²h/∂l²).

    surface : ``SnowGrid``
    """
    if surface.coefficients.shape[0] == 0:
        return f, l, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    h, h_f, h_l, h_ff, h_fl, h_ll = grid_patch(surface.coefficients, surface.origin, surface.spacing, f, l)
    return f, l, h, h_f, h_l, h_ff, h_fl, h_ll


@njit(cache=True, error_model="numpy")
def on_change(patch, x, y):
    """Return height and slopes of a patch (``PATCH`` numbers) x and y (m) away from its middle."""
    slope_f = patch[3] * x + patch[4] * y
    slope_l = patch[4] * x + patch[5] * y
    height = patch[0] + (patch[1] + 0.5 * slope_f) * x + (patch[2] + 0.5 * slope_l) * y
    return height, patch[1] + slope_f, patch[2] + slope_l


@njit(cache=True, error_model="numpy")
def on_patch(under, f, l):  # noqa: E741
    """Return height and slopes at a place near a patch, as ``patch_under`` gives it."""
    return on_change(under[2:], f - under[0], l - under[1])


@njit(cache=True, error_model="numpy")
def patch_changes(surface, f, l, changes):  # noqa: E741
    """Fill the first two rows of ``changes`` (≥ 2, ``PATCH``): the patch's change as its middle moves along f and l.

    The place at which the patch is evaluated does not move.  There, heights and slopes of a second-order patch change
    by the third derivatives alone.
    """
    coefficients, spacing = surface.coefficients, surface.spacing
    i, u, inside_u = cell(coefficients.shape[0] - 2, (f - surface.origin[0]) / spacing)
    j, w, inside_w = cell(coefficients.shape[1] - 2, (l - surface.origin[1]) / spacing)
    a, a1, a2 = weights(u)
    b, b1, b2 = weights(w)
    third = (-1.0, 3.0, -3.0, 1.0)
    fff, ffl, fll, lll = 0.0, 0.0, 0.0, 0.0
    for m in range(4):
        for n in range(4):
            node = coefficients[i + m, j + n]
            fff += third[m] * b[n] * node
            ffl += a2[m] * b1[n] * node
            fll += a1[m] * b2[n] * node
            lll += a[m] * third[n] * node
    by_f = 1.0 / spacing if inside_u else 0.0
    by_l = 1.0 / spacing if inside_w else 0.0
    fff, ffl, fll, lll = fff * by_f**3, ffl * by_f * by_f * by_l, fll * by_f * by_l * by_l, lll * by_l**3
    for c in range(3):
        changes[0, c] = changes[1, c] = 0.0
    changes[0, 3], changes[0, 4], changes[0, 5] = fff, ffl, fll
    changes[1, 3], changes[1, 4], changes[1, 5] = ffl, fll, lll


@njit(cache=True, error_model="numpy")
def patches(coefficients, origin, spacing, places, out):
    """Write ``grid_patch`` at each of places (n, 2) into ``out`` (n, ``PATCH``)."""
    for k in range(places.shape[0]):
        patch = grid_patch(coefficients, origin, spacing, places[k, 0], places[k, 1])
        for c in range(6):
            out[k, c] = patch[c]


def spline_coefficients(heights: Array) -> Array:
    """Return the coefficients (…, nf + 2, nl + 2) m of the bicubic splines through heights (…, nf, nl).

    They are mirrored by one beyond each border.
    """
    flat = np.asarray(heights, dtype=np.float64).reshape(-1, *heights.shape[-2:])
    padded = [np.pad(spline_filter(grid, order=3, mode="mirror"), 1, mode="reflect") for grid in flat]
    shape = (*heights.shape[:-2], heights.shape[-2] + 2, heights.shape[-1] + 2)
    return np.ascontiguousarray(np.reshape(padded, shape))


@dataclass(frozen=True, eq=False)
class Surface:
    """Heights over the slope's plane, in the slope frame, with their uncertainty.

    origin : (f, l) m of the first node;  spacing : m between nodes
    mean : (nf, nl) m at the nodes, at least 2 by 2
    deviation : (nf, nl) m, standard deviation there, relative to the mean height along the path
    modes : (k, nf, nl) m, shapes by which the heights may differ from the mean
    amounts : (k,) number of standard deviations of each mode
    """

    origin: tuple[float, float]
    spacing: float
    mean: Array
    deviation: Array
    modes: Array
    amounts: tuple[complex, ...] = ()

    @cached_property
    def heights(self) -> Array:
        """Heights (nf, nl) m at the nodes."""
        return np.asarray(self.mean + np.tensordot(np.array(self.amounts), self.modes, axes=1))

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients (nf + 2, nl + 2) m of the heights' spline."""
        return spline_coefficients(self.heights)

    @cached_property
    def mode_coefficients(self) -> Array:
        """Coefficients (k, nf + 2, nl + 2) m of the modes' splines."""
        return spline_coefficients(self.modes)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of origin, spacing and grids."""
        numbers = np.concatenate([[*self.origin, self.spacing, *self.grids.shape], self.grids.ravel()])
        return hashlib.sha256(numbers.tobytes()).hexdigest()

    @property
    def grids(self) -> Array:
        """Grids (2 + k, nf, nl) m: mean, deviation and modes."""
        return np.concatenate([self.mean[None], self.deviation[None], self.modes])

    @property
    def names(self) -> tuple[NumberRef, ...]:
        """Names of the modes' amounts, as a model knows them."""
        return tuple(NumberRef(f"surface.mode_{k + 1}") for k in range(len(self.amounts)))

    def with_amount(self, mode: int, amount: complex) -> Surface:
        """Return the surface with another number of standard deviations of one mode.

        Raises IndexError where there is no such mode.
        """
        amounts = list(self.amounts)
        amounts[mode] = amount
        return replace(self, amounts=tuple(amounts))

    def at(self, places: Array) -> Array:
        """Return (n, ``PATCH``) height, slopes and curvatures at ``places`` (n, 2), f and l in m."""
        out = np.empty((len(places), PATCH))
        places = np.ascontiguousarray(places[:, :2], dtype=np.float64)
        patches(self.coefficients, np.array(self.origin), self.spacing, places, out)
        return out

    def deviation_at(self, places: Array) -> Array:
        """Return the standard deviation (n,) m of the height at ``places`` (n, 2)."""
        return replace(self, mean=self.deviation, modes=self.modes[:0], amounts=()).at(places)[:, 0]

    def nodes(self) -> Array:
        """Return the places (nf·nl, 2) m of the nodes, row by row."""
        f, l = (start + self.spacing * np.arange(n) for start, n in zip(self.origin, self.mean.shape, strict=True))  # noqa: E741
        return np.stack(np.meshgrid(f, l, indexing="ij"), axis=-1).reshape(-1, 2)


def surface_over(places: Array, spacing: float, margin: float) -> Surface:
    """Return a level surface whose nodes reach ``margin`` (m) beyond all of ``places`` (n, 2)."""
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    counts = np.maximum(np.ceil((high - low) / spacing).astype(int) + 1, 2)
    return Surface((float(low[0]), float(low[1])), spacing, np.zeros(counts), np.zeros(counts), np.zeros((0, *counts)))
