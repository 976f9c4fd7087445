"""A long run in stretches: each goes on from the one before, and together they are nearly what all at once gives."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from carved_run import carved_intermediate

from sssi_exudyn.sweeps.asked_model import change_model
from sssi_exudyn.what_if import windows
from sssi_exudyn.what_if.answer import off_path, reasons_of, seconds_lost, seconds_per_number
from sssi_exudyn.what_if.fastest import solutions
from sssi_exudyn.what_if.intent import EDGE, MOMENT, PLACE, SPEED
from sssi_exudyn.what_if.question import Question, Stretch
from sssi_exudyn.what_if.recorded_run import RecordedRun
from sssi_exudyn.what_if.solve import Solution, solve
from sssi_exudyn.what_if.windows import needs_windows, solve_in_windows

STOP, HORIZON, ADVANCE = 2.2, 1.5, 0.75
MIDDLE = 1.0
"""s where a stretch begins: four spacings of 0.244 s after the start."""


def recorded() -> RecordedRun:
    return carved_intermediate(STOP)


@cache
def question(**changed: float) -> Question:
    run = recorded()
    changes = {name.replace("__", "."): value for name, value in changed.items()}
    return Question(run, change_model(run.model, changes, None), "path")


@pytest.fixture
def short_sighted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(windows, "HORIZON", HORIZON)
    monkeypatch.setattr(windows, "ADVANCE", ADVANCE)


@cache
def in_windows() -> Solution:
    return solve_in_windows(question(wind__w_f=-5.0))


def going_on(whole: Question, unknowns: np.ndarray, begin: float) -> tuple[Question, np.ndarray]:
    """Return the question from the first spline on that begins after ``begin`` (s), and its unknowns."""
    first = float(whole.supports.begins[whole.supports.begins >= begin][0])
    free = windows._open(whole, first, STOP)
    moment = windows._moment(whole, unknowns, None, first)
    return whole.during(Stretch(moment, STOP, unknowns, free), first), free


@pytest.mark.long(seconds=4)
def test_a_run_goes_on_where_it_was_left() -> None:
    whole = question(wind__w_f=-5.0)
    unknowns = np.full(whole.size, 0.05)
    part, free = going_on(whole, unknowns, MIDDLE)
    rows = np.isin(whole.samples, part.samples)
    assert part.samples[-1] == whole.samples[-1]
    assert 5 < len(part.samples) < len(whole.samples)
    apart = part.play(unknowns[free]).figures - whole.play(unknowns).figures[rows]
    # the first moments are averaged over less than those of the whole run
    apart[:2, MOMENT] = 0.0
    # accelerations at the first instant are found without a step that leads there
    assert np.max(np.abs(apart[:, PLACE])) < 1e-3
    assert np.max(np.abs(apart[:, SPEED])) < 1e-3
    assert np.max(np.abs(apart[:, EDGE])) < 1e-3
    assert np.max(np.abs(apart[:, MOMENT])) < 1.0


@pytest.mark.long(seconds=6)
def test_derivatives_go_on_too() -> None:
    whole = question(wind__w_f=-5.0)
    unknowns = np.full(whole.size, 0.05)
    part, free = going_on(whole, unknowns, MIDDLE)
    rows = np.isin(whole.samples, part.samples)
    expected = whole.weighed(whole.linearise(unknowns, whole.play(unknowns)))
    expected = expected.reshape(len(whole.samples), -1, whole.size)[rows][..., free]
    own = part.weighed(part.linearise(unknowns[free], part.play(unknowns[free])))
    own = own.reshape(expected.shape)
    moments = own[:, -3:]
    assert not np.any(moments[:2])  # averaged over what was before, too
    assert np.any(moments[2:])
    expected[:2, -3:] = 0.0
    # splines of a posture act by some parts of a thousand before they begin, which a stretch leaves out
    np.testing.assert_allclose(own, expected, atol=2e-3 * float(np.max(np.abs(expected))))


def test_short_runs_and_those_whose_heading_is_captured_are_answered_at_once() -> None:
    assert not needs_windows(question())  # 2.2 s


@pytest.mark.usefixtures("short_sighted")
@pytest.mark.long(seconds=7)
def test_long_runs_are_answered_in_stretches() -> None:
    asked = question()
    assert needs_windows(asked)
    solution, strict = solutions(asked)
    assert strict is not None
    assert solution.converged
    assert not np.any(solution.unknowns)  # nothing is changed, so the recorded run comes back
    assert not needs_windows(Question(replace(recorded(), snow_turns=False), recorded().model, "path"))


@pytest.mark.usefixtures("short_sighted")
@pytest.mark.long(seconds=40)
def test_stretches_give_nearly_what_all_at_once_gives() -> None:
    asked, solution = question(wind__w_f=-5.0), in_windows()
    assert reasons_of(solution) == ()
    at_once = solve(asked)
    lost = [float(seconds_lost(asked, of.played)[-1]) for of in (solution, at_once)]
    assert lost[1] > 0.05
    # who sees 0.75 s ahead less than all of the run keeps path and balance by other compromises
    assert lost[0] == pytest.approx(lost[1], rel=0.1)
    assert np.max(np.abs(off_path(asked, solution.played))) < 0.25
    assert solution.cost < 3.0 * at_once.cost
    names, changed = ("carving.mu", "start.velocity_f"), frozenset({"wind.w_f"})
    slopes = [seconds_per_number(of, names, changed) for of in (solution, at_once)]
    # solved again with μ 0.01 more and less, stretches give 0.0795 s a unit; derivatives are 5 % above
    assert slopes[0]["carving.mu"] == pytest.approx(0.0795, rel=0.1)
    assert slopes[0]["carving.mu"] == pytest.approx(slopes[1]["carving.mu"], rel=0.1)
