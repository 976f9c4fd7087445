"""Two linked turns, a right one and a left one, as in the paper: mean and spread over all such pairs of a run."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from sssi_exudyn.analysis.turns import Turn, Turns
from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.section import Runs

SAMPLES: Final = 100
"""Points a turn: 20 ms apart in a turn of 2 s, an eighth of a period at the 6 Hz of the filter."""

Pair = tuple[Turn, Turn]


@dataclass(frozen=True)
class Curve:
    """A quantity over two linked turns.

    time : (m,) s from the first transition
    mean, spread : (m,) over the pairs; the standard deviation is NaN where there is one pair only
    """

    time: Array
    mean: Array
    spread: Array


@dataclass(frozen=True)
class Cycle:
    """Turns that are shown together, and their time axis: each turn stretched to the mean duration of its kind.

    A run without two linked turns is shown whole, as it was: ``pairs`` is empty.

    samples : (n,) s, times of the run's samples
    """

    samples: Array
    turns: Turns
    pairs: tuple[Pair, ...]

    @property
    def durations(self) -> Array:
        """Mean durations (2,) s of first and second turn."""
        return np.asarray(np.mean([[turn.duration for turn in pair] for pair in self.pairs], axis=0))

    @property
    def transitions(self) -> Array:
        """Transitions (k,) s from the start of the axis."""
        if self.pairs:
            return np.concatenate([[0.0], np.cumsum(self.durations)])
        bounds = {bound for turn in self.turns.turns for bound in (turn.start, turn.end)}
        return np.asarray(np.array(sorted(bounds)) - self.samples[0])

    @property
    def phases(self) -> Array:
        """Begins (k,) s of control and completion, from the start of the axis."""
        if self.pairs:
            marks = self.transitions
            return np.array([a + (b - a) * third / 3.0 for a, b in pairwise(marks) for third in (1, 2)])
        bounds = [turn.phases[name][0] for turn in self.turns.turns for name in ("control", "completion")]
        return np.asarray(np.array(bounds) - self.samples[0])

    @property
    def shown(self) -> tuple[float, float]:
        """Begin and end (s, the recording's clock) of one pair, the one in the middle of the run; else of the run."""
        if not self.pairs:
            return float(self.samples[0]), float(self.samples[-1])
        first, second = self.pairs[len(self.pairs) // 2]
        return first.start, second.end

    def curve(self, values: Array) -> Curve:
        """Return the mean of ``values`` (n,), known at ``samples``, over the pairs."""
        if not self.pairs:
            return Curve(self.samples - self.samples[0], values, np.full(len(values), np.nan))
        share = np.linspace(0.0, 1.0, SAMPLES)
        rows = [
            np.concatenate([np.interp(turn.start + share * turn.duration, self.samples, values) for turn in pair])
            for pair in self.pairs
        ]
        first, second = self.durations
        time = np.concatenate([first * share, first + second * share])
        spread = np.std(rows, axis=0, ddof=1) if len(rows) > 1 else np.full(len(time), np.nan)
        return Curve(time, np.mean(rows, axis=0), spread)


def cycles_of(runs: Runs) -> list[Cycle]:
    """Return the linked turns of each run."""
    return [cycle_of(run.time, run.turns) for run in runs]


def cycle_of(time: Array, turns: Turns) -> Cycle:
    """Select the linked ones of the ``turns`` of a run sampled at ``time`` (n,) s.

    The right turn is first; where no pair begins with a right turn, the left one is first.
    """
    linked = turns.linked_pairs()
    from_right = tuple(pair for pair in linked if pair[0].side == "right")
    return Cycle(time, turns, from_right or linked)
