"""Repairs with a count: the share that may be bad, and which records of a series follow each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.repairs import Repairs, reachable_records, rising_records

PLACES = [f"line {number}" for number in range(2, 102)]


def test_a_repair_says_what_how_many_and_where() -> None:
    repairs = Repairs(Path("run.csv"))
    repairs.add_at("fix(es) without a height", np.arange(100) % 25 == 3, PLACES)
    assert repairs.notes == ("run.csv: 4 of 100 fix(es) without a height left out (first: line 5)",)


def test_nothing_bad_is_no_note() -> None:
    repairs = Repairs(Path("run.csv"))
    repairs.add_at("fix(es) without a height", np.zeros(100, bool), PLACES)
    assert repairs.notes == ()


def test_beyond_its_share_the_file_is_refused_at_the_first_bad_record() -> None:
    repairs = Repairs(Path("run.csv"))
    bad = np.arange(100) >= 74
    with pytest.raises(InputError, match=r"run.csv: line 76: 26 of 100 torn lines, more than the 25 %") as info:
        repairs.add_at("torn lines", bad, PLACES)
    assert info.value.fix


@pytest.mark.parametrize(
    ("times", "kept"),
    [
        ([0, 1, 2, 3], [0, 1, 2, 3]),
        ([0, 1, 1, 2, 3], [0, 1, 3, 4]),  # of a repeated time the first stays
        ([0, 1, 0.5, 2, 3], [0, 2, 3, 4]),
        ([0, 1, 900, 2, 3, 4], [0, 1, 3, 4, 5]),  # a leap ahead costs itself, not all that follow
        ([5, 0, 1, 2, 3], [1, 2, 3, 4]),
    ],
)
def test_the_most_records_whose_times_rise(times: list[float], kept: list[int]) -> None:
    assert np.flatnonzero(rising_records(np.array(times, float))).tolist() == kept


def test_a_value_that_cannot_be_reached_is_left_out_and_those_behind_it_stay() -> None:
    time = np.arange(20.0)
    values = 5.0 * time[:, None]
    values[[0, 7, 8, 19]] = 300.0
    kept = reachable_records(time, values, 10.0, np.full(20, 1.0))
    assert np.flatnonzero(~kept).tolist() == [0, 7, 8, 19]


def test_after_a_long_pause_a_far_value_is_reached() -> None:
    time = np.r_[np.arange(10.0), 60.0 + np.arange(10.0)]
    values = np.r_[np.zeros(10), np.full(10, 400.0)][:, None]
    assert np.all(reachable_records(time, values, 10.0, np.zeros(20)))
    assert np.count_nonzero(reachable_records(time, values, 5.0, np.zeros(20))) == 10
