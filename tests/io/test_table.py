"""Gaps are counted before they are filled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_NUMBERS
from sssi_exudyn.io.table import bridge_gaps

FILE = Path("any.csv")


def test_a_short_gap_gets_the_samples_that_are_missing() -> None:
    time = np.delete(np.arange(100) * 0.05, slice(40, 45))
    clock = bridge_gaps(FILE, time)
    np.testing.assert_allclose(clock.time, np.arange(100) * 0.05, atol=1e-12)
    assert np.flatnonzero(clock.bridged).tolist() == [40, 41, 42, 43, 44]


@pytest.mark.parametrize(
    ("time", "problem"),
    [
        (np.r_[np.arange(100) * 1e-8, 0.9 + np.arange(100) * 1e-8, 1.8], "more than any run has"),
        (np.r_[np.arange(60) * 5e-324, 0.5, 1.0], "more than any run has"),
        (np.cumsum(np.where(np.arange(900) % 20, 1e-4, 0.9)), "missing between them"),
    ],
)
def test_gaps_without_measure_are_refused(time: Array, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        bridge_gaps(FILE, time)


def test_wide_samples_count_for_more() -> None:
    time = np.delete(np.arange(2000) * 0.01, slice(500, 520))
    assert len(bridge_gaps(FILE, time, MAX_NUMBERS // 2000).time) == 2000
    with pytest.raises(InputError, match="more than any run has"):
        bridge_gaps(FILE, time, MAX_NUMBERS // 1999)
