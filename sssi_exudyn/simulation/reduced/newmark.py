"""Newmark's rule of average acceleration: a template that ``compiled`` joins with the loops over time.

    q = q₀ + h q̇₀ + h²/4 (a₀ + a),   q̇ = q̇₀ + h/2 (a₀ + a)

A tangent of q follows the same rule.
"""

from __future__ import annotations

from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.simulation.ski_on_snow.structs import TimeStep


@njit(cache=True, error_model="numpy")
def time_step(n, length):
    """Return the step of that length (s) to the n-th instant.  No step leads to the first: the start stays, whatever
    its acceleration.
    """
    h = length if n > 0 else 0.0
    return TimeStep(h, 0.25 * h * h, 0.5 * h)


@njit(cache=True, error_model="numpy")
def next_place(step, q, rate, acceleration):
    """Return q at the end of a step from q and its rate at the start, and the sum of the accelerations at both."""
    return q + step.length * rate + step.by_place * acceleration


@njit(cache=True, error_model="numpy")
def next_rate(step, rate, acceleration):
    """Return the rate at the end of a step from the same."""
    return rate + step.by_rate * acceleration
