"""The fit of few sensors: the balance agrees with the project's own model, and its interval holds the friction."""

from __future__ import annotations

from dataclasses import replace
from html import escape

import numpy as np
import pytest
from a_run import a_run
from bundled import bundled
from strapped import write_few

from sssi_exudyn.analysis.skiing import recorded_turns
from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import (
    FewSensorsFit,
    drag_of,
    effective_friction,
    fit_few_sensors,
    path_data,
)
from sssi_exudyn.fitting.few_sensors.path_balance import PathData, estimate_path
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.misfit import believable_fit, why_missed
from sssi_exudyn.fitting.parameters import posture_errors
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.few_sensors.complete import FootSigma
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports.html import section_html
from sssi_exudyn.reports.sections.few_sensors import few_sensors
from sssi_exudyn.results.posture import posture_figures, second_half_table
from sssi_exudyn.simulation.heading import HEADING
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

TRUE = {"friction.mu_t": 0.06, "friction.mu_n": 0.55}


@pytest.fixture(scope="module")
def captured() -> float:
    """Return the effective friction of the captured run."""
    complete, motion = bundled("beginner")
    model = problem_of(complete, motion, model_of(complete, motion), "joint").model.with_values(TRUE)
    return effective_friction(simulate_reduced(model, prepare(model, motion, step=COARSE_STEP)))


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, Motion, FewSensorsFit]:
    """Fit a telephone in a pocket."""
    folder = tmp_path_factory.mktemp("few") / "phone"
    recording = read_recording(write_few(bundled("beginner")[0], ("pocket",), folder))
    motion = motion_from_recording(recording)
    return recording, motion, fit_few_sensors(recording, motion, model_of(recording, motion), "joint")


def test_balance_and_track_have_the_same_fixes_where_rounding_puts_the_last_one_outside() -> None:
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    motion = replace(motion, stop=float(np.nextafter(recording.gps.time[40], 0.0)))
    problem = problem_of(recording, motion, model_of(recording, motion), "joint")
    data = path_data(recording, motion, problem.model, prepare(problem.model, motion, step=COARSE_STEP))
    assert data.time[-1] == recording.gps.time[40]
    np.testing.assert_array_equal(data.time, problem.track.time)


@pytest.mark.long
@pytest.mark.parametrize("mu_t", [0.03, 0.12])
def test_the_balance_has_the_friction_of_the_models_own_run(mu_t: float) -> None:
    complete, motion = bundled("beginner")
    model = problem_of(complete, motion, model_of(complete, motion), "joint").model
    model = model.with_values({"friction.mu_t": mu_t, "friction.mu_n": 0.55})
    prepared = prepare(model, motion, step=COARSE_STEP)
    run = simulate_reduced(model, prepared)
    inclination = model.inclination
    flat = np.hypot(
        run.com_velocity[:, 0] * np.cos(inclination) + run.com_velocity[:, 2] * np.sin(inclination),
        run.com_velocity[:, 1],
    )
    height = run.com[:, 2] * np.cos(inclination) - run.com[:, 0] * np.sin(inclination)
    every = slice(0, None, round(0.2 / prepared.step))
    data = PathData(
        run.time[every],
        flat[every],
        0.1,
        run.time[every],
        height[every],
        0.05,
        ExponentialNoise(0.05, 60.0),
        float(np.cos(inclination)),
        drag_of(model, prepared, float(np.mean(flat))),
    )
    path = estimate_path(data)
    # the centre of mass swings inside of the skis' path, which is longer, and legs do work
    assert path.effective == pytest.approx(effective_friction(run), abs=0.03)


@pytest.mark.long
def test_the_interval_of_a_telephone_holds_the_captured_runs_friction(
    case: tuple[Recording, Motion, FewSensorsFit], captured: float
) -> None:
    _, _, fit = case
    assert fit.path.converged
    assert abs(fit.path.effective - captured) < 2.0 * fit.path.effective_sigma
    # skis that point farther into turns than assumed exchange friction along the ski for friction across it
    assert fit.fitted.standard_error("friction.mu_t") > fit.path.effective_sigma


@pytest.mark.long
def test_the_models_run_confirms_the_balance(case: tuple[Recording, Motion, FewSensorsFit]) -> None:
    _, _, fit = case
    # ten seconds of turns: the slope's plane and the assumed posture are within a fifth of the friction
    assert fit.confirmed == pytest.approx(fit.path.effective, rel=0.2)
    assert fit.fitted.model.value("friction.mu_n") == 0.7


@pytest.mark.long
def test_a_posture_that_would_have_to_turn_far_is_said(case: tuple[Recording, Motion, FewSensorsFit]) -> None:
    fit = case[2]
    angles = np.zeros((3, len(PRESCRIBED)))
    angles[1, HEADING] = -1.2
    turned = PostureCorrection(np.array([0.0, 5.0, 10.0]), angles)
    model = replace(fit.fitted.model, posture=turned)
    doubt = replace(fit, fitted=replace(fit.fitted, model=model)).unconfirmed
    assert "at 5 s the posture would have to turn by 57° or more" in doubt


def test_a_track_that_few_sensors_do_not_explain_leaves_no_standard_errors(
    case: tuple[Recording, Motion, FewSensorsFit],
) -> None:
    recording, _, fit = case
    assert recording.completed is not None
    missed = replace(fit.fitted, residual=fit.fitted.residual + [0.0, 50.0])
    words = why_missed(missed, recording)
    assert f"skis that point {np.degrees(recording.completed.sigma.yaw):.2g}° wrong" in words
    assert np.all(np.isnan(believable_fit(missed, recording).standard_errors))


@pytest.mark.long
def test_page_and_summary_tell_measured_from_assumed_and_predict_the_second_half(
    case: tuple[Recording, Motion, FewSensorsFit],
) -> None:
    recording, _, fit = case
    assert recording.completed is not None
    posture = posture_figures(recording.completed, fit)
    assert posture.effective_friction_90 is not None
    assert posture.effective_friction_90.low < fit.path.effective < posture.effective_friction_90.high
    assert posture.without_errors().effective_friction_90 is None
    table = second_half_table(fit)
    assert np.all(np.isfinite(table.to_numpy()))
    run = a_run()
    run = replace(run, summary=replace(run.summary, posture=posture), second_half=table)
    page = section_html(few_sensors((run,)), "few")
    assert all(escape(line) in page for line in posture.assumed)
    assert "90\u00a0% interval" in page


@pytest.mark.long
def test_a_run_that_is_too_short_for_two_halves_is_refused(case: tuple[Recording, Motion, FewSensorsFit]) -> None:
    recording, motion, _ = case
    short = replace(motion, stop=motion.start + 1.0)
    with pytest.raises(InputError, match="longer run"):
        fit_few_sensors(recording, short, model_of(recording, motion), "joint")


@pytest.mark.long
def test_the_diagnosis_doubts_an_assumed_posture_more(case: tuple[Recording, Motion, FewSensorsFit]) -> None:
    recording, motion, _ = case
    assert recording.completed is not None

    def sigmas(assumed: FootSigma | None) -> dict[str, float]:
        errors = posture_errors(recording.uncertainty, motion.start, motion.stop, assumed)
        return {error.kind: error.sigma for error in errors if error.support < 0}

    assert sigmas(motion.foot_sigma)["roll"] == recording.completed.sigma.roll
    assert sigmas(motion.foot_sigma)["roll"] > sigmas(None)["roll"]


@pytest.mark.long
def test_turns_of_a_recording_are_those_that_the_sensor_shows(case: tuple[Recording, Motion, FewSensorsFit]) -> None:
    recording, motion, _ = case
    turns = recorded_turns(recording, motion.start, motion.stop)
    captured, _ = bundled("beginner")
    assert turns is not None
    assert recorded_turns(captured, motion.start, motion.stop) is None  # its turns are those of the path
    assert captured.gps is not None
    path = find_turns(captured.gps.time, captured.gps.enu).turns
    assert [turn.side for turn in turns.turns] == [turn.side for turn in path]
    # this skier's thigh turns before the antenna's course does, by half of the time that a change of edges takes
    assert [turn.start for turn in turns.turns] == pytest.approx([turn.start for turn in path], abs=0.7)
