"""A skier who reacts: nothing changed gives the recorded run, more friction costs time and the path is kept."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.core.choices import KEEPS, Keep
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.sweeps.asked_model import change_model
from sssi_exudyn.what_if.answer import departures, no_interval, off_path, reasons_of, seconds_lost, seconds_per_number
from sssi_exudyn.what_if.corrections import FORE_AFT, LEAN, PLOUGH, Correction
from sssi_exudyn.what_if.intent import LOOK_AHEAD, PLACE, SPEED, intent_of
from sssi_exudyn.what_if.limits import BALANCE, Imbalance, beyond, imbalance, moment_rms, out_of_balance, run_figures
from sssi_exudyn.what_if.pace import Pace
from sssi_exudyn.what_if.question import Question
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of
from sssi_exudyn.what_if.solve import Solution, solve

STOP = 3.0
MU_T = "friction.mu_t"


@cache
def recorded(name: str = "beginner") -> RecordedRun:
    recording, motion = bundled(name)
    nodes = nodes_of(motion.start, motion.start + STOP)
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    return RecordedRun(replace(model_of(recording, motion), sensors=()), short)


def recorded_com() -> Array:
    return Question(recorded(), recorded().model, "movement").as_recorded.run.com


@cache
def asked(change: float, keep: Keep) -> Solution:
    model = recorded().model
    return solve(Question(recorded(), model.with_values({MU_T: model.value(MU_T) + change}), keep))


@pytest.mark.parametrize("keep", KEEPS)
def test_nothing_changed_gives_the_recorded_run(keep: Keep) -> None:
    solution = solve(Question(recorded(), recorded().model, keep))
    assert solution.converged
    assert not np.any(solution.unknowns)
    np.testing.assert_array_equal(solution.played.run.com, solution.question.as_recorded.run.com)


@pytest.mark.long(seconds=4)
def test_more_friction_costs_time_on_the_recorded_path() -> None:
    kept, moved = asked(0.02, "path"), asked(0.02, "movement")
    off = [float(np.max(np.abs(off_path(solution.question, solution.played)))) for solution in (kept, moved)]
    assert kept.converged
    assert off[0] < off[1]
    assert seconds_lost(kept.question, kept.played)[-1] > 0.01
    assert all(part.limit is not None and part.largest < part.limit for part in departures(kept)[0])
    assert reasons_of(kept) == ()


@pytest.mark.long(seconds=4)
def test_an_interval_is_that_of_a_small_change() -> None:
    kept = asked(0.02, "path")
    assert no_interval(kept, (MU_T,), 0.05) is None
    assert "too large for derivatives" in str(no_interval(kept, (MU_T,), 0.5))  # of 3 s
    assert "no fitted numbers" in str(no_interval(kept, (), 0.0))


@pytest.mark.long(seconds=5)
def test_a_wedge_gets_narrower_on_slower_snow_and_keeps_the_speed() -> None:
    solution = asked(0.02, "speed")
    question, unchanged = solution.question, solution.question.unchanged
    ploughed = question.amounts(solution.unknowns, question.samples)[:, question.intent.corrections.index(PLOUGH)]
    assert float(np.mean(ploughed)) < 0.0
    slower = [
        float(np.mean(question.as_recorded.figures[:, SPEED] - run.figures[:, SPEED]))
        for run in (unchanged, solution.played)
    ]
    assert abs(slower[1]) < 0.2 * slower[0]


def test_parallel_skis_are_not_ploughed() -> None:
    assert PLOUGH in intent_of("speed", np.radians(9.0)).corrections
    assert PLOUGH not in intent_of("speed", np.radians(2.0)).corrections


@pytest.mark.long(seconds=4)
def test_the_derivative_of_time_is_that_of_two_answers() -> None:
    solution = asked(0.005, "path")
    model = recorded().model
    slope = seconds_per_number(solution, (MU_T,), frozenset({MU_T}))[MU_T]
    # the recorded run's friction lowers what is lost by as much as the asked one's raises it, to first order
    lost = seconds_lost(solution.question, solution.played)[-1]
    assert model.value(MU_T) > 0.0
    assert -slope * 0.005 == pytest.approx(lost, rel=0.3)  # curvature of the answer over half a step, and of the gate


@pytest.mark.long(seconds=4)
def test_the_skier_reacts_shortly_before_a_patch_is_met() -> None:
    model = recorded().model
    f = recorded_com()[:, 0]
    patch = {"snow_patch.delta_mu_t": 0.05, "snow_patch.f0": float(f[-1]) - 3.0, "snow_patch.f1": float(f[-1]) + 9.0}
    question = Question(recorded(), change_model(model, patch, None), "path")
    every = Question(recorded(), model, "path").supports
    assert question.supports.count < every.count
    # the patch begins smoothly over half a metre, which takes the beginner a tenth of a second
    met = float(np.interp(float(f[-1]) - 3.5, f, question.as_recorded.run.time))
    assert not np.any(question.supports.at(np.linspace(0.0, met - LOOK_AHEAD, 20)))
    solution = solve(question)
    before = question.samples < met - LOOK_AHEAD
    places = [run.figures[before, PLACE] for run in (solution.played, question.as_recorded)]
    np.testing.assert_allclose(*places, atol=1e-9)  # the movement is splined again through the same nodes
    assert seconds_lost(question, solution.played)[-1] > 0.0


@pytest.mark.long(seconds=4)
def test_a_stricter_skier_stays_closer_to_his_path() -> None:
    solution = asked(0.02, "path")
    strict = solve(solution.question.stricter(), nearby=solution)
    assert strict.converged
    off = [float(np.max(np.abs(off_path(solution.question, of.played)))) for of in (solution, strict)]
    assert off[1] < off[0]


@pytest.mark.long(seconds=3)
def test_figures_are_linearised() -> None:
    question = Question(recorded(), recorded().model, "path")
    unknowns = np.full(question.size, 0.05)
    played = question.play(unknowns)
    derivatives = question.linearise(unknowns, played)
    for index in (3, question.supports.count + 3, 2 * question.supports.count + 3, question.size - 3):
        step = 0.01 * np.eye(question.size)[index]
        either = [question.play(unknowns + way * step).figures[:, :2] for way in (1.0, -1.0)]
        difference = (either[0] - either[1]) / 0.02
        # tables of a moved posture are differentiated to first order in time steps of 10 ms
        np.testing.assert_allclose(
            derivatives[:, :2, index], difference, atol=0.03 * float(np.max(np.abs(difference))) + 1e-4
        )


def test_derivatives_are_the_same_in_several_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    run = recorded().until(1.0)
    question = Question(run, run.model, "path")
    unknowns = np.full(question.size, 0.05)
    played = question.play(unknowns)
    at_once = question.linearise(unknowns, played)
    assert question.size > 24
    monkeypatch.setattr("sssi_exudyn.what_if.question._AT_ONCE", 1)
    # sums over other columns are added up in another order
    np.testing.assert_allclose(question.linearise(unknowns, played), at_once, rtol=1e-9, atol=1e-9)


def test_what_was_skied_is_within_the_limits() -> None:
    figures = run_figures(Question(recorded(), recorded().model, "movement").as_recorded)
    assert beyond(figures, figures, "male") == []
    heavy = replace(figures, peak_force_bodyweights=5.1, peak_knee_extension_Nm_per_kg=3.0)
    assert ["5.1" in clause for clause in beyond(heavy, figures, "male")] == [True]
    assert len(beyond(heavy, figures, "female")) == 2
    assert beyond(heavy, heavy, "female") == []


@pytest.mark.parametrize(
    ("correction", "size", "falls"),
    [
        (LEAN, np.radians(6.0), "to the right"),
        (LEAN, np.radians(-6.0), "to the left"),
        (FORE_AFT, 0.08, "forward"),
        (FORE_AFT, -0.08, "backward"),
    ],
)
def test_a_body_that_is_not_over_its_feet_falls_there(correction: Correction, size: float, falls: str) -> None:
    run = recorded("intermediate").until(1.2)  # parallel skis: a wedge points elsewhere than the path
    question = Question(run, run.model, "path")
    unknowns = np.zeros(question.size)
    at = question.supports.count * question.intent.corrections.index(correction)
    unknowns[at : at + question.supports.count] = size / correction.scale
    apart = imbalance(question, question.play(unknowns))
    assert apart.falls == falls
    # the weight of 700 N at an arm of 0.08 m, or of 6 degrees over 0.9 m: 50 to 70 N m, and up to as much again as
    # the path gets another one
    assert 30.0 < apart.moment_Nm < 150.0


def test_out_of_balance_is_beyond_the_limit_alone() -> None:
    assert out_of_balance(Imbalance(BALANCE, 1.0, "forward")) == []
    assert "he falls forward at 1.0 s" in out_of_balance(Imbalance(BALANCE + 1.0, 1.0, "forward"))[0]


@pytest.mark.long(seconds=4)
def test_balance_comes_back_with_another_pace() -> None:
    solution = asked(0.04, "path")
    question = solution.question
    assert reasons_of(solution) == ()
    before, after = (imbalance(question, run).moment_Nm for run in (question.unchanged, solution.played))
    assert after < 0.3 * before
    # as it is, not averaged: what is faster than people move stays, a fifth of it at most
    assert moment_rms(solution.played) < 1.2 * moment_rms(question.as_recorded)


@pytest.mark.parametrize("change", [{"wind.w_f": -20.0}, {"friction.mu_n": 0.1}])
@pytest.mark.long(seconds=11)
def test_what_cannot_be_skied_is_refused(change: dict[str, float]) -> None:
    run = recorded("intermediate")
    solution = solve(Question(run, change_model(run.model, change, None), "path"))
    assert any("misses the path" in reason for reason in reasons_of(solution))


def test_standing_legs_bear_the_body() -> None:
    question = Question(recorded(), recorded().model, "movement")
    # the weight passes 0.1 to 0.25 m behind a knee bent by some 60 degrees: half of 9.8 N/kg, or all of it
    assert 0.4 < run_figures(question.as_recorded).peak_knee_extension_Nm_per_kg < 2.5


def test_time_goes_on_at_any_pace() -> None:
    clock = np.linspace(1.0, 4.0, 301)
    pace = Pace(clock, np.exp(np.sin(clock)))
    own = pace.own(clock)
    assert np.all(np.diff(own) > 0.0)
    assert own[0] == 1.0
    np.testing.assert_allclose(pace.back(own), clock, atol=1e-6)  # a cubic through points 10 ms apart
