"""Runs with something concealed, made to judge the diagnosis: a world of its own.

It shares the recorded movements, the skeleton and the beams with the program, and nothing of the diagnosis: shapes of
the concealed effects are other ones (ramps, smooth steps, half sines), steps are finer, snow is stiffer or softer than
assumed, the capture is wrong joint by joint, and instruments have autocorrelated noise.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.friction_corrections import (
    EdgeDependentFriction,
    LoadDependentFriction,
    SnowCompaction,
    SpeedDependentFriction,
)
from sssi_exudyn.contact.terms.wind import DragArea, Wind
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, level_to_enu
from sssi_exudyn.fitting.gps_observation import predict_fixes
from sssi_exudyn.model.faults import BootCuff, GpsJump, HeadingDrift, InsoleGain, LeverArm, Sensor, insole_readings
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.benchmark.concealed_terms import (
    OneSkiSlow,
    WorldBump,
    WorldGust,
    WorldPatch,
    WorldPole,
    WorldPush,
    WorldSlope,
)
from sssi_exudyn.validation.diagnosis.hypotheses.boot_cuff import LoadOnCuffs
from sssi_exudyn.validation.diagnosis.hypotheses.drag_area import OtherDragArea
from sssi_exudyn.validation.diagnosis.hypotheses.edge_dependent_friction import FrictionByEdge
from sssi_exudyn.validation.diagnosis.hypotheses.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.heading_drift import DriftingHeading
from sssi_exudyn.validation.diagnosis.hypotheses.heading_misalignment import HeadingMisalignment
from sssi_exudyn.validation.diagnosis.hypotheses.insole_gain import WrongInsoleGain
from sssi_exudyn.validation.diagnosis.hypotheses.lever_arm import OtherLeverArm
from sssi_exudyn.validation.diagnosis.hypotheses.load_dependent_friction import FrictionByLoad
from sssi_exudyn.validation.diagnosis.hypotheses.pole_plant import PolePlants
from sssi_exudyn.validation.diagnosis.hypotheses.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow_compaction import CompactedSnow
from sssi_exudyn.validation.diagnosis.hypotheses.snow_patch import PatchOfSnow
from sssi_exudyn.validation.diagnosis.hypotheses.speed_dependent_friction import FrictionBySpeed
from sssi_exudyn.validation.diagnosis.hypotheses.terrain_bump import RollOrDip
from sssi_exudyn.validation.diagnosis.hypotheses.wind import SteadyWind

_ATTEMPTS: Final = 10
STEP: Final = 0.004
"""s; the diagnosis' full model takes longer ones, its reduced model others."""


@dataclass(frozen=True)
class Case:
    """One run of the world.

    name : what is concealed, "none" where nothing is; pairs are joined by "+"
    kind : "none", "physics", "sensor", "unexplained" or "pair"
    strength : 0 to 3, weak to strong
    window : when it acts (s), None for always
    truth : its numbers, by the diagnosis' own names where it knows them
    """

    index: int
    base: str
    name: str
    kind: str
    strength: int
    window: tuple[float, float] | None
    truth: dict[str, float]


Recorded = tuple[Recording, Motion, Model]
"""What instruments recorded of a run, and what is known of it."""


@dataclass(frozen=True)
class Made:
    """A case with what its instruments recorded.

    plain : what they would have, with the same noise, were nothing concealed; None where nothing is
    """

    case: Case
    recording: Recording
    motion: Motion
    model: Model
    plain: Recorded | None


@dataclass
class _Effect:
    """What a case conceals, as it is put together."""

    terms: tuple[Term, ...] = ()
    sensors: tuple[Sensor, ...] = ()
    delay: float = 0.0
    heading: float = 0.0
    window: tuple[float, float] | None = None
    truth: dict[str, float] | None = None


Maker = Callable[[np.random.Generator, float, "_PlainRun"], _Effect]


@dataclass(frozen=True)
class _PlainRun:
    """A run with nothing concealed: begin, end and transitions (s), mean speed (m/s), and the place along the fall line
    (m) at a time.
    """

    begin: float
    end: float
    speed: float
    transitions: Array
    place_at: Callable[[float], float]

    def stretch(self, rng: np.random.Generator, least: float, most: float) -> tuple[float, float]:
        long = float(rng.uniform(least, most))
        t0 = float(rng.uniform(self.begin + 0.7, max(self.begin + 0.8, self.end - 1.0 - long)))
        return t0, t0 + long


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _wind(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    f, l = -2.5 * size * _sign(rng), float(rng.normal(0.0, 1.0))  # noqa: E741  the slope frame's name of the axis
    return _Effect((Wind(f, l),), truth={"w_f": f})


def _gust(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    window = plain.stretch(rng, 1.5, 3.0)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    f, l = 4.0 * size * np.cos(turn), 4.0 * size * np.sin(turn)  # noqa: E741  the slope frame's name of the axis
    return _Effect((WorldGust(float(f), float(l), *window),), window=window, truth={"w_f": float(f), "w_l": float(l)})


def _drag(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    share = 0.35 * size * (1.0 if size > 1.0 else _sign(rng))
    return _Effect((DragArea(share),), truth={"share": share})


def _patch(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    t0, t1 = plain.stretch(rng, 1.5, 3.0)
    delta = 0.025 * size
    patch = WorldPatch(delta, plain.place_at(t0), plain.place_at(t1))
    return _Effect((patch,), window=(t0, t1), truth={"delta_mu_t": delta})


def _speed(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    b = 0.005 * size
    return _Effect((SpeedDependentFriction(b, plain.speed),), truth={"b": b})


def _edge(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect((EdgeDependentFriction(0.08 * size, 0.3),), truth={"b": 0.08 * size})


def _load(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect((LoadDependentFriction(0.03 * size, 400.0),), truth={"b": 0.03 * size})


def _compaction(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect((SnowCompaction(5e3 * size),), truth={"c": 5e3 * size})


def _slope(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    t0 = float(rng.uniform(plain.begin + 2.0, plain.end - 2.0))
    delta = np.radians(0.6).item() * size * _sign(rng)
    return _Effect((WorldSlope(delta, plain.place_at(t0)),), window=(t0, plain.end), truth={"delta": delta})


def _bump(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    t0 = float(rng.uniform(plain.begin + 2.0, plain.end - 2.0))
    f0, reach, rise = plain.place_at(t0), float(rng.uniform(6.0, 12.0)), 0.1 * size * _sign(rng)
    return _Effect((WorldBump(rise, f0, reach),), window=(t0 - reach / plain.speed, t0 + reach / plain.speed), truth={})


def _poles(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    forward, up = 6.0 * size, 4.0 * size
    times = plain.transitions + rng.normal(0.0, 0.05, len(plain.transitions))
    return _Effect(tuple(WorldPole(forward, up, float(t)) for t in times), truth={"forward": forward})


def _delay(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect(delay=0.04 * size, truth={"clock_offset": 0.04 * size})


def _jump(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    window = plain.stretch(rng, 0.8, 2.5)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    x, y = 0.08 * size * np.cos(turn), 0.08 * size * np.sin(turn)
    return _Effect(sensors=(GpsJump(float(x), float(y), *window),), window=window, truth={"x": float(x), "y": float(y)})


def _heading(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    turn = np.radians(2.0).item() * size * _sign(rng)
    return _Effect(heading=turn, truth={"heading_offset": turn})


def _drift(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    rate = np.radians(0.25).item() * size * _sign(rng)
    return _Effect(sensors=(HeadingDrift(rate, 0.5 * (plain.begin + plain.end)),), truth={"rate": rate})


def _lever(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    arm = 0.1 * size * rng.normal(0.0, 1.0, 3) / np.sqrt(3.0)
    return _Effect(sensors=(LeverArm(*(float(x) for x in arm)),), truth={})


def _gain(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    left = 0.1 * size * _sign(rng)
    return _Effect(sensors=(InsoleGain(left, 0.0),), truth={"left": left})


def _cuff(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect(sensors=(BootCuff(0.06 * size),), truth={"share": 0.06 * size})


def _push(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    window = plain.stretch(rng, 0.3, 0.8)
    turn = rng.uniform(0.0, 2.0 * np.pi)
    force = 60.0 * size
    return _Effect(
        (WorldPush(float(force * np.cos(turn)), float(force * np.sin(turn)), 0.0, *window),), window=window, truth={}
    )


def _one_ski(rng: np.random.Generator, size: float, plain: _PlainRun) -> _Effect:
    return _Effect((OneSkiSlow(0.03 * size, _sign(rng)),), truth={})


PHYSICS: Final[dict[str, Maker]] = {
    SteadyWind.name: _wind,
    PassingGust.name: _gust,
    OtherDragArea.name: _drag,
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
}
UNKNOWN: Final[dict[str, Maker]] = {"external_push": _push, "one_ski_slow": _one_ski}
SIZES: Final = (0.5, 1.0, 2.0, 4.0)
"""The four strengths, as multiples of what each maker calls one."""
_PAIRS: Final = (
    (PatchOfSnow.name, DisplacedFixes.name),
    (PassingGust.name, OtherInclination.name),
    (PatchOfSnow.name, PassingGust.name),
    (OtherInclination.name, GpsDelay.name),
)


def plan(count: int, seed: int) -> list[tuple[str, str, int]]:
    """(name, kind, strength) of ``count`` cases: a quarter nothing, pairs and unknown effects a twelfth each, the rest
    single effects in turn at the four strengths.
    """
    rng = np.random.default_rng([seed, 0])
    nothing = [("none", "none", 0)] * round(0.25 * count)
    pairs = [("+".join(_PAIRS[i % len(_PAIRS)]), "pair", 2 + i % 2) for i in range(round(count / 12))]
    unknown = [(list(UNKNOWN)[i % 2], "unexplained", (i // 2) % 4) for i in range(round(count / 12))]
    names = [*((n, "physics") for n in PHYSICS), *((n, "sensor") for n in SENSOR)]
    rest = count - len(nothing) - len(pairs) - len(unknown)
    single = [(*names[i % len(names)], (i // len(names)) % 4) for i in range(rest)]
    cases = [*nothing, *pairs, *unknown, *single]
    order = rng.permutation(len(cases))
    return [cases[i] for i in order]


def make(index: int, planned: tuple[str, str, int], bases: list[Recorded], seed: int) -> Made:
    """The case of that number: simulated by the full model with what it conceals, and recorded.

    ``bases`` are recordings with their movements and fitted models; each case is a stretch of one of them.  A stretch
    that cannot be simulated (it begins in the air, say) is drawn again.

    Raises SimulationDiverged when none of ten can.
    """
    for attempt in range(_ATTEMPTS):
        try:
            return _draw(index, planned, bases, np.random.default_rng([seed, 1, index, attempt]))
        except SimulationDiverged as error:
            failure = error
    raise failure


def _draw(
    index: int,
    planned: tuple[str, str, int],
    bases: list[Recorded],
    rng: np.random.Generator,
) -> Made:
    name, kind, strength = planned
    recording, motion, fitted = bases[int(rng.integers(len(bases)))]
    long = float(rng.uniform(5.5, 7.0))
    begin = float(rng.uniform(motion.start, motion.stop - long))
    motion = replace(motion, start=begin, stop=begin + long)
    true = other_day(rng, recording, motion, fitted)
    plain = _plain_run(simulate(replace(true, solver=replace(true.solver, step=0.01)), motion))
    effects = [
        _maker(part)(rng, SIZES[strength] * float(rng.uniform(0.85, 1.15)), plain)
        for part in name.split("+")
        if part != "none"
    ]
    terms = tuple(t for e in effects for t in e.terms)
    sensors = tuple(s for e in effects for s in e.sensors)
    world = replace(true, terms=(*true.terms, *terms), sensors=sensors)
    given = (replace(recording, name=f"case_{index:03d}"), motion, fitted)
    same_noise = deepcopy(rng)
    made = record(rng, given, motion, world, sum(e.delay for e in effects), sum(e.heading for e in effects))
    case = Case(
        index,
        recording.name,
        name,
        kind,
        strength,
        effects[0].window if len(effects) == 1 else None,
        {k: v for e in effects for k, v in (e.truth or {}).items()} if len(effects) == 1 else {},
    )
    return Made(case, *made, record(same_noise, given, motion, true, 0.0, 0.0) if effects else None)


def record(
    rng: np.random.Generator, given: Recorded, motion: Motion, world: Model, delay: float, heading: float
) -> Recorded:
    """A run of the world as its instruments and the capture have it."""
    recording, _, fitted = given
    run = simulate(world, motion)
    assert run.antenna is not None
    gps = _record_gps(rng, recording, world.with_values({"start.clock_offset": delay}), run.time, run.antenna, motion)
    insoles = _record_insoles(rng, recording, world, run.time, run.sole_force)
    captured = _record_capture(rng, motion, heading)
    made = replace(recording, gps=gps, insoles=insoles)
    return made, captured, _model_as_known(fitted, made, captured)


def _maker(name: str) -> Maker:
    return {**PHYSICS, **SENSOR, **UNKNOWN}[name]


def other_day(rng: np.random.Generator, recording: Recording, motion: Motion, fitted: Model) -> Model:
    """The same skier on another snow, started at the stretch's begin as the recording has it."""
    assert recording.gps is not None
    start = first_guess(recording.gps, motion, fitted.inclination, fitted.fall_line_azimuth)
    mu_t = fitted.friction.mu_t + float(rng.uniform(-0.02, 0.03))
    mu_n = fitted.friction.mu_n * float(rng.uniform(0.95, 1.1))
    model = replace(fitted, start=start, solver=replace(fitted.solver, step=STEP))
    stiffness = model.value("penetration.k") * float(np.exp(rng.normal(0.0, 0.15)))
    return model.with_values(
        {"friction.mu_t": max(mu_t, 0.02), "friction.mu_n": min(mu_n, 0.95), "penetration.k": stiffness}
    )


def _model_as_known(fitted: Model, made: Recording, motion: Motion) -> Model:
    """What the diagnosis knows of it: the paper's model with usual snow."""
    assert made.gps is not None
    start = first_guess(made.gps, motion, fitted.inclination, fitted.fall_line_azimuth)
    return replace(fitted, start=start)


def _plain_run(run: SimulationResult) -> _PlainRun:
    """What makers of effects need of a run with nothing concealed."""
    time = run.time
    along = np.maximum.accumulate(run.com[:, 0])
    mean = np.convolve(run.edge_angle.mean(axis=1), np.ones(31) / 31.0, mode="same")
    crossing = np.flatnonzero(np.diff(np.sign(mean)) != 0)
    inner = crossing[(time[crossing] > time[0] + 0.5) & (time[crossing] < time[-1] - 0.5)]
    speed = float(np.mean(np.linalg.norm(run.com_velocity, axis=1)))
    return _PlainRun(float(time[0]), float(time[-1]), speed, time[inner], lambda t: float(np.interp(t, time, along)))


def _autocorrelated_noise(rng: np.random.Generator, time: Array, sigma: float, correlation_time: float) -> Array:
    """(n,) noise with an exponential correlation."""
    out = np.empty(len(time))
    out[0] = rng.normal(0.0, sigma)
    for k, step in enumerate(np.diff(time)):
        keep = np.exp(-step / correlation_time)
        out[k + 1] = keep * out[k] + sigma * np.sqrt(1.0 - keep**2) * rng.normal()
    return out


def _record_gps(
    rng: np.random.Generator, recording: Recording, world: Model, time: Array, antenna: Array, motion: Motion
) -> Gps:
    assert recording.gps is not None
    fixes = np.arange(motion.start, motion.stop, 0.1)
    sigma, correlation_time = 0.02 * float(np.exp(rng.normal(0.0, 0.2))), float(rng.uniform(2.0, 5.0))
    place = predict_fixes(world, time, antenna, fixes)
    for axis, factor in enumerate((1.0, 1.0, 1.3)):
        place[:, axis] += _autocorrelated_noise(rng, fixes, factor * sigma, correlation_time)
    enu = place @ level_to_enu(world.fall_line_azimuth).T
    return replace(recording.gps, time=fixes, enu=enu, sigma=np.full(len(fixes), 0.02), speed=None, course=None)


def _record_insoles(
    rng: np.random.Generator, recording: Recording, world: Model, time: Array, sole: Array
) -> Insoles | None:
    if recording.insoles is None:
        return None
    at = np.arange(time[0], time[-1], 0.02)
    felt = insole_readings(world.sensors, np.stack([np.interp(at, time, s) for s in sole.T], axis=1))
    cuff = float(rng.normal(0.06, 0.01))
    gains = 1.0 + rng.normal(0.0, 0.01, 2)
    read = (1.0 - cuff) * gains * felt + rng.normal(0.0, 12.0, felt.shape)
    read = np.maximum(read, 0.0)
    cells = np.zeros((len(at), 0))
    return replace(recording.insoles, time=at, left=read[:, 0], right=read[:, 1], left_cells=cells, right_cells=cells)


def _record_capture(rng: np.random.Generator, motion: Motion, heading: float) -> Motion:
    """The movement as a capture with errors in every joint has it, turned by ``heading``."""
    time = np.arange(motion.start - 0.2, motion.stop + 0.2, 1.0 / 60.0)
    time = time[(time >= motion.knots[0]) & (time <= motion.knots[-1])]
    angles, _, _ = motion.evaluate(time)
    size = np.radians(0.15) * float(np.exp(rng.normal(0.0, 0.3)))
    for column in range(angles.shape[1]):
        angles[:, column] += rng.normal(0.0, size)
        knots = np.linspace(time[0], time[-1], max(4, round((time[-1] - time[0]) / 2.0) + 1))
        angles[:, column] += np.interp(time, knots, rng.normal(0.0, size, len(knots)))
    smooth = np.ones(25) / 25.0
    kinks = np.apply_along_axis(lambda c: np.convolve(np.pad(c, 12, mode="edge"), smooth, mode="valid"), 0, angles)
    clean, _, _ = motion.evaluate(time)
    clean_smooth = np.apply_along_axis(
        lambda c: np.convolve(np.pad(c, 12, mode="edge"), smooth, mode="valid"), 0, clean
    )
    angles = clean + (kinks - clean_smooth)  # the error alone is smoothed
    angles[:, PRESCRIBED.index("pelvis_rotation")] -= heading
    made = spline_motion(motion.geometry, motion.inclination, time, angles)
    return replace(made, antenna=motion.antenna, round_trip=motion.round_trip, start=motion.start, stop=motion.stop)
