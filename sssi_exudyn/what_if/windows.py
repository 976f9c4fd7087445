"""A long run in stretches that follow one another, each beginning with the state in which the last one ended.

Least squares over all of a run cost the square of its length, since a correction moves all that comes after it.  A
skier sees some seconds ahead.  So he decides for ``HORIZON``, goes on for ``ADVANCE``, and decides again from there
(a receding horizon).  That costs as much as the run is long.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.carved_run import CarvedMoment, carved_run
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.what_if.question import STEP, Question, Stretch
from sssi_exudyn.what_if.solve import Solution, descend

HORIZON: Final = 4.0
"""s that a skier decides for at once: two to three turns."""
ADVANCE: Final = 2.0
"""s that he goes before he decides again: what the end of a horizon leaves open is 2 s ahead and not skied."""
_CLOSE: Final = 1e-9
"""s; knots are sums of spacings."""


def needs_windows(question: Question) -> bool:
    """Return whether a question is answered in stretches: where the snow decides the heading, which takes long."""
    start, stop = question.nodes[[0, -1]]
    return question.recorded.snow_turns and question.keep != "line" and bool(stop - start > HORIZON)


def solve_in_windows(question: Question, progress: Advance = silent, *, nearby: Solution | None = None) -> Solution:
    """Return the corrections that are the smallest over each stretch.

    nearby : as ``solve`` has it

    Raises SimulationDiverged when a movement that was decided on cannot be played.
    """
    start, stop = question.nodes[[0, -1]].tolist()
    begins = question.supports.begins
    unknowns = np.zeros(question.size) if nearby is None else nearby.unknowns
    moment, converged, rounds = None, True, 0
    first, last = max(start, float(begins[0])), start
    while last < stop:
        decided, last = last, min(first + HORIZON, stop)
        if first > start:
            moment = _moment(question, unknowns, moment, first)
        if nearby is None:
            unknowns = _at_the_same_pace(question, unknowns, first, decided)
        stretch = Stretch(moment, last, unknowns, _open(question, first, last))
        window = question.during(stretch, first)
        given = unknowns[stretch.free]
        report = _in_stretch(progress, (decided - start) / (stop - start), last)
        solution = descend(window, given, window.play(given), report)
        unknowns, rounds = window.of_run(solution.unknowns), rounds + solution.rounds
        converged = converged and solution.converged
        first = float(begins[np.argmin(np.abs(begins - first - ADVANCE))])
    played = question.play(unknowns)
    return Solution(question, unknowns, played, question.cost(unknowns, played), rounds, converged)


def _in_stretch(progress: Advance, share: float, last: float) -> Advance:
    """Return what reports the rounds of a stretch up to ``last`` (s), before which that share of the run is decided."""
    return lambda _share, detail: progress(share, f"until {last:.1f} s, {detail}")


def _at_the_same_pace(question: Question, unknowns: Array, first: float, decided: float) -> Array:
    """Return the unknowns of a skier who goes on, after what is ``decided`` (s), at his mean pace since ``first`` (s):
    a first guess.
    """
    if not question.intent.paced:
        return unknowns
    begins, guess = question.supports.begins, unknowns.copy()
    pace = guess[-len(begins) :]
    known = (begins >= first) & (begins < decided)
    pace[begins >= decided] = np.mean(pace[known]) if np.any(known) else 0.0
    return guess


def _open(question: Question, first: float, last: float) -> NDArray[np.intp]:
    """Return which unknowns act within a stretch and not before it."""
    begins, count = question.supports.begins, question.supports.count
    acting = np.flatnonzero(((begins >= first - _CLOSE) | (first <= question.nodes[0])) & (begins < last))
    return (np.arange(question.size // count)[:, None] * count + acting).ravel()


def _moment(question: Question, unknowns: Array, before: CarvedMoment | None, at: float) -> CarvedMoment:
    """Return the run at the last step before an instant (s) of the recorded clock.

    before : the run at an earlier instant; None for its start
    """
    motion, pace = question.movement(unknowns)
    model = replace(question.asked, terms=pace.retimed(question.asked.terms))
    start = motion.start if before is None else before.time
    steps = int((float(pace.own(np.array([at]))[0]) - start) / STEP + _CLOSE)
    prepared = prepare(model, motion, step=STEP, start=start, stop=start + steps * STEP)
    return carved_run(model, prepared, begin=before).end()
