"""Gates that stand elsewhere: the path is scaled, the posture turns with it, and the skier follows it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.core.rotations import rotations_about
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import relative_poses, spline_motion
from sssi_exudyn.what_if.answer import off_path, reasons_of
from sssi_exudyn.what_if.gates import Gates
from sssi_exudyn.what_if.intent import PATH_SIGMA, PLACE, SPEED
from sssi_exudyn.what_if.question import Question, figures_tangents
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of
from sssi_exudyn.what_if.solve import solve

STOP = 3.0


@cache
def asked(distance: float, offset: float) -> Question:
    recording, motion = bundled("beginner")
    nodes = nodes_of(motion.start, motion.start + STOP)
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    model = replace(model_of(recording, motion), sensors=())
    return Question(RecordedRun(model, short), model, "path", Gates(distance, offset))


def test_the_path_is_scaled_from_its_start() -> None:
    question = asked(0.9, 1.2)
    start = question.as_recorded.run.com[0, :2]
    recorded = question.as_recorded.figures[:, PLACE] - start
    np.testing.assert_allclose(question.intended[:, PLACE] - start, recorded * (0.9, 1.2), rtol=1e-12)
    steps = np.diff(question.intended[:, PLACE], axis=0)
    along = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    # the direction changes by up to 0.1 rad between samples, and a chord has that of its middle
    np.testing.assert_allclose(along, 0.5 * (question.way[1:] + question.way[:-1]), atol=0.01)


def test_the_whole_posture_turns_about_the_snows_normal() -> None:
    question = asked(0.9, 1.2)
    assert question.path is not None
    motion = question.recorded.motion
    turned = spline_motion(
        motion.geometry,
        motion.inclination,
        question.nodes,
        question.path.posture(motion.evaluate(question.nodes)[0], motion.inclination),
    )
    instants = question.nodes[::50]
    turns = rotations_about(np.array([0.0, 0.0, 1.0]), question.path.turned[::50])
    before, after = (relative_poses(of, instants)[0].rotation[:, SEGMENT["calcn_l"]] for of in (motion, turned))
    assert float(np.max(np.abs(question.path.turned))) > np.radians(3.0)
    np.testing.assert_allclose(after, turns @ before, atol=1e-9)  # splines through the same nodes


def test_without_a_reaction_the_speed_is_the_recorded_one_at_first() -> None:
    question = asked(0.9, 1.2)
    run, recorded = question.unchanged.run, question.as_recorded.run
    speeds = [float(np.linalg.norm(of.com_velocity[0])) for of in (run, recorded)]
    # the body moves over the pelvis, whose velocity is turned, by some cm/s
    assert speeds[0] == pytest.approx(speeds[1], rel=0.01)


@pytest.mark.parametrize(("distance", "offset", "slower"), [(0.93, 1.0, 1), (1.0, 1.1, 1), (1.07, 1.0, -1)])
@pytest.mark.long(seconds=8)
def test_the_skier_follows_the_gates(distance: float, offset: float, slower: int) -> None:
    question = asked(distance, offset)
    solution = solve(question)
    assert reasons_of(solution) == ()
    off = [float(np.max(np.abs(off_path(question, run)))) for run in (question.unchanged, solution.played)]
    assert off[1] < min(off[0], PATH_SIGMA)
    # the run begins with a braking of 2 m/s, which nearer gates shorten; what they do shows in the last second
    change = np.mean((solution.played.figures - question.as_recorded.figures)[-10:, SPEED])
    assert -slower * change > 0.02  # m/s; nearer gates and more offset slow a skier down (Gilgien et al. 2020)


def test_derivatives_by_the_recorded_start_are_turned_with_the_path() -> None:
    question = asked(1.0, 1.2)
    assert question.path is not None
    names = ("start.velocity_f", "start.velocity_l")
    slopes = question.path.by_recorded_start(figures_tangents(question.unchanged, names, ()), names)[:, PLACE]
    for column, name in enumerate(names):
        ends = []
        for change in (-0.01, 0.01):
            model = question.recorded.model
            model = model.with_values({name: model.value(name) + change})
            other = Question(question.recorded, model, "path", question.gates)
            # the path is that of the recorded run, whose model is the same
            ends.append(other.unchanged.figures[:, PLACE])
        np.testing.assert_allclose(slopes[..., column], (ends[1] - ends[0]) / 0.02, atol=0.02)
