"""Answers have the direction that measurements and mechanics have published; how large they are is in the notebook."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.sweeps.asked_model import change_model, gates_of
from sssi_exudyn.what_if.answer import reasons_of, seconds_lost
from sssi_exudyn.what_if.intent import SPEED
from sssi_exudyn.what_if.question import Question
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of
from sssi_exudyn.what_if.solve import Solution, solve

STOP = 2.5
MU_T = "friction.mu_t"
NEAR_AND_ASIDE = (("distance", 0.95), ("offset", 1.05))


@cache
def recorded(name: str, stop: float) -> RecordedRun:
    recording, motion = bundled(name)
    nodes = nodes_of(motion.start, motion.start + stop)
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    return RecordedRun(replace(model_of(recording, motion), sensors=()), short)


@cache
def asked(name: str, value: float, skier: str = "beginner") -> Solution:
    run = recorded(skier, STOP)
    changes = {name: value}
    return solve(Question(run, change_model(run.model, changes, None), "path", gates_of(changes)))


def slower(solution: Solution) -> float:
    """Return by how much (m/s) the skier is slower in the last second: the run begins with a braking of 2 m/s."""
    question = solution.question
    return float(np.mean((question.as_recorded.figures - solution.played.figures)[-10:, SPEED]))


@pytest.mark.parametrize(
    ("name", "value", "direction"),
    [
        (MU_T, 0.13, 1),  # 0.1 recorded; friction along the ski brakes
        (MU_T, 0.07, -1),
        ("air.c_d", 1.6, 1),  # 0.8 recorded
        ("wind.w_f", -5.0, 1),  # a headwind of 18 km/h
        ("skier.mass", 90.0, -1),  # air brakes a heavier body less for each of its kilograms
        ("slope.inclination_deg", 17.0, -1),  # 15.4 recorded
        ("ski.sidecut_scale", 0.7, 1),  # a larger sidecut radius: lower kinetic energy (Kröll et al. 2016)
        ("gates.distance", 0.93, 1),  # nearer gates, and gates with more offset (Gilgien et al. 2020)
        ("gates.offset", 1.1, 1),
    ],
)
@pytest.mark.long(seconds=4)
def test_speed_changes_as_published(name: str, value: float, direction: int) -> None:
    solution = asked(name, value)
    assert reasons_of(solution) == ()
    assert direction * slower(solution) > 0.0


@pytest.mark.parametrize(("name", "value"), [(MU_T, 0.13), ("ski.sidecut_scale", 0.7), ("gates.offset", 1.1)])
@pytest.mark.long(seconds=4)
def test_a_slower_run_lasts_longer(name: str, value: float) -> None:
    """Kröll et al. 2016 for the sidecut: kinetic energy falls because turns last longer."""
    solution = asked(name, value)
    assert seconds_lost(solution.question, solution.played)[-1] > 0.0


@pytest.mark.long(seconds=8)
def test_a_share_of_the_distance_slows_more_than_that_of_the_offset() -> None:
    """Gilgien et al. 2021 (super-G): 13 % less distance slow a skier as 51 % more offset do."""
    nearer, aside = (asked(f"gates.{name}", value, "intermediate") for name, value in NEAR_AND_ASIDE)
    assert slower(nearer) > slower(aside) > 0.0


def test_most_energy_goes_about_the_fall_line() -> None:
    """Supej and Holmberg 2011: most energy is lost while the skier steers, least where the edges change."""
    run = recorded("intermediate", 6.0)
    played = Question(run, change_model(run.model, {"skier.mass": 80.0}, None), "movement").unchanged
    time, velocity = played.run.time, played.run.com_velocity
    height = np.cos(run.model.inclination) * played.run.com[:, 2] - np.sin(run.model.inclination) * played.run.com[:, 0]
    energy = 0.5 * np.sum(velocity**2, axis=1) + GRAVITY * height
    turn = find_turns(time, played.run.com).turns[1]
    fifths = np.interp(np.linspace(turn.start, turn.end, 6), time, energy)
    lost = -np.diff(fifths)
    assert np.argmax(lost) in (1, 2, 3)
    assert np.argmin(lost) in (0, 4)
    assert lost[1:4].mean() > lost[[0, 4]].mean()
