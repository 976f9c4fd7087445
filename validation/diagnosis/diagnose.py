"""Where a recording and its simulation differ, what physics was left out, the extended model, and the evidence for it.

``diagnose`` is the whole of it; the ``diagnosis`` in what it gives is what ``diagnosis.json`` holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.evidence import Freedom, LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem, Progress, diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, LATENT_FORCE, STEADY_LAWS
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import Explanation, Round, compare_hypotheses
from sssi_exudyn.validation.diagnosis.search.form_error import form_error
from sssi_exudyn.validation.diagnosis.search.held_out_turns import best_residual, folds_of, held_out_errors
from sssi_exudyn.validation.diagnosis.search.probabilities import NOTHING, STANDS_OUT
from sssi_exudyn.validation.diagnosis.search.reestimate_rivals import Anew, best_law, estimate_rivals
from sssi_exudyn.validation.diagnosis.search.search_result import (
    Accepted,
    Figures,
    SearchEnd,
    SearchResult,
    SeparateFit,
)
from sssi_exudyn.validation.diagnosis.state import (
    State,
    estimate_again,
    first_fit,
    fitted_run,
    last_estimate,
    linear_model,
    remove,
)
from sssi_exudyn.validation.diagnosis.wording.description import describe, figures_of

MOST_FINDINGS: Final = 3
ONCE_MORE: Final = 0.05
"""The same as ``STANDS_OUT`` once something has been found: a second finding has to be more certain, as the first is no
exact model.
"""
_LEAST: Final = 1e-12
"""Probability below which nothing is as good as impossible."""


def diagnose(
    recording: Recording,
    motion: Motion,
    model: Model,
    *,
    full: bool = True,
    cache: Cache | None = None,
    progress: Progress = lambda _share, _detail: None,
) -> SearchResult:
    """Find what is missing from ``model`` to explain the recording.

    With ``full`` every fit is confirmed by the full model; without, the reduced one is used throughout.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    problem = diagnosis_problem(recording, motion, model, progress, cache)
    problem, state, base = first_fit(problem, full=full)
    first, before = base, state.estimate
    rounds = [compare_hypotheses(problem, state, base)]
    state = replace(state, first_evidence=rounds[0].nothing.log_evidence)
    accepted: list[Accepted] = []
    forms: list[Freedom] = []
    while len(accepted) < MOST_FINDINGS:
        latest = rounds[-1]
        allowed = ONCE_MORE if accepted else STANDS_OUT
        if latest.nothing.probability > allowed or latest.best.fit is None:
            break
        try:
            latest, anew = estimate_rivals(problem, state, latest, full=full)
            latest, pair = _try_pair(latest, anew, forms)
            best = latest.best
            if latest.nothing.probability > allowed or best.name not in anew:
                rounds[-1] = latest
                break
            about = anew[best.name]
            form, following = pair or _next_round(latest, best, about, forms)
        except SimulationDiverged as error:
            progress(None, f"the search ends: with {latest.best.name} {error}")
            break
        rounds[-1:] = [latest, following]
        forms.append(form)
        problem, state, base = about.problem, about.state, about.fit
        accepted.append(Accepted(latest, best, base, linear_model(problem, state, base)))
    if len(accepted) > 1:
        names = sorted(each.explanation.name for each in accepted)
        try:
            problem_and_state, accepted = _compare_again(problem, state, accepted, full=full)
        except SimulationDiverged as error:
            progress(None, f"findings are not compared again: {error}")
        if names != sorted(each.explanation.name for each in accepted):
            base = accepted[-1].fit if accepted else first
            problem, state, base = estimate_again(*problem_and_state, base, full=full)
            rounds.append(compare_hypotheses(problem, state, base))
    try:
        after = last_estimate(problem, state, base, full=full)
    except SimulationDiverged as error:
        problem.progress(None, f"the last estimate is the search's: {error}")
        after = state.estimate
    before = before if accepted else after
    estimates = None if before is None or after is None else (before, after)
    diagnosis, figures = describe(recording.name, problem, state, first, base, rounds, accepted, estimates)
    return SearchResult(
        diagnosis=diagnosis,
        first=first,
        fit=base,
        posterior=after,
        result=simulate(base.model if after is None else after.model, motion) if full else None,
        noise=state.levels,
        rounds=tuple(rounds),
        figures=figures,
        separate_fit=partial(separate_fit, problem, state, base, accepted),
        end=SearchEnd(problem, state, base, tuple(accepted), full),
    )


def _next_round(latest: Round, best: Explanation, about: Anew, forms: Sequence[Freedom]) -> tuple[Freedom, Round]:
    """What the form of ``best`` may be wrong by, and what is missing beside it, ``about`` its estimate."""
    form = _form_error(latest, best)
    return form, compare_hypotheses(about.problem, _beside(about.state, [*forms, form]), about.fit)


def _try_pair(
    latest: Round, anew: Mapping[str, Anew], forms: Sequence[Freedom]
) -> tuple[Round, tuple[Freedom, Round] | None]:
    """Where a force of unknown law explains more than any law alone does, and two laws together more than that: the
    round in which the best law is as probable as it is alone or with a second, and, where it is the best then, what
    ``_next_round`` gives of it.  Else the same round, and None.

    That there is a second is as probable beforehand as that there is a first; each counts by its own probability.
    """
    law = best_law(latest, anew)
    if latest.best.name != LATENT_FORCE.name or law is None:
        return latest, None
    form, following = _next_round(latest, law, anew[law.name], forms)
    second, nothing = following.best, following.nothing
    both = law.log_evidence + second.log_evidence - nothing.log_evidence
    if second.name == LATENT_FORCE.name or both <= latest.best.log_evidence:
        return latest, None
    by_laws = sum(each.probability for each in following.explanations if each.name != LATENT_FORCE.name)
    more = max(NOTHING * by_laws / max(nothing.probability, _LEAST), 1.0)
    shares = [each.probability * (more if each is law else 1.0) for each in latest.explanations]
    every = [replace(each, probability=x / sum(shares)) for each, x in zip(latest.explanations, shares, strict=True)]
    ranked = replace(latest, explanations=tuple(sorted(every, key=lambda each: -each.probability)))
    return ranked, (form, following) if ranked.best.name == law.name else None


def _form_error(latest: Round, found: Explanation) -> Freedom:
    """Of the form of what a round found; a fault of an instrument is no force, and has none, and a force that is more
    probably of any form than for a while has that.
    """
    if found.any_form is not None and found.any_form.share > 0.5:
        return found.any_form.free
    fit, candidate, by_force = found.fit, found.candidate, latest.responses[LATENT_FORCE.name]
    if fit is None or candidate is None or BY_NAME[found.name].kind == "sensor":
        return Freedom(np.zeros((len(by_force), 0)), np.zeros(0))
    of_finding = np.array([bool(candidate.strengths & set(parameter.names)) for parameter in fit.parameters])
    moved = fit.sensitivity[:, of_finding] @ fit.pulls[of_finding]
    return form_error(latest.linear, found.levels, moved, by_force, latest.fitted.time_edges)


def _beside(state: State, forms: Sequence[Freedom]) -> State:
    """The state in which the forms of findings may be wrong too."""
    free = state.nuisances.free
    for form in forms:
        free = free.with_more(form.columns, form.scales)
    return replace(state, nuisances=replace(state.nuisances, free=free))


def _compare_again(
    problem: DiagnosisProblem, state: State, accepted: Sequence[Accepted], *, full: bool
) -> tuple[tuple[DiagnosisProblem, State], list[Accepted]]:
    """Every finding compared again with all hypotheses beside the other findings; the last only when one of them has
    become another.

    The first finding was made while the others were still hidden: it may have stood for one of them, and its
    probability and its alternatives were those of a mixture.  What is superfluous beside the others goes.  Gives also
    the problem and the state that the last of them is about.
    """
    accepted = list(accepted)
    explanations = [each.explanation for each in accepted]
    names = sorted(explanation.name for explanation in explanations)
    for explanation in explanations:
        if explanation is explanations[-1] and sorted(each.explanation.name for each in accepted) == names:
            break
        candidate = explanation.candidate
        at = next(i for i, each in enumerate(accepted) if each.explanation is explanation)
        if candidate is None or [each.explanation.name for each in accepted].count(explanation.name) > 1:
            continue  # two of one name cannot be removed separately
        rest = accepted[:at]
        for each in accepted[at + 1 :]:
            state, less = remove(problem, state, each.fit, candidate)
            rest.append(replace(each, fit=less, linear=linear_model(problem, state, less)))
        if rest:
            base = rest[-1].fit
        else:
            state, base = remove(problem, state, accepted[at].fit, candidate)
        again, accepted = compare_hypotheses(problem, state, base), rest
        if again.nothing.probability > STANDS_OUT or again.best.fit is None:
            continue
        again, anew = estimate_rivals(problem, state, again, full=full)
        if again.nothing.probability <= STANDS_OUT and again.best.name in anew:
            about = anew[again.best.name]
            problem, state = about.problem, about.state
            accepted.append(Accepted(again, again.best, about.fit, linear_model(problem, state, about.fit)))
    return (problem, state), accepted


def separate_fit(problem: DiagnosisProblem, state: State, fit: Refit, accepted: Sequence[Accepted] = ()) -> SeparateFit:
    """What the runs of a day are compared by, from a fit with what was ``accepted``."""
    shared = {hypothesis.name for hypothesis in STEADY_LAWS}
    for each in reversed(accepted):  # a second of a name goes before the first
        if each.explanation.name in shared and each.explanation.candidate is not None:
            state, fit = remove(problem, state, fit, each.explanation.candidate)
    return SeparateFit(problem, state, fit)


def fit_without_findings(recording: Recording, motion: Motion, model: Model) -> tuple[LinearModel, Figures]:
    """``model`` fitted, with nothing searched, by the reduced model: the run linearised there, and its figures.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    problem = diagnosis_problem(recording, motion, model)
    problem, state, fit = first_fit(problem)
    folds = folds_of(problem.measurements, fitted_run(problem, state, fit).edge_changes)
    linear = linear_model(problem, state, fit)
    left_out = held_out_errors(linear, state.levels, folds)[:, 0]
    return linear, figures_of(linear, state.levels, best_residual(linear, state.levels), left_out)
