"""Skis compared in steady turns: the radius at each edge angle, and bars from what is uncertain of snow and posture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeSki
from sssi_exudyn.simulation.turns.steady_turn import (
    NoSteadyTurn,
    Rolling,
    SteadyTurn,
    TurnCase,
    edges_of,
    start_rolling,
    steady_turn,
)

_ESTIMATE: Final = "estimate: the spread between two pistes on the same morning"


@dataclass(frozen=True)
class Uncertain:
    """Something of a turn that is not known exactly.

    size : one standard deviation, in the unit of ``amount``;  alter : the case with so many of them added
    """

    name: str
    amount: str
    source: str
    alter: Callable[[TurnCase, Carving, float], TurnCase]


def _snow(name: str, factor: float) -> Callable[[TurnCase, Carving, float], TurnCase]:
    def alter(case: TurnCase, law: Carving, sigmas: float) -> TurnCase:
        return replace(case, law=replace(law, **{name: getattr(law, name) * factor**sigmas}))

    return alter


UNCERTAIN: Final = (
    Uncertain("hardness", "a factor of 1.5", _ESTIMATE, _snow("hardness", 1.5)),
    Uncertain("strength", "a factor of 1.25", _ESTIMATE, _snow("strength", 1.25)),
    Uncertain("recovery", "a factor of 1.5", _ESTIMATE, _snow("recovery", 1.5)),
    Uncertain(
        "edge angle", "1 degree", "motion capture: 1 to 3 degrees",
        lambda case, _, sigmas: replace(case, edge=case.edge + sigmas * np.radians(1.0).item()),
    ),
    Uncertain(
        "centre of pressure", "30 mm", "estimate: a skier's own standard deviation along the boot",
        lambda case, _, sigmas: replace(case, pressure=case.pressure + 0.03 * sigmas),
    ),
)  # fmt: skip
"""What the bars are made of; the lean of the resultant goes with the edge angle."""


@dataclass(frozen=True)
class RigPoint:
    """One ski at one edge angle.

    turn : None where there is no steady turn, for which ``problem`` gives the reason
    curvatures, reserves : for each of ``UNCERTAIN``, with one standard deviation less and more; None where there is no
        steady turn
    own : curvatures with the ski's own bending and torsional stiffness and its outline one standard error less and
        more; empty where their errors are not known
    """

    ski: str
    edge: float
    turn: SteadyTurn | None
    problem: str = ""
    curvatures: tuple[tuple[float | None, float | None], ...] = ()
    reserves: tuple[tuple[float | None, float | None], ...] = ()
    own: tuple[tuple[float | None, float | None], ...] = ()

    @property
    def radius(self) -> float | None:
        """m; None where there is no steady turn to the inside."""
        return None if self.turn is None else self.turn.radius

    @property
    def radius_low(self) -> float | None:
        """m; least radius within one standard deviation of all that is uncertain."""
        return self._radius(1.0)

    @property
    def radius_high(self) -> float | None:
        """m; greatest radius within one standard deviation; None where the ski may slip out of the turn."""
        return self._radius(-1.0)

    @property
    def side_reserve(self) -> float | None:
        """Share of what the groove's wall bears that is not used."""
        return None if self.turn is None else self.turn.side_reserve

    def reserve_bar(self) -> tuple[float, float]:
        """Return how much less and more the side reserve may be, within one standard deviation."""
        assert self.turn is not None
        changes = [
            [self.turn.side_reserve - (0.0 if value is None else value) for value in pair] for pair in self.reserves
        ]
        low = [max(0.0, *pair) for pair in changes]
        high = [max(0.0, *(-value for value in pair)) for pair in changes]
        return float(np.linalg.norm(low)), float(np.linalg.norm(high))

    def _radius(self, sign: float) -> float | None:
        """Return a radius from changes of the curvature to one side, which add up as squares: they are independent."""
        if self.turn is None:
            return None
        changes = []
        for pair in (*self.curvatures, *self.own):
            if None in pair and sign < 0.0:
                return None
            changes.append(max(0.0, *(sign * (value - self.turn.curvature) for value in pair if value is not None)))
        end = self.turn.curvature + sign * float(np.linalg.norm(changes))
        return 1.0 / end if end > 0.0 else None


@dataclass(frozen=True)
class Difference:
    """The radius of one ski against another's at the same edge angle, as a share: 0.1 is 10 % larger.

    less, more : one standard deviation of the share downwards and upwards
    """

    ski: str
    other: str
    edge: float
    share: float
    less: float
    more: float

    @property
    def error(self) -> float:
        """Return the larger of both."""
        return max(self.less, self.more)

    @property
    def interval(self) -> tuple[float, float]:
        """Return the bounds of the share that two standard deviations give, some 95 %."""
        return self.share - 2.0 * self.less, self.share + 2.0 * self.more

    @property
    def is_significant(self) -> bool:
        """Return whether the interval holds only larger or only smaller radii."""
        low, high = self.interval
        return low > 0.0 or high < 0.0


def difference(point: RigPoint, other: RigPoint) -> Difference | None:
    """Return the difference of two skis at one edge angle; None where one of them does not turn.

    Snow and posture are the same for both skis, so each of their errors changes both radii at once, and only the change
    of the ratio counts.  Either ski's stiffness and outline have errors of their own.  All add up as squares.
    """
    if point.radius is None or other.radius is None:
        return None
    assert point.turn is not None
    assert other.turn is not None
    share = other.turn.curvature / point.turn.curvature - 1.0
    mine, theirs = point.turn.curvature, other.turn.curvature
    pairs = [list(zip(own, its, strict=True)) for own, its in zip(point.curvatures, other.curvatures, strict=True)]
    pairs += [[(curvature, theirs) for curvature in own] for own in point.own]
    pairs += [[(mine, curvature) for curvature in own] for own in other.own]
    less, more = [], []
    for pair in pairs:
        changes = []
        for own, its in pair:
            if own is None or its is None or min(own, its) <= 0.0:
                return None
            changes.append(its / own - 1.0 - share)
        less.append(max(0.0, *(-change for change in changes)))
        more.append(max(0.0, *changes))
    return Difference(point.ski, other.ski, point.edge, share, float(np.linalg.norm(less)), float(np.linalg.norm(more)))


def rig_points(
    skis: Sequence[Ski], edges: Sequence[float], case: TurnCase, advance: Callable[[float, str], None]
) -> list[RigPoint]:
    """Return a point for every ski at every edge angle (rad, rising), with the rest of the turn as in ``case``."""
    points: list[RigPoint] = []
    for ski in skis:
        rolling, others = start_rolling(edges_of(ski)), _skis_of_errors(ski)
        for edge in edges:
            advance(len(points) / (len(skis) * len(edges)), f"{ski.name} at {np.degrees(edge):.0f} degrees")
            point, rolling = _rig_point(ski.name, replace(case, edge=float(edge)), rolling)
            if point.turn is not None and others:
                case_here = point.turn.case
                own = [tuple(_curvature(case_here, replace(rolling, ski=one)) for one in pair) for pair in others]
                point = replace(point, own=(*((low, high) for low, high in own), _of_outline(point.turn, ski)))
            points.append(point)
    return points


def _skis_of_errors(ski: Ski) -> tuple[tuple[EdgeSki, EdgeSki], ...]:
    """Return the ski with its bending and with its torsional stiffness one standard error less and more."""
    if ski.uncertainty is None:
        return ()
    pairs = []
    for modulus, error in (("young_modulus", ski.uncertainty.bending), ("shear_modulus", ski.uncertainty.torsion)):
        low, high = (edges_of(replace(ski, **{modulus: getattr(ski, modulus) * f})) for f in (1.0 - error, 1.0 + error))
        pairs.append((low, high))
    return tuple(pairs)


def _of_outline(turn: SteadyTurn, ski: Ski) -> tuple[float, float]:
    """Return the curvature one standard error of the ski's outline less and more."""
    error = 0.0 if ski.uncertainty is None else ski.uncertainty.outline
    return turn.curvature * (1.0 - error), turn.curvature * (1.0 + error)


def _curvature(case: TurnCase, rolling: Rolling) -> float | None:
    return _of(_altered(case, rolling), "curvature")


def _rig_point(name: str, case: TurnCase, rolling: Rolling) -> tuple[RigPoint, Rolling]:
    try:
        turn, settled = steady_turn(case, rolling)
    except NoSteadyTurn as error:
        return RigPoint(name, case.edge, None, str(error)), rolling
    assert isinstance(case.law, Carving)
    curvatures, reserves = [], []
    for uncertain in UNCERTAIN:
        pair = [_altered(uncertain.alter(case, case.law, sigmas), settled) for sigmas in (-1.0, 1.0)]
        curvatures.append((_of(pair[0], "curvature"), _of(pair[1], "curvature")))
        reserves.append((_of(pair[0], "side_reserve"), _of(pair[1], "side_reserve")))
    return RigPoint(name, case.edge, turn, "", tuple(curvatures), tuple(reserves)), settled


def _altered(case: TurnCase, settled: Rolling) -> SteadyTurn | None:
    try:
        return steady_turn(case, settled)[0]
    except NoSteadyTurn:
        return None


def _of(turn: SteadyTurn | None, name: str) -> float | None:
    return None if turn is None else float(getattr(turn, name))
