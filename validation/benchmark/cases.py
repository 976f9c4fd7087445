"""Runs with a concealed effect, made to test the diagnosis: a separate world.

It shares the recorded movements, the skeleton and the beams with the program.  Effects that act for a while have other
shapes than the hypotheses (``effects``); other properties unknown to the diagnosis are drawn for each case (``world``).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.choices import Concealed
from sssi_exudyn.core.errors import SimulationDiverged, SssiError
from sssi_exudyn.core.number_ref import CLOCK_OFFSET
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.benchmark.balanced_skier import balance_skier
from sssi_exudyn.validation.benchmark.effects import EFFECTS, PHYSICS, SENSOR, SIZES, UNKNOWN, Effect, plain_run
from sssi_exudyn.validation.benchmark.world import (
    Instruments,
    draw_instruments,
    other_day,
    record_capture,
    record_gps,
    record_insoles,
)
from sssi_exudyn.validation.diagnosis.hypotheses.air.gust import PassingGust
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_delay import GpsDelay
from sssi_exudyn.validation.diagnosis.hypotheses.instruments.gps_jump import DisplacedFixes
from sssi_exudyn.validation.diagnosis.hypotheses.snow.slope_change import OtherInclination
from sssi_exudyn.validation.diagnosis.hypotheses.snow.snow_patch import PatchOfSnow

_LENGTHS: Final = (5.5, 7.0)
"""s; lengths of cases: stretches of runs."""
_WHOLE_RUNS: Final = (12.0, 15.0)
"""s; lengths of cases that are whole runs."""
_SHORTEST: Final = 4.0
"""s; shortest case, of a short recording: effects that last for a while, and a receiver's lost fix, take up to 3 s."""
_ATTEMPTS: Final = 40
_HALVED: Final = 10
"""Draws after which an effect is half as strong: with some no slow skier goes on."""
_LEAD: Final = 1.0
"""s by which a skier starts before he is recorded: he settles on the snow within that."""
SHORTEST_RUN: Final = _SHORTEST + _LEAD
"""s; length of a recording from which a case can be made."""
_SLOWEST: Final = 2.0
"""m/s; a skier who gets slower than that has been stopped by the concealed effect.  Recorded turns are skied at 4 m/s
and more."""


class SkierStops(SssiError):
    """The concealed effect stops the skier within the run: from there on the track says nothing of it."""


@dataclass(frozen=True)
class Case:
    """One run of the world.

    name : the concealed effect, "none" where there is none; pairs are joined by "+"
    kind : "none", "physics", "sensor", "unexplained" or "pair"
    strength : 0 to 3, weak to strong
    window : times (s) between which it acts, None for always
    truth : its numbers, by the diagnosis' own names where it has them;  mu_t, mu_n : of the snow
    seconds : length of the run
    """

    index: int
    base: str
    name: str
    kind: str
    strength: int
    window: tuple[float, float] | None
    truth: dict[str, float]
    mu_t: float | None = None
    mu_n: float | None = None
    seconds: float | None = None


@dataclass(frozen=True)
class Planned:
    """What a case is to conceal: name, kind and strength are those of ``Case``; ``lengths`` are between which its
    length (s) is drawn.
    """

    name: str
    kind: str
    strength: int
    lengths: tuple[float, float] = _LENGTHS


Recorded = tuple[Recording, Motion, Model]
"""Recording of a run's instruments, its movement, and the known model."""


@dataclass(frozen=True)
class Made:
    """A case with the recordings of its instruments.

    instruments : their quality
    effects : how many are concealed
    with_effects : simulates their recordings, with the same noise, with some of these alone, by their numbers
    """

    case: Case
    recording: Recording
    motion: Motion
    model: Model
    instruments: Instruments
    effects: int
    with_effects: Callable[[Collection[int]], Recorded]


PAIRS: Final = (
    (PatchOfSnow.name, DisplacedFixes.name),
    (PassingGust.name, OtherInclination.name),
    (PatchOfSnow.name, PassingGust.name),
    (OtherInclination.name, GpsDelay.name),
)


def plan(count: int, seed: int, conceal: Concealed = "all") -> list[Planned]:
    """Plan ``count`` cases.

    A quarter conceal nothing, pairs and unlisted effects are a twelfth each, the rest are single effects in turn at the
    four strengths.  Pairs, and single effects where one kind alone is concealed, have the two larger strengths: a refit
    takes up most of the smaller ones.  Of whole runs every fourth conceals nothing.
    """
    nothing = Planned("none", "none", 0)
    names = [*((n, "physics") for n in PHYSICS), *((n, "sensor") for n in SENSOR)]
    unlisted = [(name, "unexplained") for name in UNKNOWN]

    def strong(kinds: Sequence[tuple[str, str]], number: int) -> list[Planned]:
        return [Planned(*kinds[i % len(kinds)], 2 + (i // len(kinds) + i) % 2) for i in range(number)]

    if conceal == "nothing":
        return [nothing] * count
    if conceal == "unlisted":
        return strong(unlisted, count)
    if conceal == "listed":
        return strong(names, count)
    if conceal == "whole_runs":
        listed = strong(names, count)
        return [replace(nothing if i % 4 == 3 else listed[i - i // 4], lengths=_WHOLE_RUNS) for i in range(count)]
    pairs = [Planned("+".join(PAIRS[i % len(PAIRS)]), "pair", 2 + i % 2) for i in range(count)]
    if conceal == "pairs":
        return pairs
    rng = np.random.default_rng([seed, 0])
    without = [nothing] * round(0.25 * count)
    pairs = pairs[: round(count / 12)]
    unknown = [Planned(*unlisted[i % len(unlisted)], (i // len(unlisted) + i) % 4) for i in range(round(count / 12))]
    rest = count - len(without) - len(pairs) - len(unknown)
    single = [Planned(*names[i % len(names)], (i % len(names) + i // len(names)) % 4) for i in range(rest)]
    cases = [*without, *pairs, *unknown, *single]
    order = rng.permutation(len(cases))
    return [cases[i] for i in order]


def make(index: int, planned: Planned, bases: list[Recorded], seed: int) -> Made:
    """Make the case of that number: simulated by the full model with its concealed effect, and recorded.

    ``bases`` are recordings with their movements and fitted models; each case is a stretch of one of them, or all of a
    short one.  A stretch that cannot be simulated (it begins in the air, say) or on which the effect stops the skier is
    drawn again.  An effect that stops every skier becomes weaker.

    Raises SimulationDiverged or SkierStops when none of forty can be used.
    """
    for attempt in range(_ATTEMPTS):
        try:
            share = 0.5 ** (attempt // _HALVED)
            return _draw(index, planned, bases, np.random.default_rng([seed, 1, index, attempt]), share)
        except (SimulationDiverged, SkierStops) as error:
            failure = error
    raise failure


def _draw(
    index: int,
    planned: Planned,
    bases: list[Recorded],
    rng: np.random.Generator,
    share: float,
) -> Made:
    """Draw a case whose effects have a ``share`` of the planned strength."""
    recording, motion, fitted = bases[int(rng.integers(len(bases)))]
    long = min(float(rng.uniform(*planned.lengths)), motion.stop - motion.start - _LEAD)
    begin = float(rng.uniform(motion.start + _LEAD, motion.stop - long))
    stated = replace(motion, start=begin, stop=begin + long)
    true, motion = other_day(rng, recording, replace(stated, start=begin - _LEAD), fitted)
    instruments = draw_instruments(rng, stated)
    plain = plain_run(simulate(replace(true, solver=replace(true.solver, step=0.01)), motion), begin)
    effects = [
        EFFECTS[part](rng, share * SIZES[planned.strength] * float(rng.uniform(0.85, 1.15)), plain)
        for part in planned.name.split("+")
        if part != "none"
    ]
    motion = balance_skier(replace(_world_with(true, effects), sensors=()), motion, recording)
    known = (replace(recording, name=f"case_{index:03d}"), stated, fitted)

    def with_effects(kept: Collection[int]) -> Recorded:
        some = [effect for i, effect in enumerate(effects) if i in kept]
        faults = sum(e.delay for e in some), sum(e.heading for e in some)
        return record(deepcopy(rng), known, motion, _world_with(true, some), instruments, *faults)

    recorded = with_effects(range(len(effects)))
    case = Case(
        index,
        recording.name,
        planned.name,
        planned.kind,
        planned.strength,
        effects[0].window if len(effects) == 1 else None,
        {k: v for e in effects for k, v in (e.truth or {}).items()} if len(effects) == 1 else {},
        mu_t=true.friction.mu_t,
        mu_n=true.friction.mu_n,
        seconds=long,
    )
    return Made(case, *recorded, instruments, len(effects), with_effects)


def _world_with(true: Model, effects: Sequence[Effect]) -> Model:
    terms = tuple(term for effect in effects for term in effect.terms)
    return replace(true, terms=(*true.terms, *terms), sensors=tuple(s for effect in effects for s in effect.sensors))


def record(
    rng: np.random.Generator, known: Recorded, motion: Motion, world: Model, instruments: Instruments, delay: float,
    heading: float,
) -> Recorded:  # fmt: skip
    """Record a run of the world with its instruments and the capture, from where its known movement starts.

    Raises SkierStops where the skier does not ski to the end.
    """
    recording, stated, fitted = known
    run = simulate(world, motion)
    speed = np.linalg.norm(run.com_velocity, axis=1)
    if np.min(speed) < _SLOWEST:
        raise SkierStops(f"at {run.time[np.argmin(speed)]:.1f} s the skier has {np.min(speed):.1f} m/s left")
    assert run.antenna is not None
    late = world.with_values({CLOCK_OFFSET: delay})
    motion = replace(motion, start=stated.start)
    gps = record_gps(rng, recording, late, run.time, run.antenna, motion, instruments)
    insoles = record_insoles(rng, recording, world, run.time, run.sole_force, motion, instruments)
    captured = replace(record_capture(rng, motion, heading, instruments), inclination=stated.inclination)
    recorded = replace(recording, gps=gps, insoles=insoles)
    return recorded, captured, _model_as_known(fitted, recorded, captured)


def _model_as_known(fitted: Model, recorded: Recording, motion: Motion) -> Model:
    """Return the model known to the diagnosis: the paper's with usual snow, and mass and slope as stated."""
    assert recorded.gps is not None
    start = first_guess(recorded.gps, motion, fitted.inclination, fitted.fall_line_azimuth)
    return replace(fitted, start=start)
