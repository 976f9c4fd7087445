"""The compliance of legs is found, and no longer left to the snow's stiffness."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled, steady

from sssi_exudyn.core.number_ref import COMPLIANCE, STIFFNESS
from sssi_exudyn.fitting.estimate import setting_of
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.linearised_run import Setting
from sssi_exudyn.fitting.posterior import Posterior, draw_numbers, find_posterior
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.drawn_run import draw_run

pytestmark = pytest.mark.usefixtures("coarse_skis")
SNOW = {"friction.mu_t": 0.19, "friction.mu_n": 0.9}
SOFT = 4e-5
"""m/N: 25 kN/m."""


@cache
def setting_of_legs(share: float) -> tuple[Model, Setting]:
    """Return the model and what is sought of the first seconds of the intermediate skier, legs known to that share."""
    recording, motion = bundled("intermediate")
    recording = steady(replace(recording, uncertainty=replace(recording.uncertainty, leg_compliance=share)))
    motion = replace(motion, stop=motion.start + 6.0)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    return setting_of(problem.model.with_values(SNOW), problem, recording, motion)


@cache
def estimate_of(compliance: float, share: float) -> tuple[Posterior, float]:
    """Return the estimate of a run with such legs, and the true stiffness of its snow."""
    model, setting = setting_of_legs(0.0)
    drawn = draw_run(model.with_values({COMPLIANCE: compliance}), setting, np.random.default_rng(53))
    stated, sought = setting_of_legs(share)
    seen = replace(sought.seen, measured=drawn.setting.seen.measured)
    stiffness = float(drawn.values[setting.names.index(STIFFNESS)])
    return find_posterior(stated, replace(sought, seen=seen)), stiffness


@pytest.mark.long(seconds=20)
def test_legs_that_give_are_found_and_leave_the_snow_its_stiffness() -> None:
    (held, stiffness), (sought, _) = (estimate_of(SOFT, share) for share in (0.0, 1.0))
    i, k = sought.setting.names.index(COMPLIANCE), sought.setting.names.index(STIFFNESS)
    sigmas = np.sqrt(np.diag(sought.covariance))
    assert sigmas[i] < 0.6 * sought.setting.sigmas[i]
    # one draw, of which none in a hundred is beyond 2.6
    assert abs(sought.values[i] - SOFT) < 2.6 * sigmas[i]
    assert abs(sought.values[k] - stiffness) < 2.6 * sigmas[k]
    assert held.model.value(STIFFNESS) < 0.6 * stiffness
    assert sought.log_evidence > held.log_evidence + 5.0
    assert sought.share(STIFFNESS)["legs' give"] >= 0.0


@pytest.mark.long(seconds=20)
def test_legs_that_hold_are_found_stiff() -> None:
    """The search ends at the stiffest legs, or near; draws keep them from giving the other way."""
    sought, _ = estimate_of(0.0, 1.0)
    i = sought.setting.names.index(COMPLIANCE)
    low = float(sought.setting.bounds(sought.model)[i, 0])
    assert sought.optimum.converged
    assert low <= sought.values[i] < low + 2.6 * float(np.sqrt(sought.covariance[i, i]))
    drawn, _ = draw_numbers(sought, 50, np.random.default_rng(1))
    assert np.all(drawn[:, i] >= low)
