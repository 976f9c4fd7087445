"""The runs of one descent cut at common places: what each of them shows of its energy from place to place.

Runs follow a line along the descent, the smoothed path of the run that lies in the middle.  Places on it divide the
part that all runs have into stretches.  Of every run, the time, height and speed at these places count, the way and the
air's work between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import gaussian_filter1d

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise

LONG: Final = 100.0
"""Length of a stretch, m: ten turns of a short swing, and thirty times the error of a place."""
MOST_STRETCHES: Final = 12
SHORTEST: Final = 100.0
"""m; below, two stretches are not longer than the errors of their ends allow."""
_STEP: Final = 5.0
"""m between the points of the line."""
_TURNS: Final = 20.0
"""m; standard deviation of the smoothing that takes turns out of the line."""
_BACK, _AHEAD = 20.0, 150.0
"""m back and ahead along the line within which the next fix is sought, so that a bend does not take a later part."""
_AVERAGED: Final = 2.5
"""s on either side of a place over which heights and speeds are averaged: a turn."""
_UNEVEN: Final = 0.3
"""m of height by which the ground beside the line differs anyhow: bumps and edges of the piste."""
_ACROSS: Final = 0.05
"""Slope across the line, 3°: a skier 20 m beside it is a metre higher or lower."""
_PLACES: Final = 0.5
"""Error of a place along the line over what the receiver states."""


@dataclass(frozen=True)
class Descent:
    """A run as its receiver saw it.

    time : (n,) s, rising;  flat : (n, 2) m, in axes that all runs share;  height : (n,) m;  speed : (n,) m/s over
        ground
    sigma : m, error of a place;  speed_sigma : m/s;  height_sigma, wander : independent and slow error of heights
    drag : 1/m, drag over mass and squared speed
    skier : name, whose drag area is one for all runs
    """

    time: Array
    flat: Array
    height: Array
    speed: Array
    sigma: float
    speed_sigma: float
    height_sigma: float
    wander: ExponentialNoise
    drag: float
    skier: str = ""


@dataclass(frozen=True)
class Passage:
    """A run from place to place, all in metres of height or way.

    time : (s + 1,) s at the places;  height : (s + 1,)
    off : (s + 1,) standard deviation of the height of the run's own ground there against that of the line
    kinetic, kinetic_sigma : (s + 1,) v²/2g there
    way : (s,) over ground, which is the path of the load over the weight;  air : (s,) the air's work over the weight
    height_sigma, wander, skier : of the ``Descent``
    """

    time: Array
    height: Array
    off: Array
    kinetic: Array
    kinetic_sigma: Array
    way: Array
    air: Array
    height_sigma: float
    wander: ExponentialNoise
    skier: str


def passages_of(runs: Sequence[Descent]) -> tuple[Array, list[Passage]]:
    """Return the places (s + 1,), m along the line from where all runs have begun, and each run's passage.

    Both are empty where the part that all runs have is shorter than ``SHORTEST``.
    """
    line = _line(runs)
    along = [_along(run, line) for run in runs]
    # the ends leave time to average
    inside = [
        np.interp(run.time[[0, -1]] + [_AVERAGED, -_AVERAGED], run.time, p) for run, p in zip(runs, along, strict=True)
    ]
    first, last = max(ends[0] for ends in inside), min(ends[1] for ends in inside)
    if last - first < SHORTEST:
        return np.zeros(0), []
    places = np.linspace(first, last, int(np.clip(round((last - first) / LONG), 2, MOST_STRETCHES)) + 1)
    return places - first, [_passage(run, line, progress, places) for run, progress in zip(runs, along, strict=True)]


def _line(runs: Sequence[Descent]) -> Array:
    """Return the line (k, 2) m at steps of ``_STEP``: the path of the run in the middle, without its turns."""
    shares = np.linspace(0.0, 1.0, 33)
    paths = np.array([_at_shares(run.flat, shares) for run in runs])
    apart = np.linalg.norm(paths[:, None] - paths, axis=3).mean(axis=2)
    middle = runs[int(np.argmin(apart.sum(axis=1)))].flat
    even = _at_shares(middle, np.linspace(0.0, 1.0, max(3, round(_length(middle) / _STEP) + 1)))
    margin = min(len(even) - 1, round(4.0 * _TURNS / _STEP))
    longer = np.pad(even, ((margin, margin), (0, 0)), mode="reflect", reflect_type="odd")  # the ends stay
    smooth = gaussian_filter1d(longer, _TURNS / _STEP, axis=0)[margin : margin + len(even)]
    return _at_shares(smooth, np.linspace(0.0, 1.0, max(3, round(_length(smooth) / _STEP) + 1)))


def _travelled(path: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def _length(path: Array) -> float:
    return float(_travelled(path)[-1])


def _at_shares(path: Array, shares: Array) -> Array:
    """Return the places (k, 2) m at shares of a path's length."""
    travelled = _travelled(path)
    return np.column_stack([np.interp(shares * travelled[-1], travelled, axis) for axis in path.T])


def _along(run: Descent, line: Array) -> Array:
    """Return how far (n,) m along the line each fix is; who goes back keeps what was reached."""
    travelled = _travelled(line)
    progress = np.empty(len(run.flat))
    reached = 0.0
    for i, fix in enumerate(run.flat):
        near = slice(*np.searchsorted(travelled, [reached - _BACK, reached + _AHEAD]))
        nearest = near.start + int(np.argmin(np.linalg.norm(line[near] - fix, axis=1)))
        progress[i] = _between_points(line, travelled, nearest, fix)
        reached = max(reached, progress[i])
    return np.maximum.accumulate(progress)


def _between_points(line: Array, travelled: Array, nearest: int, fix: Array) -> float:
    """Return how far along the line a fix is, projected on the line's direction at its nearest point."""
    before, after = max(nearest - 1, 0), min(nearest + 1, len(line) - 1)
    direction = (line[after] - line[before]) / max(travelled[after] - travelled[before], 1e-9)
    ahead = float((fix - line[nearest]) @ direction)
    return float(np.clip(travelled[nearest] + ahead, travelled[before], travelled[after]))


def _passage(run: Descent, line: Array, progress: Array, places: Array) -> Passage:
    keep = np.concatenate([[True], np.diff(progress) > 0.0])  # each place when it is first reached
    time = np.interp(places, progress[keep], run.time[keep])
    height = _averages(run, run.height, time)
    drop = height[0] - height[-1]
    slope = float(drop / (places[-1] - places[0]))
    longer = 1.0 + slope**2
    speed = np.sqrt(_averages(run, run.speed**2, time))
    travelled = _travelled(line)
    at_line = np.column_stack([np.interp(places, travelled, axis) for axis in line.T])
    at_fixes = np.column_stack([np.interp(time, run.time, axis) for axis in run.flat.T])
    aside = np.linalg.norm(at_fixes - at_line, axis=1)
    off = np.sqrt(_UNEVEN**2 + (_ACROSS * aside) ** 2 + (slope * _PLACES * run.sigma) ** 2)
    return Passage(
        time=time,
        height=height,
        off=off,
        kinetic=longer * speed**2 / (2.0 * GRAVITY),
        kinetic_sigma=longer * speed * run.speed_sigma / GRAVITY,  # wrong alike for the whole time of averaging
        way=_integral(run.time, run.speed, time),
        air=run.drag * longer**1.5 * _integral(run.time, run.speed**3, time) / GRAVITY,
        height_sigma=run.height_sigma,
        wander=run.wander,
        skier=run.skier,
    )


def _averages(run: Descent, values: Array, at: Array) -> Array:
    """Return the means (k,) of values (n,) over ``_AVERAGED`` before and after times (k,) within it."""
    first, last = (np.clip(at + shift, run.time[0], run.time[-1]) for shift in (-_AVERAGED, _AVERAGED))
    return np.asarray((_since_start(run.time, values, last) - _since_start(run.time, values, first)) / (last - first))


def _integral(time: Array, values: Array, at: Array) -> Array:
    """Return the integrals (k − 1,) of values (n,) at ``time`` (n,) between neighbours of ``at`` (k,)."""
    return np.diff(_since_start(time, values, at))


def _since_start(time: Array, values: Array, at: Array) -> Array:
    """Return the integral (k,) from the first time to times (k,), values in straight lines between fixes."""
    whole = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    passed = at - time[before]
    rate = (values[before + 1] - values[before]) / (time[before + 1] - time[before])
    return np.asarray(whole[before] + passed * (values[before] + 0.5 * rate * passed))
