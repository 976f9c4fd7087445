"""Functions of one coordinate, as musculoskeletal models tabulate them: a patella's glide, a vertebra's share.

All of them are piecewise cubic and continue straight beyond their ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class Curve:
    """y(x), piecewise cubic: on the k-th of n pieces Σ coefficients[k, j] (x − knots[k])^j.

    knots : (n + 1,) increasing
    coefficients : (n, 4)
    """

    knots: Array
    coefficients: Array

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Return value and slope, each (…), at ``x`` (…)."""
        inside = np.clip(x, self.knots[0], self.knots[-1])
        piece = np.clip(np.searchsorted(self.knots, inside, side="right") - 1, 0, len(self.coefficients) - 1)
        step = inside - self.knots[piece]
        a, b, c, d = np.moveaxis(self.coefficients[piece], -1, 0)
        slope = b + step * (2.0 * c + step * 3.0 * d)
        return a + step * (b + step * (c + step * d)) + (x - inside) * slope, slope

    def scale(self, x: float = 1.0, y: float = 1.0) -> Curve:
        """Return y · this(x_given / x): the same curve over axes stretched by ``x`` and ``y`` (x may be negative)."""
        powers = y / x ** np.arange(4)
        if x > 0.0:
            return Curve(self.knots * x, self.coefficients * powers)
        # run through from the other end: each piece is expanded about its former right end
        ends, h = self.knots[::-1] * x, np.diff(self.knots)
        a, b, c, d = self.coefficients.T
        right = np.stack([a + h * (b + h * (c + h * d)), b + h * (2.0 * c + 3.0 * h * d), c + 3.0 * h * d, d], axis=1)
        return Curve(ends, right[::-1] * powers)

    def lift(self, by: float) -> Curve:
        """Return this curve plus a constant."""
        moved = self.coefficients.copy()
        moved[:, 0] += by
        return Curve(self.knots, moved)


def line(slope: float, at_zero: float = 0.0) -> Curve:
    """Return the straight line y = slope · x + at_zero; a constant has slope 0."""
    return Curve(np.array([0.0, 1.0]), np.array([[at_zero, slope, 0.0, 0.0]]))


def polygon(x: Sequence[float] | Array, y: Sequence[float] | Array) -> Curve:
    """Return straight lines from point to point."""
    knots, values = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    zero = np.zeros(len(knots) - 1)
    return Curve(knots, np.stack([values[:-1], np.diff(values) / np.diff(knots), zero, zero], axis=1))


def spline(x: Sequence[float] | Array, y: Sequence[float] | Array) -> Curve:
    """Return the cubic spline through the points that SIMM and OpenSim draw; through two points, the line.

    Its third derivatives at the ends are those of the cubics through the outermost four points (Forsythe, Malcolm &
    Moler 1977, ch. 4.4).
    """
    knots, values = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    n = len(knots)
    if n < 3:
        return polygon(knots, values)
    h = np.diff(knots)
    first = np.diff(values) / h
    # unknown: s_k = a sixth of the second derivative at each knot
    upper, diagonal, lower, right = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    diagonal[1:-1] = 2.0 * (h[:-1] + h[1:])
    upper[2:], lower[:-2] = h[1:], h[:-1]
    right[1:-1] = np.diff(first)
    diagonal[0], upper[1], diagonal[-1], lower[-2] = -h[0], h[0], -h[-1], h[-1]
    if n > 3:
        second = np.diff(first) / (knots[2:] - knots[:-2])
        third = np.diff(second) / (knots[3:] - knots[:-3])
        right[0], right[-1] = third[0] * h[0] ** 2, -third[-1] * h[-1] ** 2
    s = solve_banded((1, 1), np.stack([upper, diagonal, lower]), right)
    slope = first - h * (s[1:] + 2.0 * s[:-1])
    return Curve(knots, np.stack([values[:-1], slope, 3.0 * s[:-1], np.diff(s) / h], axis=1))
