"""A force of any form in the place of a law: when it is the more probable, and what it leaves of friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_missing_force import courses, shaped

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, log_evidence
from sssi_exudyn.fitting.linear_fit import linear_values
from sssi_exudyn.fitting.noise import log_prior
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Probe, responses_of
from sssi_exudyn.validation.diagnosis.search.unlisted_force import ForceOfAnyForm, unlisted_force


def without_posture(fitted: FittedRun, residual: Array, free: Freedom) -> LinearModel:
    none = np.zeros((len(residual), 0))
    return LinearModel(fitted.measurements, residual, free, none, none)


def with_force(linear: LinearModel, found: ForceOfAnyForm) -> LinearModel:
    """The linear model in which the most probable form is free, too."""
    return replace(linear, free=linear.free.with_more(found.free.columns, found.free.scales))


def noise(fitted: FittedRun, seed: int) -> Array:
    """(N,) of instruments as they usually are, without memory."""
    levels, draws = fitted.measurements.usual, np.random.default_rng(seed)
    found = np.zeros(len(fitted.measurements.measured))
    for name, block in fitted.measurements.blocks.items():
        found[block] = levels.of(name).sigma * draws.normal(size=block.stop - block.start)
    return found


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
    levels, column = fitted.measurements.usual, growing(fitted, responses)
    linear = without_posture(fitted, column + noise(fitted, seed), no_parameters(len(column)))
    found = unlisted_force(linear, levels, fitted, responses)
    of_any, free = found.log_evidence, with_force(linear, found)
    prior = log_prior(fitted.measurements.usual, levels)
    right = log_evidence(linear, levels, Freedom(column[:, None], np.ones(1))) + prior
    cells = len(fitted.time_edges) - 1
    across = responses.reshape(len(responses), 3, cells)[:, 1].sum(axis=1)
    wrong = log_evidence(linear, levels, Freedom(across[:, None], np.full(1, 100.0))) + prior
    assert right > of_any > wrong
    # its most probable form leaves what noise is
    best = log_evidence(free, levels) + prior
    assert best >= of_any
    assert right - best < 25.0  # some ten amplitudes are found with it, each of which costs 1 to 3 of evidence


@pytest.mark.parametrize("seed", range(3))
def test_where_nothing_acts_a_force_is_less_probable_than_none(fitted: FittedRun, responses: Array, seed: int) -> None:
    levels, residual = fitted.measurements.usual, noise(fitted, seed)
    linear = without_posture(fitted, residual, no_parameters(len(residual)))
    of_any = unlisted_force(linear, levels, fitted, responses).log_evidence
    assert of_any < log_evidence(linear, levels) + log_prior(fitted.measurements.usual, levels)


def test_beside_a_force_along_the_way_friction_is_less_certain(fitted: FittedRun, responses: Array) -> None:
    levels = fitted.measurements.usual
    by_friction = responses_of([Probe(fitted.model, "friction.mu_t")], fitted.prepared, fitted.measurements)
    parameter = Parameter(("friction.mu_t",), Prior(0.06, 0.1))
    residual = growing(fitted, responses) + noise(fitted, 0)
    linear = without_posture(fitted, residual, Freedom(by_friction, np.array([0.1])))
    free = with_force(linear, unlisted_force(linear, levels, fitted, responses))
    _, alone = linear_values(linear, levels, [parameter], 0)["friction.mu_t"]
    value, sigma = linear_values(free, levels, [parameter], 0)["friction.mu_t"]
    assert sigma > 2.0 * alone
    assert abs(value - 0.06) < 3.0 * sigma  # a force of 40 N in the mean is more than most are beforehand
