"""Descents of a day: a long track split at lifts, pauses and losses of the receiver.

Turning points of the height, with a hysteresis beyond its noise, separate ways down from ways up.  A way down is cut
where the skier stands for long or the receiver was lost, and its ends are cut to where the skier moves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, Literal

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.repairs import Mask

Kind = Literal["run", "too short", "lift", "pause", "no fixes"]

CLIMB: Final = 12.0
"""Rise of the height, m, that ends a descent: beyond the wander of telephones' heights, below the shortest lifts."""
LEAST_DROP: Final = 25.0
"""Vertical, m, from which on a way down is a run: twice the wander of telephones' heights."""
LEAST_TIME: Final = 10.0
"""Duration, s, from which on a way down is a run: some five turns."""
PAUSE: Final = 60.0
"""Time of standing, s, that ends a run; a skier who waits for others at the edge of a slope stands for less."""
LOST: Final = 60.0
"""Time without fixes, s, in which the skier moved on, that ends a run: more than ten turns are unknown."""
STANDING: Final = 1.0
"""Speed, m/s, below which a skier stands: a receiver at rest wanders by half of it, a queue moves more slowly."""
_SMOOTH: Final = 5.0
"""Time over which a speed is averaged, s: receivers' noise is half a metre per second then."""
_COASTING: Final = 2.0
"""Speed, m/s, down to which a skier still coasts at the bottom; surface lifts draw more slowly."""
_SLOW_SHARE: Final = 0.1
"""Share of a run's high speed (its 95th percentile) below which its ends are walked and not skied."""


@dataclass(frozen=True)
class Piece:
    """A part of a track.

    kind : whether it is a run, and if not what it is
    first, last : its fixes, both included
    """

    kind: Kind
    first: int
    last: int


def split_day(time: Array, flat: Array, height: Array) -> list[Piece]:
    """Split a track into runs and what is between them, in order of time.

    Parameters
    ----------
    time : (n,) s, rising;  flat : (n, 2) m over ground;  height : (n,) m
    """
    speed = averaged_speed(time, flat)
    stands, lost = _idle_steps(time, flat, speed)
    pieces: list[Piece] = []
    for start, stop in _with_run_outs(height, speed, list(_ways(height))):
        drop = float(height[start] - height[stop])
        for kind, first, last in _stretches(time, stands, lost, start, stop):
            if kind == "move":
                pieces += _moving(time, height, speed, first, last) if drop > CLIMB else [Piece("lift", first, last)]
            else:
                pieces.append(Piece(kind, first, last))
    return _joined(height, pieces)


def averaged_speed(time: Array, flat: Array) -> Array:
    """Return the speed (n,) m/s over ground of a track, averaged over ``_SMOOTH``."""
    before, after = (np.clip(time + shift, time[0], time[-1]) for shift in (-0.5 * _SMOOTH, 0.5 * _SMOOTH))
    moved = np.stack([np.interp(after, time, axis) - np.interp(before, time, axis) for axis in flat.T], axis=1)
    return np.asarray(np.linalg.norm(moved, axis=1) / np.maximum(after - before, 1e-9))


def _ways(height: Array) -> Iterator[tuple[int, int]]:
    """Yield the first and last fix of every way down and up between the turning points of the height."""
    turns, direction, top, bottom = [0], 0, 0, 0
    for at in range(1, len(height)):
        if direction >= 0 and height[at] > height[top]:
            top = at
        if direction <= 0 and height[at] < height[bottom]:
            bottom = at
        if direction >= 0 and height[top] - height[at] > CLIMB:
            turns.append(top)
            direction, bottom = -1, at
        elif direction <= 0 and height[at] - height[bottom] > CLIMB:
            turns.append(bottom)
            direction, top = 1, at
    turns += [{1: top, -1: bottom, 0: 0}[direction], len(height) - 1]
    yield from ((start, stop) for start, stop in pairwise(turns) if stop > start)


def _with_run_outs(height: Array, speed: Array, ways: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the ways with each run-out, on which a skier coasts level or up from the lowest fix, in the way down."""
    starts, stops = ([way[end] for way in ways] for end in (0, 1))
    for i, (start, lowest) in enumerate(ways[:-1]):
        if height[start] - height[lowest] > CLIMB:
            beyond = slice(lowest, ways[i + 1][1])
            slow = (speed[beyond] < _COASTING) | (height[beyond] > height[lowest] + CLIMB)
            stops[i] = starts[i + 1] = lowest + (int(np.argmax(slow)) if np.any(slow) else 0)
    return [(start, stop) for start, stop in zip(starts, stops, strict=True) if stop > start]


def _idle_steps(time: Array, flat: Array, speed: Array) -> tuple[Mask, Mask]:
    """Return in which steps (n - 1) from fix to fix the skier stands, and in which the receiver was lost."""
    step = np.diff(time)
    straight = np.linalg.norm(np.diff(flat, axis=0), axis=1) / step
    slow = (speed[1:] < STANDING) & (speed[:-1] < STANDING)
    stands = np.where(step > _SMOOTH, straight < STANDING, slow)
    return np.asarray(stands, bool), np.asarray(~stands & (step > LOST))


def _stretches(
    time: Array, stands: Mask, lost: Mask, start: int, stop: int
) -> Iterator[tuple[Literal["move", "pause", "no fixes"], int, int]]:
    """Yield what a way consists of: long pauses, losses of the receiver, and motion between them."""
    state = np.where(lost[start:stop], 2, stands[start:stop].astype(int))
    ends = start + np.r_[0, np.flatnonzero(np.diff(state)) + 1, len(state)]
    moving = start
    for first, last in pairwise(ends.tolist()):
        idle = state[first - start]
        if idle == 2 or (idle == 1 and time[last] - time[first] >= PAUSE):
            if first > moving:
                yield "move", moving, first
            yield "no fixes" if idle == 2 else "pause", first, last
            moving = last
    if stop > moving:
        yield "move", moving, stop


def _moving(time: Array, height: Array, speed: Array, first: int, last: int) -> list[Piece]:
    """Return a run without what is walked at its ends, and those; or say that it is too short."""
    within = speed[first : last + 1]
    fast = first + np.flatnonzero(within > max(STANDING, _SLOW_SHARE * float(np.percentile(within, 95.0))))
    if len(fast) < 2:
        return [Piece("pause", first, last)]
    start, stop = int(fast[0]), int(fast[-1])
    whole = height[start] - height[stop] >= LEAST_DROP and time[stop] - time[start] >= LEAST_TIME
    ends = [Piece("pause", first, start), Piece("run" if whole else "too short", start, stop)]
    return [piece for piece in (*ends, Piece("pause", stop, last)) if piece.last > piece.first]


def _joined(height: Array, pieces: list[Piece]) -> list[Piece]:
    """Return the pieces with level motion counted as pauses, slow rises as lifts, and equal neighbours as one."""
    joined: list[Piece] = []
    for piece in pieces:
        rise = float(height[piece.last] - height[piece.first])
        kind = piece.kind
        if kind in ("lift", "too short") and abs(rise) < 0.5 * CLIMB:
            kind = "pause"
        elif kind == "pause" and rise > CLIMB:  # a moving carpet is as slow as a queue
            kind = "lift"
        if joined and joined[-1].kind == kind and kind in ("pause", "lift"):
            joined[-1] = replace(joined[-1], last=piece.last)
        else:
            joined.append(replace(piece, kind=kind))
    return joined
