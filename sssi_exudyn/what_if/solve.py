"""The smallest corrections that keep what the skier keeps: Gauss and Newton's method with Levenberg's damping."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.what_if.question import Played, Question

_ROUNDS: Final = 15
_SETTLED: Final = 0.02
"""Scales of any unknown by which the last round moves at most."""
_GAINED: Final = 1e-3
"""Share of ½|r|² below which a round gains nothing more."""
_LITTLE: Final = 1.0
"""½|r|² of which a share counts where it is less: a figure by its standard deviation."""
_DAMPINGS: Final = (0.0, 0.3, 3.0, 30.0, 300.0, 3000.0)
_KEPT: Final = 0.25
"""Share of the promised decrease with which a step is taken."""


@dataclass(frozen=True)
class Solution:
    """A solved what-if.

    unknowns : (size,);  played : the asked model with the corrected movement
    by_unknown : (n, figures, size) derivatives at the end;  cost : ½|r|²
    rounds, converged : how the search ended
    """

    question: Question
    unknowns: Array
    played: Played
    by_unknown: Array
    cost: float
    rounds: int
    converged: bool

    @property
    def jacobian(self) -> Array:
        """Return dr/du at the end."""
        return self.question.jacobian(self.by_unknown)


def solve(question: Question, progress: Advance = silent, *, nearby: Solution | None = None) -> Solution:
    """Return the smallest corrections.

    nearby : solution of the question for a skier who keeps the same less or more strictly; the search starts there
    """
    unknowns = np.zeros(question.size) if nearby is None else nearby.unknowns
    played = question.unchanged if nearby is None else nearby.played
    residual = question.residual(unknowns, played)
    cost, converged, rounds = _half_square(residual), question.size == 0, 0
    by_unknown = question.linearise(unknowns, played)
    while not converged and rounds < _ROUNDS:
        rounds += 1
        jacobian = question.jacobian(by_unknown)
        step, tried, value = _step(question, unknowns, residual, jacobian)
        if tried is None:
            converged = not np.any(step)
            break
        gained, moved = cost - value, float(np.max(np.abs(step)))
        unknowns, played, cost = unknowns + step, tried, value
        residual = question.residual(unknowns, played)
        by_unknown = question.linearise(unknowns, played)
        converged = moved < _SETTLED or gained < _GAINED * max(cost, _LITTLE)
        progress(None, f"round {rounds}: moved by {moved:.2f} scales, misfit {cost:.1f}")
    return Solution(question, unknowns, played, by_unknown, cost, rounds, converged)


def _half_square(residual: Array) -> float:
    return 0.5 * float(residual @ residual)


def _step(question: Question, unknowns: Array, residual: Array, jacobian: Array) -> tuple[Array, Played | None, float]:
    """Return the step, the run after it, and ½|r|² there.  There is no run where no step lessens it, and no step where
    the undamped one promises nothing.
    """
    cost = _half_square(residual)
    curvature, slope = jacobian.T @ jacobian, jacobian.T @ residual
    for damping in _DAMPINGS:
        step = np.asarray(-np.linalg.solve(curvature + damping * np.eye(len(slope)), slope), dtype=np.float64)
        promised = -float(slope @ step + 0.5 * step @ curvature @ step)
        if damping == 0.0 and promised < _GAINED * max(cost, _LITTLE):
            return np.zeros(len(slope)), None, cost
        try:
            played = question.play(unknowns + step)
        except SimulationDiverged:
            continue
        value = _half_square(question.residual(unknowns + step, played))
        if cost - value > _KEPT * promised:
            return step, played, value
    return step, None, cost
