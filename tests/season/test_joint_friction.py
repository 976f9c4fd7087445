"""The runs of a descent together: what differs is named, sizes lie in their intervals as often as these state."""

from __future__ import annotations

import numpy as np
import pytest
from passages import draw_passages

from sssi_exudyn.season.joint_friction import JointFriction, compare_runs

PLACE = np.array([0.08, 0.15, 0.10, 0.12, 0.07, 0.11])
NAMES = ["first", "second", "third", "fourth", "fifth"]
PATCH = (1, 3)
"""The run and the stretch of the patch."""


def compared(seed: int, cells: dict[tuple[int, int], float], runs: list[float], noise: float = 1.0) -> JointFriction:
    rng = np.random.default_rng(seed)
    scatters = rng.choice([0.004, 0.008, 0.015], len(runs)) * noise
    return compare_runs("A", NAMES[: len(runs)], *draw_passages(rng, PLACE, runs, cells, scatters, noise))


def test_runs_that_are_measured_exactly_give_the_place_the_run_and_the_patch() -> None:
    # without errors only the priors pull: the run's by (σ/0.05)², a hundredth of the run, σ of 0.005
    answer = compared(1, {PATCH: 0.08}, [0.0, 0.0, 0.0, 0.03, 0.0], noise=0.0)
    others = [run.more.value for run in answer.runs if run.run != "fourth"]
    assert answer.runs[3].more.value == pytest.approx(0.03, abs=1e-3)
    assert others == pytest.approx([-0.03 / 4.0] * 4, abs=1e-3)
    assert [run.differs > 0.8 for run in answer.runs] == [False, False, False, True, False]
    (patch,) = answer.differences
    assert (patch.run, patch.stretch) == ("second", 3)
    assert patch.size.value == pytest.approx(0.08, rel=0.1)  # of a spread of 0.05, known to 0.01: a 25th less
    assert patch.probability > 0.9  # the scatter of a run is as uncertain as six stretches leave it
    apart = [stretch.apart.value for stretch in answer.stretches]
    # heights are taken to err by metres: the place's stretches are drawn together by some hundredths of 0.1
    assert apart == pytest.approx([value - np.mean(np.delete(PLACE, s)) for s, value in enumerate(PLACE)], abs=4e-3)


@pytest.mark.long(seconds=12)
def test_intervals_hold_and_names_are_right_as_often_as_stated() -> None:
    days, held, right, sure, wrong, promised = 240, np.zeros((3, 2)), 0, 0, 0, 0.0
    large = np.zeros((2, 2))
    for seed in range(days):
        rng = np.random.default_rng([seed, 9])
        size, patch = rng.choice([-1.0, 1.0]) * rng.uniform(0.015, 0.04), float(rng.uniform(0.06, 0.14))
        runs = [0.0, 0.0, 0.0, float(size), 0.0]
        answer = compared(seed, {PATCH: patch}, runs)
        for run, (more, told) in enumerate(zip(runs, answer.runs, strict=True)):
            truth = more - np.mean(np.delete(runs, run))
            held[0] += told.more.low <= truth <= told.more.high, 1.0
            sure, wrong = sure + (told.differs > 0.8), wrong + (told.differs > 0.8 and run != 3)
            if run == 3 and abs(truth) > told.seen:
                large[0] += told.differs > 0.5, 1.0
        for stretch, told_apart in enumerate(answer.stretches):
            truth = PLACE[stretch] - np.mean(np.delete(PLACE, stretch))
            held[1] += told_apart.apart.low <= truth <= told_apart.apart.high, 1.0
        if patch > answer.seen:
            large[1] += any((told.run, told.stretch) == (NAMES[PATCH[0]], PATCH[1]) for told in answer.differences), 1.0
        for told_patch in answer.differences:
            there = (NAMES.index(told_patch.run), told_patch.stretch) == PATCH
            promised += told_patch.probability
            certain = told_patch.probability > 0.8
            right, sure, wrong = right + there, sure + certain, wrong + (certain and not there)
            if there:
                held[2] += told_patch.size.low <= patch <= told_patch.size.high, 1.0
    share = held[:, 0] / held[:, 1]
    # 90 %: runs of a day share their errors, so that 1200 intervals count as 240; three standard errors of these
    assert np.all(np.abs(share[:2] - 0.9) < 3.0 * np.sqrt(0.9 * 0.1 / days))
    # of a patch that is found by noise in its favour the size is too large: of all that is found 85 % at least
    assert share[2] > 0.85
    # what is as large as the bound is noticed nine times of ten, and all of it is larger; three standard errors
    assert np.all(large[:, 1] > 20)
    assert np.all(large[:, 0] / large[:, 1] > 0.9 - 3.0 * np.sqrt(0.9 * 0.1 / large[:, 1]))
    assert sure > 200
    assert wrong < 0.05 * sure  # said with 0.8 and more, most with 0.95
    # every run has its chance of a difference beforehand, and one has it for certain: what is named is there more often
    assert promised < 1.1 * right


def test_where_nothing_differs_nothing_is_named_and_the_bound_holds() -> None:
    named = 0
    for seed in range(40):
        answer = compared(1000 + seed, {}, [0.0] * 5)
        named += sum(run.differs > 0.5 for run in answer.runs) + len(answer.differences)
        for run in answer.runs:
            assert abs(run.more.value) < 2.0 * run.seen  # a bound of 2.9 standard deviations, none of 200 is twice it
    assert named <= 6  # a prior tenth of the runs for each kind is twenty of both


def test_of_two_runs_each_is_as_much_over_the_other_as_that_is_under_it() -> None:
    answer = compared(3, {}, [0.04, 0.0])
    first, second = answer.runs
    assert first.more.value == pytest.approx(-second.more.value, abs=2e-3)  # each averaged over its own scatter
    assert first.more.low > 0.0
    assert first.differs == pytest.approx(second.differs, abs=0.05)


def test_faster_runs_of_one_skier_share_the_error_of_his_drag() -> None:
    rng = np.random.default_rng(5)
    places, passages = draw_passages(rng, PLACE, [0.0] * 4, {}, [0.005] * 4)
    own = [type(passage)(**(vars(passage) | {"skier": str(row)})) for row, passage in enumerate(passages)]
    shared, apart = (compare_runs("A", NAMES[:4], places, some) for some in (passages, own))
    widths = [[run.more.high - run.more.low for run in answer.runs] for answer in (shared, apart)]
    assert np.all(np.array(widths[0]) < 0.9 * np.array(widths[1]))  # 2 m of air in 104: 25 % are 0.005 of friction
