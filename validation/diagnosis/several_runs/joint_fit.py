"""Several runs of one day compared together: the same snow, the same air, each its own path.

What one run cannot distinguish, several may: friction and drag take the same speed from one run, but not from a slow
and a fast one.  Friction along and across the ski is one number for all runs, and so is the strength of whatever acts
everywhere; starts, headings, mountings and the capture's errors are each run's own.

Laws are compared by their linear responses first.  The best of them are then fitted to all runs together with the real
term, in turns: each run's own numbers are fitted at the shared ones, and the shared ones then follow from all runs'
responses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.linalg import block_diag, cho_solve

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import FRICTION, NumberRef
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, best_levels, log_volume, precision, whiten_columns
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.noise import NoiseLevels, log_prior
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.runtime.threads import side_by_side
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Number
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    FittedRun,
    Probe,
    SteadyLaw,
    probes_by,
    responses_of,
)
from sssi_exudyn.validation.diagnosis.search.physical_limits import DRAWS, POSSIBLE_SEED, log_share
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities
from sssi_exudyn.validation.diagnosis.search.search_result import SeparateFit
from sssi_exudyn.validation.diagnosis.state import fit_model, fitted_run, linear_model
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

SHARED: Final = FRICTION


@dataclass(frozen=True)
class DayRun:
    """What is needed of one run.

    linear : about its fit without anything that all share;  levels : its noise
    shared : columns of the linear model's freedom that are the day's numbers, in the order of ``SHARED``
    """

    linear: LinearModel
    levels: NoiseLevels
    shared: tuple[int, ...]


@dataclass(frozen=True)
class DayExplanation:
    """An explanation of the whole day, or that nothing is missing, and its numbers, those of friction first.

    fitted : whether it was fitted to all runs with the real term; otherwise it is as linear responses have it
    """

    name: str
    probability: float
    log_evidence: float
    numbers: dict[str, Number]
    fitted: bool = True


def joint_evidence(runs: Sequence[DayRun], extra: Sequence[Freedom] | None = None) -> tuple[float, Array, Array]:
    """Return the log evidence of all runs, with what ``extra`` (one a run, of the same scales) adds in common; and the
    most probable shared numbers with their standard deviations: those of ``SHARED``, then the extra ones.
    """
    rows, shared, own, volume = [], [], [], 0.0
    for i, run in enumerate(runs):
        linear = run.linear
        free = linear.all_free(run.levels)
        columns = free.columns * free.scales
        common = columns[:, list(run.shared)]
        if extra is not None:
            common = np.hstack([common, extra[i].columns * extra[i].scales])
        apart = np.delete(columns, list(run.shared), axis=1)
        table = whiten_columns(linear, run.levels, np.column_stack([linear.residual, common, apart]))
        rows.append(table[:, 0])
        shared.append(table[:, 1 : 1 + common.shape[1]])
        own.append(table[:, 1 + common.shape[1] :])
        volume += log_volume(linear, run.levels)
    y, x = np.concatenate(rows), np.hstack([np.vstack(shared), block_diag(*own)])
    factor = precision(x)
    along = x.T @ y
    amounts = cho_solve(factor, along)
    evidence = -0.5 * float(y @ y - along @ amounts) - float(np.sum(np.log(np.diag(factor[0])))) - volume
    count = shared[0].shape[1]
    first = runs[0].linear.free.scales[list(runs[0].shared)]
    scales = first if extra is None else np.concatenate([first, extra[0].scales])
    inverse = cho_solve(factor, np.eye(x.shape[1])[:, :count])
    return evidence, scales * amounts[:count], scales * np.sqrt(np.diag(inverse[:count]))


def day_run(own: SeparateFit, linear: LinearModel, levels: NoiseLevels) -> DayRun:
    """Return what the day needs of a run, linear about its own fit or about one with as many parameters."""
    names = [p.names[0] for p in own.fit.parameters]
    mounting = linear.free.columns.shape[1] - len(names)  # those of the instruments' mounting come first
    return DayRun(linear, levels, tuple(mounting + names.index(name) for name in SHARED))


@dataclass(frozen=True)
class Law:
    """A law with the amplitudes that all runs share; by default none, where nothing is missing.

    keys, scales : the amplitudes' names in its term, and their usual sizes;  parts : what is added to each run's model
    weight : prior probability relative to the others
    possible : whether a model fitted with it is physically possible
    """

    name: str = NOTHING_MISSING
    keys: tuple[str, ...] = ()
    scales: Array = field(default_factory=lambda: np.zeros(0))
    parts: tuple[Term | Sensor, ...] = ()
    weight: float = 1.0
    possible: Callable[[Model], bool] = lambda _model: True

    @property
    def amplitudes(self) -> tuple[NumberRef, ...]:
        """Names of the amplitudes, as the day lists them."""
        return tuple(NumberRef.of(self.name, key) for key in self.keys)

    def probes(self, model: Model, run: int) -> list[Probe]:
        """Return probes by each amplitude, in the model of a run."""
        return probes_by(model, self.parts[run], self.keys) if self.parts else []

    def added_to(self, model: Model, run: int) -> tuple[Model, tuple[NumberRef, ...]]:
        """Return the model of a run with the law, and the names of its amplitudes there."""
        if not self.parts:
            return model, ()
        owner = name_in_model(model, self.parts[run])
        return add_part(model, self.parts[run]), tuple(NumberRef.of(owner, key) for key in self.keys)


def named_law(hypothesis: SteadyLaw, first: FittedRun, runs: int) -> Law:
    """Return a law of the list, the same for all runs: the speed, edge or load that it refers to is the ``first``
    one's.
    """
    keys = tuple(key for key, _ in hypothesis.amplitudes)
    return Law(
        hypothesis.name,
        keys,
        hypothesis.scales,
        (hypothesis.part(first),) * runs,
        hypothesis.weight,
        hypothesis.possible,
    )


@dataclass(frozen=True)
class Joint:
    """All runs with a law: log evidence, and the shared numbers with their standard deviations, less their priors'
    means.

    size : of those that the law usually has, what suits best
    fits : of each run with the law, the shared numbers held; none by linear responses
    """

    evidence: float
    values: Array
    errors: Array
    size: float = 1.0
    fits: tuple[Refit, ...] = ()


def by_size(law: Law, runs: Sequence[DayRun], columns: Sequence[Array], thresholds: Thresholds = THRESHOLDS) -> Joint:
    """Return the evidence over all sizes that the law usually has, and the numbers for the one that suits best.

    columns : one (N, amplitudes) a run, its responses to the law
    """
    if not law.amplitudes:
        return Joint(*joint_evidence(runs))
    each_size = [
        joint_evidence(runs, [Freedom(of_run, size * law.scales) for of_run in columns]) for size in thresholds.sizes
    ]
    total = float(np.logaddexp.reduce([evidence for evidence, _, _ in each_size]) - np.log(len(thresholds.sizes)))
    (_, values, errors), size = max(zip(each_size, thresholds.sizes, strict=True), key=lambda pair: pair[0][0])
    return Joint(total, values, errors, size)


def fit_to_all(law: Law, runs_alone: Sequence[SeparateFit], start: Array) -> Joint:
    """Fit the law with the real term in all runs' models, from shared numbers ``start``, less their priors' means, on.

    Raises SimulationDiverged where a run cannot be simulated so.
    """
    joint, thresholds = Joint(-np.inf, start, np.ones(len(start))), runs_alone[0].problem.thresholds
    for _ in range(thresholds.day_turns):
        values = joint.values
        runs_with_law = fit_own_numbers(law, values, runs_alone)
        beforehand = sum(log_prior(run.linear.measurements.usual, run.levels) for run, _, _ in runs_with_law)
        joint = by_size(
            law, [run for run, _, _ in runs_with_law], [columns for _, columns, _ in runs_with_law], thresholds
        )
        fits = tuple(fit for _, _, fit in runs_with_law)
        joint = replace(joint, evidence=joint.evidence + beforehand, fits=fits)
        if np.all(np.abs(joint.values - values) < thresholds.day_settled * joint.errors):
            break
    return replace(joint, evidence=joint.evidence + _log_possible(law, runs_alone[0], joint))


def _log_possible(law: Law, own: SeparateFit, joint: Joint) -> float:
    """Return ``log_share`` of a law's amplitudes, each drawn by itself."""
    _, names = law.added_to(own.fit.model, 0)
    if not names:
        return 0.0
    model, normal = joint.fits[0].model, np.random.default_rng(POSSIBLE_SEED).standard_normal((DRAWS, len(names)))
    low, high = np.array([model.bounds(name) for name in names]).T

    def possible(values: Array) -> bool:
        inside = bool(np.all((values >= low) & (values <= high)))
        return inside and law.possible(model.with_values(dict(zip(names, map(float, values), strict=True))))

    of_law = slice(len(SHARED), None)
    before, after = joint.size * law.scales * normal, joint.values[of_law] + joint.errors[of_law] * normal
    return log_share(possible, before, after)


def fit_own_numbers(law: Law, values: Array, runs_alone: Sequence[SeparateFit]) -> list[tuple[DayRun, Array, Refit]]:
    """Fit each run's own numbers while the shared ``values`` are held.

    Return for each what the day needs of it about that fit, its responses (N, amplitudes) to the law, and the fit.

    Raises as ``fit_to_all``.
    """
    return side_by_side(partial(_fit_own_numbers_of, law, values, runs_alone), range(len(runs_alone)))


def _fit_own_numbers_of(
    law: Law, values: Array, runs_alone: Sequence[SeparateFit], run: int
) -> tuple[DayRun, Array, Refit]:
    own = runs_alone[run]
    model, amplitudes = law.added_to(own.fit.model, run)
    shared, held = dict(zip(SHARED, values, strict=False)), own.problem.thresholds.day_held
    parameters = [
        Parameter(p.names, _held(p.prior, shared[p.names[0]], held)) if p.names[0] in shared else p
        for p in own.fit.parameters
    ]
    more = [
        Parameter((name,), _held(Prior(0.0, float(scale)), value, held))
        for name, scale, value in zip(amplitudes, law.scales, values[len(SHARED) :], strict=True)
    ]
    every = (*parameters, *more)
    means = {p.names[0]: p.prior.mean for p in every if p not in own.fit.parameters}
    start = model.with_values({name: float(np.clip(value, *model.bounds(name))) for name, value in means.items()})
    fit = fit_model(own.problem, own.state, start, every, own.state.levels)
    count = len(parameters)
    columns = fit.sensitivity[:, count:]
    without_law = replace(
        fit, parameters=own.fit.parameters, values=fit.values[:count], sensitivity=fit.sensitivity[:, :count]
    )
    linear = linear_model(own.problem, own.state, without_law)
    linear = replace(linear, residual=linear.residual + columns @ fit.values[count:])
    levels, _ = best_levels(linear, own.state.levels, Freedom(columns, law.scales) if amplitudes else None)
    return day_run(own, linear, levels), columns, fit


def _held(prior: Prior, apart: float, share: float) -> Prior:
    """Return a prior that holds a number ``apart`` from its prior's mean, to that ``share`` of its usual size."""
    return Prior(prior.mean + apart, share * prior.sigma)


def responses(runs_alone: Sequence[SeparateFit], laws: Sequence[Law]) -> list[list[Array]]:
    """Return (N, amplitudes) of each law, in one pass over each run; of none for none."""
    by_run = []
    for i, own in enumerate(runs_alone):
        every = [law.probes(own.fit.model, i) for law in laws]
        columns = responses_of([p for some in every for p in some], own.problem.prepared, own.problem.measurements)
        by_run.append(np.split(columns, np.cumsum([len(some) for some in every])[:-1], axis=1))
    return by_run


def on_one_snow(runs_alone: Sequence[SeparateFit]) -> list[SeparateFit]:
    """Return runs of which all know the same of the day's numbers beforehand: what the first one does.

    Recordings may state the snow differently, or one of them may not state it.  Numbers are shared as distances from
    their prior's mean in its standard deviations, so that these have to be alike.
    """
    known = {p.names: p.prior for p in runs_alone[0].fit.parameters if p.names[0] in SHARED}

    def knowing(own: SeparateFit) -> SeparateFit:
        parameters = tuple(replace(p, prior=known.get(p.names, p.prior)) for p in own.fit.parameters)
        return replace(own, fit=replace(own.fit, parameters=parameters))

    return [knowing(own) for own in runs_alone]


def compare_for_day(runs_alone: Sequence[SeparateFit], progress: Advance = silent) -> list[DayExplanation]:
    """Compare everything that can act on all runs alike, and nothing, the most probable first; without a law whose fit
    to all is physically impossible.

    What was found in one run alone, a gust or a late clock, stays with it.
    """
    runs_alone = on_one_snow(runs_alone)
    first, thresholds = runs_alone[0], runs_alone[0].problem.thresholds
    fitted = fitted_run(first.problem, first.state, first.fit)
    laws = [
        Law(),
        *(
            named_law(hypothesis, fitted, len(runs_alone))
            for hypothesis in first.problem.hypotheses
            if isinstance(hypothesis, SteadyLaw)
        ),
    ]
    runs = [day_run(own, linear_model(own.problem, own.state, own.fit), own.state.levels) for own in runs_alone]
    by_law = zip(*responses(runs_alone, laws), strict=True)
    linearly = [by_size(law, runs, columns, thresholds) for law, columns in zip(laws, by_law, strict=True)]
    best = max(joint.evidence for joint in linearly)
    ranked = sorted(range(1, len(laws)), key=lambda i: -linearly[i].evidence)
    finalists = [
        0,
        *(i for i in ranked[: thresholds.day_finalists] if linearly[i].evidence > best - thresholds.worthwhile),
    ]
    fitted_laws: dict[int, Joint] = {}
    for i in finalists:
        added = laws[i].name if i else "nothing added"
        progress(None, f"all runs fitted with {added}")
        try:
            fitted_laws[i] = fit_to_all(laws[i], runs_alone, linearly[i].values)
        except SimulationDiverged as error:
            progress(None, f"{added} is compared by its linear response: {error}")
    gains = [fitted_laws[i].evidence - linearly[i].evidence for i in fitted_laws]
    gain = min((gain for gain in gains if np.isfinite(gain)), default=0.0)
    joint = {
        i: fitted_laws.get(i) or replace(with_law, evidence=with_law.evidence + gain)
        for i, with_law in enumerate(linearly)
    }
    joint = {i: with_law for i, with_law in joint.items() if np.isfinite(with_law.evidence)}
    nothing, *others = joint.items()
    evidence, weights = np.array([(with_law.evidence, laws[i].weight) for i, with_law in others]).reshape(-1, 2).T
    odds = probabilities(nothing[1].evidence, evidence, weights, thresholds)
    explanations = [
        DayExplanation(
            laws[i].name,
            float(probability),
            with_law.evidence,
            numbers_of(laws[i], first, with_law),
            fitted=i in fitted_laws,
        )
        for probability, (i, with_law) in zip(odds, joint.items(), strict=True)
    ]
    return sorted(explanations, key=lambda explanation: -explanation.probability)


def numbers_of(law: Law, first: SeparateFit, joint: Joint) -> dict[str, Number]:
    """Return the shared numbers, those of ``SHARED`` first, with their 90 % intervals, all within their bounds."""
    known = {p.names[0]: p.prior.mean for p in first.fit.parameters}
    model, _ = law.added_to(first.fit.model, 0)
    numbers = {}
    for name, apart, error in zip((*SHARED, *law.amplitudes), joint.values, joint.errors, strict=True):
        value, half = known.get(name, 0.0) + float(apart), first.problem.thresholds.interval_90 * float(error)
        value, low, high = np.clip([value, value - half, value + half], *model.bounds(name)).tolist()
        numbers[str(name)] = Number(value, low, high, model.about(name).unit)
    return numbers
