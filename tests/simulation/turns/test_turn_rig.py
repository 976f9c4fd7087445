"""Skis compared: bars, and differences of which what is uncertain of both is taken out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.bodies.ski.ski import SkiUncertainty, read_ski
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


def test_the_error_of_a_ski_s_own_stiffness_widens_its_bar_and_the_difference(points: list[RigPoint]) -> None:
    known = points[0]
    measured = replace(SKIS[0], uncertainty=SkiUncertainty(bending=0.2, torsion=0.2, outline=0.01))
    (unsure,) = rig_points([measured], [known.edge], TurnCase(), lambda *_: None)
    assert unsure.radius == known.radius
    assert len(unsure.own) == 3
    assert all(pair[0] != pair[1] for pair in unsure.own)
    assert unsure.radius_high - unsure.radius_low > known.radius_high - known.radius_low
    sharp, blunt = difference(known, points[1]), difference(unsure, points[1])
    assert sharp is not None
    assert blunt is not None
    assert blunt.share == sharp.share
    assert blunt.error > sharp.error
    same = difference(unsure, known)
    assert same is not None
    assert same.interval[0] < 0.0 < same.interval[1]  # its own error is not shared
    assert not same.is_significant
