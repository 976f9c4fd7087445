"""The snow's memory as it moves along the ski: how exactly, and its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.edge_setup import carving_module
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeSki
from sssi_exudyn.simulation.ski_on_snow.structs import Groove

KERNEL = carving_module()


def ski_with(station: Array) -> EdgeSki:
    """A ski of which nothing but the stations counts."""
    none = np.zeros(0)
    return EdgeSki(none, none, none, none, none, none, none, station, none, none)


@pytest.mark.parametrize("steps_a_gap", [0.3, 1.0, 2.6])
def test_in_a_steady_turn_the_offset_is_the_parabola_of_its_drift(steps_a_gap: float) -> None:
    station = np.concatenate([np.linspace(0.0, 1.0, 21), np.linspace(1.02, 1.4, 20)])
    speed, step = 10.0, 0.02 * steps_a_gap / 10.0
    drift = 0.3 - 0.8 * station  # m/s: a ski that yaws
    ski, memory = ski_with(station), Groove.fresh(2, len(station))
    memory.speed[:], memory.drift[:] = speed, drift
    for _ in range(round(3.0 * 1.4 / (speed * step))):
        KERNEL.advect(ski, memory, step)
        memory.offset[:] = memory.arrived_offset + step * drift  # as the law adds it
    begin = np.searchsorted(station, 1.2)  # some steps behind the tip, ahead of which snow is fresh
    passed = 0.5 * (drift[begin] + drift[:begin]) * (station[begin] - station[:begin]) / speed
    grown = memory.offset[0, :begin] - memory.offset[0, begin]
    # exact where steps are shorter than gaps; else the offset goes in stairs where snow is fresh, each of a step's
    # drift, of which interpolation leaves less than a tenth
    tolerance = 1e-12 if steps_a_gap <= 1.0 else 0.1 * step * np.abs(drift).max()
    np.testing.assert_allclose(grown, passed, atol=tolerance)


def test_what_moves_along_has_the_derivatives_of_its_differences() -> None:
    points, many, step = 12, 4, 2e-3
    rng = np.random.default_rng(7)
    station = np.cumsum(rng.uniform(0.01, 0.03, points))
    ski, memory = ski_with(station), Groove.fresh(2, points)
    speed = rng.uniform(-1.0, 15.0, points)
    held = rng.normal(size=(6 * points, many))
    values = [np.abs(rng.normal(size=(2, points))), rng.normal(size=(2, points))]
    drift = rng.normal(size=points)

    def brought(direction: int, size: float) -> Array:
        change = size * held[:, direction]
        memory.groove[:] = values[0] + change[: 2 * points].reshape(2, points)
        memory.offset[:] = values[1] + change[2 * points : 4 * points].reshape(2, points)
        memory.speed[:] = speed + change[4 * points : 5 * points]
        memory.drift[:] = drift + change[5 * points :]
        KERNEL.advect(ski, memory, step)
        return np.concatenate([memory.arrived_groove.ravel(), memory.arrived_offset.ravel()])

    arrived = np.zeros((4 * points, many))
    brought(0, 0.0)
    KERNEL.advect_tangents(ski, memory, step, held, arrived)
    assert np.count_nonzero(arrived) > 2 * points * many
    for k in range(many):
        slope = (brought(k, 1e-6) - brought(k, -1e-6)) / 2e-6
        np.testing.assert_allclose(arrived[:, k], slope, atol=1e-7 * np.abs(slope).max())
