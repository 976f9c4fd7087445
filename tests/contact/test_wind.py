"""A wind that swells and falls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import PlaceState
from sssi_exudyn.contact.terms.wind import Wind


def along(wind: Wind, time: float) -> float:
    """Return the wind down the fall line (m/s) at a time (s)."""
    down, left, up = wind.velocity(FloatMath(), PlaceState(t=time, f=0.0, l=0.0))
    assert (left, up) == (wind.w_l, 0.0)
    return float(down)


@pytest.mark.parametrize("i", range(6))
def test_each_swell_is_about_its_own_time(i: int) -> None:
    wind = replace(Wind(w_f=-3.0, w_l=1.0, begin=2.0, every=2.5), **{f"f_{i + 1}": 1.5})
    about = 2.0 + 2.5 * i
    assert along(wind, about) == pytest.approx(-1.5)
    assert along(wind, about + 1.25) == pytest.approx(-2.25)  # half of it, half-way to the next
    assert along(wind, about - 2.5) == along(wind, about + 2.5) == pytest.approx(-3.0)


def test_swells_of_one_size_are_a_steady_wind() -> None:
    wind = Wind(-3.0, 1.0, 2.0, 2.5, *[1.5] * 6)
    for time in np.linspace(2.0, 14.5, 40):
        assert along(wind, float(time)) == pytest.approx(-1.5)
