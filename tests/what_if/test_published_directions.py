"""Answers have the direction that measurements and mechanics have published; how large they are is in the notebook."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.simulation.reduced.carved_run import carved_run
from sssi_exudyn.sweeps.asked_model import change_model, gates_of
from sssi_exudyn.what_if.answer import reasons_of, seconds_lost
from sssi_exudyn.what_if.intent import SPEED
from sssi_exudyn.what_if.question import STEP, Played, Question
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


def on_snow_that_edges_cut() -> RecordedRun:
    paper = recorded("intermediate", STOP)
    # hardness, strength and friction as fitted to this recording
    carving = Carving(hardness=4.3e7, strength=8e4, mu=0.13)
    return replace(paper, model=replace(paper.model, terms=combine_terms(paper.model.terms, (carving,))))


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


@pytest.mark.long
def test_a_larger_sidecut_radius_turns_wider_on_snow_that_edges_cut() -> None:
    """Spörri et al. 2016 (Br. J. Sports Med. 50:14), with radii of 30, 35 and 40 m."""
    run = on_snow_that_edges_cut()
    question, deeper = (
        Question(run, change_model(run.model, {"ski.sidecut_scale": scale}, None), "movement") for scale in (0.7, 1.3)
    )
    radii = [mean_radius(played) for played in (deeper.unchanged, question.as_recorded, question.unchanged)]
    assert radii[0] < radii[1] < radii[2]


@pytest.mark.long(seconds=16)
def test_a_ski_that_turns_less_than_the_path_asks_for_is_skidded_more() -> None:
    """Kröll et al. 2016 (Br. J. Sports Med. 50:26): from 30 to 35 m kinetic energy falls.  Why, shows at once: the
    skier steers the ski across its way.  It takes 4 s until he is slower by more than a part of a thousand.
    """
    run = on_snow_that_edges_cut()
    thirty = change_model(run.model, {"ski.sidecut_scale": 0.65}, "giant_slalom_183")
    run = replace(run, model=thirty, snow_turns=True)
    solution = solve(Question(run, change_model(thirty, {"ski.sidecut_scale": 30.0 / 35.0}, None), "path"))
    assert reasons_of(solution) == ()
    before, after = (energy_across(played) for played in (solution.question.as_recorded, solution.played))
    assert after > 1.1 * before


def energy_across(played: Played) -> float:
    """Return what the snow takes across the edges, J."""
    power = carved_run(played.model, played.prepared).series.power[:, 1]
    return float(np.trapezoid(power, played.run.time))


def mean_radius(played: Played) -> float:
    """Return path length by angle turned, m, without the first 0.3 s in which skis settle."""
    velocity = played.run.com_velocity[30:, :2]
    turned = np.abs(np.diff(np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0])))).sum()
    return float(np.linalg.norm(velocity, axis=1).sum() * STEP / turned)


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
