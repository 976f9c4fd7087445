"""Activations that make given joint moments: at each instant the least Σ aᵖ within the reach of the instant before.

min Σ aᵖ + Σ (r / r₀)²   subject to   A a + r = b,   a_min ≤ a ≤ 1,

A (c, m) are the moments that m muscles make at full activation, b (c,) the moments to be made.  The reserve moments r
stand in where the muscles are too weak; elsewhere their cost keeps them near zero.  For p = 2 this is a quadratic
programme, solved by OSQP, which starts from the instant before (B. Stellato et al., Math. Prog. Comp. 12 (2020)
637-672).  For p = 3 such programmes are solved one after another (Newton's method): a³ is convex.

Activation follows excitation u, a_min ≤ u ≤ 1, by ȧ = (u − a)/τ (F. E. Zajac, Crit. Rev. Biomed. Eng. 17 (1989)
359-411), τ = 10 ms where it rises and 40 ms where it falls (as in OpenSim: M. Millard et al., J. Biomech. Eng. 135
(2013) 021005).  So after a step of h

    a_min + (a − a_min) e^(−h/40 ms)  ≤  a′  ≤  1 − (1 − a) e^(−h/10 ms).

Each instant is solved alone, so that a muscle does not rise before it is needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import sparse
from scipy.optimize import lsq_linear

from sssi_exudyn.core.choices import POWERS
from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import Array

LEAST: Final = 0.01
"""Least activation of muscles."""
RISE: Final = 0.010
"""s; time constant of rising activation."""
FALL: Final = 0.040
"""s; time constant of falling activation."""
RESERVE: Final = 0.3
"""N m, r₀: a reserve of this size costs as much as one fully active muscle."""
_UNIT: Final = 50.0
"""N m in which the programme counts moments, so that its numbers are around 1.  OSQP's own scaling, which looks at the
first instant, takes four times the steps.
"""
_PRECISION: Final = 1e-6
_NEWTON_STEPS: Final = 20
_NEWTON_PRECISION: Final = 1e-5
MAX_ITERATIONS: Final = 5_000
"""Steps after which OSQP gives up and another method takes over."""


@dataclass(frozen=True)
class Optimum:
    """Activation (n, m) and reserve (n, c) N m."""

    activation: Array
    reserve: Array


def optimise(
    at_full: Array,
    wanted: Array,
    power: int = 2,
    time: Array | None = None,
    before: tuple[float, Array] | None = None,
) -> Optimum:
    """Find the activations at n instants, each started from the one before.

    Parameters
    ----------
    at_full : (n, c, m) N m of each muscle on each coordinate at full activation
    wanted : (n, c) N m
    power : p
    time : (n,) s, over which activation follows excitation; where left out, it follows at once
    before : time (s) and activation (m,) before the first instant; where left out, the first instant is free

    Raises ValueError for another power than ``POWERS``, SssiError where the solver gives up.
    """
    if power not in POWERS:
        raise ValueError(f"power is {power}, not one of {POWERS}")
    n, c, m = at_full.shape
    programme = _Programme(np.any(at_full != 0.0, axis=0))
    activation, reserve = np.empty((n, m)), np.empty((n, c))
    guess = np.full(m, 0.1) if before is None else before[1]
    elapsed = np.inf if time is None or before is None else time[0] - before[0]
    for i in range(n):
        programme.constrain(at_full[i], wanted[i], *reach(guess, elapsed))
        if power == 2:
            guess, reserve[i] = programme.solve(i)
        else:
            for _ in range(_NEWTON_STEPS):
                # a³ about g: 3 g a² − 3 g² a + …
                programme.weigh(3.0 * guess, -3.0 * guess**2)
                improved, reserve[i] = programme.solve(i)
                change, guess = float(np.max(np.abs(improved - guess))), improved
                if change < _NEWTON_PRECISION:
                    break
        activation[i] = guess
        if time is not None and i + 1 < n:
            elapsed = time[i + 1] - time[i]
    return Optimum(activation, reserve)


def reach(activation: Array, step: float) -> tuple[Array, Array]:
    """Return least and greatest activation (m,) a ``step`` (s) after ``activation`` (m,)."""
    return LEAST + (activation - LEAST) * np.exp(-step / FALL), 1.0 - (1.0 - activation) * np.exp(-step / RISE)


class _Programme:
    """The programme of one instant in OSQP, which keeps its structure and its last solution: x = (a, r / _UNIT)."""

    def __init__(self, acting: Array) -> None:
        c, m = acting.shape
        self.muscles, self.linear = m, np.zeros(m)
        self.at_full, self.wanted = np.zeros((c, m)), np.zeros(c)
        self.rows, self.columns = np.nonzero(acting.T)[::-1]  # column by column, as OSQP stores it
        reserve = (_UNIT / RESERVE) ** 2
        self.weight = np.concatenate([np.full(m, 2.0), np.full(c, 2.0 * reserve)])
        numbered = sparse.csc_matrix((np.arange(1.0, len(self.rows) + 1.0), (self.rows, self.columns)), (c, m))
        bounded = sparse.csc_matrix((-np.ones(m), (np.arange(m), np.arange(m))), (m, m + c))
        balanced = sparse.hstack([numbered, sparse.csc_matrix(-np.eye(c))])
        matrix = sparse.csc_matrix(sparse.vstack([balanced, bounded]))
        self.places = np.flatnonzero(matrix.data > 0.0).astype(np.int32)
        self.order = matrix.data[self.places].astype(int) - 1
        matrix.data = np.abs(np.sign(matrix.data))
        self.lower = np.concatenate([np.zeros(c), np.full(m, LEAST)])
        self.upper = np.concatenate([np.zeros(c), np.ones(m)])
        import osqp  # here: it loads a template engine, which every command would wait for

        self.solver = osqp.OSQP()
        self.solved = (
            osqp.SolverStatus.OSQP_SOLVED,
            osqp.SolverStatus.OSQP_SOLVED_INACCURATE,  # nearly to the requested precision
        )
        self.solver.setup(
            sparse.diags(self.weight).tocsc(),
            np.zeros(m + c),
            matrix,
            self.lower,
            self.upper,
            verbose=False,
            eps_abs=_PRECISION,
            eps_rel=_PRECISION,
            max_iter=MAX_ITERATIONS,
            polishing=True,
            warm_starting=True,
            scaling=0,
        )

    def constrain(self, at_full: Array, wanted: Array, least: Array, greatest: Array) -> None:
        """Set A, b and the activations' bounds."""
        count = len(wanted)
        self.lower[:count] = self.upper[:count] = wanted / _UNIT
        self.lower[count:], self.upper[count:] = least, greatest
        self.at_full, self.wanted = at_full / _UNIT, wanted / _UNIT
        values = at_full[self.rows, self.columns][self.order] / _UNIT
        self.solver.update(Ax=values, Ax_idx=self.places, l=self.lower, u=self.upper)

    def weigh(self, quadratic: Array, linear: Array) -> None:
        """Set the muscles' cost: Σ quadratic a² + linear a."""
        self.weight[: self.muscles], self.linear = 2.0 * quadratic, linear
        cost = np.concatenate([linear, np.zeros(len(self.weight) - self.muscles)])
        self.solver.update(Px=self.weight, q=cost)

    def solve(self, instant: int) -> tuple[Array, Array]:
        """Return activations (m,) and reserves (c,) N m."""
        solution = self.solver.solve(raise_error=False)
        if solution.info.status_val not in self.solved:
            return self._solve_by_active_set(instant)
        x = np.array(solution.x, dtype=np.float64)
        return np.clip(x[: self.muscles], LEAST, 1.0), x[self.muscles :] * _UNIT

    def _solve_by_active_set(self, instant: int) -> tuple[Array, Array]:
        """Solve the same programme as bounded least squares of the muscles alone, exactly.

        It is tens of times slower, and sure where many muscles are at a bound (P. B. Stark & R. L. Parker, Comput.
        Stat. 10 (1995) 129-141).
        """
        root = np.sqrt(0.5 * self.weight)
        table = np.vstack([np.diag(root[: self.muscles]), root[self.muscles :, None] * self.at_full])
        least = -0.5 * self.linear / root[: self.muscles]
        right = np.concatenate([least, root[self.muscles :] * self.wanted])
        bounds = self.lower[len(self.wanted) :], self.upper[len(self.wanted) :]
        solution = lsq_linear(table, right, bounds, method="bvls", tol=_PRECISION**2)
        if not solution.success:
            raise SssiError(f"no activations at sample {instant}: {solution.message}")
        activation = np.asarray(solution.x, dtype=np.float64)
        self.solver.warm_start(x=np.concatenate([activation, self.wanted - self.at_full @ activation]))
        return activation, (self.wanted - self.at_full @ activation) * _UNIT
