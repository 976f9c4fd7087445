"""Turns of synthetic paths, whose turns are known."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.analysis.turns import PHASES, edge_changes, find_turns, radius, turns_of_course
from sssi_exudyn.core.frames import Array

STEP = 1.0 / 200.0
TURN = 2.4
ANGLE = np.radians(60.0)


def path_of(course: Array, speed: Array | float) -> Array:
    tangent = np.stack([np.cos(course), np.sin(course)], axis=1)
    return np.cumsum(tangent * np.broadcast_to(np.asarray(speed), len(course))[:, None] * STEP, axis=0)


def linked(count: int = 8) -> tuple[Array, Array]:
    """Return time and course of ``count`` linked turns, the first to the left, the course's rate a sine."""
    time = np.arange(0.0, TURN * count, STEP)
    return time, -0.5 * ANGLE * np.cos(np.pi * time / TURN)


def noise(count: int, rate: float, sigma: float, seed: int) -> Array:
    """Draw noise (count, 2) m, correlated over 1 s."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-1.0 / rate)
    values = np.empty((count, 2))
    values[0] = rng.normal(0.0, sigma, 2)
    for i in range(1, count):
        values[i] = keep * values[i - 1] + rng.normal(0.0, sigma * np.sqrt(1.0 - keep**2), 2)
    return values


@pytest.mark.parametrize(
    ("every", "sigma", "within"),
    [
        (1, 0.0, 0.03),  # a simulation; the filter's time is 0.02 s
        (20, 0.02, 0.15),  # 10 fixes a second: 2 cm over 1 s are 0.04 m/s or 0.4° of course at 8 m/s;
        (20, 0.10, 0.40),  # where the course is level within 2 degrees for 0.3 s an extremum is anywhere in it
        (200, 0.50, 0.60),  # a phone's satellites, once a second
    ],
)
@pytest.mark.parametrize("seed", range(5))
def test_linked_turns(every: int, sigma: float, within: float, seed: int) -> None:
    time, course = linked()
    path = path_of(course, 8.0)[::every]
    path = path + noise(len(path), 1.0 / (STEP * every), sigma, seed) if sigma else path
    course_turns = find_turns(time[::every], path)
    assert [turn.side for turn in course_turns.turns] == ["left", "right"] * 4
    assert [turn.complete for turn in course_turns.turns] == [False, *[True] * 6, False]
    assert not course_turns.stretches
    starts = [turn.start for turn in course_turns.turns]
    assert np.allclose(starts, TURN * np.arange(8), atol=within)
    assert len(course_turns.linked_pairs()) == 5


def test_phases_are_thirds_and_labels_follow_them() -> None:
    time, course = linked(3)
    course_turns = find_turns(time, path_of(course, 8.0))
    turn = course_turns.turns[1]
    bounds = [turn.phases[name] for name in PHASES]
    assert bounds[0][0] == turn.start
    assert bounds[-1][1] == pytest.approx(turn.end)
    assert np.diff(bounds, axis=1).ravel() == pytest.approx(turn.duration / 3.0)
    instants = np.array([turn.start + 0.5 * turn.duration, -1.0])
    number, side, phase = course_turns.labels(instants)
    assert (list(number), side, phase) == ([2, 0], ["right", ""], ["control", ""])


def test_a_single_turn_between_two_traverses() -> None:
    time = np.arange(0.0, 12.0, STEP)
    course = np.interp(time, [0.0, 5.0, 7.0, 12.0], [0.0, 0.0, np.pi / 2.0, np.pi / 2.0])
    course_turns = find_turns(time, path_of(course, 6.0))
    assert [(turn.side, turn.complete) for turn in course_turns.turns] == [("left", False)]
    assert [stretch.kind for stretch in course_turns.stretches] == ["traverse", "traverse"]
    assert course_turns.turns[0].start == pytest.approx(5.0, abs=0.3)  # corners of the course are rounded over 0.2 s
    assert course_turns.turns[0].end == pytest.approx(7.0, abs=0.3)


def test_two_turns_to_one_side_are_two() -> None:
    time = np.arange(0.0, 10.0, STEP)
    course = np.interp(time, [0.0, 2.0, 7.0, 9.0, 10.0], [0.0, 1.0, 1.0, 2.0, 2.0])
    course_turns = find_turns(time, path_of(course, 6.0))
    assert [turn.side for turn in course_turns.turns] == ["left", "left"]
    assert [stretch.kind for stretch in course_turns.stretches] == ["traverse"]


def test_a_hesitation_within_a_turn_makes_no_turns() -> None:
    time, course = linked(8)
    wide = 2.5 * course  # turns of 150°, so that a quarter is 37°
    hesitates = wide + np.radians(30.0) * np.exp(-(((time - 3.5 * TURN) / 0.25) ** 2))
    turns = turns_of_course(time, hesitates, np.full(len(time), 8.0)).turns
    assert [turn.side for turn in turns] == ["left", "right"] * 4
    alone = turns_of_course(time[: len(time) // 8], hesitates[: len(time) // 8], np.full(len(time) // 8, 8.0)).turns
    assert [turn.side for turn in alone] == ["left"]


def test_a_pause_within_a_turn_belongs_to_it() -> None:
    time = np.arange(0.0, 12.0, STEP)
    course = np.interp(time, [0.0, 2.0, 4.0, 6.0, 9.0, 12.0], [0.0, 1.0, 1.0, 2.0, 0.5, 0.5])
    assert [turn.side for turn in find_turns(time, path_of(course, 6.0)).turns] == ["left", "right"]


def test_a_turn_that_the_run_cuts_off_needs_half_the_angle() -> None:
    time, course = linked(3)
    late = time > 0.6 * TURN  # cos(0.6 π) leaves 35 % of the first turn's 60°, 21°; a whole turn needs 25°
    turns = turns_of_course(time[late], course[late], np.full(np.count_nonzero(late), 8.0)).turns
    assert [turn.side for turn in turns] == ["left", "right", "left"]
    barely = time > 0.8 * TURN  # 10 %, 6°
    turns = turns_of_course(time[barely], course[barely], np.full(np.count_nonzero(barely), 8.0)).turns
    assert [turn.side for turn in turns] == ["right", "left"]


def test_who_turns_does_not_stand() -> None:
    time, course = linked(6)
    late = np.where(time < 2.0 * TURN, 0.0, 8.0)  # a receiver that has no places yet
    turns = turns_of_course(time, course, late)
    assert [turn.side for turn in turns.turns] == ["left", "right"] * 3
    assert not turns.stretches
    waits = turns_of_course(time, np.where(time < 2.0 * TURN, course[0], course), late)
    assert [stretch.kind for stretch in waits.stretches] == ["stop"]


def test_straight_running_has_no_turns() -> None:
    time = np.arange(0.0, 8.0, 0.1)
    path = np.stack([9.0 * time, 0.0 * time], axis=1) + noise(len(time), 10.0, 0.05, 3)
    course_turns = find_turns(time, path)
    assert not course_turns.turns
    assert [stretch.kind for stretch in course_turns.stretches] == ["traverse"]


def test_a_stop_parts_the_run() -> None:
    time, course = linked()
    speed = 8.0 * np.ones(len(time))
    stands = (time > 3.0 * TURN) & (time < 4.0 * TURN)
    fading = np.interp(time, [3.0 * TURN - 2.5, 3.0 * TURN, 4.0 * TURN, 4.0 * TURN + 2.5], [1.0, 0.0, 0.0, 1.0])
    course_turns = find_turns(time, path_of(course, speed * np.where(stands, 0.0, fading)))
    stops = [stretch for stretch in course_turns.stretches if stretch.kind == "stop"]
    assert len(stops) == 1
    assert stops[0].start == pytest.approx(3.0 * TURN, abs=0.5)
    assert stops[0].end == pytest.approx(4.0 * TURN, abs=0.5)
    assert all(turn.end <= stops[0].start + 0.1 or turn.start >= stops[0].end - 0.1 for turn in course_turns.turns)


def test_a_fall_is_a_speed_that_breaks_down() -> None:
    time, course = linked(4)
    speed = np.interp(time, [0.0, 5.0, 5.9, 9.6], [11.0, 11.0, 1.5, 0.0])  # 10.6 m/s², more than gravity
    course_turns = find_turns(time, path_of(course, speed))
    assert [stretch.kind for stretch in course_turns.stretches] == ["fall"]
    assert course_turns.stretches[0].start == pytest.approx(5.0, abs=0.4)
    assert course_turns.turns[-1].end <= course_turns.stretches[0].start + 0.1
    hard_stop = np.interp(time, [0.0, 5.0, 7.0, 9.6], [11.0, 11.0, 0.0, 0.0])  # 5.5 m/s², a hockey stop
    kinds = [stretch.kind for stretch in find_turns(time, path_of(course, hard_stop)).stretches]
    assert kinds == ["stop"]


def test_a_few_samples_are_no_run() -> None:
    assert not find_turns(np.arange(3.0), np.zeros((3, 2))).turns
    assert not find_turns(np.arange(30.0), np.zeros((30, 2))).turns  # stands all the time


def test_neither_heading_nor_clock_matters() -> None:
    time, course = linked(5)
    path = path_of(course, 8.0)
    turned = find_turns(time + 100.0, path_of(course + 2.0, 8.0) + 1e3)
    for a, b in zip(find_turns(time, path).turns, turned.turns, strict=True):
        assert (a.side, a.complete) == (b.side, b.complete)
        assert b.start - 100.0 == pytest.approx(a.start, abs=0.021)  # one sample of the grid
    mirrored = find_turns(time, path * [1.0, -1.0])
    assert [turn.side for turn in mirrored.turns] == ["right", "left", "right", "left", "right"]


def test_course_alone_gives_the_same_turns() -> None:
    time, course = linked(5)
    of_path = find_turns(time, path_of(course, 8.0)).turns
    of_course = turns_of_course(time, course, np.full(len(time), 8.0)).turns
    assert [turn.side for turn in of_course] == [turn.side for turn in of_path]
    assert [turn.start for turn in of_course] == pytest.approx([turn.start for turn in of_path], abs=0.05)


def test_radius_of_an_arc() -> None:
    course = np.linspace(0.0, 1.2, 400)
    assert radius(12.0 * np.stack([np.sin(course), 1.0 - np.cos(course)], axis=1)) == pytest.approx(12.0, rel=1e-4)
    assert radius(np.stack([np.arange(5.0), np.zeros(5)], axis=1)) == np.inf


def test_edges_change_where_both_skis_go_over_and_not_where_they_chatter() -> None:
    time = np.arange(0.0, 8.0, 0.01)
    edge = 0.6 * np.sin(np.pi * time / 2.0)
    chatter = 0.04 * np.sin(40.0 * time)  # less than a ski's that counts as edged
    both = np.stack([edge + chatter, edge - 0.5 * chatter], axis=1)
    np.testing.assert_allclose(edge_changes(time, both), [2.0, 4.0, 6.0], atol=0.02)  # a few samples
    assert len(edge_changes(time, np.stack([chatter, chatter], axis=1))) == 0
    assert len(edge_changes(time, np.stack([0.3 + chatter, 0.3 + chatter], axis=1))) == 0
