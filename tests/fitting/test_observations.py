"""Measurements by a clock that is late: fixes of instants outside the run."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.fitting.observations import Measurements

START, STOP, SIGMA = 2.0, 4.0, 0.02


def fixes(counts: float = 1.0) -> Measurements:
    """Eleven fixes from start to stop."""
    time, stated = np.linspace(START, STOP, 11), np.ones(11)
    nothing, none = np.zeros(0), np.zeros((0, 2))
    return Measurements(time, np.zeros((11, 3)), SIGMA, nothing, none, stated, np.full(11, counts))


@pytest.mark.parametrize("late", [0.0, 0.5, -0.5])
@pytest.mark.parametrize("counts", [1.0, 0.1])
def test_fixes_of_instants_outside_the_run_count_less(late: float, counts: float) -> None:
    """Their variance is that of the fix and of a place after an unknown acceleration of 5 m/s²."""
    seen = fixes(counts)
    found = seen.stamped_by(late, START, STOP)
    at = seen.fixes - late
    outside = np.where(at < START, START - at, np.where(at > STOP, at - STOP, 0.0))
    variance = SIGMA**2 / counts + (0.5 * 5.0 * outside**2) ** 2
    np.testing.assert_allclose(found.counts, SIGMA**2 / variance)
    np.testing.assert_array_equal(found.stated, seen.stated)  # for seconds they are as good as they say
    assert np.count_nonzero(found.counts < counts) == (3 if late else 0)
