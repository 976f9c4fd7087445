"""Instruments whose faults a model states: they stay as stated while hypotheses are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.model.faults import BootCuff, InsoleOffset, LeverArm
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem
from sssi_exudyn.validation.diagnosis.state import first_fit

ZERO = 200.0
"""N; far beyond what is uncertain of an insole."""


@pytest.mark.long(seconds=10)
@pytest.mark.usefixtures("coarse_skis")
def test_a_stated_zero_is_no_misfit() -> None:
    recording, motion = bundled("beginner")
    assert recording.insoles is not None
    insoles = replace(recording.insoles, left=recording.insoles.left + ZERO)
    recording, motion = replace(recording, insoles=insoles), replace(motion, stop=motion.start + 3.0)
    stated = (LeverArm(up=0.02), BootCuff(share=0.06), InsoleOffset(left=ZERO))
    model = replace(model_of(recording, motion), sensors=stated)
    problem, _, fit = first_fit(diagnosis_problem(recording, motion, model))
    assert set(fit.model.sensors) == set(stated)
    measurements = problem.measurements
    left = measurements.measured - fit.predicted
    for name in ("load", "difference"):
        # 12 N of noise of each insole, and what the start's bounce and the posture do: without the zero it is 200 N
        assert abs(np.mean(left[measurements.blocks[name]])) < 0.25 * ZERO
