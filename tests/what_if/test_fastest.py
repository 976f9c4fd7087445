"""The fastest run: it wins time within the limits, and a limit is what ends it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled import bundled

import sssi_exudyn
from sssi_exudyn.core.errors import InputError
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
    return Question(RecordedRun(model, short), model, "path", throughout=True)


@pytest.mark.long(seconds=15)
def test_the_fastest_run_wins_time_within_the_limits() -> None:
    question = a_question()
    solution = fastest(question)
    assert solution.question.worth > 0.0
    assert reasons_of(solution) == ()
    won = -float(seconds_lost(question, solution.played)[-1])
    # the skier is at the line at the end of his own time: to three times the 1 cm of place and pace, at 5 m/s
    assert won == pytest.approx(question.samples[-1] - solution.played.times[-1], abs=0.006)
    assert won > 0.02
    assert float(np.max(np.abs(off_path(question, solution.played)))) < 1.0


def test_a_second_is_worth_what_the_cost_says() -> None:
    question = a_question()
    slower = np.zeros(question.size)
    slower[-question.supports.count :] = 0.5
    played = question.play(slower)
    dearer = question.hurried(100.0).cost(slower, played) - question.cost(slower, played)
    # the pace is exp(0.5 · 0.3) all along, since B-splines add up to one
    assert dearer == pytest.approx(100.0 * (np.exp(0.15) - 1.0) * (question.samples[-1] - question.nodes[0]), rel=1e-6)


def test_the_fastest_run_keeps_a_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--fastest"):
        sssi_exudyn.whatif(tmp_path, keep="speed", fastest=True)
