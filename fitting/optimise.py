"""NLopt's SLSQP on a least-squares problem whose curvature is known beforehand.

SLSQP starts from the identity as its second derivatives.  In coordinates in which the Gauss-Newton curvature is the
identity it therefore steps as Gauss-Newton would from the start, and converges in a few iterations whatever the
parameters' units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import nlopt
import numpy as np

from sssi_exudyn.core.frames import Array

_REASONS = {
    nlopt.SUCCESS: "converged",
    nlopt.STOPVAL_REACHED: "converged",
    nlopt.FTOL_REACHED: "converged: the objective no longer changes",
    nlopt.XTOL_REACHED: "converged: the parameters no longer change",
    nlopt.MAXEVAL_REACHED: "stopped: too many evaluations",
    nlopt.MAXTIME_REACHED: "stopped: out of time",
}


@dataclass(frozen=True)
class Optimum:
    """Where the search ended: parameters (k,), the objective there, evaluations used, whether and why it converged."""

    values: Array
    objective: float
    evaluations: int
    converged: bool
    reason: str


def minimise(
    function: Callable[[Array], tuple[float, Array]],
    start: Array,
    bounds: Array,
    curvature: Array,
    *,
    objective_tolerance: float,
    step_tolerance: float = 1e-3,
    most: int = 60,
) -> Optimum:
    """Least value of ``function`` (value and gradient) by SLSQP.

    Parameters
    ----------
    start, bounds : (k,) and (k, 2)
    curvature : (k, k) positive definite guess of the second derivatives
    objective_tolerance : change of the objective that ends the search
    step_tolerance : change of the parameters that ends it, in the coordinates in which ``curvature`` is the identity
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
    search.set_maxeval(most)
    try:
        search.optimize(np.zeros(size))
        code = search.last_optimize_result()
    except nlopt.RoundoffLimited:
        code = nlopt.FTOL_REACHED  # no step improves what rounding lets one see
    reason = _REASONS.get(code, f"stopped: NLopt's code {code}")
    return Optimum(best, float(least), used, reason.startswith("converged"), reason)
