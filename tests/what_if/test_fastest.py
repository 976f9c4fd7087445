"""The fastest run: it wins time within the limits, and a limit is what ends it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.what_if.answer import off_path, reasons_of, seconds_lost
from sssi_exudyn.what_if.fastest import fastest
from sssi_exudyn.what_if.question import Question
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of

STOP = 1.5


def a_question() -> Question:
    recording, motion = bundled("beginner")
    nodes = nodes_of(motion.start, motion.start + STOP)
    short = spline_motion(motion.geometry, motion.inclination, nodes, motion.evaluate(nodes)[0])
    model = replace(model_of(recording, motion), sensors=())
    return Question(RecordedRun(model, short), model, "line")


@pytest.mark.long(seconds=15)
def test_the_fastest_run_wins_time_within_the_limits() -> None:
    question = a_question()
    solution = fastest(question)
    assert solution.question.worth > 0.0
    assert reasons_of(solution) == ()
    won = -float(seconds_lost(question, solution.played)[-1])
    # the line is passed between two steps of 10 ms, where the speed hardly changes
    assert won == pytest.approx(-question.later_at_end(solution.played), abs=1e-3)
    assert won > 0.02
    assert float(np.max(np.abs(off_path(question, solution.played)))) < 1.0


def test_the_end_of_the_path_is_passed_when_the_figures_say() -> None:
    question = a_question()
    unknowns = np.full(question.size, 0.02)
    played = question.play(unknowns)
    slope = question.later_at_end_by(question.linearise(unknowns, played), played)
    paced = question.size - question.supports.count
    for index in (int(np.argmax(np.abs(slope[:paced]))), paced + int(np.argmax(np.abs(slope[paced:])))):
        step = 0.01 * np.eye(question.size)[index]
        either = [question.later_at_end(question.play(unknowns + sign * step)) for sign in (1.0, -1.0)]
        # tables of a moved posture are differentiated to first order in time steps of 10 ms
        assert slope[index] == pytest.approx((either[0] - either[1]) / 0.02, rel=0.03, abs=1e-4)
