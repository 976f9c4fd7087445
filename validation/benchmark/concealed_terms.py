"""Force terms of the benchmark's world, with other shapes than those of the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np

from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.term import BodyState, BodyTerm, FootState, FootTerm, PlaceState, TerrainTerm, WindTerm
from sssi_exudyn.core.quantity import quantity

_HERE: Final = "the benchmark's world"


def _any(meaning: str, unit: str = "1") -> Any:
    return quantity(0.0, unit, low=-1e4, high=1e4, source=_HERE, meaning=meaning)


def _ramp(math: Math, x: Number) -> Number:
    """Return 0 below 0, 1 above 1, and a smooth step between."""
    u = math.minimum(math.maximum(x, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


def _box(math: Math, x: Number, low: Number, high: Number, edge: float) -> Number:
    return _ramp(math, (x - low) / edge + 0.5) - _ramp(math, (x - high) / edge + 0.5)


@dataclass(frozen=True)
class WorldPatch(FootTerm):
    """Formula: more friction between f0 and f1, with smooth steps of 1 m."""

    name: ClassVar[str] = "world_patch"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    delta: float = _any("more friction")
    f0: float = _any("begin", "m")
    f1: float = _any("end", "m")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        more = self.delta * _box(math, state.f, self.f0, self.f1, 1.0)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldGust(WindTerm):
    """Formula: a wind that ramps up and down in 0.6 s."""

    name: ClassVar[str] = "world_gust"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    w_f: float = _any("down the slope", "m/s")
    w_l: float = _any("to the left", "m/s")
    t0: float = _any("begin", "s")
    t1: float = _any("end", "s")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        share = _box(math, state.t, self.t0 + 0.3, self.t1 - 0.3, 0.6)
        return self.w_f * share, self.w_l * share, 0.0


@dataclass(frozen=True)
class WorldSlope(TerrainTerm):
    """Formula: the slope's tangent changes by a smooth step over 8 m about f0."""

    name: ClassVar[str] = "world_slope"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    delta: float = _any("steeper", "rad")
    f0: float = _any("where", "m")

    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        long = 8.0
        x = (f - self.f0) / long + 0.5
        u = math.minimum(math.maximum(x, 0.0), 1.0)
        beyond = math.maximum(x - 1.0, 0.0)
        return -self.delta * long * (u * u * u - 0.5 * u * u * u * u + beyond), -self.delta * _ramp(math, x), 0.0


@dataclass(frozen=True)
class WorldBump(TerrainTerm):
    """Formula: half a cosine's square, ``reach`` to either side."""

    name: ClassVar[str] = "world_bump"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    rise: float = _any("height", "m")
    f0: float = _any("where", "m")
    reach: float = _any("half its length", "m")

    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        x = math.minimum(math.maximum((f - self.f0) / self.reach, -1.0), 1.0)
        h = 0.5 * self.rise * (1.0 + math.cos(np.pi * x))
        return h, -0.5 * self.rise * np.pi / self.reach * math.sin(np.pi * x), 0.0


@dataclass(frozen=True)
class WorldPush(BodyTerm):
    """Formula: half a sine of force from t0 to t1."""

    name: ClassVar[str] = "world_push"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    force_f: float = _any("down the slope", "N")
    force_l: float = _any("to the left", "N")
    force_n: float = _any("up", "N")
    t0: float = _any("begin", "s")
    t1: float = _any("end", "s")

    def force(self, math: Math, state: BodyState) -> Vector:
        x = math.minimum(math.maximum((state.t - self.t0) / (self.t1 - self.t0), 0.0), 1.0)
        share = math.sin(np.pi * x)
        return self.force_f * share, self.force_l * share, self.force_n * share


@dataclass(frozen=True)
class WorldPole(BodyTerm):
    """Formula: a triangle of force along the path and up, 0.2 s long."""

    name: ClassVar[str] = "world_pole"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    forward: float = _any("impulse", "N*s")
    up: float = _any("impulse", "N*s")
    t: float = _any("when", "s")

    def force(self, math: Math, state: BodyState) -> Vector:
        v_f, v_l, _ = state.velocity
        pulse = math.maximum(0.0, 1.0 - math.absolute(state.t - self.t) / 0.1) / 0.1
        along = self.forward * pulse / math.sqrt(v_f * v_f + v_l * v_l + 0.01)
        return along * v_f, along * v_l, self.up * pulse


@dataclass(frozen=True)
class OneSkiSlow(FootTerm):
    """Formula: more friction on one ski alone, which grows with the root of its load and is delta at 400 N."""

    name: ClassVar[str] = "one_ski_slow"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    delta: float = _any("more friction")
    side: float = _any("+1 left, -1 right")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        share = 0.5 * (1.0 + self.side * state.side)
        return -20.0 * self.delta * share * math.sqrt(math.maximum(state.load, 0.0) + 1e-3) * math.saturate(
            state.v_t, 0.1
        ), 0.0


@dataclass(frozen=True)
class DragOfPosture(BodyTerm):
    """Formula: a drag area that goes up and down with the turns."""

    name: ClassVar[str] = "drag_of_posture"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    area: float = _any("of the drag area's change", "m^2")
    period: float = quantity(3.0, "s", low=0.1, high=100.0, source=_HERE, meaning="of the change")
    phase: float = _any("of the change", "rad")

    def force(self, math: Math, state: BodyState) -> Vector:
        f, l, n = state.velocity  # noqa: E741  the slope frame's name of the axis
        speed = math.sqrt(f * f + l * l + n * n + 1e-6)
        factor = -0.55 * self.area * math.sin(2.0 * np.pi * state.t / self.period + self.phase) * speed
        return factor * f, factor * l, factor * n


@dataclass(frozen=True)
class WarmingSnow(FootTerm):
    """Formula: friction that grows along the path from f0 on."""

    name: ClassVar[str] = "warming_snow"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    growth: float = _any("more friction a metre", "1/m")
    f0: float = _any("begin", "m")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        more = self.growth * math.maximum(state.f - self.f0, 0.0)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldLift(BodyTerm):
    """Formula: a force up that grows with the square of the speed, and comes and goes with the skier's posture."""

    name: ClassVar[str] = "world_lift"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    area: float = _any("mean lift area", "m^2")
    rate: float = _any("angular rate of the posture", "1/s")
    phase: float = _any("of the posture at the beginning", "rad")

    def force(self, math: Math, state: BodyState) -> Vector:
        f, l, n = state.velocity  # noqa: E741  the slope frame's name of the axis
        area = self.area * (1.0 + 0.4 * math.sin(self.rate * state.t + self.phase))
        return 0.0, 0.0, 0.55 * area * (f * f + l * l + n * n)


@dataclass(frozen=True)
class EdgeBite(FootTerm):
    """Formula: one edge that catches ever more and lets go at once: a force back that grows from t0 on until it ends at
    t1, and one across, against the slip.
    """

    name: ClassVar[str] = "edge_bite"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    force_size: float = _any("greatest force back", "N")
    across: float = _any("force across, for each newton back")
    side: float = _any("+1 left, -1 right")
    t0: float = _any("begin", "s")
    t1: float = _any("end", "s")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        grown = math.minimum(math.maximum((state.t - self.t0) / (self.t1 - self.t0), 0.0), 1.0)
        share = 0.5 * (1.0 + self.side * state.side) * (grown - _ramp(math, (state.t - self.t1) / 0.04 + 1.0))
        pull = self.force_size * math.maximum(share, 0.0)
        return -pull * math.saturate(state.v_t, 0.1), -self.across * pull * math.saturate(state.v_n, 0.1)


@dataclass(frozen=True)
class Ruts(FootTerm):
    """Formula: ruts between f0 and f1, which push both skis to one side and to the other every few metres and brake
    them by half as much.
    """

    name: ClassVar[str] = "ruts"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    force_size: float = _any("force on each ski", "N")
    length: float = quantity(4.0, "m", low=0.1, high=100.0, source=_HERE, meaning="from one rut to the next")
    f0: float = _any("begin", "m")
    f1: float = _any("end", "m")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        push = self.force_size * _box(math, state.f, self.f0, self.f1, 1.0)
        direction = math.sin(2.0 * np.pi * state.f / self.length)
        return -0.5 * push * direction * direction * math.saturate(state.v_t, 0.1), push * direction


@dataclass(frozen=True)
class WorldWind(WindTerm):
    """Formula: a wind that swells and falls by a third, every six seconds."""

    name: ClassVar[str] = "world_wind"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    w_f: float = _any("down the slope", "m/s")
    w_l: float = _any("to the left", "m/s")
    phase: float = _any("of its swell", "rad")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        factor = 1.0 + math.sin(np.pi * state.t / 3.0 + self.phase) / 3.0
        return self.w_f * factor, self.w_l * factor, 0.0


@dataclass(frozen=True)
class WorldDrag(BodyTerm):
    """Formula: a drag area that acts at the centre of mass."""

    name: ClassVar[str] = "world_drag"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    area: float = _any("more drag area", "m^2")

    def force(self, math: Math, state: BodyState) -> Vector:
        f, l, n = state.velocity  # noqa: E741  the slope frame's name of the axis
        factor = -0.55 * self.area * math.sqrt(f * f + l * l + n * n + 1e-6)
        return factor * f, factor * l, factor * n


@dataclass(frozen=True)
class WorldSpeed(FootTerm):
    """Formula: friction that grows with the square of the speed, by b a metre a second at v_ref."""

    name: ClassVar[str] = "world_speed"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    b: float = _any("growth", "s/m")
    v_ref: float = quantity(8.0, "m/s", low=0.1, high=100.0, source=_HERE, meaning="where it is nothing")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        square = state.v_t * state.v_t + state.v_n * state.v_n
        more = math.maximum(0.5 * self.b * (square / self.v_ref - self.v_ref), -0.05)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldEdge(FootTerm):
    """Formula: friction that grows with the square of the sine of the edge angle, from edge_ref on, where it is μ_t."""

    name: ClassVar[str] = "world_edge"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    growth: float = _any("growth")
    edge_ref: float = _any("where it is nothing", "rad")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        sine = math.sin(state.edge)
        more = math.maximum(self.growth * (sine * sine - np.sin(self.edge_ref) ** 2), -0.05)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldLoad(FootTerm):
    """Formula: friction that grows with the root of a ski's load."""

    name: ClassVar[str] = "world_load"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    growth: float = _any("growth from 0 to 400 N")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        more = self.growth * (math.sqrt(math.maximum(state.load, 0.0) / 400.0 + 1e-6) - 1.0)
        return -math.maximum(more, -0.05) * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldCompaction(FootTerm):
    """Formula: a resistance that grows with the power 1.5 of the groove's area, in units of 0.02 m²."""

    name: ClassVar[str] = "world_compaction"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    c: float = quantity(0.0, "N/m^2", low=0.0, high=1e6, source=_HERE, meaning="resistance")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        groove = math.maximum(state.groove, 0.0)
        pull = self.c * groove * math.sqrt(groove / 0.02 + 1e-9)
        return -pull * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldMinimum(FootTerm):
    """Formula: friction that is least at v_ref and grows by ``rise`` to either side, most of it within ``width``."""

    name: ClassVar[str] = "world_minimum"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    rise: float = _any("growth")
    v_ref: float = quantity(10.0, "m/s", low=0.1, high=100.0, source=_HERE, meaning="where it is least")
    width: float = quantity(1.0, "m/s", low=0.1, high=100.0, source=_HERE, meaning="over which it grows")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        speed = math.sqrt(state.v_t * state.v_t + state.v_n * state.v_n + 1e-6)
        x = (speed - self.v_ref) / self.width
        more = self.rise * (1.0 - math.exp(-0.5 * x * x))
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldSlip(FootTerm):
    """Formula: friction that grows with the angle of slip, by ``rise`` in the end, most of it within ``width``."""

    name: ClassVar[str] = "world_slip"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    rise: float = _any("growth")
    width: float = quantity(0.1, "rad", low=0.001, high=1.0, source=_HERE, meaning="over which it grows")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        angle = math.absolute(state.v_n) / math.sqrt(state.v_t * state.v_t + 0.01)
        more = self.rise * math.tanh(angle / self.width)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldEdgeAtSpeed(FootTerm):
    """Formula: friction that grows with the edge angle above v_ref, and falls with it below."""

    name: ClassVar[str] = "world_edge_at_speed"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    growth: float = _any("growth")
    v_ref: float = quantity(10.0, "m/s", low=0.1, high=100.0, source=_HERE, meaning="where it does not change")
    edge_ref: float = _any("where it is nothing", "rad")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        speed = math.sqrt(state.v_t * state.v_t + state.v_n * state.v_n + 1e-6)
        edged = math.sin(math.absolute(state.edge)) - math.sin(self.edge_ref)
        more = math.maximum(self.growth * edged * math.tanh((speed - self.v_ref) / 1.5), -0.05)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0


@dataclass(frozen=True)
class WorldPlace(FootTerm):
    """Formula: friction that is greatest, by ``rise``, in a hollow about f0."""

    name: ClassVar[str] = "world_place"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    rise: float = _any("growth")
    f0: float = _any("where", "m")
    width: float = quantity(20.0, "m", low=1.0, high=1e3, source=_HERE, meaning="how far it reaches")

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        x = (state.f - self.f0) / self.width
        more = self.rise / (1.0 + x * x)
        return -more * state.load * math.saturate(state.v_t, 0.1), 0.0
