"""Whole carved turns on a slope: possible on flat slopes alone, and on steeper ones the more friction there is."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from carved_slope import TurnTable, carved_turn, speed_after, turn_table

from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY

pytestmark = pytest.mark.long


@cache
def slalom(mu: float) -> TurnTable:
    return turn_table(read_ski("slalom_165", "."), Carving(mu=mu))


# S. Komissarov, arXiv 1812.02539: pure carving is possible below a slope of 8 to 20 degrees, by the friction
@pytest.mark.parametrize(
    ("mu", "turns", "slope_deg", "carved"),
    [
        (0.05, 1, 5.0, True),
        (0.05, 1, 25.0, False),
        (0.05, 10, 7.0, True),
        (0.05, 10, 12.0, False),
        (0.1, 10, 12.0, True),
        (0.1, 10, 25.0, False),
    ],
)
def test_carving_is_possible_below_a_critical_slope(mu: float, turns: int, slope_deg: float, carved: bool) -> None:
    assert (speed_after(slalom(mu), np.radians(slope_deg).item(), turns) is not None) is carved


def test_a_turn_gains_what_gravity_gives_and_loses_what_the_drag_takes() -> None:
    # a constant radius and drag: from traverse to traverse the skier descends by 2R·sinα along a way of πR
    slope, radius, drag = np.radians(8.0).item(), 10.0, 0.07
    edge = np.linspace(0.0, np.radians(70.0), 400)
    table = TurnTable(edge, np.full(400, radius), np.full(400, drag))
    end = carved_turn(table, slope, np.array([7.0]))[0]
    gained = 2.0 * GRAVITY * radius * (2.0 * np.sin(slope) - np.pi * drag * np.cos(slope))
    assert end**2 == pytest.approx(7.0**2 + gained, rel=1e-4)  # steps of a degree
