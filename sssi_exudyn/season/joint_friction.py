"""Friction of the runs of one descent together: the place's by stretch, each run's own, and what differs.

All runs pass the same ground, whose heights are unknown but one.  So the errors of receivers' heights, which decide
the friction of a single run, leave the differences between runs.  Friction of run r on stretch s, over its own way, is

    f = place + stretch + run + scatter (+ difference)

A difference is what one run alone has on one stretch beyond its own scatter; few stretches have one (a spike at zero,
or a slab).  Energy from place to place is the measurement: v²/2g and heights at the places, the air's work between
them.  Everything but the scatter is linear and Gaussian.

Runs and stretches have wide priors, so that their intervals hold what they state for a single run that differs, too.
The scatter of each run is unknown and averaged over a grid by its evidence, the others' at their best.
Differences are added while the runs become more probable by them.  The probability of each is that against none and
against every other in its stead.

Sources: Gelman and Hill, Data Analysis Using Regression and Multilevel Models (2007), ch. 12; T. J. Mitchell,
J. J. Beauchamp, J. Am. Stat. Assoc. 83 (1988) 1023 (spike and slab); MacKay 2003, ch. 28.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import expit, logsumexp, ndtri

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.mixture import Mixture
from sssi_exudyn.fitting.few_sensors.path_balance import FRICTION
from sssi_exudyn.season.stretches import Passage

SCATTERS: Final = (0.0025, 0.005, 0.01, 0.02, 0.04, 0.08)
"""Possible spreads of a run's friction from stretch to stretch: from the snow's own to a skier who stops somewhere."""
_UNLIKE: Final = 1.2
"""Spread of the runs' scatters, logarithmic: a third or three times as much in a third of the runs."""
RUN: Final = 0.05
"""Prior standard deviation of a run's friction: dry and wet snow, old wax and new."""
STRETCH: Final = 0.1
"""The same of the place from stretch to stretch: skiers brake where it is steep."""
SIZE: Final = 0.05
"""Standard deviation of a difference on one stretch: deep snow on half of it, a swing to a halt on a third."""
RARE: Final = 0.1
"""Share of runs that differ all along, and of those that have a difference somewhere."""
ALIKE, OTHER = 0.005, 0.03
"""Standard deviations of friction of runs that do not differ and of runs that do."""
_DRAG: Final = 0.25, 0.1
"""Error of the drag area, relative: one for a skier (as in ``path_balance``), and one of each run's posture."""
_OFFSET: Final = 30.0
"""m; constant error of a run's heights: weather moves a barometer by as much from day to day."""
_GROUND: Final = 1000.0
"""m; heights are unknown beforehand."""
_NINE_OF_TEN: Final = float(ndtri(0.9))
"""Standard deviations by which a difference exceeds the least that is noticed, so that noise seldom hides it."""
LARGEST: Final = 0.3
"""Largest difference that is thought of: a snowplough on the steep against gliding."""
_SIZES: Final = np.geomspace(0.002, LARGEST, 150)
"""Differences among which the least that is noticed is sought: 3 % apart."""
_MOST: Final = 20
"""Maximum number of differences of a descent."""
_ROUNDS: Final = 3
"""Searches for the scatter of each run in turn: no run changes in a fourth."""


@dataclass(frozen=True)
class Range:
    """An estimate with its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class StretchFriction:
    """The place on a stretch, of all runs together.

    begin_m, end_m : along the descent;  drop_m : of the ground
    friction : effective friction of the runs on average;  apart : against the other stretches
    """

    begin_m: float
    end_m: float
    drop_m: float
    friction: Range
    apart: Range


@dataclass(frozen=True)
class RunFriction:
    """A run against the others of the descent, on all stretches alike.

    more : its friction over that of the others on average, which are those that are not ``apart``
    differs : probability that it is another than theirs
    apart : whether that is more probable than not, and two others at least are left
    seen, seen_on_stretch : least difference on all stretches alike, and on one of them, that would be noticed nine
        times of ten; ``LARGEST`` where all would pass for scatter
    scatter : its spread from stretch to stretch
    """

    run: str
    more: Range
    differs: float
    apart: bool
    seen: float
    seen_on_stretch: float
    scatter: float


@dataclass(frozen=True)
class Difference:
    """What one run alone has on one stretch.

    stretch : number from 0;  size : more friction there, if it is there
    probability : that it is there, and no other in its stead
    """

    run: str
    stretch: int
    size: Range
    probability: float


@dataclass(frozen=True)
class JointFriction:
    """What the runs of one descent show together.

    place : letter of the descent;  friction : effective friction of the runs on average, over all stretches
    left_out : runs of the descent that are not compared
    """

    place: str
    friction: Range
    stretches: tuple[StretchFriction, ...]
    runs: tuple[RunFriction, ...]
    differences: tuple[Difference, ...]
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Block:
    """What a run says with one scatter: −½ θᵀ matrix θ + vector·θ + constant, of its own unknowns θ (m,).

    These are the ground, the place, the stretches, its skier's drag, itself, and last its differences.
    """

    matrix: Array
    vector: Array
    constant: float


@dataclass(frozen=True)
class _State:
    """A model: the number of each run's scatter (r,), and the differences that are there, run and stretch."""

    scatters: tuple[int, ...]
    chosen: tuple[tuple[int, int], ...] = ()

    def scattered(self, run: int, number: int) -> _State:
        """Return the model with another scatter of one run."""
        return replace(self, scatters=(*self.scatters[:run], number, *self.scatters[run + 1 :]))

    def without(self, cell: tuple[int, int]) -> _State:
        """Return the model without a difference."""
        return replace(self, chosen=tuple(other for other in self.chosen if other != cell))


@dataclass(frozen=True)
class _Posterior:
    """Of the unknowns that all models have, and the chosen differences after them: mean, covariance, log evidence."""

    mean: Array
    covariance: Array
    evidence: float


class _Day:
    """All runs of a descent, and the places of the unknowns: ground, place, stretches, drag of each skier, runs."""

    def __init__(self, passages: Sequence[Passage]) -> None:
        self.runs, self.stretches = len(passages), len(passages[0].way)
        skiers = sorted({passage.skier for passage in passages})
        sizes = (self.stretches + 1, 1, self.stretches, len(skiers), self.runs)
        ends = np.cumsum((0, *sizes)).tolist()
        kinds = [np.arange(begin, end) for begin, end in itertools.pairwise(ends)]
        self.ground, self.place, self.stretch, drag, self.run = kinds
        spreads = (_GROUND, FRICTION.sigma, STRETCH, _DRAG[0], RUN)
        self.precision = np.concatenate(
            [np.full(len(kind), spread**-2) for kind, spread in zip(kinds, spreads, strict=True)]
        )
        shared = [self.ground, self.place, self.stretch]
        self.columns = [
            np.concatenate([*shared, drag[[skiers.index(passage.skier)]], self.run[[row]]])
            for row, passage in enumerate(passages)
        ]
        level = float(np.mean([passage.height for passage in passages]))
        self.blocks = [[_block(passage, level, scatter) for scatter in SCATTERS] for passage in passages]

    def solve(self, state: _State) -> _Posterior:
        """Return the posterior of a model."""
        common = len(self.precision)
        precision = np.diag(np.concatenate([self.precision, np.full(len(state.chosen), SIZE**-2)]))
        vector, constant = np.zeros(len(precision)), 0.5 * float(np.sum(np.log(np.diag(precision))))
        for run, number in enumerate(state.scatters):
            block, columns = self.blocks[run][number], self.columns[run]
            own = [(at, stretch) for at, (of, stretch) in enumerate(state.chosen) if of == run]
            rows = np.concatenate([columns, [common + at for at, _ in own]]).astype(np.intp)
            kept = np.concatenate([np.arange(len(columns)), [len(columns) + s for _, s in own]]).astype(np.intp)
            precision[np.ix_(rows, rows)] += block.matrix[np.ix_(kept, kept)]
            vector[rows] += block.vector[kept]
            constant += block.constant
        factor = cho_factor(precision, lower=True)
        covariance = cho_solve(factor, np.eye(len(precision)))
        mean = covariance @ vector
        constant += 0.5 * float(vector @ mean) - float(np.sum(np.log(np.diag(factor[0]))))
        return _Posterior(mean, covariance, constant)

    def gains(self, state: _State, run: int, posterior: _Posterior) -> tuple[Array, Array]:
        """Return the log evidence (s,) that a difference on each stretch of a run brings, and what the runs alone tell
        of it (s,), as a precision.
        """
        block, columns = self.blocks[run][state.scatters[run]], self.columns[run]
        own = [(at, stretch) for at, (of, stretch) in enumerate(state.chosen) if of == run]
        rows = np.concatenate([columns, [len(self.precision) + at for at, _ in own]]).astype(np.intp)
        kept = np.concatenate([np.arange(len(columns)), [len(columns) + s for _, s in own]]).astype(np.intp)
        cells = slice(len(columns), None)
        across = block.matrix[kept, cells]
        known = posterior.covariance[np.ix_(rows, rows)]
        precision = np.diag(block.matrix)[cells] - np.einsum("ij,ij->j", across, known @ across)
        pull = block.vector[cells] - across.T @ posterior.mean[rows]
        total = np.maximum(precision, 0.0) + SIZE**-2
        return 0.5 * pull**2 / total - 0.5 * np.log(total * SIZE**2), np.maximum(precision, 0.0)


def _block(passage: Passage, level: float, scatter: float) -> _Block:
    count = len(passage.way)
    below = np.eye(count, count + 1) - np.eye(count, count + 1, 1)  # what is at a place less at the next
    seen = np.concatenate([passage.height - level, below @ passage.kinetic - passage.air - FRICTION.mean * passage.way])
    way, own = passage.way[:, None], np.diag(passage.way)
    design = np.block([
        [np.eye(count + 1), np.zeros((count + 1, 2 * count + 3))],
        [-below, way, own, passage.air[:, None], way, own],
    ])  # fmt: skip
    factor = cho_factor(_noise(passage, below, scatter), lower=True)
    weighed = cho_solve(factor, np.column_stack([design, seen]))
    constant = -0.5 * float(seen @ weighed[:, -1]) - float(np.sum(np.log(np.diag(factor[0]))))
    return _Block(design.T @ weighed[:, :-1], design.T @ weighed[:, -1], constant)


def _noise(passage: Passage, below: Array, scatter: float) -> Array:
    """Return the covariance (2 s + 1, 2 s + 1) of a run's heights and energies about what the unknowns say."""
    kept = np.exp(-np.abs(np.subtract.outer(passage.time, passage.time)) / passage.wander.correlation_time)
    heights = passage.wander.sigma**2 * kept + passage.height_sigma**2 * np.eye(len(kept)) + _OFFSET**2
    ground, speeds = np.diag(passage.off**2), np.diag(passage.kinetic_sigma**2)
    energies = below @ (ground + speeds) @ below.T + np.diag((scatter * passage.way) ** 2)
    energies += _DRAG[1] ** 2 * np.outer(passage.air, passage.air)
    return np.block([[heights + ground, -ground @ below.T], [-below @ ground, energies]])


def compare_runs(place: str, names: Sequence[str], places: Array, passages: Sequence[Passage]) -> JointFriction:
    """Compare two or more runs of a descent.

    place : its letter;  names : of the runs;  places : (s + 1,) m along it;  passages : of the runs
    """
    search = _Search(_Day(passages))
    state = search.differences()
    day = search.day
    answers = [search.answer(state, run) for run in range(day.runs)]
    answer = search.answer(state)
    average = answer.row({int(day.place[0]): 1.0} | dict.fromkeys(day.run.tolist(), 1.0 / day.runs))
    shares = np.diff(places) / (places[-1] - places[0])
    whole = average + answer.row(dict(zip(day.stretch.tolist(), shares.tolist(), strict=True)))
    stretches = []
    for s, (begin, end) in enumerate(itertools.pairwise(places.tolist())):
        drop = answer.row({int(day.ground[s]): 1.0, int(day.ground[s + 1]): -1.0})
        stretches.append(
            StretchFriction(
                begin_m=begin,
                end_m=end,
                drop_m=answer.of(drop).mean,
                friction=answer.of(average + answer.row({int(day.stretch[s]): 1.0})).range(FRICTION.mean),
                apart=answer.of(answer.against(day.stretch[s], np.delete(day.stretch, s))).range(),
            )
        )
    apart = _apart(day, answers)
    runs = []
    for r, (name, own) in enumerate(zip(names, answers, strict=True)):
        more, differs = _over_others(day, own, r, apart)
        scatter = float(np.exp(own.share @ np.log(SCATTERS)))
        on_stretch = search.least_seen(state, r)
        runs.append(RunFriction(name, more.range(), differs, r in apart, more.least_other(), on_stretch, scatter))
    differences = []
    for at, (run, stretch) in enumerate(state.chosen):
        size = answers[run].of(answers[run].row({len(day.precision) + at: 1.0})).range()
        probability = search.probability(state, (run, stretch))
        differences.append(Difference(names[run], stretch, size, probability))
    return JointFriction(
        place=place,
        friction=answer.of(whole).range(FRICTION.mean),
        stretches=tuple(stretches),
        runs=tuple(runs),
        differences=tuple(sorted(differences, key=lambda difference: -difference.probability)),
    )


def _apart(day: _Day, answers: Sequence[_Answer]) -> list[int]:
    """Return the runs that differ, the most certain first; of two runs none is the one that differs."""
    apart: list[int] = []
    while day.runs - len(apart) > 2:
        left = [run for run in range(day.runs) if run not in apart]
        differs = [_over_others(day, answers[run], run, apart)[1] for run in left]
        if max(differs) <= 0.5:
            break
        apart.append(left[int(np.argmax(differs))])
    return apart


def _over_others(day: _Day, own: _Answer, run: int, apart: Sequence[int]) -> tuple[_Departure, float]:
    """Return a run's friction over that of the others that are not ``apart``, and how probably it differs."""
    others = day.run[[other for other in range(day.runs) if other != run and other not in apart]]
    more = own.of(own.against(day.run[run], others))
    return more, more.other(RUN * float(np.sqrt(1.0 + 1.0 / len(others))))


class _Search:
    """The search for each run's scatter and for differences."""

    def __init__(self, day: _Day) -> None:
        self.day = day
        alike = [day.solve(_State((number,) * day.runs)).evidence for number in range(len(SCATTERS))]
        self._prior = np.zeros(len(SCATTERS))
        scatters = self.scattered(_State((int(np.argmax(alike)),) * day.runs)).scatters
        # of the usual run: a difference in one of them does not count for all
        usual = float(np.median(np.log(SCATTERS)[list(scatters)]))
        self._prior = -0.5 * ((np.log(SCATTERS) - usual) / _UNLIKE) ** 2
        self._begin = scatters
        share = RARE / day.stretches
        self._log_odds = float(np.log(share / (1.0 - share)))

    def scattered(self, state: _State) -> _State:
        """Return a model with the most probable scatter of each run in turn."""
        for _ in range(_ROUNDS):
            before = state
            for run in range(self.day.runs):
                state = state.scattered(run, int(np.argmax(self._weights(state, run)[0])))
            if state == before:
                break
        return state

    def _weights(self, state: _State, run: int) -> tuple[Array, list[_Posterior]]:
        """Return the log weight (c,) and the posterior of a model with each scatter of one run."""
        posteriors = [self.day.solve(state.scattered(run, number)) for number in range(len(SCATTERS))]
        return np.array([posterior.evidence for posterior in posteriors]) + self._prior, posteriors

    def log_odds(self, state: _State) -> Array:
        """Return the log odds (r, s) of each difference besides the chosen; −∞ for these."""
        odds = np.empty((self.day.runs, self.day.stretches))
        for run in range(self.day.runs):
            weights, posteriors = self._weights(state, run)
            gains = [
                self.day.gains(state.scattered(run, number), run, posterior)[0]
                for number, posterior in enumerate(posteriors)
            ]
            odds[run] = logsumexp(weights[:, None] + gains, axis=0) - logsumexp(weights) + self._log_odds
        for cell in state.chosen:
            odds[cell] = -np.inf
        return odds

    def differences(self) -> _State:
        """Return the model with the differences that make the runs more probable, added one after another."""
        state = self.scattered(_State(self._begin))
        while len(state.chosen) < _MOST:
            odds = self.log_odds(state)
            if np.max(odds) <= 0.0:
                break
            run, stretch = divmod(int(np.argmax(odds)), self.day.stretches)
            state = self.scattered(replace(state, chosen=(*state.chosen, (run, stretch))))
        return state

    def probability(self, state: _State, cell: tuple[int, int]) -> float:
        """Return the probability of a chosen difference against none and every other in its stead."""
        odds = self.log_odds(self.scattered(state.without(cell)))
        return float(np.exp(odds[cell] - logsumexp(np.append(odds.ravel(), 0.0))))

    def answer(self, state: _State, run: int = 0) -> _Answer:
        """Return the posterior of a model, averaged over the scatter of one run."""
        weights, posteriors = self._weights(state, run)
        return _Answer(np.exp(weights - logsumexp(weights)), posteriors)

    def least_seen(self, state: _State, run: int) -> float:
        """Return the least difference on a run's usual stretch that is chosen nine times of ten, ``LARGEST`` at most.

        Part of a difference passes for scatter: without noise, one of size x lowers the evidence of a model without it
        by ½ x² precision.
        """
        weights, posteriors = self._weights(state, run)
        precision = np.array(
            [
                np.median(self.day.gains(state.scattered(run, number), run, posterior)[1])
                for number, posterior in enumerate(posteriors)
            ]
        )
        total = precision + SIZE**-2
        without = weights - 0.5 * _SIZES[:, None] ** 2 * precision
        there = without + 0.5 * (_SIZES[:, None] * precision) ** 2 / total - 0.5 * np.log(total * SIZE**2)
        odds = logsumexp(there, axis=1) - logsumexp(without, axis=1) + self._log_odds
        usual = max(float(precision[int(np.argmax(weights))]), SIZE**-2)
        return min(_first_above(odds) + _NINE_OF_TEN / float(np.sqrt(usual)), LARGEST)


def _first_above(log_odds: Array) -> float:
    """Return the least of ``_SIZES`` (n,) at which log odds (n,) are above zero; the largest where none are."""
    above = log_odds > 0.0
    return float(_SIZES[np.argmax(above)] if np.any(above) else _SIZES[-1])


@dataclass(frozen=True)
class _Answer:
    """Posteriors with their shares (c,)."""

    share: Array
    posteriors: Sequence[_Posterior]

    def row(self, shares: Mapping[int, float]) -> Array:
        """Return a linear combination (k,) of the unknowns, by their places."""
        row = np.zeros(len(self.posteriors[0].mean))
        row[list(shares)] = list(shares.values())
        return row

    def against(self, one: int, others: NDArray[np.intp]) -> Array:
        """Return what one unknown is over the mean of others."""
        return self.row({int(one): 1.0} | dict.fromkeys(others.tolist(), -1.0 / len(others)))

    def of(self, combination: Array) -> _Departure:
        """Return the distribution of a linear combination."""
        means = np.array([posterior.mean @ combination for posterior in self.posteriors])
        variances = np.array([combination @ posterior.covariance @ combination for posterior in self.posteriors])
        return _Departure(self.share, means, np.sqrt(variances))


@dataclass(frozen=True)
class _Departure(Mixture):
    """A number, of which it is asked whether it is another than zero."""

    def other(self, prior: float) -> float:
        """Return the probability of a number that is another than zero, whose ``prior`` standard deviation was wide."""
        shrunk = 1.0 - (self.sigmas / prior) ** 2
        return float(self.weights @ expit(_log_odds_of_other(self.means / shrunk, self.sigmas**2 / shrunk)))

    def least_other(self) -> float:
        """Return the least number whose ``other`` is above one half nine times of ten."""
        variance = float(self.weights @ self.sigmas**2)
        return _first_above(_log_odds_of_other(_SIZES, variance)) + _NINE_OF_TEN * float(np.sqrt(variance))

    def range(self, shift: float = 0.0) -> Range:
        """Return mean and 90 % interval, ``shift`` added."""
        return Range(self.mean + shift, self.quantile(0.05) + shift, self.quantile(0.95) + shift)


def _log_odds_of_other(measured: Array, variance: Array | float) -> Array:
    """Return the log odds of a run that differs, by the spread of such runs, against one that does not."""
    logs = [-0.5 * (measured**2 / (variance + s**2) + np.log(variance + s**2)) for s in (ALIKE, OTHER)]
    return np.asarray(logs[1] - logs[0] + np.log(RARE / (1.0 - RARE)))
