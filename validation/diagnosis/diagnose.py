"""Where a recording and its simulation differ, what physics was left out, the extended model, and the evidence for it.

``diagnose`` is the whole of it; the ``diagnosis`` in what it gives is what ``diagnosis.json`` holds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.evidence import Freedom, LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.threads import both
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem, diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import HYPOTHESES, STEADY_LAWS
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted, Round
from sssi_exudyn.validation.diagnosis.search.form_error import form_of
from sssi_exudyn.validation.diagnosis.search.held_out_turns import best_residual, folds_of, held_out_errors
from sssi_exudyn.validation.diagnosis.search.reestimate_rivals import best_law, estimate_rivals
from sssi_exudyn.validation.diagnosis.search.search_result import (
    Accepted,
    Figures,
    SearchEnd,
    SearchResult,
    SeparateFit,
)
from sssi_exudyn.validation.diagnosis.search.second_law import count_second_law
from sssi_exudyn.validation.diagnosis.state import (
    Reestimate,
    State,
    estimate_again,
    first_fit,
    fitted_run,
    last_estimate,
    linear_model,
    remove,
)
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds
from sssi_exudyn.validation.diagnosis.wording.description import describe, figures_of
from sssi_exudyn.validation.diagnosis.worlds.weigh import weigh_finding, weigh_nothing

_FIRST_SHARE: Final = 0.1
"""Share of a search's computing that the first estimate takes, roughly."""
_FIRST_COMPARED: Final = 0.3
"""The same until all hypotheses are compared about it."""
_LAST_SHARE: Final = 0.15
"""The same of the last estimate."""
_ROUND: Final = 0.8
"""Share that a round takes of what is left until the last estimate: most searches end after the first or the second."""
_RIVALS: Final = 0.7
"""Share of a round that the rivals take; the comparison about the best of them takes the rest."""


def diagnose(
    recording: Recording,
    motion: Motion,
    model: Model,
    *,
    full: bool = True,
    cache: Cache | None = None,
    progress: Advance = silent,
    hypotheses: Sequence[Hypothesis] = HYPOTHESES,
    thresholds: Thresholds = THRESHOLDS,
) -> SearchResult:
    """Find which of the ``hypotheses`` is missing from ``model`` to explain the recording.

    With ``full`` every fit is confirmed by the full model; without, the reduced one is used throughout.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    problem = diagnosis_problem(recording, motion, model, progress, cache, hypotheses=hypotheses, thresholds=thresholds)
    problem, state, first = first_fit(problem.reporting(0.0, _FIRST_SHARE), full=full)
    problem, before = replace(problem, progress=progress), state.estimate
    about, rounds, accepted, ahead = _search(Reestimate(problem, state, first), full=full)
    if len(accepted) > 1:
        about, accepted = _confirm(about, first, rounds, accepted, full=full)
    about = replace(about, problem=replace(about.problem, progress=progress))
    problem, state, base = about.problem, about.state, about.fit
    if ahead is not None and ahead.about is base:
        after = ahead.posterior
    elif accepted or rounds[-1].judgement is not None:
        after = _estimate_last(about.problem.reporting(1.0 - _LAST_SHARE, 1.0), about, full=full)
    else:
        rounds[-1], after = both(
            partial(weigh_nothing, problem, state, rounds[-1]),
            partial(_estimate_last, problem.reporting(1.0 - _LAST_SHARE, 1.0), about, full=full),
        )
    before = before if accepted else after
    estimates = None if before is None or after is None else (before, after)
    (diagnosis, figures), result = both(  # on a core each
        partial(describe, recording.name, problem, state, first, base, rounds, accepted, estimates),
        partial(simulate, base.model if after is None else after.model, motion) if full else lambda: None,
    )
    return SearchResult(
        diagnosis=diagnosis,
        first=first,
        fit=base,
        posterior=after,
        result=result,
        noise=state.levels,
        rounds=tuple(rounds),
        figures=figures,
        separate_fit=partial(separate_fit, problem, state, base, accepted),
        end=SearchEnd(problem, state, base, tuple(accepted), full),
    )


@dataclass(frozen=True)
class _LastEstimate:
    """The last estimate of a search that was expected to end, made while its finding was weighed.

    about : the fit that it is of;  posterior : as of ``last_estimate``
    """

    about: Refit
    posterior: Posterior | None


def _estimate_last(problem: DiagnosisProblem, about: Reestimate, *, full: bool) -> Posterior | None:
    """Return the last estimate of a search, or that of its state where it cannot be simulated."""
    try:
        return last_estimate(problem, about.state, about.fit, full=full)
    except SimulationDiverged as error:
        problem.progress(None, f"the last estimate is the search's: {error}")
        return about.state.estimate


def _search(about: Reestimate, *, full: bool) -> tuple[Reestimate, list[Round], list[Accepted], _LastEstimate | None]:
    """Compare hypotheses round by round, each about the estimate with what was found before, until nothing more is
    missing: the search's last estimate, the rounds, what was found, and the last estimate of all where it was made.
    """
    ahead: _LastEstimate | None = None
    problem, state = about.problem, about.state
    thresholds = problem.thresholds
    rounds = [compare_hypotheses(problem.reporting(_FIRST_SHARE, _FIRST_COMPARED), state, about.fit)]
    accepted: list[Accepted] = []
    forms: list[Freedom] = []
    share = _FIRST_COMPARED
    while len(accepted) < thresholds.most_findings:
        problem, state, latest = about.problem, about.state, rounds[-1]
        allowed = thresholds.stands_out_again if accepted else thresholds.stands_out
        if not _goes_on(latest, allowed):
            break
        begin, share = share, share + _ROUND * (1.0 - _LAST_SHARE - share)
        compared = begin + _RIVALS * (share - begin)
        report_comparison = problem.reporting(compared, share).progress
        try:
            latest, estimates = estimate_rivals(problem.reporting(begin, compared), state, latest, full=full)
            latest, pair = _try_pair(report_comparison, latest, estimates, forms)
            best = latest.best
            if latest.nothing.probability > allowed or not isinstance(best, Refitted) or best.name not in estimates:
                rounds[-1] = latest
                break
            form, following = pair or _next_round(report_comparison, latest, best, estimates[best.name], forms)
            by_fits = best.name
            weigh = partial(weigh_finding, latest, best, estimates, following)
            if _goes_on(following, thresholds.stands_out_again):
                latest, best = weigh()
            else:
                weighed, ahead = both(weigh, partial(_estimate_ahead, estimates[best.name], full=full))
                latest, best = weighed
            if latest.nothing.probability > allowed:
                rounds[-1] = latest
                break
            chosen = estimates[best.name]
            chosen = replace(chosen, problem=replace(chosen.problem, progress=problem.progress))
            if best.name != by_fits:
                form, following = _next_round(report_comparison, latest, best, chosen, forms)
        except SimulationDiverged as error:
            problem.progress(None, f"the search ends: with {latest.best.name} {error}")
            break
        rounds[-1:] = [latest, following]
        forms.append(form)
        about = chosen
        accepted.append(Accepted(latest, best, about.fit, linear_model(about.problem, about.state, about.fit)))
    return about, rounds, accepted, ahead


def _goes_on(latest: Round, allowed: float) -> bool:
    """Return whether a search goes on after a round."""
    return latest.nothing.probability <= allowed and isinstance(latest.best, Refitted)


def _estimate_ahead(about: Reestimate, *, full: bool) -> _LastEstimate:
    return _LastEstimate(about.fit, _estimate_last(replace(about.problem, progress=silent), about, full=full))


def _confirm(
    about: Reestimate, first: Refit, rounds: list[Round], accepted: list[Accepted], *, full: bool
) -> tuple[Reestimate, list[Accepted]]:
    """Compare several findings again, each next to the others; another round follows where one became another.

    first : the fit without any finding;  rounds : of the search, to which that round is added
    """
    names = sorted(finding.explanation.name for finding in accepted)
    problem, state = about.problem.reporting(1.0 - _LAST_SHARE, 1.0 - _LAST_SHARE), about.state
    try:
        (problem, state), accepted = compare_again(problem, state, accepted, full=full)
    except SimulationDiverged as error:
        problem.progress(None, f"findings are not compared again: {error}")
    if names == sorted(finding.explanation.name for finding in accepted):
        return about, accepted
    base = accepted[-1].fit if accepted else first
    about = Reestimate(*estimate_again(problem, state, base, full=full))
    rounds.append(compare_hypotheses(about.problem, about.state, about.fit))
    return about, accepted


def _next_round(
    progress: Advance, latest: Round, best: Refitted, about: Reestimate, forms: Sequence[Freedom]
) -> tuple[Freedom, Round]:
    """Return what the form of ``best`` may be wrong by, and the next round, which is about its estimate."""
    form = form_of(latest, best)
    problem = replace(about.problem, progress=progress)
    return form, compare_hypotheses(problem, _with_forms(about.state, [*forms, form]), about.fit)


def _try_pair(
    progress: Advance, latest: Round, estimates: Mapping[str, Reestimate], forms: Sequence[Freedom]
) -> tuple[Round, tuple[Freedom, Round] | None]:
    """Count the best law with a second one where a force without a law explains more than any law alone does.

    Return the round with the probabilities so counted and, where that law is then the best, what ``_next_round`` gives
    of it.  Without such a force, or such a law, the round stays as it is, with None.
    """
    law = best_law(latest.explanations, estimates)
    if latest.best.has_law or law is None:
        return latest, None
    form, following = _next_round(progress, latest, law, estimates[law.name], forms)
    counted = count_second_law(latest, law, following)
    if counted is None:
        return latest, None
    return counted, (form, following) if counted.best.name == law.name else None


def _with_forms(state: State, forms: Sequence[Freedom]) -> State:
    """Return the state in which the forms of findings may be wrong too."""
    free = state.nuisances.free
    for form in forms:
        free = free.with_more(form.columns, form.scales)
    return replace(state, nuisances=replace(state.nuisances, free=free))


def compare_again(
    problem: DiagnosisProblem, state: State, accepted: Sequence[Accepted], *, full: bool
) -> tuple[tuple[DiagnosisProblem, State], list[Accepted]]:
    """Compare every finding again with all hypotheses, next to the other findings.

    The first finding was made while the others were still hidden: it may have stood for one of them, and its
    probability and its alternatives were those of a mixture.  The last finding is compared only when another one has
    changed.  A finding that the others make superfluous goes.  Return also the problem and the state that the last of
    them is about.
    """
    accepted = list(accepted)
    explanations = [finding.explanation for finding in accepted]
    names = sorted(explanation.name for explanation in explanations)
    for explanation in explanations:
        if explanation is explanations[-1] and sorted(finding.explanation.name for finding in accepted) == names:
            break
        if [finding.explanation.name for finding in accepted].count(explanation.name) > 1:
            continue  # two of one name cannot be removed separately
        at = next(i for i, finding in enumerate(accepted) if finding.explanation is explanation)
        rest = accepted[:at]
        for finding in accepted[at + 1 :]:
            state, less = remove(problem, state, finding.fit, explanation.candidate)
            rest.append(replace(finding, fit=less, linear=linear_model(problem, state, less)))
        if rest:
            base = rest[-1].fit
        else:
            state, base = remove(problem, state, accepted[at].fit, explanation.candidate)
        again, accepted = compare_hypotheses(problem, state, base), rest
        allowed = problem.thresholds.stands_out
        if again.nothing.probability > allowed or not isinstance(again.best, Refitted):
            continue
        again, estimates = estimate_rivals(problem, state, again, full=full)
        best = again.best
        if again.nothing.probability <= allowed and isinstance(best, Refitted) and best.name in estimates:
            again, best = weigh_finding(again, best, estimates)
        if again.nothing.probability <= allowed and isinstance(best, Refitted) and best.name in estimates:
            about = estimates[best.name]
            problem, state = about.problem, about.state
            accepted.append(Accepted(again, best, about.fit, linear_model(problem, state, about.fit)))
    return (problem, state), accepted


def separate_fit(problem: DiagnosisProblem, state: State, fit: Refit, accepted: Sequence[Accepted] = ()) -> SeparateFit:
    """Return what the runs of a day are compared by, from a fit with what was ``accepted``."""
    shared = {hypothesis.name for hypothesis in STEADY_LAWS}
    for finding in reversed(accepted):  # a second of a name goes before the first
        if finding.explanation.name in shared:
            state, fit = remove(problem, state, fit, finding.explanation.candidate)
    return SeparateFit(problem, state, fit)


def fit_without_findings(recording: Recording, motion: Motion, model: Model) -> tuple[LinearModel, Figures]:
    """Fit ``model`` by the reduced model, with nothing searched: the run linearised there, and its figures.

    Raises ValueError without a GPS, and SimulationDiverged when the model cannot be simulated.
    """
    problem = diagnosis_problem(recording, motion, model)
    problem, state, fit = first_fit(problem)
    folds = folds_of(problem.measurements, fitted_run(problem, state, fit).edge_changes)
    linear = linear_model(problem, state, fit)
    left_out = held_out_errors(linear, state.levels, folds)[:, 0]
    return linear, figures_of(linear, state.levels, best_residual(linear, state.levels), left_out)
