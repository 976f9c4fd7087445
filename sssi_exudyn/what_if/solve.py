"""The smallest corrections that keep what the skier keeps: Gauss and Newton's method with Levenberg's damping."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.what_if.question import Played, Question

ROUNDS: Final = 15
_SETTLED: Final = 0.02
"""Scales of any unknown by which the last round moves at most."""
_GAINED: Final = 1e-3
"""Share of the cost below which a round gains nothing more."""
_GAINED_BY_EDGES: Final = 0.02
"""The same where edges cut: their walls yield and hold again, at whose kinks rounds go on gaining next to nothing."""
_LITTLE: Final = 1.0
"""Cost of which a share counts where it is less: a figure by its standard deviation."""
_DAMPINGS: Final = (0.0, 0.3, 3.0, 30.0, 300.0, 3000.0)
_KEPT: Final = 0.25
"""Share of the promised decrease with which a step is taken."""


@dataclass(frozen=True)
class Solution:
    """A solved what-if.

    unknowns : (size,);  played : the asked model with the corrected movement;  cost : ½|r|² + w T
    rounds, converged : how the search ended
    """

    question: Question
    unknowns: Array
    played: Played
    cost: float
    rounds: int
    converged: bool

    @cached_property
    def by_unknown(self) -> Array:
        """(n, figures, size) derivatives at the end."""
        return self.question.linearise(self.unknowns, self.played)

    @property
    def jacobian(self) -> Array:
        """Return dr/du at the end."""
        return self.question.jacobian(self.by_unknown)


def solve(
    question: Question, progress: Advance = silent, *, nearby: Solution | None = None, most: int = ROUNDS
) -> Solution:
    """Return the smallest corrections.

    nearby : solution of the question for a skier who keeps the same less or more strictly; the search starts there
    most : rounds after which the search is given up
    """
    unknowns = np.zeros(question.size) if nearby is None else nearby.unknowns
    return descend(question, unknowns, question.unchanged if nearby is None else nearby.played, progress, most)


def descend(
    question: Question, unknowns: Array, played: Played, progress: Advance = silent, most: int = ROUNDS
) -> Solution:
    """Return the smallest corrections; the search starts at ``unknowns`` (size,), which were played."""
    cost, converged, rounds = question.cost(unknowns, played), question.size == 0, 0
    least = _GAINED_BY_EDGES if is_carved(question.asked.terms) else _GAINED
    while not converged and rounds < most:
        rounds += 1
        by_unknown = question.linearise(unknowns, played)
        slope = question.slope(unknowns, played, by_unknown)
        step, tried, value = _step(question, unknowns, (cost, slope), question.jacobian(by_unknown), least)
        if tried is None:
            converged = not np.any(step)
            break
        gained, moved = cost - value, float(np.max(np.abs(step)))
        unknowns, played, cost = unknowns + step, tried, value
        converged = moved < _SETTLED or gained < least * max(abs(cost), _LITTLE)
        progress(None, f"round {rounds}: moved by {moved:.2f} scales, misfit {cost:.1f}")
    return Solution(question, unknowns, played, cost, rounds, converged)


def _step(
    question: Question, unknowns: Array, here: tuple[float, Array], jacobian: Array, least: float
) -> tuple[Array, Played | None, float]:
    """Return the step, the run after it, and the cost there.  There is no run where no step lessens it, and no step
    where the undamped one promises nothing.

    here : the cost, and its slope (size,);  least : share of the cost that is worth a step
    """
    cost, slope = here
    curvature = jacobian.T @ jacobian
    for damping in _DAMPINGS:
        step = np.asarray(-np.linalg.solve(curvature + damping * np.eye(len(slope)), slope), dtype=np.float64)
        promised = -float(slope @ step + 0.5 * step @ curvature @ step)
        if damping == 0.0 and promised < least * max(abs(cost), _LITTLE):
            return np.zeros(len(slope)), None, cost
        try:
            played = question.play(unknowns + step)
        except SimulationDiverged:
            continue
        value = question.cost(unknowns + step, played)
        if cost - value > _KEPT * promised:
            return step, played, value
    return step, None, cost
