"""A force of any form in the place of a law: when it is the more probable, what it leaves of friction, and that it is
the same in the place of whichever law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from a_missing_force import courses, shaped
from coarse_skis import in_less_detail
from displaced_fixes import displaced_by

from sssi_exudyn.contact.terms.body_forces import UnexplainedForce
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, best_evidence, evidence_over_noise
from sssi_exudyn.fitting.linear_fit import linear_values
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, FreeFormForce, Probe, responses_of
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses, without_law
from sssi_exudyn.validation.diagnosis.search.explanation import Refitted, Round
from sssi_exudyn.validation.diagnosis.search.free_form_force import (
    ForceOfAnyForm,
    force_of_any_form,
    weigh_free_form,
)
from sssi_exudyn.validation.diagnosis.state import Reestimate, first_fit
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

LAWS = ("snow_patch", "gust")


@dataclass(frozen=True)
class Compared:
    about: Reestimate
    latest: Round

    def law(self, name: str) -> Refitted:
        return next(explanation for explanation in self.latest.refitted if explanation.name == name)

    def linearly(self, law: Refitted) -> float:
        """Log evidence of a force of any form, taken from the estimate with the law."""
        problem, state = self.about.problem, self.about.state
        linear, _ = without_law(problem, state, self.latest.base, law.candidate, law.fit)
        responses = self.latest.responses["unexplained_force"]
        return force_of_any_form(linear, law.levels, self.latest.fitted, responses).log_evidence


@pytest.fixture(scope="module")
def compared() -> Compared:
    """A run on which a brake grows from nothing to 60 N, as no law of the list does."""
    start, stop = 0.0, 5.0
    steps = np.linspace(start, stop, 11)
    brake = [
        UnexplainedForce(-60.0 * share, 0.0, 0.0, float(a), float(b))
        for share, a, b in zip(np.linspace(0.0, 1.0, 10), steps[:-1], steps[1:], strict=True)
    ]
    with in_less_detail():
        recording, motion = displaced_by("beginner", start, stop, lambda _run: brake)
        hypotheses = [BY_NAME[name] for name in (*LAWS, "unexplained_force")]
        model = model_of(recording, motion)
        # both laws are refitted, however little they explain linearly
        every_law = replace(THRESHOLDS, worthwhile=20.0, hopeful=20.0)
        about = Reestimate(
            *first_fit(diagnosis_problem(recording, motion, model, hypotheses=hypotheses, thresholds=every_law))
        )
        return Compared(about, compare_hypotheses(about.problem, about.state, about.fit))


@pytest.mark.long(seconds=40)
@pytest.mark.usefixtures("coarse_skis")
def test_its_evidence_is_the_same_in_the_place_of_whichever_law(compared: Compared) -> None:
    force = BY_NAME["unexplained_force"]
    assert isinstance(force, FreeFormForce)
    about_law, linearly = [], []
    for name in LAWS:
        law = compared.law(name)
        about = replace(compared.about, fit=law.fit)
        evidence, form = weigh_free_form(force, about, compared.latest, law, full=False)
        about_law.append(evidence)
        linearly.append(compared.linearly(law))
        assert set(form.values) >= {"friction.mu_t", "friction.mu_n"}
        assert np.all(form.free.scales > 0.0)
    # each is under the noise that suits its law; responses taken from the laws' own estimates differ by 3.6
    assert abs(about_law[0] - about_law[1]) < 0.5 * abs(linearly[0] - linearly[1])
    assert min(about_law) > max(linearly)


def without_posture(fitted: FittedRun, residual: Array, free: Freedom) -> LinearModel:
    return LinearModel(fitted.measurements, residual, free)


def with_force(linear: LinearModel, force: ForceOfAnyForm) -> LinearModel:
    """The linear model in which the most probable form is free, too."""
    return replace(linear, free=linear.free.with_more(force.free.columns, force.free.scales))


def noise(fitted: FittedRun, seed: int) -> Array:
    """(N,) of instruments as they usually are, without memory."""
    levels, draws = fitted.measurements.usual, np.random.default_rng(seed)
    noisy = np.zeros(len(fitted.measurements.measured))
    for name, block in fitted.measurements.blocks.items():
        noisy[block] = levels.of(name).sigma * draws.normal(size=block.stop - block.start)
    return noisy


def growing(fitted: FittedRun, responses: Array) -> Array:
    """(N,) what a brake does that grows from nothing to 80 N along the run."""
    along = shaped(responses, courses(fitted, 0))[:, 0]
    return np.asarray(-along @ np.linspace(0.0, 80.0, along.shape[1]))


def no_parameters(size: int) -> Freedom:
    return Freedom(np.zeros((size, 0)), np.zeros(0))


@pytest.mark.parametrize("seed", range(3))
def test_a_law_that_fits_is_more_probable_than_a_force_of_any_form_and_that_than_a_law_that_does_not(
    fitted: FittedRun, responses: Array, seed: int
) -> None:
    column = growing(fitted, responses)
    linear = without_posture(fitted, column + noise(fitted, seed), no_parameters(len(column)))
    law = Freedom(column[:, None], np.ones(1))
    levels, right = best_evidence(linear, fitted.measurements.usual, law)
    free_form = force_of_any_form(linear, levels, fitted, responses)
    of_any, free = free_form.log_evidence, with_force(linear, free_form)
    cells = len(fitted.time_edges) - 1
    across = responses.reshape(len(responses), 3, cells)[:, 1].sum(axis=1)
    wrong = evidence_over_noise(linear, levels, Freedom(across[:, None], np.full(1, 100.0)))
    assert right > of_any > wrong
    # its most probable form leaves what noise is
    best = evidence_over_noise(free, levels)
    assert best >= of_any
    assert right - best < 25.0  # some ten amplitudes are found with it, each of which costs 1 to 3 of evidence


@pytest.mark.parametrize("seed", range(3))
def test_where_nothing_acts_a_force_is_less_probable_than_none(fitted: FittedRun, responses: Array, seed: int) -> None:
    residual = noise(fitted, seed)
    linear = without_posture(fitted, residual, no_parameters(len(residual)))
    levels, without = best_evidence(linear, fitted.measurements.usual)
    assert force_of_any_form(linear, levels, fitted, responses).log_evidence < without


def test_next_to_a_force_along_the_path_friction_is_less_certain(fitted: FittedRun, responses: Array) -> None:
    levels = fitted.measurements.usual
    by_friction = responses_of([Probe(fitted.model, "friction.mu_t")], fitted.prepared, fitted.measurements)
    parameter = Parameter(("friction.mu_t",), Prior(0.06, 0.1))
    residual = growing(fitted, responses) + noise(fitted, 0)
    linear = without_posture(fitted, residual, Freedom(by_friction, np.array([0.1])))
    free = with_force(linear, force_of_any_form(linear, levels, fitted, responses))
    _, alone = linear_values(linear, levels, [parameter], 0)["friction.mu_t"]
    value, sigma = linear_values(free, levels, [parameter], 0)["friction.mu_t"]
    assert sigma > 2.0 * alone
    assert abs(value - 0.06) < 3.0 * sigma  # a force of 40 N in the mean is more than most are beforehand
