"""A force of any form in the place of a law, about its own estimate.

About the estimate with a law, responses are not those about one in which a force does the same: taken from there, a
force that follows any course lost 5 to 20 of log evidence, more than two names differ by.  So the force that is found
there acts in the model, cell by cell, friction is fitted beside it, and it is found again about that; where force and
law are about as probable, posture and snow surface are estimated with the force, too, as they were with the law.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel
from sssi_exudyn.fitting.linear_fit import Refit, linear_values, with_parameters
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import responses_of
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import AnyForm, Explanation, Round, without_law
from sssi_exudyn.validation.diagnosis.search.unlisted_force import ForceOfAnyForm, unlisted_force
from sssi_exudyn.validation.diagnosis.state import (
    State,
    estimate_again,
    fit_model,
    fitted_run,
    linear_model,
    model_without,
)

_TIMES: Final = 2
"""How often the force is found again: a third time moves its evidence by 0.2."""
_CLOSE: Final = 6.0
"""Log evidence apart within which an estimate of the posture decides between force and law: it moves the force's by 1
to 3, seldom by 6."""


def weigh_any_form(
    problem: DiagnosisProblem, state: State, latest: Round, law: Explanation, fit: Refit, *, full: bool
) -> tuple[float, AnyForm]:
    """Log evidence of a force of any form in the place of the ``law`` that ``fit`` is an estimate with, and what else
    there is to say of it, all of its explanation.
    """
    assert law.candidate is not None
    levels, bare = law.levels, model_without(problem, fit.model, law.candidate)
    linear, parameters = without_law(problem, state, latest.base, law.candidate, fit)
    found = unlisted_force(linear, levels, latest.fitted, latest.responses[LATENT_FORCE.name])
    try:
        for _ in range(_TIMES):
            force = found.force
            acting = replace(bare, terms=(*bare.terms, *_in_cells(force, latest.fitted.time_edges)))
            fit = fit_model(problem, state, acting, parameters, levels)
            bare = with_parameters(bare, parameters, fit.values)
            linear, found = _find_again(problem, state, fit, force, levels)
        if abs(found.log_evidence - law.log_evidence) < _CLOSE:
            problem, state, fit = estimate_again(problem, replace(state, levels=levels), fit, full=full)
            linear, found = _find_again(problem, state, fit, force, state.levels)
            levels = state.levels
    except SimulationDiverged as error:
        problem.progress(None, f"a force of any form is as it was found last: {error}")
    linear = replace(linear, free=linear.free.with_more(found.free.columns, found.free.scales))
    first = len(linear.free.scales) - len(found.free.scales) - len(parameters)
    return found.log_evidence, AnyForm(1.0, linear_values(linear, levels, parameters, first), found.free)


def _in_cells(force: Array, edges: Array) -> list[UnexplainedForce]:
    """Terms that act as the force (3, c) N in its cells between ``edges`` (c + 1,) s."""
    return [
        UnexplainedForce(*map(float, (*by_slope, begin, end)))
        for by_slope, begin, end in zip(force.T, edges[:-1], edges[1:], strict=True)
    ]


def _find_again(
    problem: DiagnosisProblem, state: State, fit: Refit, force: Array, levels: NoiseLevels
) -> tuple[LinearModel, ForceOfAnyForm]:
    """The force found about a fit in whose model ``force`` (3, c) acts, and the linear model that it was found by."""
    fitted, linear = fitted_run(problem, state, fit), linear_model(problem, state, fit)
    responses = responses_of(LATENT_FORCE.probes(fitted), fitted.prepared, fitted.measurements)
    linear = replace(linear, residual=linear.residual + responses @ force.ravel())
    return linear, unlisted_force(linear, levels, fitted, responses)
