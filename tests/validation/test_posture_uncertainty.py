"""The share of an assumed posture in friction's error, and a second half that is predicted from the first."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest
from a_run import a_run
from strapped import write_few

from sssi_exudyn.core.noise import fit_noise
from sssi_exudyn.fitting.first_fit import COARSE_STEP, Fitted, fit_reduced, problem_of
from sssi_exudyn.fitting.misfit import believable_fit, why_missed
from sssi_exudyn.fitting.objective import Problem, uncertainty
from sssi_exudyn.fitting.parameters import posture_errors
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.few_sensors.complete import FootSigma
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports.html import section_html
from sssi_exudyn.reports.sections.few_sensors import few_sensors
from sssi_exudyn.results.posture import posture_figures, second_half_table
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.validation.posture_uncertainty import effective_friction, over_ground, second_half, shares_of

EXAMPLE = Path(__file__).parents[2] / "examples" / "beginner"
TRUE = {"friction.mu_t": 0.06, "friction.mu_n": 0.55}


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, Motion, Problem, Fitted]:
    """Fit sensors on both skis and the chest with the reduced model."""
    folder = tmp_path_factory.mktemp("few") / "skis"
    recording = read_recording(write_few(read_recording(EXAMPLE), ("left_ski", "right_ski", "chest"), folder))
    motion = motion_from_recording(recording)
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    prepared = prepare(problem.model, motion, step=COARSE_STEP)
    fit = fit_reduced(problem, prepared, tolerance=1.0)  # friction to a fraction of its error
    model = problem.model_at(fit.values)
    residual, slopes = sensitivities(
        model, prepared, problem.names, lambda model, run: problem.residual(model, run.time, run.antenna)
    )
    noise = fit_noise(problem.track.time, residual)
    covariance = uncertainty(problem.with_noise(noise), -slopes, noise)
    fitted = Fitted(
        "joint", model, problem.names, fit.values, covariance, problem.track.time, residual, noise, fit, fit, 0.0
    )
    return recording, motion, problem, fitted


@pytest.mark.long
def test_a_track_that_few_sensors_do_not_explain_leaves_no_standard_errors(
    case: tuple[Recording, Motion, Problem, Fitted],
) -> None:
    recording, _, _, fitted = case
    assert why_missed(fitted, recording) == ""
    assert recording.completed is not None
    # skis are assumed to be known to some degrees: over 60 m that is less than 2 m
    missed = replace(fitted, residual=fitted.residual + [0.0, 5.0])
    words = why_missed(missed, recording)
    assert f"skis that point {np.degrees(recording.completed.sigma.yaw):.2g}° wrong" in words
    assert np.all(np.isnan(believable_fit(missed, recording).standard_errors))


@pytest.mark.long
def test_effective_friction_is_right_within_what_is_said_of_it(
    case: tuple[Recording, Motion, Problem, Fitted],
) -> None:
    """Compare the sum of friction along the ski and skidding, however they are parted, with the captured run's."""
    recording, motion, problem, fitted = case
    assert recording.completed is not None
    shares = shares_of(fitted, problem, motion, recording.completed, 0.0)
    index = problem.names.index("friction.mu_t")
    error = float(np.sqrt(shares.covariance[index, index]))
    assert error > shares.track[index]
    complete = read_recording(EXAMPLE)
    captured = motion_from_recording(complete)
    start = problem_of(complete, captured, model_of(complete, captured), "joint").model.with_values(TRUE)
    true = effective_friction(simulate_reduced(start, prepare(start, captured)))
    # steering exchanges friction along the ski for friction across it, and leaves their sum
    stated_error = float(np.linalg.norm([shares.track[index], shares.posture[index], shares.slope[index]]))
    assert abs(shares.effective - true) < 2.0 * stated_error
    assert stated_error < 0.1 * true
    # A wedge's skis, 9° apart, are taken as parallel, and headings are also 8° off (standard deviation): the skier
    # seems to skid less than he does, and what is missed of friction across, up to μ_n sin 9°, is found along the ski.
    assert 0.0 < fitted.values[index] - TRUE["friction.mu_t"] < TRUE["friction.mu_n"] * np.sin(np.radians(9.0))
    assert shares.effective > fitted.values[index]


@pytest.mark.long
def test_a_slope_that_is_a_degree_off_moves_friction_by_its_tangent(
    case: tuple[Recording, Motion, Problem, Fitted],
) -> None:
    recording, motion, problem, fitted = case
    assert recording.completed is not None
    sigma = replace(recording.completed.sigma, roll=0.0, pitch=0.0, yaw=0.0, height=0.0)
    known_posture = replace(recording.completed, sigma=sigma)
    shares = shares_of(fitted, problem, motion, known_posture, float(np.radians(1.0)))
    index = problem.names.index("friction.mu_t")
    assert shares.posture[index] == 0.0
    # d(tan α) = 0.019 straight down; in turns the path falls less, and start and heading take up a part
    assert 0.004 < shares.slope[index] < 0.022


@pytest.mark.long
def test_page_and_summary_tell_measured_from_assumed_and_predict_the_second_half(
    case: tuple[Recording, Motion, Problem, Fitted],
) -> None:
    recording, motion, problem, fitted = case
    assert recording.completed is not None
    assert recording.gps is not None
    shares = shares_of(fitted, problem, motion, recording.completed, recording.slope.sigma_inclination)
    wider = replace(fitted, covariance=shares.covariance)
    assert wider.standard_error("friction.mu_t") > fitted.standard_error("friction.mu_t")
    half = second_half(fitted, problem, motion, recording.gps)
    posture = posture_figures(recording.completed, fitted.names, shares, half)
    assert any("both skis" in line for line in posture.measured)
    assert any("knee flexion" in line for line in posture.assumed)
    assert posture.second_half.speed_rms_mps < 1.0  # of five and a half, over five seconds that were not fitted
    run = a_run()
    run = replace(run, summary=replace(run.summary, posture=posture), second_half=second_half_table(half))
    page = section_html(few_sensors((run,)), "few")
    assert all(escape(line) in page for line in posture.assumed)


@pytest.mark.long
def test_the_diagnosis_doubts_an_assumed_posture_more(case: tuple[Recording, Motion, Problem, Fitted]) -> None:
    recording, motion, _, _ = case
    assert recording.completed is not None

    def sigmas(assumed: FootSigma | None) -> dict[str, float]:
        errors = posture_errors(recording.uncertainty, motion.start, motion.stop, assumed)
        return {error.kind: error.sigma for error in errors if error.support < 0}

    assert sigmas(motion.foot_sigma)["roll"] == recording.completed.sigma.roll
    assert sigmas(motion.foot_sigma)["roll"] > sigmas(None)["roll"]


def test_speed_over_ground_of_a_straight_descent() -> None:
    time = np.linspace(0.0, 10.0, 201)
    path = np.stack([6.0 * time, 8.0 * time, np.zeros(201)], axis=1)
    instants = np.array([0.2, 5.0, 9.9])
    flat = np.hypot(6.0 * np.cos(0.3), 8.0)
    np.testing.assert_allclose(over_ground(time, path, 0.3)(instants), flat, rtol=1e-12)
