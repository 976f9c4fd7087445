"""A force of any form in the place of a law, about its own estimate.

What a listed law does, one that is not listed may do as well.  About the estimate with the law, where responses are
linear, the law is taken out and a latent force (``missing_force``) put in.  How probable the measurements are so says
how sure the law's name can be; and what friction would be then is less certain, as a force along the path does what
friction does.

Responses about the law's estimate are not those about one in which a force does the same: taken from there, a force
that follows any course lost 5 to 20 of log evidence, more than two names differ by.  So the force acts in the model,
cell by cell, friction is fitted with it, and it is found again about that.  Where force and law are about as probable,
posture and snow surface are estimated with the force, too, as they were with the law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import (
    Freedom,
    LinearModel,
    evidence_over_noise,
    log_posterior,
    uncertain,
    whiten_columns,
)
from sssi_exudyn.fitting.linear_fit import linear_values, with_parameters
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, FreeFormForce, responses_of
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import without_law
from sssi_exudyn.validation.diagnosis.search.explanation import OtherForm, Refitted, Round
from sssi_exudyn.validation.diagnosis.search.missing_force import (
    DIRECTIONS,
    along_course,
    course_of,
    forms_of,
    gain_of,
    half_each,
)
from sssi_exudyn.validation.diagnosis.state import (
    Reestimate,
    estimate_again,
    fit_model,
    fitted_run,
    linear_model,
    model_without,
)

_NEGLIGIBLE: Final = 1e-9
"""Share of the largest variance below which a direction of the force is rounding."""


@dataclass(frozen=True)
class ForceOfAnyForm:
    """What measurements know of a force of any form.

    log_evidence : averaged over the forms
    force : (3, c) N down the fall line, to the left and away from the snow in cells of time, of the most probable form
    free : the most probable form before the data speak, its directions with their standard deviations
    """

    log_evidence: float
    force: Array
    free: Freedom


def force_of_any_form(linear: LinearModel, levels: NoiseLevels, fitted: FittedRun, responses: Array) -> ForceOfAnyForm:
    """Return what measurements know of a force that explains what a law did.

    linear : about an estimate, its residual as if no such force acted;  responses : as in ``missing_force``
    """
    columns = along_course(fitted, responses)
    known, white = uncertain(linear, levels), whiten_columns(linear, levels, columns)
    gram, pull = white.T @ known.remove_from(white), white.T @ known.remove_from(known.residual)
    forms = forms_of(fitted, 1)
    gains = [[gain_of(form, gram, pull) for form in some] for some in forms]
    (gain, _), best = max(zip(chain(*gains), chain(*forms), strict=True), key=lambda pair: pair[0][1])
    along, across, normal = (gain @ pull).reshape(len(DIRECTIONS), -1)
    cosine, sine = course_of(fitted)
    sizes, directions = np.linalg.eigh(best)
    kept = sizes > _NEGLIGIBLE * sizes[-1]
    free = Freedom(columns @ directions[:, kept], np.sqrt(sizes[kept]))
    acting = replace(linear, free=linear.free.with_more(free.columns, free.scales))
    over_noise = evidence_over_noise(acting, levels) - log_posterior(acting, levels)
    return ForceOfAnyForm(
        log_evidence=(
            log_posterior(linear, levels) + half_each(*([factor for _, factor in some] for some in gains)) + over_noise
        ),
        force=np.stack([along * cosine - across * sine, along * sine + across * cosine, normal]),
        free=free,
    )


def weigh_free_form(
    hypothesis: FreeFormForce, about: Reestimate, latest: Round, law: Refitted, *, full: bool
) -> tuple[float, OtherForm]:
    """Return the log evidence of a force of any form in the place of the ``law``, and its numbers.

    about : the estimate with the law;  latest : the round in which both are compared
    """
    problem, state, fit = about.problem, about.state, about.fit
    levels, bare = law.levels, model_without(problem, fit.model, law.candidate)
    linear, parameters = without_law(problem, state, latest.base, law.candidate, fit)
    edges, thresholds = latest.fitted.time_edges, problem.thresholds
    known = force_of_any_form(linear, levels, latest.fitted, latest.responses[hypothesis.name])
    try:
        for _ in range(thresholds.force_repeats):
            force = known.force
            acting = replace(bare, terms=(*bare.terms, *hypothesis.in_cells(force, edges)))
            fit = fit_model(problem, state, acting, parameters, levels)
            bare = with_parameters(bare, parameters, fit.values)
            linear, known = _find_again(hypothesis, Reestimate(problem, state, fit), force, levels)
        if abs(known.log_evidence - law.log_evidence) < thresholds.force_close:
            about = Reestimate(*estimate_again(problem, replace(state, levels=levels), fit, full=full))
            linear, known = _find_again(hypothesis, about, force, about.state.levels)
            levels = about.state.levels
    except SimulationDiverged as error:
        problem.progress(None, f"a force of any form is as it was found last: {error}")
    linear = replace(linear, free=linear.free.with_more(known.free.columns, known.free.scales))
    first = len(linear.free.scales) - len(known.free.scales) - len(parameters)
    return known.log_evidence, OtherForm(1.0, linear_values(linear, levels, parameters, first), known.free)


def _find_again(
    hypothesis: FreeFormForce, about: Reestimate, force: Array, levels: NoiseLevels
) -> tuple[LinearModel, ForceOfAnyForm]:
    """Return the force estimated about a fit in whose model ``force`` (3, c) acts, and the linear model that it was
    estimated by.
    """
    fitted = fitted_run(about.problem, about.state, about.fit)
    linear = linear_model(about.problem, about.state, about.fit)
    responses = responses_of(hypothesis.probes(fitted), fitted.prepared, fitted.measurements)
    linear = replace(linear, residual=linear.residual + responses @ force.ravel())
    return linear, force_of_any_form(linear, levels, fitted, responses)
