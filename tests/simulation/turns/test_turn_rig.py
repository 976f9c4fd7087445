"""Skis compared: bars, and differences of which what is uncertain of both is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.simulation.turns.steady_turn import TurnCase
from sssi_exudyn.simulation.turns.turn_rig import UNCERTAIN, RigPoint, difference, rig_points

pytestmark = pytest.mark.long
SKIS = [read_ski(name, ".") for name in ("slalom_165", "rossignol_9gs_174")]


@pytest.fixture(scope="module")
def points() -> list[RigPoint]:
    shares: list[float] = []
    rigged = rig_points(SKIS, [np.radians(45.0).item()], TurnCase(), lambda share, _: shares.append(share))
    assert shares == [0.0, 0.5]
    return rigged


def test_the_bar_holds_the_radius_and_every_change(points: list[RigPoint]) -> None:
    for point in points:
        assert point.radius_low < point.radius < point.radius_high
        assert len(point.curvatures) == len(UNCERTAIN)
        for pair in point.curvatures:
            assert all(1.0 / point.radius_high <= curvature <= 1.0 / point.radius_low for curvature in pair)
        low, high = point.reserve_bar()
        assert 0.0 < low < 1.0
        assert 0.0 < high < 1.0


def test_a_difference_is_known_better_than_the_radii(points: list[RigPoint]) -> None:
    slalom, giant = points
    apart = difference(giant, slalom)
    assert apart is not None
    assert apart.share == pytest.approx(giant.radius / slalom.radius - 1.0, rel=1e-12)
    bars = [(point.radius_high - point.radius_low) / point.radius for point in points]
    assert apart.error < np.linalg.norm(bars)
    back = difference(slalom, giant)
    assert back is not None
    assert (1.0 + back.share) * (1.0 + apart.share) == pytest.approx(1.0, rel=1e-12)
    assert difference(slalom, slalom).error == 0.0


def test_no_difference_from_a_ski_that_slips(points: list[RigPoint]) -> None:
    assert difference(points[0], RigPoint("none", points[0].edge, None, "slips")) is None
