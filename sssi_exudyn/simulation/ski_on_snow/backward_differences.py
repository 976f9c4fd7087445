"""Backward differences, of second order or Euler's of first: a template that ``compiled`` joins with loops over time.

    q = last·q₋₁ + before·q₋₂ + share·q̇

with a share of the step, and the rate of q likewise by its acceleration.  They damp what is faster than a step; those
of first order damp slower movement too.  A tangent of q follows the same rule.
"""

from __future__ import annotations

from typing import NamedTuple

from sssi_exudyn.runtime.jit import njit


class Backward(NamedTuple):
    """How a value at the end of a step follows from those at its start and a step before, and from its rate (s)."""

    last: float
    before: float
    share: float


@njit(cache=True, error_model="numpy")
def backward(n, length, order):
    """Return the differences of order 1 or 2 at the n-th instant, each ``length`` (s) after the one before.  No step
    leads to the first instant, and the step to the second is of first order.
    """
    if n < order:
        return Backward(1.0, 0.0, length if n > 0 else 0.0)
    return Backward(1.0, 0.0, length) if order == 1 else Backward(4.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0 * length)


@njit(cache=True, error_model="numpy")
def next_value(rule, last, before, rate):
    """Return the value at the end of a step."""
    return rule.last * last + rule.before * before + rule.share * rate


@njit(cache=True, error_model="numpy")
def rate_to(rule, value, last, before):
    """Return the rate at the end of a step by which the value becomes ``value``."""
    return (value - rule.last * last - rule.before * before) / rule.share
