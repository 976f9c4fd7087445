"""Two linked turns: which ones the page shows, and their mean."""

import numpy as np
import pytest

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.sections.curve_figures import spikes
from sssi_exudyn.reports.sections.linked_turns import SAMPLES, Cycle, cycle_of

TIME = np.arange(0.0, 20.0, 0.01)
PERIOD = 4.0
PHASE = 2.0 * np.pi * TIME / PERIOD


def swinging(side: float = 1.0) -> Array:
    """Return a path (n, 2) m with turns to both sides, 2 s each; where it points to a side most, it is straightest."""
    return np.column_stack([8.0 * TIME, side * 2.0 * np.sin(PHASE)])


@pytest.fixture
def cycle() -> Cycle:
    return cycle_of(TIME, find_turns(TIME, swinging()))


def test_pairs_begin_with_a_right_turn_and_are_as_long_as_the_turns(cycle: Cycle) -> None:
    assert {(first.side, second.side) for first, second in cycle.pairs} == {("right", "left")}
    assert len(cycle.pairs) >= 3
    # turns are found on a grid of 20 ms
    np.testing.assert_allclose(cycle.transitions, [0.0, 2.0, 4.0], atol=0.03)
    np.testing.assert_allclose(cycle.phases, [2 / 3, 4 / 3, 2 + 2 / 3, 2 + 4 / 3], atol=0.03)


def test_mirrored_the_same_run_still_begins_with_a_right_turn() -> None:
    assert cycle_of(TIME, find_turns(TIME, swinging(-1.0))).pairs[0][0].side == "right"


def test_the_mean_of_what_repeats_is_itself_and_does_not_spread(cycle: Cycle) -> None:
    curve = cycle.curve(np.cos(PHASE))
    assert len(curve.time) == 2 * SAMPLES
    begin = cycle.pairs[0][0].start
    expected = np.cos(2.0 * np.pi * (begin + curve.time) / PERIOD)
    # the turns' bounds are up to a step of 20 ms apart from pair to pair, at a slope of at most 1.6/s
    np.testing.assert_allclose(curve.mean, expected, atol=0.05)
    assert np.max(curve.spread) < 0.05


def test_the_spread_is_that_between_the_pairs(cycle: Cycle) -> None:
    pairs = len(cycle.pairs)
    number = np.searchsorted([pair[0].start for pair in cycle.pairs], TIME, side="right")
    curve = cycle.curve(number.astype(float))
    inside = slice(5, -5)  # away from the ends, where interpolation meets the neighbour
    np.testing.assert_allclose(curve.mean[inside], 0.5 * (1 + pairs), atol=1e-9)
    np.testing.assert_allclose(curve.spread[inside], np.std(np.arange(pairs), ddof=1), atol=1e-9)


def test_straight_down_there_is_the_whole_run() -> None:
    straight = cycle_of(TIME, find_turns(TIME, np.column_stack([8.0 * TIME, np.zeros(len(TIME))])))
    assert straight.pairs == ()
    assert straight.shown == (TIME[0], TIME[-1])
    np.testing.assert_array_equal(straight.curve(PHASE).mean, PHASE)


def test_a_spike_at_the_transition_is_found_and_none_elsewhere(cycle: Cycle) -> None:
    time = cycle.curve(TIME).time
    middle = cycle.transitions[1]

    def bump(instant: float) -> Array:
        return np.exp(-(((time - instant) / 0.05) ** 2))

    (spike,) = spikes(time, bump(middle + 0.1) + bump(0.5), cycle)
    assert time[spike] == pytest.approx(middle + 0.1, abs=0.02)
    (spike,) = spikes(time, -bump(middle - 0.1), cycle)
    assert time[spike] == pytest.approx(middle - 0.1, abs=0.02)
    assert spikes(time, np.sin(2.0 * np.pi * (time - middle) / PERIOD), cycle) == []
