"""Runs with something concealed, made to test the diagnosis: a world of its own.

It shares the recorded movements, the skeleton and the beams with the program.  Effects that act for a while have other
shapes than the hypotheses (``effects``), steps are finer, snow is stiffer or softer than assumed, the capture is wrong
joint by joint, and instruments have autocorrelated noise.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array, level_to_enu
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.fitting.gps_observation import predict_fixes
from sssi_exudyn.model.faults import insole_readings
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.validation.benchmark.effects import EFFECTS, PHYSICS, SENSOR, SIZES, UNKNOWN, plain_run
from sssi_exudyn.validation.diagnosis.hypotheses.air.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.snow.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_patch import PatchOfSnow

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

    plain : simulates what they would have, with the same noise, were nothing concealed; None where nothing is
    """

    case: Case
    recording: Recording
    motion: Motion
    model: Model
    plain: Callable[[], Recorded] | None


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
    plain = plain_run(simulate(replace(true, solver=replace(true.solver, step=0.01)), motion))
    effects = [
        EFFECTS[part](rng, SIZES[strength] * float(rng.uniform(0.85, 1.15)), plain)
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
    return Made(case, *made, partial(record, same_noise, given, motion, true, 0.0, 0.0) if effects else None)


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


def _record_gps(
    rng: np.random.Generator, recording: Recording, world: Model, time: Array, antenna: Array, motion: Motion
) -> Gps:
    assert recording.gps is not None
    fixes = np.arange(motion.start, motion.stop, 0.1)
    sigma, correlation_time = 0.02 * float(np.exp(rng.normal(0.0, 0.2))), float(rng.uniform(2.0, 5.0))
    place = predict_fixes(world, time, antenna, fixes)
    for axis, factor in enumerate((1.0, 1.0, 1.3)):
        place[:, axis] += draw_noise(rng, fixes, ExponentialNoise(factor * sigma, correlation_time))
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
