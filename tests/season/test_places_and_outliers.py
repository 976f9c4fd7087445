"""Runs of one descent are recognised by their tracks, and what differs from them stands out."""

from __future__ import annotations

from itertools import starmap

import numpy as np
import pandas as pd
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.season.outliers import WATCHED, add_outliers
from sssi_exudyn.season.places import areas_of, local, places_of


def descent(east: float, swing: float, seed: int, length: float = 800.0) -> Array:
    """Return a track (n, 2) m that swings down north, with a telephone's noise of 6 m."""
    down = np.linspace(0.0, length, 50)
    noise = np.random.default_rng(seed).normal(0.0, 6.0, (50, 2))
    return np.column_stack([east + swing * np.sin(down / 60.0), -down]) + noise


def test_the_same_descent_is_one_place_and_others_are_not() -> None:
    tracks = [
        *(descent(0.0, 15.0, seed) for seed in range(5)),
        *(descent(400.0, 15.0, seed) for seed in range(10, 12)),  # the next piste
        descent(0.0, 15.0, 20, length=400.0),  # its upper half alone
    ]
    assert places_of(tracks) == ["A"] * 5 + ["B"] * 2 + [""]
    assert places_of(tracks[:1]) == [""]
    assert places_of([]) == []


def test_a_chain_of_neighbours_is_not_one_descent() -> None:
    # complete linkage: every two runs of a descent are near each other, not only each to the next
    places = places_of([descent(40.0 * number, 0.0, number) for number in range(6)])
    assert places[:2] == ["A", "A"]
    assert "A" not in places[3:]


def test_degrees_become_metres_and_areas_are_apart() -> None:
    first, second = (
        np.array([[46.8, 9.8], [46.8 + north, 9.8 + east]]) for north, east in ((0.001, 0.0), (0.0, 0.001))
    )
    north, east = (path[1] - path[0] for path in local([first, second]))
    # a thousandth of a degree of latitude is 111.2 m on a sphere
    assert north == pytest.approx([0.0, 111.2], abs=0.1)
    assert east == pytest.approx([111.2 * np.cos(np.radians(46.8)), 0.0], abs=0.1)
    assert areas_of(list(starmap(descent, [(20_000.0, 0.0, 1), (0.0, 0.0, 2), (100.0, 0.0, 3)]))) == [1, 0, 0]


def runs(count: int, place: str, day: str) -> pd.DataFrame:
    rows = np.random.default_rng(3)
    columns = {name: rows.normal(10.0, 0.1, count) for name in WATCHED}
    return pd.DataFrame({**columns, "place": place, "day": day, "run": [f"{place}{day}{row}" for row in range(count)]})


def test_a_run_that_differs_from_its_descent_stands_out() -> None:
    table = pd.concat([runs(8, "A", "monday"), runs(3, "", "monday")], ignore_index=True)
    table.loc[2, "top_speed_mps"] = 20.0
    said = add_outliers(table)["stands_out"]
    assert said[2].startswith("top speed 20.0 m/s, median of descent A 10.")
    assert (said.drop(2) == "").all()


def test_few_runs_and_instruments_noise_do_not_stand_out() -> None:
    table = runs(4, "A", "monday")
    table.loc[0, "top_speed_mps"] = 20.0  # of four nothing is said
    assert (add_outliers(table)["stands_out"] == "").all()
    table = runs(8, "A", "monday").assign(top_speed_mps=10.0)
    table.loc[0, "top_speed_mps"] = 11.5  # all others alike: half a metre per second is what a receiver leaves open
    assert (add_outliers(table)["stands_out"] == "").all()
    table.loc[0, "top_speed_mps"] = np.nan
    assert (add_outliers(table)["stands_out"] == "").all()
