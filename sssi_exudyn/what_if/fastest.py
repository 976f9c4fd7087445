"""The fastest run that a skier can do on his path: other line and stance, as far as the limits let him.

    ½ |r|² + w T least

T is how much later he comes to the end of the path, and w the worth of a second.  A skier to whom time is worth more
leans and steers further from what he did, cuts turns within his path's scale, and is less well balanced.  The worth
grows until something is beyond its limit.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.what_if.answer import reasons_of
from sssi_exudyn.what_if.question import Question
from sssi_exudyn.what_if.solve import Solution, solve
from sssi_exudyn.what_if.windows import needs_windows, solve_in_windows

_LEAST: Final = 40.0
"""Worth of a second at which the search begins, in halves of a squared standard deviation: time hardly counts."""
_FACTOR: Final = 4.0
"""From one worth to the next: corrections grow by less, and solutions start from one another."""
_STEPS: Final = 6
_MOST: Final = 5
"""Rounds for each worth; the next one goes on from there."""
_HALVINGS: Final = 2
"""Steps between a worth within the limits and one beyond them: to a factor of 1.4."""


def solutions(question: Question, progress: Advance = silent) -> tuple[Solution, Solution | None]:
    """Return the solution of a question, and that of a stricter skier where a path is kept.

    Raises SimulationDiverged when the asked model cannot play the recorded movement.
    """
    if question.keep == "line":
        return fastest(question, progress), None
    solve_all = solve_in_windows if needs_windows(question) else solve
    solution = solve_all(question, progress)
    return solution, solve_all(question.stricter(), progress, nearby=solution) if question.keep == "path" else None


def fastest(question: Question, progress: Advance = silent) -> Solution:
    """Return the fastest run within the limits, or the unhurried one where that is beyond them."""
    within = solve(question, progress)
    low, high = 0.0, _LEAST
    for _ in range(_STEPS):
        tried = _within(question.hurried(high), within, progress)
        if tried is None:
            break
        low, high, within = high, _FACTOR * high, tried
    for _ in range(_HALVINGS if low > 0.0 else 0):
        middle = float(np.sqrt(low * high))
        tried = _within(question.hurried(middle), within, progress)
        if tried is None:
            high = middle
        else:
            low, within = middle, tried
    return within


def _within(question: Question, nearby: Solution, progress: Advance) -> Solution | None:
    """Return the run of a skier in that hurry; None where it is beyond the limits."""
    try:
        solution = solve(question, progress, nearby=nearby, most=_MOST)
    except SimulationDiverged:
        return None
    return None if reasons_of(solution) else solution
