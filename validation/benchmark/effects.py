"""Concealed effects of cases: the additions of each to the world, drawn at a size.

No effect of physics has the law of its hypothesis.  What acts for a while or at a place has another shape (ramps,
smooth steps, half sines); what lasts grows otherwise with speed, edge angle, load or groove.  Of the instruments'
faults only clocks, an antenna's place, a heading and an insole's zero have one law, which is the hypothesis' own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import HeadingDrift, InsoleDelay, InsoleOffset, LeverArm, Sensor
from sssi_exudyn.simulation.reduced.prepared import ReducedRun
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.benchmark.concealed_faults import WorldCuff, WorldGain, WorldJump
from sssi_exudyn.validation.benchmark.concealed_terms import (
    EdgeBite,
    OneSkiSlow,
    Ruts,
    WarmingSnow,
    WorldBump,
    WorldCompaction,
    WorldDrag,
    WorldEdge,
    WorldGust,
    WorldLift,
    WorldLoad,
    WorldPatch,
    WorldPole,
    WorldPush,
    WorldSlope,
    WorldSpeed,
    WorldWind,
)
from sssi_exudyn.validation.diagnosis.hypotheses.air.drag_area import OtherDragArea
from sssi_exudyn.validation.diagnosis.hypotheses.air.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.air.lift import OtherLift
from sssi_exudyn.validation.diagnosis.hypotheses.air.wind import SteadyWind
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.boot_cuff import LoadOnCuffs
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_drift import DriftingHeading
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.heading_misalignment import HeadingMisalignment
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_delay import LateInsoles
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_gain import WrongInsoleGain
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.insole_offset import DriftedInsoleZero
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.lever_arm import OtherLeverArm
from sssi_exudyn.validation.diagnosis.hypotheses.skier.pole_plant import PolePlants
from sssi_exudyn.validation.diagnosis.hypotheses.snow.edge_dependent_friction import FrictionByEdge
from sssi_exudyn.validation.diagnosis.hypotheses.snow.load_dependent_friction import FrictionByLoad
from sssi_exudyn.validation.diagnosis.hypotheses.snow.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_compaction import CompactedSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_patch import PatchOfSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow.speed_dependent_friction import FrictionBySpeed
from sssi_exudyn.validation.diagnosis.hypotheses.snow.terrain_bump import RollOrDip


@dataclass
class Effect:
    """The concealed effect of a case while it is put together."""

    terms: tuple[Term, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    delay: float = 0.0
    heading: float = 0.0
    window: tuple[float, float] | None = None
    truth: dict[str, float] | None = None


Maker = Callable[[np.random.Generator, float, "PlainRun"], Effect]


@dataclass(frozen=True)
class PlainRun:
    """A run with nothing concealed: begin, end and transitions (s), mean speed (m/s) and edge angle (rad).

    ``place_at`` gives its place along the fall line (m) at a time.
    """

    begin: float
    end: float
    speed: float
    edge: float
    transitions: Array
    place_at: Callable[[float], float]

    def stretch(self, rng: np.random.Generator, least: float, most: float) -> tuple[float, float]:
        long = float(rng.uniform(least, most))
        t0 = float(rng.uniform(self.begin + 0.7, max(self.begin + 0.8, self.end - 1.0 - long)))
        return t0, t0 + long


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _wind(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    f, l = -2.5 * size * _sign(rng), size * float(rng.normal(0.0, 1.0))  # noqa: E741  the slope frame's name of the axis
    return Effect((WorldWind(f, l, float(rng.uniform(0.0, 2.0 * np.pi))),), truth={"w_f": f})


def _gust(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    window = plain.stretch(rng, 1.5, 3.0)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    f, l = 4.0 * size * np.cos(turn), 4.0 * size * np.sin(turn)  # noqa: E741  the slope frame's name of the axis
    return Effect((WorldGust(float(f), float(l), *window),), window=window, truth={"w_f": float(f), "w_l": float(l)})


def _drag(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    share = 0.35 * size * (1.0 if size > 1.0 else _sign(rng))
    return Effect((WorldDrag(0.4 * share),), truth={})


def _lift(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    rate, phase = float(rng.uniform(2.0, 5.0)), float(rng.uniform(0.0, 2.0 * np.pi))
    return Effect((WorldLift(0.2 * size, rate, phase),), truth={})


def _patch(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    t0, t1 = plain.stretch(rng, 1.5, 3.0)
    delta = 0.025 * size
    patch = WorldPatch(delta, plain.place_at(t0), plain.place_at(t1))
    return Effect((patch,), window=(t0, t1), truth={"delta_mu_t": delta})


def _speed(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    b = 0.005 * size
    return Effect((WorldSpeed(b, plain.speed),), truth={"b": b})


def _edge(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect((WorldEdge(0.08 * size, plain.edge),), truth={})


def _load(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect((WorldLoad(0.06 * size),), truth={})


def _compaction(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect((WorldCompaction(5e3 * size),), truth={})


def _slope(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    t0 = float(rng.uniform(plain.begin + 2.0, plain.end - 2.0))
    delta = np.radians(0.6).item() * size * _sign(rng)
    return Effect((WorldSlope(delta, plain.place_at(t0)),), window=(t0, plain.end), truth={"delta": delta})


def _bump(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    t0 = float(rng.uniform(plain.begin + 2.0, plain.end - 2.0))
    f0, reach, rise = plain.place_at(t0), float(rng.uniform(6.0, 12.0)), 0.1 * size * _sign(rng)
    return Effect((WorldBump(rise, f0, reach),), window=(t0 - reach / plain.speed, t0 + reach / plain.speed), truth={})


def _poles(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    forward, up = 6.0 * size, 4.0 * size
    times = plain.transitions + rng.normal(0.0, 0.05, len(plain.transitions))
    return Effect(tuple(WorldPole(forward, up, float(t)) for t in times), truth={"forward": forward})


def _delay(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect(delay=0.04 * size, truth={"clock_offset": 0.04 * size})


def _jump(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    window = plain.stretch(rng, 0.8, 2.5)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    x, y = 0.08 * size * np.cos(turn), 0.08 * size * np.sin(turn)
    return Effect(sensors=(WorldJump(float(x), float(y), *window),), window=window, truth={})


def _heading(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    turn = np.radians(2.0).item() * size * _sign(rng)
    return Effect(heading=turn, truth={"heading_offset": turn})


def _drift(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    rate = np.radians(0.25).item() * size * _sign(rng)
    return Effect(sensors=(HeadingDrift(rate, 0.5 * (plain.begin + plain.end)),), truth={"rate": rate})


def _lever(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    arm = 0.1 * size * rng.normal(0.0, 1.0, 3) / np.sqrt(3.0)
    return Effect(sensors=(LeverArm(*(float(x) for x in arm)),), truth={})


def _gain(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    left = 0.1 * size * _sign(rng)
    return Effect(sensors=(WorldGain(left),), truth={})


def _cuff(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect(sensors=(WorldCuff(0.06 * size),), truth={})


def _zero(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    offset, side = 25.0 * size * _sign(rng), float(rng.integers(2))
    left, right = offset * side, offset * (1.0 - side)
    return Effect(sensors=(InsoleOffset(left, right),), truth={"left": left, "right": right})


def _late_insoles(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    late = 0.02 * size * _sign(rng)
    return Effect(sensors=(InsoleDelay(late),), truth={"late": late})


def _push(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    window = plain.stretch(rng, 0.3, 0.8)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    force = 60.0 * size
    return Effect(
        (WorldPush(float(force * np.cos(turn)), float(force * np.sin(turn)), 0.0, *window),), window=window, truth={}
    )


def _one_ski(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    delta, side = 0.03 * size, _sign(rng)
    return Effect((OneSkiSlow(delta, side),), truth={"delta_mu": side * delta})


def _warming(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    return Effect((WarmingSnow(0.025 * size / 30.0, plain.place_at(plain.begin)),), truth={})


def _bite(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    window = plain.stretch(rng, 0.3, 0.6)
    bite = EdgeBite(80.0 * size, float(rng.uniform(0.3, 1.5)), _sign(rng), *window)
    return Effect((bite,), window=window, truth={})


def _ruts(rng: np.random.Generator, size: float, plain: PlainRun) -> Effect:
    t0, t1 = plain.stretch(rng, 1.0, 2.0)
    ruts = Ruts(25.0 * size, float(rng.uniform(3.0, 6.0)), plain.place_at(t0), plain.place_at(t1))
    return Effect((ruts,), window=(t0, t1), truth={})


PHYSICS: Final[dict[str, Maker]] = {
    SteadyWind.name: _wind,
    PassingGust.name: _gust,
    OtherDragArea.name: _drag,
    OtherLift.name: _lift,
    PatchOfSnow.name: _patch,
    FrictionBySpeed.name: _speed,
    FrictionByEdge.name: _edge,
    FrictionByLoad.name: _load,
    CompactedSnow.name: _compaction,
    OtherInclination.name: _slope,
    RollOrDip.name: _bump,
    PolePlants.name: _poles,
}
"""Makers of effects, by the names of the hypotheses that explain them."""
SENSOR: Final[dict[str, Maker]] = {
    GpsDelay.name: _delay,
    DisplacedFixes.name: _jump,
    HeadingMisalignment.name: _heading,
    DriftingHeading.name: _drift,
    OtherLeverArm.name: _lever,
    WrongInsoleGain.name: _gain,
    LoadOnCuffs.name: _cuff,
    DriftedInsoleZero.name: _zero,
    LateInsoles.name: _late_insoles,
}
UNKNOWN: Final[dict[str, Maker]] = {
    "external_push": _push,
    "one_ski_slow": _one_ski,
    WarmingSnow.name: _warming,
    EdgeBite.name: _bite,
    Ruts.name: _ruts,
}
EFFECTS: Final = {**PHYSICS, **SENSOR, **UNKNOWN}
SIZES: Final = (0.5, 1.0, 2.0, 4.0)
"""The four strengths, as multiples of each maker's unit size."""


def plain_run(run: SimulationResult | ReducedRun, begin: float | None = None) -> PlainRun:
    """Return the properties of a run with nothing concealed that makers of effects need, from ``begin`` (s) on; of the
    whole run where that is None.
    """
    time = run.time
    begin = float(time[0]) if begin is None else begin
    along = np.maximum.accumulate(run.com[:, 0])
    mean = np.convolve(run.edge_angle.mean(axis=1), np.ones(31) / 31.0, mode="same")
    crossing = np.flatnonzero(np.diff(np.sign(mean)) != 0)
    inner = crossing[(time[crossing] > begin + 0.5) & (time[crossing] < time[-1] - 0.5)]
    recorded = time >= begin
    speed = float(np.mean(np.linalg.norm(run.com_velocity[recorded], axis=1)))
    edge = float(np.mean(np.abs(run.edge_angle[recorded])))
    return PlainRun(begin, float(time[-1]), speed, edge, time[inner], lambda t: float(np.interp(t, time, along)))
