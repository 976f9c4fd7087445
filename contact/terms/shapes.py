"""Shapes in time and space that several force terms share, without a branch."""

from __future__ import annotations

from typing import Final

from sssi_exudyn.contact.maths import Math, Number

TURN: Final = 6.283185307179586
"""rad in a full turn."""
SHORTEST: Final = 1e-3
"""Shortest length of a swell, so that it exists for ends that coincide too."""


def window(math: Math, x: Number, low: Number, high: Number, edge: Number) -> Number:
    """Return 1 between ``low`` and ``high``, 0 outside, each edge smoothed over ``edge`` (> 0, the unit of x)."""
    return 0.5 * (math.tanh((x - low) / edge) - math.tanh((x - high) / edge))


def bell(math: Math, x: Number, centre: Number, width: Number) -> Number:
    """Return exp(−½((x − centre)/width)²)."""
    z = (x - centre) / width
    return math.exp(-0.5 * z * z)


def swell(math: Math, x: Number, low: Number, high: Number, rise: Number) -> Number:
    """Return 0 at ``low``, ``high`` and beyond, and 1 between.

    It rises and falls as ½(1 − cos) within the share ``rise`` of the length.
    """
    share = (x - low) / math.maximum(high - low, SHORTEST)
    inwards = math.maximum(math.minimum(share, 1.0 - share), 0.0)
    return 0.5 * (1.0 - math.cos(0.5 * TURN * math.minimum(2.0 * inwards / rise, 1.0)))
