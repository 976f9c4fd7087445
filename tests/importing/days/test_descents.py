"""A day's track split into runs and what is between them, on tracks whose runs are known."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.importing.days.descents import CLIMB, PAUSE, Piece, split_day

Leg = tuple[float, float, float]
"""Duration (s), way over ground (m) and change of the height (m) of a leg at constant speed."""

LIFT: Leg = (300.0, 600.0, 130.0)
DOWN: Leg = (100.0, 900.0, -130.0)
QUEUE: Leg = (90.0, 9.0, 0.0)


def track(*legs: Leg, step: float = 1.0, noise: float = 0.0) -> tuple[Array, Array, Array]:
    """Return time, places over ground and heights of legs that follow each other."""
    corners = np.cumsum([(0.0, 0.0, 1000.0), *legs], axis=0)
    time = np.arange(0.0, corners[-1, 0] + 0.5 * step, step)
    along, height = (np.interp(time, corners[:, 0], corners[:, axis]) for axis in (1, 2))
    wander = np.random.default_rng(1).normal(0.0, noise, (3, len(time)))
    return time, np.column_stack([along + wander[0], wander[1]]), height + wander[2]


def kinds(pieces: list[Piece]) -> list[str]:
    return [piece.kind for piece in pieces]


def runs(pieces: list[Piece]) -> list[Piece]:
    return [piece for piece in pieces if piece.kind == "run"]


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_every_descent_between_lifts_is_a_run(noise: float) -> None:
    time, flat, height = track(*[LIFT, DOWN, QUEUE] * 9, noise=noise)
    pieces = split_day(time, flat, height)
    assert len(runs(pieces)) == 9
    for number, run in enumerate(runs(pieces)):
        start = number * 490.0 + 300.0
        # the speed is a mean of five seconds, and the highest fix is one of a noisy receiver
        assert time[run.first] == pytest.approx(start, abs=3.0)
        assert time[run.last] == pytest.approx(start + 100.0, abs=4.0)
        assert height[run.first] - height[run.last] == pytest.approx(130.0, abs=5.0)


def test_pieces_cover_the_track_in_order() -> None:
    time, flat, height = track(QUEUE, LIFT, DOWN, QUEUE, LIFT, DOWN)
    pieces = split_day(time, flat, height)
    assert kinds(pieces) == ["pause", "lift", "run", "pause", "lift", "run"]
    assert [piece.first for piece in pieces[1:]] == [piece.last for piece in pieces[:-1]]
    assert (pieces[0].first, pieces[-1].last) == (0, len(time) - 1)


def test_a_long_pause_ends_a_run_and_a_short_one_does_not() -> None:
    half = (50.0, 450.0, -65.0)
    for lasting, count in ((0.5 * PAUSE, 1), (2.0 * PAUSE, 2)):
        pieces = split_day(*track(LIFT, half, (lasting, 0.0, 0.0), half))
        assert len(runs(pieces)) == count


def test_a_rise_within_a_run_that_is_no_lift_does_not_end_it() -> None:
    half, counter_slope = (50.0, 450.0, -65.0), (15.0, 60.0, 0.8 * CLIMB)
    assert len(runs(split_day(*track(LIFT, half, counter_slope, half)))) == 1
    assert len(runs(split_day(*track(LIFT, half, (60.0, 100.0, 3.0 * CLIMB), half)))) == 2


def test_a_moving_carpet_is_a_lift_although_it_is_slow() -> None:
    carpet, down = (150.0, 100.0, 30.0), (15.0, 110.0, -30.0)
    pieces = split_day(*track(carpet, down, QUEUE, carpet, down))
    assert [kind for kind in kinds(pieces) if kind != "pause"] == ["lift", "run"] * 2


def test_what_leads_down_by_little_is_too_short() -> None:
    assert kinds(split_day(*track(LIFT, (20.0, 100.0, -20.0), QUEUE, LIFT))) == ["lift", "too short", "pause", "lift"]


def test_a_run_out_belongs_to_the_run() -> None:
    """A skier coasts up the counter slope at the bottom, and then stands."""
    pieces = split_day(*track(LIFT, DOWN, (10.0, 80.0, 4.0), QUEUE, LIFT))
    (run,) = runs(pieces)
    assert run.last == pytest.approx(410, abs=3)


def test_a_lost_receiver_splits_a_run_only_where_the_skier_moved() -> None:
    time, flat, height = track(LIFT, DOWN, QUEUE)
    kept = (time < 330.0) | (time > 395.0)
    pieces = split_day(time[kept], flat[kept], height[kept])
    assert "no fixes" in kinds(pieces)
    waits = track(LIFT, (50.0, 450.0, -65.0), (2.0 * PAUSE, 0.0, 0.0), (50.0, 450.0, -65.0))
    kept = (waits[0] < 352.0) | (waits[0] > 468.0)  # an app that saves no fixes of a skier who stands
    assert kinds(split_day(*(column[kept] for column in waits))) == ["lift", "run", "pause", "run"]


def test_slow_fixes_of_an_app_are_split_as_well() -> None:
    time, flat, height = track(*[LIFT, DOWN, QUEUE] * 3, step=12.0)
    assert len(runs(split_day(time, flat, height))) == 3
