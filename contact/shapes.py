"""Shapes in time and space that several force terms share, without a branch."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.contact.maths import Math, Number

TURN: Final = 6.283185307179586
"""rad in a full turn."""
SHORTEST: Final = 1e-3
"""A swell is no shorter, so that it exists for ends that coincide too."""


def window(math: Math, x: Number, low: Number, high: Number, edge: Number) -> Number:
    """1 between ``low`` and ``high``, 0 outside, each edge smoothed over ``edge`` (> 0, the unit of x)."""
    return 0.5 * (math.tanh((x - low) / edge) - math.tanh((x - high) / edge))


def bell(math: Math, x: Number, centre: Number, width: Number) -> Number:
    """exp(−½((x − centre)/width)²)."""
    z = (x - centre) / width
    return math.exp(-0.5 * z * z)


def swell(math: Math, x: Number, low: Number, high: Number) -> Number:
    """½(1 − cos) from ``low`` to ``high``: 0 at both ends and beyond, 1 half-way."""
    share = math.minimum(math.maximum((x - low) / math.maximum(high - low, SHORTEST), 0.0), 1.0)
    return 0.5 * (1.0 - math.cos(TURN * share))
