"""A round of the search: every hypothesis tried on a fitted run, and how probable each is.

All hypotheses give their candidates, linear responses about the fit; these are compared by their evidence under the
noise as it is; the best are refitted with the real term or fault in the model, and compared again about their own fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.stats import norm

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import (
    Freedom,
    LinearModel,
    best_levels,
    log_evidence,
    log_factors,
    log_volume,
    overlaps,
    uncertain,
)
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.runtime.threads import side_by_side
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import Smallest
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, Hypothesis, responses_of
from sssi_exudyn.validation.diagnosis.search.detectability import smallest_noticed
from sssi_exudyn.validation.diagnosis.search.physical_limits import log_possible
from sssi_exudyn.validation.diagnosis.search.probabilities import SIZES, probabilities
from sssi_exudyn.validation.diagnosis.state import State, fit_model, fitted_run, get_or_make, linear_model

_FINALISTS: Final = 6
_WORTHWHILE: Final = 12.0
"""A hypothesis whose linear evidence is worse than the best by more than this is not refitted."""
_FURTHER: Final = 2
"""Further times at which a hypothesis is tried."""
_HALF: Final = 0.5
"""Share of the best candidate's gain that one at another time has for that."""
_APART: Final = 0.2
"""Of the time of two candidates together, what both act at most where they act at other times."""
_STIFF: Final = 0.1
"""Share of its usual waves that the snow surface has while a hypothesis about its shape is placed."""
_HOPELESS: Final = -1.0
"""Log Bayes factor under the noise of nothing below which other noise is not tried either."""
_HOPEFUL: Final = 0.5
"""Nor one that is less probable than nothing by as much."""


@dataclass(frozen=True)
class AnyForm:
    """A force of any form in the place of a law.

    share : what of the explanation's probability is this form
    values : each of the fit's numbers there, with its standard deviation
    free : how the force may vary, before the data speak
    """

    share: float
    values: Mapping[str, tuple[float, float]]
    free: Freedom


@dataclass(frozen=True)
class Explanation:
    """A hypothesis in a round, or that nothing is missing.

    name : of the hypothesis; "" where nothing is added
    log_evidence : with the noise's own prior, place and size integrated
    probability : among all explanations of the round
    candidate : where and what, its usual amplitudes times the size that suits best; None for nothing
    elsewhere : at other times, of the same amplitudes, where a fit may end better
    fit : None where it was not worth a refit
    levels : of the noise under it
    size : one of ``SIZES``
    log_place : what searching all places adds to the log evidence of the best one, below 0
    log_natural : of what shapes the snow: density of its size were it the slope's own, over that were it not
    any_form : of the force that no known law explains, once it was weighed beside a law
    """

    name: str
    log_evidence: float
    probability: float
    candidate: Candidate | None
    fit: Refit | None
    levels: NoiseLevels
    size: float = 1.0
    log_place: float = 0.0
    log_natural: float = -np.inf
    any_form: AnyForm | None = None
    elsewhere: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Round:
    """All explanations, the most probable first, and what they were compared on.

    responses : (N, probes) by the names of the hypotheses, a unit of amplitude
    noticed : by their names, from which size on each would have been noticed
    explained : log evidence that earlier findings brought
    """

    explanations: tuple[Explanation, ...]
    linear: LinearModel
    base: Refit
    fitted: FittedRun
    responses: dict[str, Array]
    noticed: dict[str, Smallest]
    explained: float = 0.0

    @property
    def nothing(self) -> Explanation:
        """That nothing more is missing."""
        return next(each for each in self.explanations if not each.name)

    @property
    def best(self) -> Explanation:
        """The most probable one that adds something."""
        return next(each for each in self.explanations if each.name)


def compare_hypotheses(problem: DiagnosisProblem, state: State, base: Refit) -> Round:
    """Compare all hypotheses on the fitted model ``base``."""
    fitted = fitted_run(problem, state, base)
    linear = linear_model(problem, state, base)
    levels, evidence = best_levels(linear, state.levels)
    nothing = Explanation("", evidence, 0.0, None, base, levels)
    responses = _responses_by_name(problem, fitted)

    uncertainty = uncertain(linear, state.levels)

    def compare(hypothesis: Hypothesis) -> tuple[Explanation, Smallest] | None:
        candidates = hypothesis.candidates(fitted, responses[hypothesis.name])
        if not candidates:
            return None
        known = overlaps(linear, state.levels, uncertainty, [candidate.free for candidate in candidates])
        explanation = _compare_candidates(state, linear, hypothesis, candidates, known, evidence)
        return explanation, smallest_noticed(hypothesis, candidates, known[0])

    compared = [pair for pair in side_by_side(compare, HYPOTHESES) if pair is not None]
    noticed = {explanation.name: smallest for explanation, smallest in compared}
    explained = 0.0 if state.first_evidence is None else max(0.0, evidence - state.first_evidence)
    found = [nothing, *_refit_best(problem, state, base, fitted, nothing, [explanation for explanation, _ in compared])]
    return Round(rank_by_probability(found, explained), linear, base, fitted, responses, noticed, explained)


def extended_parameters(base: Refit, candidate: Candidate) -> tuple[tuple[Parameter, ...], tuple[Parameter, ...]]:
    """Parameters of a fit with the candidate: those of ``base`` with the amplitudes, and the places."""
    kept = tuple(p for p in base.parameters if not candidate.strengths & set(p.names))
    known = {p.names[0]: p.prior.mean for p in base.parameters}
    amplitudes = tuple(
        Parameter(group, Prior(known.get(group[0], _before(base.model, candidate.model, group[0])), float(scale)))
        for group, scale in zip(candidate.amplitudes, candidate.free.scales, strict=True)
    )
    places = tuple(
        Parameter((name,), Prior(candidate.model.value(name), spread)) for name, spread in candidate.places.items()
    )
    return (*kept, *amplitudes), places


def _before(model: Model, extended: Model, name: str) -> float:
    """A number of a model, or where it has none of that name of one that is ``extended``: a candidate may begin with
    another value.
    """
    try:
        return model.value(name)
    except KeyError:
        return extended.value(name)


def _responses_by_name(problem: DiagnosisProblem, fitted: FittedRun) -> dict[str, Array]:
    """(N, probes) of every hypothesis, a unit of amplitude."""
    problem.progress(None, "the response to every hypothesis")
    by_name = {hypothesis.name: hypothesis.probes(fitted) for hypothesis in HYPOTHESES}
    probes = [probe for some in by_name.values() for probe in some]
    key = fingerprint("probes", problem.key, [(model_to_dict(p.model), p.number) for p in probes])
    shapes = {"columns": (len(fitted.prediction), len(probes))}
    kept = get_or_make(
        problem, key, lambda: {"columns": responses_of(probes, fitted.prepared, fitted.measurements)}, shapes
    )
    columns = np.asarray(kept["columns"], dtype=np.float64)
    ends = np.cumsum([len(some) for some in by_name.values()])
    return dict(zip(by_name, np.split(columns, ends[:-1], axis=1), strict=True))


def _compare_candidates(
    state: State,
    linear: LinearModel,
    hypothesis: Hypothesis,
    candidates: list[Candidate],
    known: tuple[Array, Array],
    nothing: float,
) -> Explanation:
    """A hypothesis by its candidates' linear responses, whose ``overlaps`` are ``known``: the best of them, all others
    counted as places searched.
    """
    by_size = log_factors(*known, SIZES)[..., 0]
    factors = np.logaddexp.reduce(by_size, axis=0) - np.log(len(SIZES))
    best = int(np.argmax(factors))
    places = float(np.logaddexp.reduce(factors) - np.log(len(factors)) - factors[best])
    size = int(np.argmax(by_size[:, best]))
    spread = float(factors[best] - by_size[size, best])
    chosen = _scale(candidates[best], SIZES[size])
    levels, evidence = state.levels, nothing + float(by_size[size, best])
    if by_size[size, best] > _HOPELESS:
        levels, evidence = best_levels(linear, state.levels, chosen.free)
    elsewhere = tuple(_scale(candidates[i], SIZES[size]) for i in _at_other_times(candidates, factors, best))
    return Explanation(
        hypothesis.name,
        evidence + places + spread,
        0.0,
        chosen,
        None,
        levels,
        size=SIZES[size],
        log_place=places,
        elsewhere=elsewhere,
    )


def _at_other_times(candidates: Sequence[Candidate], factors: Array, best: int) -> list[int]:
    """The best candidates that act when better ones do not, by all candidates' log Bayes ``factors``; none where the
    gain is small.

    Where much is to be explained responses are not linear: a patch in the middle of a run gained less than a slippery
    beginning, and a fit does not go from one to the other.
    """
    chosen = [best]
    if factors[best] < _WORTHWHILE:
        return []
    for i in np.argsort(-factors):
        if factors[i] < _HALF * factors[best] or len(chosen) > _FURTHER:
            break
        if all(_in_common(candidates[i], candidates[j]) < _APART for j in chosen):
            chosen.append(int(i))
    return chosen[1:]


def _in_common(one: Candidate, other: Candidate) -> float:
    """Share of the time of two candidates together that both act."""
    if one.window is None or other.window is None:
        return 1.0
    (a, b), (c, d) = one.window, other.window
    return max(0.0, min(b, d) - max(a, c)) / (max(b, d) - min(a, c))


def _refit_best(
    problem: DiagnosisProblem,
    state: State,
    base: Refit,
    fitted: FittedRun,
    nothing: Explanation,
    linearly: list[Explanation],
) -> list[Explanation]:
    """The hypotheses by their linear evidence, the most probable of them refitted with the real term."""
    ranked = sorted(linearly, key=lambda each: -each.log_evidence)
    gain = max(ranked[0].log_evidence - nothing.log_evidence, 0.0)
    # far from the truth responses are not linear: whoever explains half of it may explain it best
    least = max(nothing.log_evidence - _HOPEFUL, nothing.log_evidence + gain - max(_WORTHWHILE, 0.5 * gain))
    finalists = [each for each in ranked[:_FINALISTS] if each.log_evidence > least]
    if gain > _WORTHWHILE:
        unlike = [each for each in ranked if BY_NAME[each.name].moves_all or BY_NAME[each.name].kind == "unexplained"]
        finalists += [each for each in unlike if each not in finalists]
    finalists += [each for each in ranked if BY_NAME[each.name].always_refitted(fitted) and each not in finalists]
    if finalists:
        problem.progress(None, f"refitting with {', '.join(each.name for each in finalists)}")
    fits = side_by_side(lambda each: _refit_with(problem, state, base, fitted, each), finalists)
    return [*fits, *(each for each in ranked if each not in finalists)]


def _refit_with(
    problem: DiagnosisProblem, state: State, base: Refit, fitted: FittedRun, explanation: Explanation
) -> Explanation:
    candidate, hypothesis = explanation.candidate, BY_NAME[explanation.name]
    assert candidate is not None

    def fit_from(candidate: Candidate, start: Model, levels: NoiseLevels = explanation.levels) -> Refit:
        parameters, places = extended_parameters(base, candidate)
        return fit_model(problem, state, start, (*parameters, *places), levels)

    def misfit(fit: Refit) -> float:
        """J with the noise's volume, which a clock changes: fixes of instants outside the run count less."""
        return fit.objective + log_volume(linear_model(problem, state, fit), explanation.levels)

    def best_fit(candidate: Candidate) -> Refit:
        starts = [candidate.model, *_models_beside(candidate, hypothesis.sides(fitted))]
        if hypothesis.shapes_snow:
            stiff = replace(explanation.levels, surface=_STIFF * explanation.levels.surface)
            starts = [fit_from(candidate, candidate.model, stiff).model]
        return min((fit_from(candidate, start) for start in starts), key=misfit)

    fits = []
    for each in (candidate, *explanation.elsewhere):
        with suppress(SimulationDiverged):
            fits.append((best_fit(each), each))
    if not fits:
        return explanation
    fit, candidate = min(fits, key=lambda pair: misfit(pair[0]))
    explanation = replace(explanation, candidate=candidate)
    try:
        # how strong it is shows only now that it stands where it acts
        by_size = evidence_by_size(problem, state, base, explanation, fit)
        size = SIZES[int(np.argmax(by_size))]
        if size != explanation.size:
            candidate = _scale(candidate, size / explanation.size)
            fit = fit_from(candidate, fit.model)
            explanation = replace(explanation, candidate=candidate, size=size)
            by_size = evidence_by_size(problem, state, base, explanation, fit)
    except SimulationDiverged:
        return explanation
    return weigh_refit(problem, state, base, explanation, fit, by_size)


def weigh_refit(
    problem: DiagnosisProblem, state: State, base: Refit, explanation: Explanation, fit: Refit, by_size: Array
) -> Explanation:
    """The explanation by its evidence about ``fit``, none where that is physically impossible; ``by_size`` is its
    ``evidence_by_size`` there.
    """
    assert explanation.candidate is not None
    there = _fix_places(base, explanation.candidate, fit)
    placed = linear_model(problem, state, there)
    levels, evidence = best_levels(placed, explanation.levels)
    possible = log_possible(BY_NAME[explanation.name], explanation.candidate, there, placed, levels)
    if possible == -np.inf:
        return replace(explanation, log_evidence=-np.inf, fit=fit)
    spread = float(np.logaddexp.reduce(by_size) - np.log(len(SIZES)) - by_size[SIZES.index(explanation.size)])
    return replace(
        explanation,
        log_evidence=evidence + spread + explanation.log_place + possible,
        fit=fit,
        levels=levels,
        log_natural=_log_natural(problem, explanation, fit, levels),
    )


def _log_natural(problem: DiagnosisProblem, explanation: Explanation, fit: Refit, levels: NoiseLevels) -> float:
    """``Explanation.log_natural``; the slope's waves are those that the explanation leaves."""
    hypothesis, candidate = BY_NAME[explanation.name], explanation.candidate
    if not hypothesis.shapes_snow or problem.ground is None or candidate is None:
        return -np.inf
    found = fit.model.value(candidate.amplitudes[0][0])
    usual, natural = candidate.free.scales[0], hypothesis.natural * levels.surface * problem.ground.amplitude
    return float(norm.logpdf(found, scale=natural) - norm.logpdf(found, scale=usual))


def _fix_places(base: Refit, candidate: Candidate, fit: Refit) -> Refit:
    """The fit with the candidate where it has been found: places were searched by the candidates, their freedom is not
    counted again.
    """
    parameters, _ = extended_parameters(base, candidate)
    count = len(parameters)
    return replace(fit, parameters=parameters, values=fit.values[:count], sensitivity=fit.sensitivity[:, :count])


def without_law(
    problem: DiagnosisProblem, state: State, base: Refit, candidate: Candidate, fit: Refit
) -> tuple[LinearModel, tuple[Parameter, ...]]:
    """Measurements less prediction about ``fit``, as if the candidate that it has did nothing; and the parameters that
    are left, the last of what is free.
    """
    placed = _fix_places(base, candidate, fit)
    linear, kept = linear_model(problem, state, placed), -len(candidate.amplitudes)
    free = Freedom(linear.free.columns[:, :kept], linear.free.scales[:kept])
    return replace(linear, free=free), placed.parameters[:kept]


def evidence_by_size(
    problem: DiagnosisProblem, state: State, base: Refit, explanation: Explanation, fit: Refit
) -> Array:
    """(sizes,) log evidence of the fit, were it usually of each size."""
    candidate = explanation.candidate
    assert candidate is not None
    every = [_fix_places(base, _scale(candidate, size / explanation.size), fit) for size in SIZES]
    return np.array([log_evidence(linear_model(problem, state, each), explanation.levels) for each in every])


def _scale(candidate: Candidate, factor: float) -> Candidate:
    """The candidate, its usual amplitudes that much larger."""
    return replace(candidate, free=Freedom(candidate.free.columns, factor * candidate.free.scales))


def _models_beside(candidate: Candidate, sides: Sequence[float]) -> list[Model]:
    """The candidate's model with its amplitudes so many of their usual sizes beside where it stands, within bounds."""
    model, found = candidate.model, []
    for side in sides:
        values = {}
        for group, scale in zip(candidate.amplitudes, candidate.free.scales, strict=True):
            for name in group:
                values[name] = float(np.clip(model.value(name) + side * scale, *model.bounds(name)))
        found.append(model.with_values(values))
    return found


def rank_by_probability(found: Sequence[Explanation], explained: float) -> tuple[Explanation, ...]:
    """All explanations of a round with their probabilities, the most probable first."""
    evidence, natural = (np.array([getattr(each, key) for each in found]) for key in ("log_evidence", "log_natural"))
    odds = probabilities([each.name for each in found], evidence, explained, natural)
    ranked = [replace(each, probability=float(p)) for each, p in zip(found, odds, strict=True)]
    return tuple(sorted(ranked, key=lambda each: -each.probability))
