"""A round of the search: every hypothesis tried on a fitted run, and how probable each is.

All hypotheses give their candidates, linear responses about the fit; these are compared by their evidence under the
noise as it is; the best are refitted with the real term or fault in the model, and compared again about their own fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.stats import norm

from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import (
    Freedom,
    LinearModel,
    best_evidence,
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
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.runtime.threads import side_by_side
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import Smallest
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun, Hypothesis, responses_of
from sssi_exudyn.validation.diagnosis.search.detectability import smallest_noticed
from sssi_exudyn.validation.diagnosis.search.explanation import (
    Explanation,
    Nothing,
    Refitted,
    Round,
    Screened,
    rank_by_probability,
)
from sssi_exudyn.validation.diagnosis.search.physical_limits import log_possible
from sssi_exudyn.validation.diagnosis.state import State, fit_model, fitted_run, get_or_make, linear_model
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds

_SCREENED: Final = 0.5
"""Share of a comparison after which the most probable hypotheses are refitted."""


def compare_hypotheses(problem: DiagnosisProblem, state: State, base: Refit) -> Round:
    """Compare all hypotheses of the problem on the fitted model ``base``."""
    fitted = fitted_run(problem, state, base)
    linear = linear_model(problem, state, base)
    levels, evidence = best_evidence(linear, state.levels)
    nothing = Nothing(evidence, levels, base)
    responses = responses_by_name(problem, fitted)

    uncertainty = uncertain(linear, state.levels)

    def compare(hypothesis: Hypothesis) -> tuple[Screened, Smallest] | None:
        candidates = hypothesis.candidates(fitted, responses[hypothesis.name])
        if not candidates:
            return None
        known = overlaps(linear, state.levels, uncertainty, [candidate.free for candidate in candidates])
        explanation = _screen(state, linear, hypothesis, candidates, known, evidence, problem.thresholds)
        noticed = smallest_noticed(
            hypothesis, candidates, known[0], problem.hypotheses, fitted.cell, problem.thresholds
        )
        return explanation, noticed

    compared = [pair for pair in side_by_side(compare, problem.hypotheses) if pair is not None]
    noticed = {explanation.name: smallest for explanation, smallest in compared}
    screened = [explanation for explanation, _ in compared]
    explanations: list[Explanation] = [nothing, *_refit_best(problem, state, base, fitted, nothing, screened)]
    ranked = rank_by_probability(explanations, fitted)
    return Round(ranked, linear, base, fitted, responses, noticed)


def extended_parameters(base: Refit, candidate: Candidate) -> tuple[tuple[Parameter, ...], tuple[Parameter, ...]]:
    """Return parameters of a fit with the candidate: those of ``base`` with the amplitudes, and the places."""
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
    """Return a number of a model, or of the one that is ``extended`` where the model has none of that name: a candidate
    may begin with another value.
    """
    try:
        return model.value(name)
    except InputError:
        return extended.value(name)


def responses_by_name(problem: DiagnosisProblem, fitted: FittedRun) -> dict[str, Array]:
    """Return the responses (N, probes) of every hypothesis, a unit of amplitude."""
    problem.progress(0.0, "the response to every hypothesis")
    by_name = {hypothesis.name: hypothesis.probes(fitted) for hypothesis in problem.hypotheses}
    probes = [probe for some in by_name.values() for probe in some]
    own = [(_without_large_parts(probe.model, fitted.model), probe.number) for probe in probes]
    key = fingerprint("probes", problem.key, fitted.model, own)
    shapes = {"columns": (len(fitted.prediction), len(probes))}
    kept = get_or_make(
        problem, key, lambda: {"columns": responses_of(probes, fitted.prepared, fitted.measurements)}, shapes
    )
    columns = np.asarray(kept["columns"], dtype=np.float64)
    ends = np.cumsum([len(some) for some in by_name.values()])
    return dict(zip(by_name, np.split(columns, ends[:-1], axis=1), strict=True))


def _without_large_parts(model: Model, run_model: Model) -> Model:
    """Return a probe's model without the snow surface and the posture's correction of the run, which all probes share:
    to hash them for each of some hundred probes took a twentieth of a diagnosis.
    """
    surface = None if model.surface is run_model.surface else model.surface
    posture = None if model.posture is run_model.posture else model.posture
    return replace(model, surface=surface, posture=posture)


def _screen(
    state: State,
    linear: LinearModel,
    hypothesis: Hypothesis,
    candidates: list[Candidate],
    known: tuple[Array, Array],
    nothing: float,
    thresholds: Thresholds,
) -> Screened:
    """Return a hypothesis by its candidates' linear responses, whose ``overlaps`` are ``known``.  The best of them
    stands for it, and all others count as places searched; ``nothing`` is the log evidence of nothing missing.
    """
    sizes = thresholds.sizes
    by_size = log_factors(*known, sizes)[..., 0]
    factors = np.logaddexp.reduce(by_size, axis=0) - np.log(len(sizes))
    best = int(np.argmax(factors))
    places = float(np.logaddexp.reduce(factors) - np.log(len(factors)) - factors[best])
    size = int(np.argmax(by_size[:, best]))
    spread = float(factors[best] - by_size[size, best])
    chosen = _scale(candidates[best], sizes[size])
    levels, evidence = state.levels, nothing + float(by_size[size, best])
    if by_size[size, best] > thresholds.hopeless:
        levels, evidence = best_evidence(linear, state.levels, chosen.free)
    other_times = _at_other_times(candidates, factors, best, thresholds)
    return Screened(
        hypothesis,
        chosen,
        evidence + places + spread,
        levels,
        size=sizes[size],
        log_place=places,
        elsewhere=tuple(_scale(candidates[i], sizes[size]) for i in other_times),
    )


def _at_other_times(candidates: Sequence[Candidate], factors: Array, best: int, thresholds: Thresholds) -> list[int]:
    """Return the best candidates that act when better ones do not, by all candidates' log Bayes ``factors``; none where
    the gain is small.

    Where much is to be explained responses are not linear: a patch in the middle of a run gained less than a slippery
    beginning, and a fit does not go from one to the other.
    """
    chosen = [best]
    if factors[best] < thresholds.worthwhile:
        return []
    for i in np.argsort(-factors):
        if factors[i] < thresholds.half_explained * factors[best] or len(chosen) > thresholds.further_times:
            break
        if all(_in_common(candidates[i], candidates[j]) < thresholds.apart for j in chosen):
            chosen.append(int(i))
    return chosen[1:]


def _in_common(one: Candidate, other: Candidate) -> float:
    """Return the share of the time of two candidates together that both act."""
    if one.window is None or other.window is None:
        return 1.0
    (a, b), (c, d) = one.window, other.window
    return max(0.0, min(b, d) - max(a, c)) / (max(b, d) - min(a, c))


def _refit_best(
    problem: DiagnosisProblem,
    state: State,
    base: Refit,
    fitted: FittedRun,
    nothing: Nothing,
    screened: list[Screened],
) -> list[Screened]:
    """Refit the most probable hypotheses with their real terms; return them first, then all others as ranked."""
    ranked = sorted(screened, key=lambda explanation: -explanation.log_evidence)
    finalists = _finalists(ranked, nothing, fitted, problem.thresholds)
    if finalists:
        problem.progress(_SCREENED, f"refitting with {', '.join(explanation.name for explanation in finalists)}")
    fits = side_by_side(lambda explanation: _refit_with(problem, state, base, fitted, explanation), finalists)
    return [*fits, *(explanation for explanation in ranked if explanation not in finalists)]


def _finalists(
    ranked: Sequence[Screened], nothing: Nothing, fitted: FittedRun, thresholds: Thresholds
) -> list[Screened]:
    """Return the hypotheses that are worth a fit, of all hypotheses ``ranked`` by their linear evidence."""
    gain = max(ranked[0].log_evidence - nothing.log_evidence, 0.0)
    # far from the truth responses are not linear: what explains half of it may explain it best
    short = max(thresholds.worthwhile, (1.0 - thresholds.half_explained) * gain)
    least = max(nothing.log_evidence - thresholds.hopeful, nothing.log_evidence + gain - short)
    finalists = [explanation for explanation in ranked[: thresholds.finalists] if explanation.log_evidence > least]
    if gain > thresholds.worthwhile:
        unlike = [
            explanation
            for explanation in ranked
            if explanation.hypothesis.moves_all or explanation.hypothesis.kind == "unexplained"
        ]
        finalists += [explanation for explanation in unlike if explanation not in finalists]
    return finalists + [
        explanation
        for explanation in ranked
        if explanation.hypothesis.always_refitted(fitted) and explanation not in finalists
    ]


def _refit_with(
    problem: DiagnosisProblem, state: State, base: Refit, fitted: FittedRun, explanation: Screened
) -> Screened:
    """Fit the real term of an explanation; return it unchanged where that cannot be simulated."""
    candidate, hypothesis, sizes = explanation.candidate, explanation.hypothesis, problem.thresholds.sizes

    def fit_from(
        candidate: Candidate, start: Model, levels: NoiseLevels = explanation.levels, worth: float = np.inf
    ) -> Refit:
        parameters, places = extended_parameters(base, candidate)
        return fit_model(problem, state, start, (*parameters, *places), levels, worth)

    def misfit(fit: Refit) -> float:
        """Return J with the noise's volume, which a clock changes: fixes of instants outside the run count less."""
        return fit.objective + log_volume(linear_model(problem, state, fit), explanation.levels)

    def best_fit(candidate: Candidate, worth: float) -> Refit:
        starts = [candidate.model, *_models_on_both_sides(candidate, hypothesis.sides(fitted))]
        if hypothesis.shapes_snow:
            stiff = replace(explanation.levels, surface=problem.thresholds.stiff * explanation.levels.surface)
            starts = [fit_from(candidate, candidate.model, stiff).model]
        return min((fit_from(candidate, start, worth=worth) for start in starts), key=misfit)

    fits: list[tuple[Refit, Candidate]] = []
    for placed in (candidate, *explanation.elsewhere):
        least = min((fit.objective for fit, _ in fits), default=np.inf)
        with suppress(SimulationDiverged):
            fits.append((best_fit(placed, least + problem.thresholds.far_behind), placed))
    if not fits:
        return explanation
    fit, candidate = min(fits, key=lambda pair: misfit(pair[0]))
    explanation = replace(explanation, candidate=candidate)
    try:
        # how strong it is shows only now that it stands where it acts
        by_size = evidence_by_size(problem, state, base, explanation, fit)
        size = sizes[int(np.argmax(by_size))]
        if size != explanation.size:
            candidate = _scale(candidate, size / explanation.size)
            fit = fit_from(candidate, fit.model)
            explanation = replace(explanation, candidate=candidate, size=size)
            by_size = evidence_by_size(problem, state, base, explanation, fit)
    except SimulationDiverged:
        return explanation
    return weigh_refit(problem, state, base, explanation, fit, by_size)


def weigh_refit(
    problem: DiagnosisProblem, state: State, base: Refit, explanation: Screened, fit: Refit, by_size: Array
) -> Refitted:
    """Return the explanation by its evidence about ``fit``, none where that is physically impossible; ``by_size`` is
    its ``evidence_by_size`` there.
    """
    there = _fix_places(base, explanation.candidate, fit)
    placed = linear_model(problem, state, there)
    levels, evidence = best_evidence(placed, explanation.levels)
    possible = log_possible(explanation.hypothesis, explanation.candidate, there, placed, levels)
    refitted = replace(explanation.with_fit(fit), levels=levels)
    if possible == -np.inf:
        return replace(refitted, log_evidence=-np.inf, levels=explanation.levels)
    sizes = problem.thresholds.sizes
    spread = float(np.logaddexp.reduce(by_size) - np.log(len(sizes)) - by_size[sizes.index(explanation.size)])
    return replace(
        refitted,
        log_evidence=evidence + spread + explanation.log_place + possible,
        log_natural=-np.inf if problem.ground is None else log_natural(problem.ground.amplitude, refitted),
    )


def log_natural(amplitude: float, explanation: Refitted) -> float:
    """Return ``Screened.log_natural`` on a slope whose usual waves are ``amplitude`` (m) high; they are as much larger
    as the explanation leaves them.
    """
    hypothesis, candidate = explanation.hypothesis, explanation.candidate
    if not hypothesis.shapes_snow:
        return -np.inf
    fitted_size = explanation.fit.model.value(candidate.amplitudes[0][0])
    usual, natural = candidate.free.scales[0], hypothesis.natural * explanation.levels.surface * amplitude
    return float(norm.logpdf(fitted_size, scale=natural) - norm.logpdf(fitted_size, scale=usual))


def _fix_places(base: Refit, candidate: Candidate, fit: Refit) -> Refit:
    """Return the fit with the candidate where it was found: the candidates searched its places, whose freedom is not
    counted again.
    """
    parameters, _ = extended_parameters(base, candidate)
    count = len(parameters)
    return replace(fit, parameters=parameters, values=fit.values[:count], sensitivity=fit.sensitivity[:, :count])


def without_law(
    problem: DiagnosisProblem, state: State, base: Refit, candidate: Candidate, fit: Refit
) -> tuple[LinearModel, tuple[Parameter, ...]]:
    """Return measurements less prediction about ``fit``, as if its candidate did nothing, and the parameters that are
    left, the last of what is free.
    """
    placed = _fix_places(base, candidate, fit)
    linear, kept = linear_model(problem, state, placed), -len(candidate.amplitudes)
    free = Freedom(linear.free.columns[:, :kept], linear.free.scales[:kept])
    return replace(linear, free=free), placed.parameters[:kept]


def evidence_by_size(problem: DiagnosisProblem, state: State, base: Refit, explanation: Screened, fit: Refit) -> Array:
    """Return (sizes,) log evidence of the fit, were it usually of each size."""
    fits = [
        _fix_places(base, _scale(explanation.candidate, size / explanation.size), fit)
        for size in problem.thresholds.sizes
    ]
    return np.array([log_evidence(linear_model(problem, state, fixed), explanation.levels) for fixed in fits])


def _scale(candidate: Candidate, factor: float) -> Candidate:
    """Return the candidate with its usual amplitudes that much larger."""
    return replace(candidate, free=Freedom(candidate.free.columns, factor * candidate.free.scales))


def _models_on_both_sides(candidate: Candidate, sides: Sequence[float]) -> list[Model]:
    """Return the candidate's model with its amplitudes so many of their usual sizes from where it stands, within
    bounds.
    """
    model, models = candidate.model, []
    for side in sides:
        values = {}
        for group, scale in zip(candidate.amplitudes, candidate.free.scales, strict=True):
            for name in group:
                values[name] = float(np.clip(model.value(name) + side * scale, *model.bounds(name)))
        models.append(model.with_values(values))
    return models
