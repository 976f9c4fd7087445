"""Shapes in time and space that several force terms share, without a branch."""

from __future__ import annotations

from sssi_exudyn.contact.maths import Math, Number


def window(math: Math, x: Number, low: Number, high: Number, edge: Number) -> Number:
    """1 between ``low`` and ``high``, 0 outside, each edge smoothed over ``edge`` (> 0, the unit of x)."""
    return 0.5 * (math.tanh((x - low) / edge) - math.tanh((x - high) / edge))


def hat(math: Math, x: Number, centre: Number, width: Number) -> Number:
    """1 at ``centre``, falling in straight lines to 0 at ``width`` (> 0) to either side."""
    return math.maximum(0.0, 1.0 - math.absolute(x - centre) / width)


def bell(math: Math, x: Number, centre: Number, width: Number) -> Number:
    """exp(−½((x − centre)/width)²)."""
    z = (x - centre) / width
    return math.exp(-0.5 * z * z)
