"""The stated snow is the prior of friction along the skis; without it the prior is as it was."""

from __future__ import annotations

from dataclasses import replace

import pytest
from bundled import bundled

from sssi_exudyn.core.number_ref import MU_T
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.parameters import FREE, unknown_numbers, with_unknown_parts
from sssi_exudyn.fitting.snow_prior import GLIDES
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.snow import SnowConditions


def prior_of(recording: Recording) -> tuple[float, float]:
    _, motion = bundled("beginner")
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    stated = with_unknown_parts(problem.model, recording)
    (prior,) = [unknown.prior for unknown in unknown_numbers(stated, problem.priors, recording) if unknown.name == MU_T]
    return prior.mean, prior.sigma


def test_stated_snow_is_the_prior_of_friction() -> None:
    recording, _ = bundled("beginner")
    assert prior_of(recording) == (FREE[MU_T].mean, FREE[MU_T].sigma) == (0.1, 0.1)
    wet = GLIDES["melting"]
    stated = replace(recording, snow=SnowConditions(kind="wet"))
    assert prior_of(stated) == pytest.approx((wet.mean, wet.sigma))
