"""Simulated days on one hill: what differs between runs is named, and its size lies in its interval as often as stated.

A point of mass slides along swings over a hill whose friction is known, and a watch records it.  In a quarter of the
days nothing differs but the skier's scatter; in the others one run has another friction all along, one run meets a
patch of slow snow, or all runs do.

``python benchmarks/same_descent.py [--days 200] [--seed 1]`` prints a table; about a second of computing a day.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.season.joint_friction import Range, compare_runs
from sssi_exudyn.season.stretches import Descent, passages_of

Kind = Literal["nothing", "a run", "a patch in one run", "a patch in all runs"]
KINDS: Final[tuple[Kind, ...]] = ("nothing", "a run", "a patch in one run", "a patch in all runs")
LONG: Final = 700.0
"""m of the hill along its line."""
_STEP: Final = 0.1
HALT: Final = 2.5
"""m/s; who is slower somewhere stops, and friction no longer acts as drawn."""
SURE: Final = 0.8
"""Probability from which a name is said without alternatives."""
TOUCHED: Final = 0.01
"""Mean of a patch over a stretch from which it counts as there."""
_DRAG: Final = 0.0024
"""1/m: 0.4 m² of a skier of 87 kg with equipment."""
_PLACES: Final = (ExponentialNoise(1.5, 20.0), ExponentialNoise(0.5, 0.5))
_SPEEDS: Final = ExponentialNoise(0.2, 3.0)
_HEIGHTS: Final = (ExponentialNoise(4.0, 60.0), ExponentialNoise(0.5, 0.5))


@dataclass(frozen=True)
class Hill:
    """A hill and the day's snow: slopes of the line in sines, friction about ``friction`` and with the slope."""

    slope: float
    waves: Array
    phases: Array
    friction: float
    braked: float

    def down(self, place: Array) -> Array:
        """Return by how much (n,) m the line has gone down at places (n,) m."""
        numbers = np.arange(1.0, len(self.waves) + 1.0) * np.pi / LONG
        waves = self.waves * (np.sin(np.outer(place, numbers) + self.phases) - np.sin(self.phases)) / numbers
        return np.asarray(self.slope * place + waves.sum(axis=1))

    def steeper(self, place: float) -> float:
        """Return the slope less its mean."""
        numbers = np.arange(1.0, len(self.waves) + 1.0) * np.pi / LONG
        return float(self.waves @ np.cos(place * numbers + self.phases))


@dataclass(frozen=True)
class Effect:
    """What differs: friction ``size`` more between two places, in one run, or in all (None)."""

    kind: Kind
    size: float = 0.0
    begin: float = 0.0
    end: float = 0.0
    run: int | None = None

    def at(self, run: int, place: float) -> float:
        """Return how much more friction a run has at a place."""
        return self.size * (self.run in (None, run) and self.begin <= place < self.end)

    def share(self, begin: float, end: float) -> float:
        """Return the mean of the effect between two places."""
        return self.size * max(0.0, min(end, self.end) - max(begin, self.begin)) / (end - begin)


def draw_effect(rng: np.random.Generator, kind: Kind, runs: int) -> Effect:
    """Draw a run of another friction (0.01 to 0.03 to either side), or a patch of 60 to 120 m (0.04 to 0.12)."""
    if kind == "nothing":
        return Effect(kind)
    run = int(rng.integers(runs))
    if kind == "a run":
        return Effect(kind, float(rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.03)), -LONG, 2.0 * LONG, run)
    begin, long = float(rng.uniform(60.0, LONG - 180.0)), float(rng.uniform(60.0, 120.0))
    only = run if kind == "a patch in one run" else None
    return Effect(kind, float(rng.uniform(0.04, 0.12)), begin, begin + long, only)


def draw_hill(rng: np.random.Generator) -> Hill:
    """Draw a hill of 7 to 11° on average, steeper and flatter by 2°, on which a skier goes some 16 m/s."""
    slope = float(rng.uniform(0.13, 0.2))
    waves, phases = rng.normal(0.0, 0.01, 5), rng.uniform(0.0, 2.0 * np.pi, 5)
    return Hill(slope, waves, phases, slope - float(rng.uniform(0.06, 0.09)), float(rng.uniform(0.7, 1.0)))


def ski(rng: np.random.Generator, hill: Hill, effect: Effect, run: int, drag: float) -> Descent:
    """Return a run down the hill as a watch records it."""
    long, wide, aside = rng.uniform(25.0, 45.0), rng.uniform(3.0, 7.0), rng.uniform(-8.0, 8.0)
    scatter = ExponentialNoise(float(rng.uniform(0.01, 0.03)), 2.0)
    braking = draw_noise(rng, np.arange(0.0, 120.0, _STEP), scatter)
    place, speed, rows = float(rng.uniform(-20.0, 20.0)), float(rng.uniform(10.0, 14.0)), list[tuple[float, ...]]()
    while place < LONG + 20.0 and len(rows) < len(braking):
        swing = 2.0 * np.pi / long
        lateral, leaning = aside + wide * np.sin(swing * place), wide * swing * np.cos(swing * place)
        longer = np.sqrt(1.0 + leaning**2)
        steep = hill.slope + hill.steeper(place)
        slope = (-steep + 0.05 * leaning) / longer
        rows.append((place, lateral, speed / np.sqrt(1.0 + slope**2)))
        friction = hill.friction + hill.braked * hill.steeper(place) + effect.at(run, place) + braking[len(rows) - 1]
        pull = -GRAVITY * (slope + friction) / np.sqrt(1.0 + slope**2) - drag * speed**2
        speed = max(speed + _STEP * pull, 1.0)
        place += _STEP * speed / np.sqrt(1.0 + slope**2) / longer
    places, laterals, speeds = np.array(rows)[:: round(1.0 / _STEP)].T
    time = np.arange(len(places), dtype=float)
    noise = [sum(draw_noise(rng, time, part) for part in _PLACES) for _ in range(2)]
    bend = 40.0 * (1.0 - np.cos(places / 500.0))  # the line is no straight one
    flat = np.column_stack([places + noise[0], laterals + bend + noise[1]])
    heights = 0.05 * laterals - hill.down(places) + rng.normal(0.0, 20.0)
    heights = heights + sum(draw_noise(rng, time, part) for part in _HEIGHTS)
    speeds = np.maximum(speeds + draw_noise(rng, time, _SPEEDS), 0.0)
    return Descent(time, flat, heights, speeds, 3.0, 0.3, _HEIGHTS[1].sigma, _HEIGHTS[0], _DRAG)


def draw_day(rng: np.random.Generator, kind: Kind, runs: int) -> tuple[Hill, Effect, list[Descent]]:
    """Draw a day on which nobody comes to a halt."""
    while True:
        hill, effect = draw_hill(rng), draw_effect(rng, kind, runs)
        drag = _DRAG * float(np.exp(rng.normal(0.0, 0.2)))
        tracks = [ski(rng, hill, effect, run, drag * float(np.exp(rng.normal(0.0, 0.08)))) for run in range(runs)]
        if all(np.min(track.speed) > HALT for track in tracks):
            return hill, effect, tracks


@dataclass
class Score:
    """Counts of days of one kind.

    held : by what is estimated, intervals that hold the truth, and all of them
    noticed : days whose effect is named in the right run, and stretch
    named, promised, right : differences that are named, the sum of their probabilities, and those that are there
    sure, sure_wrong : what is said with 0.8 and more, of runs and stretches, and what of it is wrong
    """

    days: int = 0
    held: dict[str, tuple[int, int]] = field(default_factory=dict)
    noticed: int = 0
    named: int = 0
    promised: float = 0.0
    right: int = 0
    sure: int = 0
    sure_wrong: int = 0

    def hold(self, what: str, interval: Range, truth: float) -> None:
        """Count whether an interval holds the truth."""
        held, every = self.held.get(what, (0, 0))
        self.held[what] = held + (interval.low <= truth <= interval.high), every + 1

    def row(self, kind: Kind) -> str:
        """Return the counts as a row of a table."""
        held = " | ".join("{} of {}".format(*self.held.get(what, (0, 0))) for what in HELD)
        names = f"{self.right} of {self.named} ({self.promised:.1f})"
        return f"| {kind} | {self.days} | {held} | {self.noticed} | {names} | {self.sure_wrong} of {self.sure} |"


HELD: Final = ("a run over the others", "a stretch over the others", "a difference")


def judge(score: Score, seed: tuple[int, ...], kind: Kind, runs: int) -> None:
    """Draw a day, compare its runs, and count."""
    hill, effect, tracks = draw_day(np.random.default_rng(seed), kind, runs)
    answer = compare_runs("A", [str(run) for run in range(runs)], *passages_of(tracks))
    score.days += 1
    noticed = False
    whole = effect.size if kind == "a run" else 0.0
    for run, compared in enumerate(answer.runs):
        others = [other for other in range(runs) if other != run and not answer.runs[other].apart]
        truth = whole * ((run == effect.run) - float(np.mean([other == effect.run for other in others])))
        score.hold(HELD[0], compared.more, truth)
        if compared.differs >= SURE:
            right = run == effect.run and kind == "a run"
            score.sure, score.sure_wrong = score.sure + 1, score.sure_wrong + (not right)
            noticed = noticed or right
    # the first stretch begins where the last of the runs does, 2.5 s after its first fix
    begin = max(float(np.interp(2.5, track.time, track.flat[:, 0])) for track in tracks)
    ends = [(stretch.begin_m + begin, stretch.end_m + begin) for stretch in answer.stretches]
    patches = np.array([effect.share(*part) for part in ends])
    place = np.array([hill.braked * np.mean([hill.steeper(at) for at in np.linspace(*part, 11)]) for part in ends])
    place = place + patches if kind == "a patch in all runs" else place
    for number, stretch in enumerate(answer.stretches):
        score.hold(HELD[1], stretch.apart, float(place[number] - np.mean(np.delete(place, number))))
    for difference in answer.differences:
        there = kind == "a patch in one run" and difference.run == str(effect.run)
        right = there and patches[difference.stretch] > TOUCHED
        score.named, score.right = score.named + 1, score.right + right
        score.promised += difference.probability
        if difference.probability >= SURE:
            score.sure, score.sure_wrong = score.sure + 1, score.sure_wrong + (not right)
        if right:
            score.hold(HELD[2], difference.size, float(patches[difference.stretch]))
            noticed = True
    score.noticed += noticed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--days", type=int, default=200, help="days of each kind")
    parser.add_argument("--runs", type=int, default=5, help="runs of a day")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"| what differs | days | {' | '.join(HELD)} | noticed | named right (promised) | sure and wrong |")
    print("|---|---|---|---|---|---|---|---|")
    for number, kind in enumerate(KINDS):
        score = Score()
        for day in range(options.days):
            judge(score, (options.seed, number, day), kind, options.runs)
        print(score.row(kind), flush=True)


if __name__ == "__main__":
    main()
