"""What an estimate is held against: the moment about the pelvis, or for comparing hypotheses the fixes' heights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.noise import ExponentialNoise, Scale, uneven_covariance
from sssi_exudyn.fitting.noise import LinearRun
from sssi_exudyn.fitting.observation import Observation, observation_of
from sssi_exudyn.fitting.observations import HEIGHT_ORIGIN
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem

SECONDS = 3.0


def observed(*, comparing: bool) -> Observation:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + SECONDS)
    counts = diagnosis_problem(recording, motion, model_of(recording, motion)).measurements.counts
    return observation_of(
        recording, model_of(recording, motion), motion, counts, balanced=not comparing, heights=comparing
    )


def test_heights_take_the_place_of_the_moments() -> None:
    balanced, comparing = observed(comparing=False), observed(comparing=True)
    assert "height" not in balanced.groups
    assert "moment" not in comparing.groups
    n = len(comparing.times["x"])
    assert comparing.times["height"].shape == (n,)
    for name in ("x", "y", "load", "difference"):
        both = (each.measured[each.blocks[name]] for each in (balanced, comparing))
        np.testing.assert_array_equal(*both)


def test_heights_of_a_run_are_predicted_as_the_diagnosis_predicts_them() -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + SECONDS)
    problem = diagnosis_problem(recording, motion, model_of(recording, motion))
    seen = observed(comparing=True)
    run = simulate_reduced(problem.model, prepare(problem.model, motion, step=0.01))
    ours = seen.predict_instruments(problem.model, run.time, run.antenna, run.sole_force)
    theirs = problem.measurements.predict(problem.model, run)
    for name, block in problem.measurements.blocks.items():
        np.testing.assert_array_equal(ours[seen.blocks[name]], theirs[block])
        np.testing.assert_array_equal(seen.measured[seen.blocks[name]], problem.measurements.measured[block])


def test_where_heights_count_from_is_not_known() -> None:
    """The evidence of what is whitened is that of dense matrices, with an origin of heights that is hardly known."""
    rng = np.random.default_rng(2)
    time = np.sort(rng.uniform(0.0, 5.0, 12))
    none = np.zeros(0)
    blocks = dict.fromkeys(("x", "y", "load", "difference", "speed_x", "speed_y"), slice(0, 0))
    blocks |= {"height": slice(0, 12)} | dict.fromkeys(("moment_f", "moment_l", "moment_n"), slice(12, 12))
    noise, scale = ExponentialNoise(0.03, 1.5), Scale(np.ones(12), np.where(np.arange(12) == 4, 3.0, 1.0))
    times = {**dict.fromkeys(blocks, none), "height": time}
    seen = Observation(75.0, rng.normal(size=12), blocks, times, scale, {"height": noise})
    columns = rng.normal(size=(12, 2))
    residual = 0.1 * rng.normal(size=12)
    covariance = uneven_covariance(time, noise, scale) + columns @ columns.T + HEIGHT_ORIGIN**2
    sign, log_volume = np.linalg.slogdet(2.0 * np.pi * covariance)
    assert sign == 1.0
    dense = -0.5 * float(residual @ np.linalg.solve(covariance, residual) + log_volume)
    found = LinearRun(seen, residual, columns).log_evidence({"height": noise})
    # dense matrices whose numbers span eight decades lose as many digits
    assert found == pytest.approx(dense, abs=1e-4)
    higher = LinearRun(seen, residual + 0.7, columns).log_evidence({"height": noise})
    assert higher == pytest.approx(found, abs=(0.7 / HEIGHT_ORIGIN) ** 2)  # what the origin's own density takes
