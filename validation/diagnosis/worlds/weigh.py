"""A round's explanations weighed by the fits and by simulated runs together.

Both have something that the other lacks.  The fits know each rival about its own estimate, with its real term.  The
simulated runs know by how much a law's form may be wrong, how large causes are and what else may do the same.  Which
of them is right about a recording is not known, so each counts half: a name is sure only where both are.

Source: Clemen and Winkler, Risk Analysis 19 (1999) 187 (linear opinion pool).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.parameters import drag_coefficient
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.judgement import Judgement
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import responses_by_name
from sssi_exudyn.validation.diagnosis.search.explanation import Explanation, Nothing, Refitted, Round
from sssi_exudyn.validation.diagnosis.state import Reestimate, State, fitted_run, linear_model, linear_without
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE
from sssi_exudyn.validation.diagnosis.worlds.geometry import geometry_of
from sssi_exudyn.validation.diagnosis.worlds.judge import judge, train

_BY_FITS: Final = 0.5
"""Share of a probability that the fits have."""


def weigh_nothing(problem: DiagnosisProblem, state: State, latest: Round) -> Round:
    """Return a round in which nothing was found, with its probabilities by both."""
    linear = linear_model(problem, state, latest.base)
    return weigh_by_both(latest, _judge(problem, state, linear, latest.fitted, latest.responses, NOTHING_MISSING))


def weigh_finding(
    latest: Round, finding: Refitted, estimates: Mapping[str, Reestimate], following: Round | None = None
) -> tuple[Round, Refitted]:
    """Return a round with its probabilities by both, and the explanation that is then the most probable one of those
    estimated again.

    finding : by the fits;  estimates : of it and its rivals
    following : the round about its estimate, where there was one
    """
    about = estimates[finding.name]
    problem, state = about.problem, about.state
    fitted = fitted_run(problem, state, about.fit) if following is None else following.fitted
    responses = responses_by_name(problem, fitted) if following is None else following.responses
    fit = fit_without(latest, finding, about.fit)
    linear = linear_without(problem, state, fit, finding.candidate)
    without = _responses_without(latest, finding, responses)
    weighed = weigh_by_both(latest, _judge(problem, state, linear, fitted, without, finding.name))
    return weighed, next(explanation for explanation in weighed.refitted if explanation.name in estimates)


def weigh_by_both(latest: Round, judgement: Judgement) -> Round:
    """Return the round with the probabilities of its explanations by the fits and by simulated runs.

    That two things are hidden speaks for each law, as one of them.  A recording that is unlike all simulated runs may
    have a cause that no list has: the names that fits give then are wrong more often than they say.
    """
    fits = {explanation.name: explanation.probability for explanation in latest.explanations}
    thresholds = latest.fitted.thresholds
    by_fits, said = _BY_FITS, judgement.probabilities
    if judgement.outside < thresholds.world_outside:
        by_fits, said = thresholds.named_outside, {NOT_IN_THE_LIST: 1.0}
    by_runs = _by_explanation(latest, said)
    shares = {name: by_fits * fit + (1.0 - by_fits) * by_runs[name] for name, fit in fits.items()}
    weighed: list[Explanation] = [
        replace(one, probability=shares[one.name], by_fits=fits[one.name]) for one in latest.explanations
    ]
    weighed.sort(key=lambda explanation: -explanation.probability)
    return replace(latest, explanations=tuple(weighed), judgement=judgement)


def _by_explanation(latest: Round, said: Mapping[str, float]) -> dict[str, float]:
    """Return the probability of each explanation by what is ``said`` of simulated runs: what is in no list is shared by
    the explanations without a cause, and two things at once by the laws, as the fits have them.  What no fit was tried
    with is left out; where nothing remains the fits have all of it.
    """
    causes = [one for one in latest.hypotheses if one.hypothesis.kind != "unexplained"]
    others = [one for one in latest.hypotheses if one.hypothesis.kind == "unexplained"]
    by_name = {Nothing.name: said.get(NOTHING_MISSING, 0.0)}
    for group, shared in ((causes, TWO_AT_ONCE), (others, NOT_IN_THE_LIST)):
        total = sum(one.probability for one in group)
        for one in group:
            share = one.probability / total if total > 0.0 else 1.0 / len(group)
            by_name[one.name] = said.get(one.name, 0.0) + share * said.get(shared, 0.0)
    total = sum(by_name.values())
    if total == 0.0:
        return {explanation.name: explanation.probability for explanation in latest.explanations}
    return {name: probability / total for name, probability in by_name.items()}


def _judge(
    problem: DiagnosisProblem,
    state: State,
    linear: LinearModel,
    fitted: FittedRun,
    responses: Mapping[str, Array],
    about: str,
) -> Judgement:
    """Return what simulated runs had hidden that look like the recording without the finding ``about``."""
    problem.progress(None, "thousands of simulated runs with known causes")
    waves = 0.0 if problem.ground is None else problem.ground.amplitude * state.levels.surface
    geometry = geometry_of(linear, state.levels, fitted, problem.hypotheses, responses, waves)
    return judge(train(geometry, problem.thresholds, problem.hypotheses), geometry, about)


def fit_without(searched: Round, explanation: Refitted, fit: Refit) -> Refit:
    """Return the ``fit`` with the response to the drag coefficient as if a finding of a round did not act.

    As ``_responses_without``: about a gust, more drag does what the gust does, and nothing else would be missing.
    """
    if not explanation.hypothesis.through_air:
        return fit
    drag, base = drag_coefficient(searched.fitted.model), searched.base
    names, before = ([parameter.name for parameter in one.parameters] for one in (fit, base))
    if drag not in names or drag not in before:
        return fit
    sensitivity = fit.sensitivity.copy()
    sensitivity[:, names.index(drag)] = base.sensitivity[:, before.index(drag)]
    return replace(fit, sensitivity=sensitivity)


def _responses_without(searched: Round, explanation: Refitted, responses: Mapping[str, Array]) -> Mapping[str, Array]:
    """Return the ``responses`` to every hypothesis as if a finding of a round did not act.

    In a gust a larger drag area does what the gust does.  So what acts through the air has its response from before
    such a finding, except for the finding itself: its force grows with the square of the wind, and is known where it
    was found.
    """
    if not explanation.hypothesis.through_air:
        return responses
    through_air = [other.name for other in searched.hypotheses if other.hypothesis.through_air]
    before = {name: searched.responses[name] for name in through_air if name != explanation.name}
    return {**responses, **before}
