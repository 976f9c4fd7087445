"""What an estimate is held against: fixes by a late clock, and the moment about the pelvis or the fixes' heights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import Scale, uneven_covariance
from sssi_exudyn.fitting.evidence import Freedom, LinearProblem, log_evidence
from sssi_exudyn.fitting.noise import HEIGHT_ORIGIN, usual_levels
from sssi_exudyn.fitting.observations import Measurements, Observation, observation_of
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem

SECONDS = 3.0
START, STOP, SIGMA = 2.0, 4.0, 0.02


def fixes(counts: float = 1.0) -> Measurements:
    """Eleven fixes from start to stop."""
    time, stated = np.linspace(START, STOP, 11), np.ones(11)
    nothing, none = np.zeros(0), np.zeros((0, 2))
    return Measurements(time, np.zeros((11, 3)), SIGMA, nothing, none, stated, np.full(11, counts))


@pytest.mark.parametrize("late", [0.0, 0.5, -0.5])
@pytest.mark.parametrize("counts", [1.0, 0.1])
def test_fixes_of_instants_outside_the_run_count_less(late: float, counts: float) -> None:
    """Their variance is that of the fix and of a place after an unknown acceleration of 5 m/s²."""
    seen = fixes(counts)
    stamped = seen.stamped_by(late, START, STOP)
    at = seen.fixes - late
    outside = np.where(at < START, START - at, np.where(at > STOP, at - STOP, 0.0))
    variance = SIGMA**2 / counts + (0.5 * 5.0 * outside**2) ** 2
    np.testing.assert_allclose(stamped.counts, SIGMA**2 / variance)
    np.testing.assert_array_equal(stamped.stated, seen.stated)  # for seconds they are as good as they say
    assert np.count_nonzero(stamped.counts < counts) == (3 if late else 0)


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
        both = (observation.measured[observation.blocks[name]] for observation in (balanced, comparing))
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


def test_a_late_clock_moves_the_receiver_s_speeds_too() -> None:
    """The derivative by a complex step is that of two runs; both interpolate linearly, within one step of the run."""
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    n = len(recording.gps.time)
    recording = replace(recording, gps=replace(recording.gps, speed=np.full(n, 5.0), course=np.zeros(n)))
    motion = replace(motion, stop=motion.start + SECONDS)
    model = model_of(recording, motion)
    seen = observation_of(recording, model, motion, np.ones(n))
    run = simulate_reduced(model, prepare(model, motion, step=0.01))

    def predicted(late: complex) -> Array:
        # between two instants of the run, where its interpolation has a corner
        clock = replace(model.start, clock_offset=0.003 + late)  # type: ignore[arg-type]
        return seen.predict_instruments(replace(model, start=clock), run.time, run.antenna, run.sole_force)

    step = 1e-3
    by_clock = np.imag(predicted(1e-30j)) / 1e-30
    both = (predicted(step) - predicted(-step)) / (2.0 * step)
    for name in ("x", "y", "speed_x", "speed_y"):
        block = seen.blocks[name]
        assert np.abs(both[block]).max() > 1.0
        np.testing.assert_allclose(by_clock[block], both[block], rtol=1e-6, atol=1e-6)


def test_heights_count_alike_wherever_they_count_from() -> None:
    seen = observed(comparing=True)
    levels = seen.usual
    residual = np.zeros(len(seen.measured))
    block = seen.blocks["height"]
    residual[block] = 0.3 * levels.height.sigma * np.sin(np.arange(block.stop - block.start))
    residual[block.start + 3] += 20.0 * levels.height.sigma
    higher = residual.copy()
    higher[block] += 1.0
    one, other = (seen.weighed(r, levels).scale.total[block] for r in (residual, higher))
    np.testing.assert_allclose(one, other)
    assert np.argmax(one) == 3
    assert one[3] > 3.0 * np.median(one)


def test_where_heights_count_from_is_not_known() -> None:
    """The evidence of what is whitened is that of dense matrices, with an origin of heights that is hardly known."""
    rng = np.random.default_rng(2)
    time = np.sort(rng.uniform(0.0, 5.0, 12))
    nothing = np.zeros(0)
    blocks = dict.fromkeys(("x", "y", "load", "difference", "speed_x", "speed_y"), slice(0, 0))
    blocks |= {"height": slice(0, 12)} | dict.fromkeys(("moment_f", "moment_l", "moment_n"), slice(12, 12))
    levels = usual_levels(0.02, 0.03, 700.0, 20.0)
    noise, scale = levels.height, Scale(np.ones(12), np.where(np.arange(12) == 4, 3.0, 1.0))
    times = {**dict.fromkeys(blocks, nothing), "height": time}
    seen = Observation(75.0, rng.normal(size=12), blocks, times, scale, levels)
    columns = rng.normal(size=(12, 2))
    residual = 0.1 * rng.normal(size=12)
    covariance = uneven_covariance(time, noise, scale) + columns @ columns.T + HEIGHT_ORIGIN**2
    sign, log_volume = np.linalg.slogdet(2.0 * np.pi * covariance)
    assert sign == 1.0
    dense = -0.5 * float(residual @ np.linalg.solve(covariance, residual) + log_volume)
    free = Freedom(np.hstack([columns, seen.height_origin]), np.ones(3))
    evidence = log_evidence(LinearProblem(seen, residual, free), levels)
    # dense matrices whose numbers span eight decades lose as many digits
    assert evidence == pytest.approx(dense, abs=1e-4)
    higher = log_evidence(LinearProblem(seen, residual + 0.7, free), levels)
    assert higher == pytest.approx(evidence, abs=(0.7 / HEIGHT_ORIGIN) ** 2)  # what the origin's own density takes
    # what a search minimises has the origin as part of the noise
    square = float(np.sum(seen.whiten(levels, residual[:, None]) ** 2))
    with_origin = uneven_covariance(time, noise, scale) + HEIGHT_ORIGIN**2
    assert square == pytest.approx(float(residual @ np.linalg.solve(with_origin, residual)), rel=1e-4)
