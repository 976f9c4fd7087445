"""The runs of a descent together: what differs is named, sizes lie in their intervals as often as these state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from passages import draw_passages

from sssi_exudyn.season.joint_friction import JointFriction, compare_runs
from sssi_exudyn.season.page_descents import NAMED

PLACE = np.array([0.08, 0.15, 0.10, 0.12, 0.07, 0.11])
NAMES = ["first", "second", "third", "fourth", "fifth"]
PATCH = (1, 3)
"""The run and the stretch of the patch."""
SURE = 0.8
"""Probability from which a name is counted as said."""


def compared(seed: int, cells: dict[tuple[int, int], float], runs: list[float], noise: float = 1.0) -> JointFriction:
    rng = np.random.default_rng([seed, 14])
    scatters = rng.choice([0.004, 0.008, 0.015], len(runs)) * noise
    return compare_runs("A", NAMES[: len(runs)], *draw_passages(rng, PLACE, runs, cells, scatters, noise))


def test_runs_that_are_measured_exactly_give_the_place_the_run_and_the_patch() -> None:
    # without errors only the priors pull: the run's by (σ/0.05)², a hundredth of the run, σ of 0.005
    answer = compared(1, {PATCH: 0.08}, [0.0, 0.0, 0.0, 0.03, 0.0], noise=0.0)
    others = [run.more.value for run in answer.runs if run.run != "fourth"]
    assert answer.runs[3].more.value == pytest.approx(0.03, abs=1e-3)
    assert others == pytest.approx([0.0] * 4, abs=1e-3)  # against those that do not differ
    assert [run.differs > SURE for run in answer.runs] == [False, False, False, True, False]
    (patch,) = answer.differences
    assert (patch.run, patch.stretch) == ("second", 3)
    assert patch.size.value == pytest.approx(0.08, rel=0.1)  # of a spread of 0.05, known to 0.01: a 25th less
    assert patch.probability > 0.9  # the scatter of a run is as uncertain as six stretches leave it
    apart = [stretch.apart.value for stretch in answer.stretches]
    # heights are taken to err by metres: the place's stretches are drawn together by some hundredths of 0.1
    assert apart == pytest.approx([value - np.mean(np.delete(PLACE, s)) for s, value in enumerate(PLACE)], abs=4e-3)


@dataclass
class Count:
    """Statements of one kind, and those that hold."""

    held: int = 0
    every: int = 0

    def add(self, *, holds: bool) -> None:
        self.held, self.every = self.held + bool(holds), self.every + 1

    @property
    def share(self) -> float:
        return self.held / self.every

    @property
    def error(self) -> float:
        """Standard error of a share of 0.9."""
        return float(np.sqrt(0.09 / self.every))


@pytest.mark.long(seconds=14)
def test_intervals_hold_and_names_are_right_as_often_as_stated() -> None:
    runs_held, stretches_held, sizes_held = Count(), Count(), Count()
    runs_noticed, patches_noticed, names = Count(), Count(), Count()
    for seed in range(300):
        rng = np.random.default_rng([seed, 13])
        size = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.015, 0.04)) if seed % 2 else 0.0
        patch = 0.0 if seed % 2 else float(rng.uniform(0.06, 0.14))
        runs = [0.0, 0.0, 0.0, size, 0.0]
        answer = compared(seed, {PATCH: patch}, runs)
        for run, against in enumerate(answer.runs):
            others = [
                more for more, other in zip(runs, answer.runs, strict=True) if other is not against and not other.apart
            ]
            truth = runs[run] - float(np.mean(others))
            runs_held.add(holds=against.more.low <= truth <= against.more.high)
            if against.differs > SURE:
                names.add(holds=run == 3 and size != 0.0)
        for number, stretch in enumerate(answer.stretches):
            truth = PLACE[number] - float(np.mean(np.delete(PLACE, number)))
            stretches_held.add(holds=stretch.apart.low <= truth <= stretch.apart.high)
        named = {(NAMES.index(difference.run), difference.stretch): difference for difference in answer.differences}
        for cell, difference in named.items():
            if difference.probability > SURE:
                names.add(holds=cell == PATCH and patch > 0.0)
        if PATCH in named and patch > 0.0:
            sizes_held.add(holds=named[PATCH].size.low <= patch <= named[PATCH].size.high)
        if abs(size) > answer.runs[3].seen:
            runs_noticed.add(holds=answer.runs[3].differs > NAMED)
        if patch > answer.runs[PATCH[0]].seen_on_stretch:
            patches_noticed.add(holds=PATCH in named)
    # the five runs and six stretches of a day share errors: they count as two of each, and three standard errors
    assert abs(runs_held.share - 0.9) < 3.0 * runs_held.error * np.sqrt(2.5)
    assert abs(stretches_held.share - 0.9) < 3.0 * stretches_held.error * np.sqrt(3.0)
    assert abs(sizes_held.share - 0.9) < 3.0 * sizes_held.error
    # what exceeds a bound is noticed nine times of ten at least
    assert min(runs_noticed.every, patches_noticed.every) > 20
    assert runs_noticed.share > 0.9 - 3.0 * runs_noticed.error
    assert patches_noticed.share > 0.9 - 3.0 * patches_noticed.error
    # said with 0.8 and more
    assert names.every > 100
    assert names.share > SURE + 0.1


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
