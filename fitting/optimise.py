"""NLopt's SLSQP on a least-squares problem whose curvature is known beforehand.

SLSQP starts from the identity as its second derivatives.  In coordinates in which the Gauss-Newton curvature is the
identity it therefore steps as Gauss-Newton would from the start, and converges in a few iterations whatever the
parameters' units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import nlopt
import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array

_REASONS = {
    nlopt.SUCCESS: "converged",
    nlopt.STOPVAL_REACHED: "converged",
    nlopt.FTOL_REACHED: "converged: the objective no longer changes",
    nlopt.XTOL_REACHED: "converged: the parameters no longer change",
    nlopt.MAXEVAL_REACHED: "stopped: too many evaluations",
    nlopt.MAXTIME_REACHED: "stopped: out of time",
}

_TRIED: Final = 6
"""Evaluations of a search before it gives up: most end within them, and what the first promise is far off."""
_STRAIGHT: Final = 0.8
"""Share of what Gauss-Newton's form promises of a step with which that form is taken for the next."""
_NEAR: Final = 3.0
"""Standard deviations of a step at whose end gradients show the curvature there."""
_BEYOND: Final = 2.0
"""Times Gauss-Newton's curvature that is added to it in a direction at most: along bent valleys a secant shows hundreds
of times as much, with which a search creeps.
"""


@dataclass(frozen=True)
class Optimum:
    """Where the search ended: parameters (k,), the objective there, evaluations used, whether and why it converged."""

    values: Array
    objective: float
    evaluations: int
    converged: bool
    reason: str


Squares = Callable[[Array], tuple[float, Array, Array]]
"""Gives value, gradient and Gauss-Newton curvature at a point."""


def step_back(function: Squares) -> Squares:
    """Return a function whose value is infinite where a run diverges, so that a search steps back.

    It raises SimulationDiverged as long as no run has ended.
    """
    begun = False

    def evaluate(at: Array) -> tuple[float, Array, Array]:
        nonlocal begun
        try:
            evaluated = function(at)
        except SimulationDiverged:
            if not begun:
                raise
            return np.inf, np.zeros(len(at)), np.eye(len(at))
        begun = True
        return evaluated

    return evaluate


def minimise(
    function: Callable[[Array], tuple[float, Array]],
    start: Array,
    bounds: Array,
    curvature: Array,
    *,
    objective_tolerance: float,
    step_tolerance: float = 1e-3,
    enough: float = -np.inf,
    most: int = 60,
) -> Optimum:
    """Minimise ``function`` (value and gradient) by SLSQP.

    Parameters
    ----------
    start, bounds : (k,) and (k, 2)
    curvature : (k, k) positive definite guess of the second derivatives
    objective_tolerance : change of the objective that ends the search
    step_tolerance : change of the parameters that ends it, in the coordinates in which ``curvature`` is the identity
    enough : value at which the search stops
    most : evaluations at most
    """
    size = len(start)
    lower = np.linalg.cholesky(curvature)
    back = np.linalg.inv(lower).T  # x = start + back z
    least, best = np.inf, np.asarray(start, dtype=np.float64)
    known: dict[bytes, tuple[float, Array]] = {}
    used = 0

    def objective(z: Array, gradient: Array) -> float:
        nonlocal used, least, best
        x = np.clip(start + back @ z, bounds[:, 0], bounds[:, 1])
        key = x.tobytes()
        if key not in known:  # SLSQP asks again for the point at which its line search ended
            used += 1
            known.clear()
            known[key] = function(x)
        value, slope = known[key]
        if gradient.size:
            gradient[:] = back.T @ slope
        if value < least:
            least, best = value, x
        return value

    def outside(result: Array, z: Array, gradient: Array) -> None:
        x = start + back @ z
        result[:] = np.concatenate([bounds[:, 0] - x, x - bounds[:, 1]])
        if gradient.size:
            gradient[:] = np.vstack([-back, back])

    search = nlopt.opt(nlopt.LD_SLSQP, size)
    search.set_min_objective(objective)
    search.add_inequality_mconstraint(outside, np.full(2 * size, 1e-10))
    search.set_ftol_abs(objective_tolerance)
    search.set_xtol_abs(step_tolerance)
    search.set_stopval(enough)
    search.set_maxeval(most)
    try:
        search.optimize(np.zeros(size))
        code = search.last_optimize_result()
    except nlopt.RoundoffLimited:
        code = nlopt.FTOL_REACHED  # no step improves what rounding lets one see
    reason = _REASONS.get(code, f"stopped: NLopt's code {code}")
    return Optimum(best, float(least), used, reason.startswith("converged"), reason)


def minimise_squares(
    function: Squares,
    start: Array,
    bounds: Array,
    *,
    objective_tolerance: float,
    most: int = 60,
    worth: float = np.inf,
) -> Optimum:
    """Minimise as ``minimise`` does, where ``function`` gives the Gauss-Newton curvature too.  SLSQP begins again, with
    the curvature there, from every point that is better than the one before, until a whole step would gain less than
    the tolerance.  It gives up where a step of Gauss-Newton, after ``_TRIED`` evaluations, promises no value below
    ``worth``.

    Far from the optimum curvatures differ so much from place to place that what SLSQP learns of them on its way
    misleads it.  Where a step gains less than Gauss-Newton's form promises, the next one takes what its curvature lacks
    from the gradients.  As long as a cause is missing much is left over; the curvature is then several times as much,
    and every step would go too far.
    """
    known: dict[bytes, tuple[float, Array, Array]] = {}

    def at(x: Array) -> tuple[float, Array, Array]:
        key = x.tobytes()
        if key not in known:
            known[key] = function(x)
        return known[key]

    values = np.asarray(start, dtype=np.float64)
    beyond, bent = np.zeros((len(values), len(values))), False
    while True:
        least, slope, squares = at(values)
        curvature = squares + _bounded(beyond, squares) if bent else squares
        promised = 0.5 * slope @ np.linalg.solve(curvature, slope)
        if promised < objective_tolerance:
            return Optimum(values, least, len(known), True, _REASONS[nlopt.FTOL_REACHED])
        if len(known) >= _TRIED and least - 0.5 * slope @ np.linalg.solve(squares, slope) > worth:
            return Optimum(values, least, len(known), False, "stopped: it promises too little")
        optimum = minimise(
            lambda x: at(x)[:2],
            values,
            bounds,
            curvature,
            objective_tolerance=objective_tolerance,
            enough=float(np.nextafter(least, -np.inf)),
            most=1 + most - len(known),
        )
        gain, before = least - optimum.objective, values
        values = optimum.values
        if 0.0 < gain < objective_tolerance:
            optimum = replace(optimum, converged=True, reason=_REASONS[nlopt.FTOL_REACHED])
        if gain < objective_tolerance or len(known) >= most:
            return replace(optimum, evaluations=len(known))
        _, after, there = at(values)
        step = values - before
        straight = -float(slope @ step + 0.5 * step @ squares @ step)
        bent = gain < _STRAIGHT * straight and float(step @ squares @ step) < _NEAR**2
        beyond = _learned(beyond, step, after - slope, there)


def _learned(beyond: Array, step: Array, change: Array, squares: Array) -> Array:
    """Return what the curvature has beyond Gauss-Newton's ``squares`` (k, k) at the end of a ``step`` (k,) over which
    the gradient changed by ``change`` (k,), so that the whole gives that change; ``beyond`` is what was known of it.

    Source: Dennis, Gay and Welsch, ACM Trans. Math. Softw. 7 (1981) 348 (NL2SOL), with its sizing.
    """
    along = float(change @ step)
    if along <= 0.0:
        return beyond
    shown = change - squares @ step
    known = float(step @ beyond @ step)
    if known != 0.0:
        beyond = min(1.0, abs(float(step @ shown) / known)) * beyond
    rest = shown - beyond @ step
    both = np.outer(rest, change)
    return np.asarray(beyond + (both + both.T) / along - float(rest @ step) * np.outer(change, change) / along**2)


def _bounded(beyond: Array, squares: Array) -> Array:
    """Return what of ``beyond`` (k, k) adds up to ``_BEYOND`` times the curvature ``squares`` to it in any direction,
    and takes nothing from it.
    """
    lower = np.linalg.cholesky(squares)
    half = np.linalg.solve(lower, beyond)
    sizes, axes = np.linalg.eigh(np.linalg.solve(lower, half.T))
    back = lower @ axes
    return np.asarray(back * np.clip(sizes, 0.0, _BEYOND) @ back.T)
