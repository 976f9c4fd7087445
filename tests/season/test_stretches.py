"""Runs are cut at common places, and their energies are those of mechanics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.season.stretches import SHORTEST, Descent, passages_of

SLOPE = 0.2
"""Drop over the way on the level."""


def slide(friction: float, begin: float, swing: float = 0.0, seconds: float = 50.0) -> Descent:
    """Return the closed form of a block on a plane, whose path swings without changing its speed."""
    time = np.arange(0.0, seconds, 1.0)
    steepness = np.sqrt(1.0 + SLOPE**2)
    pull = GRAVITY * (SLOPE - friction) / steepness**2  # of the speed over ground
    speed = 6.0 + pull * time
    along = begin + 6.0 * time + 0.5 * pull * time**2
    flat = np.column_stack([swing * np.sin(along / 6.0), -along])
    return Descent(time, flat, 100.0 - SLOPE * along, speed, 3.0, 0.3, 0.5, ExponentialNoise(4.0, 60.0), 0.0)


def friction_of(runs: list[Descent]) -> list[Array]:
    places, passages = passages_of(runs)
    drops = SLOPE * np.diff(places)
    return [(drops + passage.kinetic[:-1] - passage.kinetic[1:]) / passage.way for passage in passages]


def test_a_block_on_a_plane_has_its_friction_on_every_stretch() -> None:
    for by_stretch, friction in zip(friction_of([slide(0.15, 0.0), slide(0.17, 12.0)]), (0.15, 0.17), strict=True):
        # speeds between fixes are straight lines here; v² is averaged over 5 s, which adds the same at both ends
        assert by_stretch == pytest.approx(np.full(len(by_stretch), friction), abs=5e-4)


def test_swings_lengthen_the_way_and_not_the_line() -> None:
    places, (straight, swung) = passages_of([slide(0.15, 0.0), slide(0.15, 0.0, swing=3.0)])
    assert straight.way == pytest.approx(np.diff(places), rel=0.01)
    # places are passed at the same times: projections on the line lose what goes across, to a fix's second
    assert swung.time == pytest.approx(straight.time, abs=0.6)


def test_places_lie_where_all_runs_have_begun_and_none_has_ended() -> None:
    runs = [slide(0.16, 0.0), slide(0.16, 70.0), slide(0.16, -20.0)]
    places, passages = passages_of(runs)
    assert places[0] == 0.0
    # 2.5 s at 6 m/s are left for averages at the begin of the run that begins last
    assert float(np.interp(passages[1].time[0], runs[1].time, -runs[1].flat[:, 1])) == pytest.approx(86.0, abs=2.0)
    assert passages[2].time[-1] == pytest.approx(runs[2].time[-1] - 2.5, abs=0.1)
    short = [slide(0.16, 0.0, seconds=14.0), slide(0.16, 30.0, seconds=14.0)]
    assert -short[0].flat[-1, 1] - 30.0 < SHORTEST
    assert passages_of(short)[1] == []


def test_air_takes_the_integral_of_the_cube_of_the_speed() -> None:
    runs = [replace(slide(SLOPE, 0.0, seconds=80.0), drag=0.003), slide(SLOPE, 0.0, seconds=80.0)]
    places, (draggy, free) = passages_of(runs)
    # at 6 m/s over ground all along: k v² (v over snow) over g on the way over snow
    over_snow = np.sqrt(1.0 + SLOPE**2)
    assert draggy.air == pytest.approx(0.003 * (6.0 * over_snow) ** 2 / GRAVITY * np.diff(places) * over_snow, rel=1e-3)
    assert np.all(free.air == 0.0)


def test_who_turns_back_for_a_while_passes_each_place_once() -> None:
    run = slide(SLOPE, 0.0, seconds=80.0)
    back = run.flat.copy()
    back[40:44, 1] = back[40, 1] + [0.0, 6.0, 6.0, 0.0]  # uphill for two seconds
    _, (passage, _) = passages_of([replace(run, flat=back), run])
    assert np.all(np.diff(passage.time) > 0.0)
