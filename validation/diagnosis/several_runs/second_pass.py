"""What one run was found to have, asked of the other runs of the day that passed the same place.

Snow keeps to its place: who passes it later meets it again, as strong as before.  A gust or a push keeps to its time.
So each explanation of a finding says what another run measures there: what keeps to a place acts on it with the
strength and the extent that the first run knows, as far as it knows them; of all others nothing does, or something of
that run's own that keeps to its time, which is as rare as anything that is missing.  What of its own would keep to the
place would be in the first run too.

Terrain says nothing here.  Both runs' snow surface is one, but is estimated of each by itself: of any real roll that
the first run shows the second would make its measurements more probable, whatever else was missing there.

A place is what both find on a map, from their fixes; heights, by which receivers differ by metres, do not count.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu, slope_to_level
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import best_evidence
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.model import add_part, name_in_model
from sssi_exudyn.recording.instruments.gps import enu_from
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import (
    evidence_by_size,
    extended_parameters,
    weigh_refit,
)
from sssi_exudyn.validation.diagnosis.search.explanation import Explanation, Nothing, Refitted, Round
from sssi_exudyn.validation.diagnosis.search.search_result import Accepted, SearchEnd
from sssi_exudyn.validation.diagnosis.state import (
    Reestimate,
    estimate_again,
    fit_model,
    fitted_run,
    linear_model,
    remove,
)
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds


@dataclass(frozen=True)
class Pass:
    """Another run over a place.

    metres : of its path there
    log_evidence : by the name of each explanation that keeps to a place: of what this run measured were it there again,
        less that of all others; None where it cannot be
    """

    run: str
    metres: float
    log_evidence: dict[str, float | None]


@dataclass(frozen=True)
class SamePlace:
    """A finding of one run with what other runs measured at its place.

    before, after : probabilities by the name of the explanation, "nothing" for none, without and with the other runs
    """

    run: str
    finding: str
    before: dict[str, float]
    after: dict[str, float]
    passes: tuple[Pass, ...]
    sentence: str

    @property
    def settled(self) -> bool:
        """Return whether the other runs made a name sure, or another one sure."""
        name, probability = best_of(self.after)
        first, before = best_of(self.before)
        return probability >= THRESHOLDS.sure and (before < THRESHOLDS.sure or name != first)


@dataclass(frozen=True)
class Way:
    """A run's path over its slope: instants (n,) s, the middle of the feet (n, 3) m in the slope frame, and where that
    frame is: inclination and azimuth (rad), origin (as ``Gps.origin``).
    """

    time: Array
    places: Array
    inclination: float
    azimuth: float
    origin: tuple[float, float, float]

    def from_above(self, places: Array, origin: tuple[float, float, float]) -> Array:
        """Return (m, 2) m east and north of ``origin``, of places (m, 3) in this slope frame."""
        return enu_from(places @ slope_to_enu(self.inclination, self.azimuth).T, self.origin, origin)[:, :2]

    def line_in(self, f: float, other: Way) -> float:
        """Return where the place at which this path meets ``f`` (m) lies down the fall line (m) of another's slope
        frame; it goes straight on down the fall line where the path has ended.
        """
        along = np.maximum.accumulate(self.places[:, 0])
        place = np.array([[f, *(np.interp(f, along, axis) for axis in self.places[:, 1:].T)]])
        east, north = self.from_above(place, other.origin)[0]
        down = float(east * np.sin(other.azimuth) + north * np.cos(other.azimuth))
        level = np.maximum.accumulate((other.places @ slope_to_level(other.inclination).T)[:, 0])
        beyond = down - float(np.clip(down, level[0], level[-1]))
        return float(np.interp(down, level, other.places[:, 0])) + beyond / float(np.cos(other.inclination))

    def passes(
        self, other: Way, window: tuple[float, float], near_path: float = THRESHOLDS.near_path
    ) -> NDArray[np.bool_]:
        """Return (n,) instants at which this path is within ``near_path`` (m) of the other's in that time (s)."""
        there = other.places[(other.time >= window[0]) & (other.time <= window[1])]
        if len(there) == 0:
            return np.zeros(len(self.time), dtype=bool)
        begin, end = (other.line_in(float(f), self) for f in (there[:, 0].min(), there[:, 0].max()))
        tree = cKDTree(other.from_above(there, self.origin))
        near = tree.query(self.from_above(self.places, self.origin))[0] <= near_path
        return np.asarray(near & (self.places[:, 0] >= begin) & (self.places[:, 0] <= end))

    def metres(self, inside: NDArray[np.bool_]) -> float:
        """Return the length (m) of the path at those of its instants (n,)."""
        steps = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        return float(np.sum(steps[inside[:-1] & inside[1:]]))


@dataclass(frozen=True)
class _Run:
    """A run of the day: where its search ended, the run there, and its way."""

    name: str
    end: SearchEnd
    fitted: FittedRun
    way: Way


@dataclass(frozen=True)
class _Known:
    """What is known of something that keeps to its place: its term, and its numbers in the slope frame of the run that
    found it; ``lines`` of them are places down the fall line.
    """

    part: Term
    lines: tuple[str, ...]
    numbers: dict[str, Prior]


def ask_other_runs(ends: Mapping[str, SearchEnd], progress: Advance = silent) -> tuple[SamePlace, ...]:
    """Ask the other runs about every finding of each run, by the runs' names, that may keep to its place and may be
    something else, where they passed that place.
    """
    runs = [_run(name, end) for name, end in ends.items()]
    answers = []
    for run in runs:
        for finding in run.end.accepted:
            progress(None, f"{finding.explanation.name} of {run.name} in the other runs")
            asked = _ask(run, finding, [other for other in runs if other is not run])
            if asked is not None:
                answers.append(asked)
    return tuple(answers)


def _run(name: str, end: SearchEnd) -> _Run:
    fitted = fitted_run(end.problem, end.state, end.fit)
    places = fitted.run.foot_position.mean(axis=1)
    way = Way(fitted.run.time, places, fitted.model.inclination, fitted.model.fall_line_azimuth, end.problem.gps.origin)
    return _Run(name, end, fitted, way)


def _ask(run: _Run, finding: Accepted, others: Sequence[_Run]) -> SamePlace | None:
    """Return what the other runs say of a finding; None where they say nothing."""
    thresholds, searched = run.end.problem.thresholds, finding.searched
    rivals = [
        rival
        for rival in searched.explanations
        if isinstance(rival, Nothing | Refitted) and rival.probability >= thresholds.rival
    ]
    keeping = [rival for rival in rivals if isinstance(rival, Refitted) and rival.hypothesis.lines]
    if not keeping or len(rivals) < 2:
        return None
    known = {rival.name: _known(rival, thresholds) for rival in keeping}
    windows = {rival.name: _window(run, rival) for rival in keeping}
    passes = []
    for other in others:
        inside = {name: other.way.passes(run.way, window, thresholds.near_path) for name, window in windows.items()}
        metres = {name: other.way.metres(there) for name, there in inside.items()}
        passed = [name for name, length in metres.items() if length >= thresholds.least_passed]
        if not passed:
            continue
        try:
            gains, known = _weigh_there(run, other, known, {name: inside[name] for name in passed})
        except SimulationDiverged:
            continue
        if gains:
            passes.append(Pass(other.name, max(metres.values()), gains))
    if not passes:
        return None
    after = update(searched, passes)
    named = {
        e.name for some in (searched.explanations, after) for e in some if e.probability >= thresholds.worth_naming
    }
    before, later = (
        {e.name: e.probability for e in some if e.name in named} for some in (searched.explanations, after)
    )
    window = windows.get(finding.explanation.name) or next(iter(windows.values()))
    sentence = _sentence(run.name, window, before, later, passes, thresholds)
    return SamePlace(run.name, finding.explanation.name, before, later, tuple(passes), sentence)


def update(searched: Round, passes: Sequence[Pass]) -> tuple[Explanation, ...]:
    """Return the explanations of a round with what other runs measured at its place, the most probable first.

    Simulated runs had their say of the first run alone, which stays as it is.
    """
    gains = gains_of(passes)
    ranked = searched.ranked(
        [
            replace(explanation, log_evidence=explanation.log_evidence + gains.get(explanation.name, 0.0))
            for explanation in searched.explanations
        ]
    ).explanations
    before = {e.name: 1.0 if not e.by_fits else e.probability / e.by_fits for e in searched.explanations}
    total = sum(e.probability * before[e.name] for e in ranked)
    weighed = [replace(e, probability=e.probability * before[e.name] / total) for e in ranked]
    return tuple(sorted(weighed, key=lambda e: -e.probability))


def gains_of(passes: Sequence[Pass]) -> dict[str, float]:
    """Return the log evidence of all passes together, by the names of what keeps to a place; -inf if impossible."""
    gains: dict[str, float] = {}
    for passed in passes:
        for name, gain in passed.log_evidence.items():
            gains[name] = gains.get(name, 0.0) + (-np.inf if gain is None else gain)
    return gains


def _known(explanation: Refitted, thresholds: Thresholds) -> _Known:
    fit, candidate = explanation.fit, explanation.candidate
    names = [*(group[0] for group in candidate.amplitudes), *candidate.places]
    part = fit.model.owner(names[0].owner)
    assert isinstance(part, Term)
    numbers = {name.key: _what_is_known(fit, name, thresholds) for name in names}
    return _Known(part, explanation.hypothesis.lines, numbers)


def _what_is_known(fit: Refit, name: NumberRef, thresholds: Thresholds) -> Prior:
    value, low, _ = fit.interval(name, thresholds.spread)
    return Prior(value, value - low)


def _window(run: _Run, explanation: Refitted) -> tuple[float, float]:
    """Return when an explanation that keeps to a place acts on its own run (s)."""
    candidate, model = explanation.candidate, explanation.fit.model
    names = [*candidate.strengths, *candidate.places]
    values = {name.key: model.value(name) for name in names}
    numbers = {key: Number(value, value, value, "") for key, value in values.items()}
    window = explanation.hypothesis.window(run.fitted, candidate, numbers)
    return window or (float(run.way.time[0]), float(run.way.time[-1]))


def _weigh_there(
    run: _Run, other: _Run, known: Mapping[str, _Known], inside: Mapping[str, NDArray[np.bool_]]
) -> tuple[dict[str, float | None], dict[str, _Known]]:
    """Return ``Pass.log_evidence`` by the names of ``inside``, and what is ``known`` of each afterwards.

    inside : (n,) by name, when the other run is at the place

    A run says nothing where what it was found to have there cannot be removed separately, as it has two of that name.
    Raises SimulationDiverged where the other run cannot be simulated without what it was found to have there.
    """
    end = other.end
    own = _own_there(other, np.any(list(inside.values()), axis=0))
    if own is None:
        without = Reestimate(end.problem, end.state, end.fit)
    else:
        finding = own.explanation
        if sum(accepted.explanation.name == finding.name for accepted in end.accepted) > 1:
            return {}, dict(known)
        state, less = remove(end.problem, end.state, end.fit, finding.candidate)
        without = Reestimate(*estimate_again(end.problem, state, less, full=end.full))
    neutral = _evidence(without)
    if own is not None:
        neutral = _either(neutral, own, _evidence_of_own(end, without, own.explanation), end.problem)
    gains: dict[str, float | None] = {}
    updated = dict(known)
    for name in inside:
        try:
            there, lines = _meet_again(run, other, without, known[name])
        except SimulationDiverged:
            continue
        possible = BY_NAME[name].possible(there.fit.model)
        gains[name] = _evidence(there) - neutral if possible else None
        updated[name] = _after(known[name], there.fit, lines, end.problem.thresholds)
    return gains, updated


def _evidence(about: Reestimate) -> float:
    return best_evidence(linear_model(about.problem, about.state, about.fit), about.state.levels)[1]


def _own_there(other: _Run, inside: NDArray[np.bool_]) -> Accepted | None:
    """Return the run's own finding that shares most of its time at a place; ``inside`` (n,) says when it is there."""
    shares: dict[int, float] = {}
    for i, accepted in enumerate(other.end.accepted):
        if accepted.explanation.candidate.window is None:
            continue
        begin, end = _window(other, accepted.explanation)
        acts = (other.way.time >= begin) & (other.way.time <= end)
        shares[i] = float(np.sum(acts & inside)) / max(1.0, float(np.sum(acts | inside)))
    best = max(shares, key=lambda i: shares[i], default=None)
    return None if best is None or shares[best] < other.end.problem.thresholds.same_time else other.end.accepted[best]


def _evidence_of_own(end: SearchEnd, without: Reestimate, own: Refitted) -> float:
    """Return the log evidence of a run with its own finding, wherever that was sought."""
    amplitudes, places = extended_parameters(without.fit, own.candidate)
    names = [p.names for p in (*amplitudes, *places)]
    order = [next(i for i, p in enumerate(end.fit.parameters) if p.names == sought) for sought in names]
    fit = end.fit
    ordered = replace(
        fit,
        parameters=tuple(fit.parameters[i] for i in order),
        values=fit.values[order],
        sensitivity=fit.sensitivity[:, order],
        covariance=fit.covariance[np.ix_(order, order)],
    )
    by_size = evidence_by_size(end.problem, end.state, without.fit, own, ordered)
    return weigh_refit(end.problem, end.state, without.fit, own, ordered, by_size).log_evidence


def _either(nothing: float, own: Accepted, evidence: float, problem: DiagnosisProblem) -> float:
    """Return the log evidence of a run in which either nothing is missing at a place or its own finding was there.  Of
    that finding those explanations count that keep to their time, as probable beforehand as in a diagnosis of that run
    alone; ``evidence`` is that of the best of them.
    """
    temper, whole = problem.thresholds.temper, sum(hypothesis.weight for hypothesis in problem.hypotheses)
    logs = [temper * nothing]
    for rival in own.searched.hypotheses:
        if not rival.hypothesis.comes_again:
            behind = own.explanation.log_evidence - rival.log_evidence
            logs.append(temper * (evidence - behind) + float(np.log(rival.hypothesis.weight / whole)))
    return float(np.logaddexp.reduce(logs)) / temper


def _meet_again(run: _Run, other: _Run, without: Reestimate, known: _Known) -> tuple[Reestimate, dict[str, float]]:
    """Estimate a run again that meets what another run knows of; return it, and by how much (m) places lie further down
    its fall line than down the other's.
    """
    lines = {key: run.way.line_in(known.numbers[key].mean, other.way) - known.numbers[key].mean for key in known.lines}
    fixes = float(np.hypot(run.fitted.measurements.gps_sigma, other.fitted.measurements.gps_sigma))
    priors = {
        key: Prior(prior.mean + lines[key], float(np.hypot(prior.sigma, fixes))) if key in lines else prior
        for key, prior in known.numbers.items()
    }
    part = replace(known.part, **{key: prior.mean for key, prior in priors.items()})
    owner = name_in_model(without.fit.model, part)
    more = tuple(Parameter((NumberRef.of(owner, key),), prior) for key, prior in priors.items())
    start = add_part(without.fit.model, part)
    fit = fit_model(without.problem, without.state, start, (*without.fit.parameters, *more), without.state.levels)
    return Reestimate(*estimate_again(without.problem, without.state, fit, full=other.end.full)), lines


def _after(known: _Known, fit: Refit, lines: Mapping[str, float], thresholds: Thresholds) -> _Known:
    """Return what is known once a run has met it; its parameters are the last of ``fit``."""
    numbers = {}
    for key, parameter in zip(known.numbers, fit.parameters[-len(known.numbers) :], strict=True):
        now = _what_is_known(fit, parameter.names[0], thresholds)
        numbers[key] = Prior(now.mean - lines.get(key, 0.0), min(now.sigma, known.numbers[key].sigma))
    return replace(known, numbers=numbers)


def best_of(probabilities: Mapping[str, float]) -> tuple[str, float]:
    """Return the most probable name, and its probability."""
    return max(probabilities.items(), key=lambda item: item[1])


def _sentence(
    run: str,
    window: tuple[float, float],
    before: Mapping[str, float],
    after: Mapping[str, float],
    passes: Sequence[Pass],
    thresholds: Thresholds,
) -> str:
    """Return a finding in words, now that the other runs have been asked."""
    *most, last = [passed.run for passed in passes]
    who = f"{', '.join(most)} and {last}" if most else last
    met = "met it again" if max(gains_of(passes).values()) > 0.0 else "met nothing of it"
    name, probability = best_of(after)
    listed = ", ".join(
        f"{_caption(cause)} ({share:.0%}, by {run} alone {before[cause]:.0%})"
        for cause, share in after.items()
        if cause == name or (probability < thresholds.sure and share >= thresholds.rival)
    )
    return f"{who} passed where {run} was between {window[0]:.1f} s and {window[1]:.1f} s, and {met}: {listed}."


def _caption(name: str) -> str:
    return name if name == NOTHING_MISSING else BY_NAME[name].caption
