"""Carved turns on a slope, from traverse to traverse, made of the turns that the rig settles into.

In each instant the skier balances on one edge in a steady turn: the resultant on the snow is square to the base, and
radius and drag are the rig's at that edge angle θ.  On a slope α, with the heading β from the fall line,

    tanθ = v²/(R(θ)·g·cosα) − tanα·sinβ,   d(v²)/ds = 2g·(sinα·cosβ − D(θ)·cosα)

R, D : radius, and drag as a share of the load along the snow's normal

The air is left out, and so is the work of a change of edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.simulation.turns.steady_turn import TurnCase, edges_of, start_rolling, steady_turn

GREATEST = 70.0
"""Greatest edge angle at which a skier carves, deg."""
STARTS = np.arange(1.0, 15.0, 0.2)
"""Speeds at which a turn begins, m/s."""
_HEADINGS = np.radians(np.arange(89.5, -90.0, -1.0))
"""Middles of the steps of a turn, rad."""


@dataclass(frozen=True)
class TurnTable:
    """Steady turns by edge angle: (n,) rad, m, and drag as a share of the load along the snow's normal."""

    edge: Array
    radius: Array
    drag: Array


def turn_table(ski: Ski, law: Carving) -> TurnTable:
    """Return the rig's turns every 5°, as far as the groove's wall is not used up, and linear between."""
    rolling, rows = start_rolling(edges_of(ski)), []
    for edge_deg in np.arange(5.0, GREATEST + 1.0, 5.0):
        turn, rolling = steady_turn(TurnCase(np.radians(edge_deg).item(), law), rolling)
        if turn.radius is None or turn.side_reserve <= 0.0:
            break
        rows.append((turn.case.edge, turn.radius, turn.drag / turn.normal))
    edge, radius, drag = np.array(rows).T
    fine = np.linspace(edge[0], edge[-1], 400)
    return TurnTable(fine, np.interp(fine, edge, radius), np.interp(fine, edge, drag))


def carved_turn(table: TurnTable, slope: float, speed: Array) -> Array:
    """Return the speed (n,) m/s at the end of turns that begin with these speeds.

    It is nan where no edge angle of the table balances the skier somewhere in the turn, or where he stops.

    slope : rad
    """
    square = speed**2
    for heading in _HEADINGS:
        lean = square[:, None] / (table.radius * GRAVITY * np.cos(slope)) - np.tan(slope) * np.sin(heading)
        upright = np.tan(table.edge) > lean
        at = np.argmax(upright, axis=1)  # 0 too where no edge angle is enough
        balanced = (at > 0) & (square > 0.0)
        gained = np.sin(slope) * np.cos(heading) - table.drag[at] * np.cos(slope)
        further = table.radius[at] * (_HEADINGS[0] - _HEADINGS[1])
        square = np.where(balanced, square + 2.0 * GRAVITY * gained * further, np.nan)
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def speed_after(table: TurnTable, slope: float, turns: int) -> float | None:
    """Return the least speed (m/s) after so many turns to both sides, begun with any of ``STARTS``.

    It is None where no turn is carved.
    """
    speed = STARTS
    for _ in range(turns):
        speed = carved_turn(table, slope, speed[np.isfinite(speed)])
    carved = speed[speed > 0.0]
    return float(carved.min()) if len(carved) else None


def greatest_slope(table: TurnTable, turns: int) -> float:
    """Return the steepest slope (deg) on which so many turns are carved one after the other.

    Slopes are tried every 0.5° from 30° down.
    """
    slopes = np.arange(30.0, 0.0, -0.5)
    return next((slope for slope in slopes if speed_after(table, np.radians(slope).item(), turns) is not None), 0.0)
