"""Turns of a run, from its path or from its course over time.

A turn is delimited by two transitions, where the turn's radius is largest (paper, "Quantitative analysis"): the course
over ground has an extremum there.  Extrema count when the course changes enough on both of their sides: by
20 or 25°, so that noise of a track makes no turn, and by ``LEAST_SHARE`` of the run's usual turn, so that a
hesitation makes none either.  Where the skier goes straight for longer than ``LONGEST_TRANSITION``, a traverse lies
between two turns and they end where it begins.  Initiation, control and completion are three equal parts of a turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import lowpass

Side = Literal["left", "right"]
StretchKind = Literal["stop", "traverse", "fall"]
PHASES: Final = ("initiation", "control", "completion")

RATE: Final = 50.0
"""Hz at which course and speed are sampled."""
CUTOFF: Final = 1.5
"""Hz; the quickest slalom turns last 0.7 s, two of them 1.4 s, which is 0.7 Hz."""
LEAST_SHARE: Final = 0.25
"""Share of the run's median turn below which a change of course back and forth is a hesitation within a turn."""
STRAIGHT: Final = 0.2
"""Share of a turn's quickest change of course below which the skier goes straight."""
LONGEST_TRANSITION: Final = 1.5
"""s; the longest straight path that is still one transition; longer ones are a traverse."""
EDGE_AVERAGE: Final = 0.3
"""s over which edge angles are averaged before their sign is taken."""
LEAST_EDGE: Final = 0.05
"""rad of edge angle below which a ski is flat."""
LEAST_SAMPLES: Final = 4
"""Least samples of a run with turns."""
STANDING: Final = 0.5
"""m/s below which the skier stands."""
FALL_DECELERATION: Final = 7.0
"""m/s²; no skid lasts at it for ``FALL_TIME``: its friction would have to be 0.7 and more, all of it backwards."""
FALL_TIME: Final = 0.4
FALL_SPEED: Final = 3.0
"""m/s; least loss of speed in a fall."""


@dataclass(frozen=True)
class Least:
    """Change of course (rad) that makes a turn, and the share of it that makes one which start or end cut off."""

    angle: float
    cut: float


_OF_PATH: Final = Least(float(np.radians(20.0)), 1.0)
"""A traverse that drifts turns by less; a path's course is least certain at its ends."""
_OF_COURSE: Final = Least(float(np.radians(25.0)), 0.5)
"""A telephone that slips, and a body that twists, turn by less; a gyroscope is as certain at the ends as elsewhere."""


@dataclass(frozen=True)
class Turn:
    """One turn, between two transitions.

    side : direction of the turn, seen by the skier; its outside ski is the other one
    start, end : s, the transitions
    complete : False where the recording, a traverse or a stop cuts it off, so that it has no transition at one end
    """

    side: Side
    start: float
    end: float
    complete: bool

    @property
    def duration(self) -> float:
        """Duration (s)."""
        return self.end - self.start

    @property
    def phases(self) -> dict[str, tuple[float, float]]:
        """Begin and end (s) of each phase."""
        bounds = np.linspace(self.start, self.end, len(PHASES) + 1)
        return {name: (float(a), float(b)) for name, a, b in zip(PHASES, bounds[:-1], bounds[1:], strict=True)}


@dataclass(frozen=True)
class Stretch:
    """An interval (s) in which the skier does not turn: stands, goes straight, or has fallen."""

    kind: StretchKind
    start: float
    end: float


@dataclass(frozen=True)
class Turns:
    """All turns in order, and the stretches between them.

    course : time (n,) s and course (n,) rad of a sensor that shows more of it than the path does; None where none does
    """

    turns: tuple[Turn, ...]
    stretches: tuple[Stretch, ...]
    course: tuple[Array, Array] | None = field(default=None, compare=False)

    def radius(self, time: Array, path: Array) -> float:
        """Return the mean turn radius (m) of a ``path`` (n, ≥ 2) at ``time`` (n,) s, inf where it is straight."""
        if self.course is None:
            return radius(path)
        length = float(np.sum(np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)))
        first, last = np.interp(time[[0, -1]], *self.course).tolist()
        return length / abs(last - first) if last != first else float("inf")

    def linked_pairs(self) -> tuple[tuple[Turn, Turn], ...]:
        """Return pairs of complete turns that follow each other without a stretch between them, one to each side."""
        return tuple(
            (a, b)
            for a, b in pairwise(self.turns)
            if a.complete and b.complete and a.end == b.start and a.side != b.side
        )

    def labels(self, times: Array) -> tuple[Array, list[str], list[str]]:
        """Return for each of ``times`` (n,) the number of its turn, its side and its phase.

        The number is 1, 2, …, and 0 for none; side and phase are then "".
        """
        number = np.zeros(len(times))
        sides, phases = [""] * len(times), [""] * len(times)
        for count, turn in enumerate(self.turns, 1):
            for phase, (begin, end) in turn.phases.items():
                last = phase == PHASES[-1] and turn is self.turns[-1]
                for i in np.flatnonzero((times >= begin) & ((times <= end) if last else (times < end))):
                    number[i], sides[i], phases[i] = count, turn.side, phase
        return number, sides, phases


def find_turns(time: Array, path: Array) -> Turns:
    """Find the turns of a path over ground.

    Parameters
    ----------
    time : (n,) s, rising
    path : (n, ≥ 2) m, east and north (or the slope's f and l), of the centre of mass or of an antenna
    """
    if len(time) < LEAST_SAMPLES:
        return Turns((), ())
    grid = _grid(time)
    place = lowpass(CubicSpline(time, path[:, :2])(grid), RATE, CUTOFF)
    velocity = np.gradient(place, 1.0 / RATE, axis=0)
    speed = np.linalg.norm(velocity, axis=1)
    return _turns(grid, _course(velocity, speed), speed, speed > STANDING, _OF_PATH)


def turns_of_course(time: Array, course: Array, speed: Array) -> Turns:
    """Find the turns of a known course, for instance the integral of a phone's yaw rate.

    Parameters
    ----------
    time : (n,) s, rising
    course : (n,) rad anticlockwise, unwrapped
    speed : (n,) m/s over ground; a skier whose course turns does not stand, whatever the speed
    """
    if len(time) < LEAST_SAMPLES:
        return Turns((), ())
    grid = _grid(time)
    smooth, fast = lowpass(PchipInterpolator(time, course)(grid), RATE, CUTOFF), PchipInterpolator(time, speed)(grid)
    moving = fast > STANDING
    for first, last in _runs(~moving):
        # a receiver says 0 m/s until it has places, and a telephone's first speeds come seconds late
        if float(np.ptp(smooth[first : last + 1])) >= _OF_COURSE.angle:
            moving[first : last + 1] = True
    return _turns(grid, smooth, fast, moving, _OF_COURSE)


def edge_changes(time: Array, edge_angle: Array) -> Array:
    """Find the times (s) at which the skis go from one edge to the other.

    They are not the transitions, which are extrema of the course, some 0.15 s earlier, between two turns of
    20°.

    Parameters
    ----------
    time : (n,) s, evenly spaced
    edge_angle : (n, 2) rad, of the left and the right ski
    """
    count = max(1, round(EDGE_AVERAGE / float(np.diff(time[:2])[0])))
    smooth = np.convolve(edge_angle.mean(axis=1), np.ones(count) / count, mode="same")
    edged = np.flatnonzero(np.abs(smooth) > LEAST_EDGE)
    changes = [(a, b) for a, b in pairwise(edged) if smooth[a] * smooth[b] < 0.0]
    return np.array([0.5 * (time[a] + time[b]) for a, b in changes])


def radius(path: Array) -> float:
    """Return the mean turn radius (m) of a path (n, ≥ 2): its length over its change of course; inf when straight."""
    steps = np.diff(path[:, :2], axis=0)
    course = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    turned = abs(float(course[-1] - course[0]))
    # the first and the last half of a step are in the length and not in the angle
    length = float(np.sum(np.linalg.norm(steps, axis=1))) * (len(steps) - 1) / len(steps)
    return length / turned if turned > 0.0 else float("inf")


def _grid(time: Array) -> Array:
    count = max(LEAST_SAMPLES, int(np.floor((time[-1] - time[0]) * RATE)) + 1)
    return np.asarray(time[0] + np.arange(count) / RATE)


def _course(velocity: Array, speed: Array) -> Array:
    """Return the course (n,) rad, unwrapped; where the skier stands it is meaningless and joined by a straight line."""
    index = np.arange(len(speed))
    moving = speed > STANDING
    if not np.any(moving):
        return np.zeros(len(speed))
    course = np.unwrap(np.arctan2(velocity[moving, 1], velocity[moving, 0]))
    return np.asarray(np.interp(index, index[moving], course), dtype=np.float64)


def _turns(time: Array, course: Array, speed: Array, moving: NDArray[np.bool_], least: Least) -> Turns:
    turns: list[Turn] = []
    stretches: list[Stretch] = []
    falls = list(_falls(time, speed))
    for fall in falls:
        moving = moving & ~((time >= fall.start) & (time <= fall.end))
    for first, last in _runs(~moving):
        start = float(time[first])
        if not any(fall.start <= start <= fall.end for fall in falls):
            stretches.append(Stretch("stop", start, float(time[last])))
    for first, last in _runs(moving):
        if last - first >= LEAST_SAMPLES:
            part = slice(first, last + 1)
            run_turns, traverses = _turns_of_run(time[part], course[part], least)
            turns += run_turns
            stretches += traverses
    stretches += falls
    return Turns(tuple(turns), tuple(sorted(stretches, key=lambda stretch: stretch.start)))


def _falls(time: Array, speed: Array) -> Iterator[Stretch]:
    """Yield where the speed falls faster than in any skid, until the skier moves again, or to the end."""
    slowing = -np.gradient(speed, 1.0 / RATE) > FALL_DECELERATION
    for first, last in _runs(slowing):
        if time[last] - time[first] >= FALL_TIME and speed[first] - speed[last] >= FALL_SPEED:
            moving_again = np.flatnonzero(speed[last:] > max(STANDING, speed[last]) + FALL_SPEED)
            until = last + int(moving_again[0]) if len(moving_again) else len(time) - 1
            yield Stretch("fall", float(time[first]), float(time[until]))


def _turns_of_run(time: Array, course: Array, least: Least) -> tuple[list[Turn], list[Stretch]]:
    """Return turns and traverses of one run without a stop."""
    rate = np.gradient(course, time)
    pieces = list(pairwise(_transitions(course, least)))
    turning = [piece for a, b in pieces for piece in _split_at_traverses(course, rate, (a, b), least.angle)]
    if len(turning) == 1:
        turning = [(a, b) for a, b in turning if abs(course[b] - course[a]) >= least.angle]
    ends = [_active(rate, a, b) for a, b in turning]
    turns: list[Turn] = []
    stretches: list[Stretch] = []
    before = 0
    joined = False
    for i, (a, b) in enumerate(turning):
        begins, stops = ends[i]
        if not joined and time[begins] - time[before] > LONGEST_TRANSITION:
            stretches.append(Stretch("traverse", float(time[before]), float(time[begins])))
            start, cut = begins, True
        elif joined:
            start, cut = a, False
        else:
            start, cut = max(a, before), a == 0
        following = i + 1 < len(turning)
        joined = following and time[ends[i + 1][0]] - time[stops] <= LONGEST_TRANSITION
        last = b if joined or time[b] - time[stops] <= LONGEST_TRANSITION else stops
        turns.append(
            Turn(
                side="left" if course[b] > course[a] else "right",
                start=float(time[start]),
                end=float(time[last]),
                complete=not cut and (joined or 0 < last < len(time) - 1) and last == b,
            )
        )
        before = last
    if len(time) and time[-1] - time[before] > LONGEST_TRANSITION:
        stretches.append(Stretch("traverse", float(time[before]), float(time[-1])))
    return turns, stretches


def _transitions(course: Array, least: Least) -> list[int]:
    """Return the indices of the ends and of every transition between them.

    The least change of course rises with the run's own turns, until the turns that it leaves are all larger.  A turn
    that start or end cuts off needs its share of that, else it belongs to its neighbour.
    """
    angle = least.angle
    while True:
        bounds = _changes_of_side(course, angle)
        while len(bounds) > 2 and abs(course[bounds[1]] - course[bounds[0]]) < least.cut * angle:
            del bounds[1]
        while len(bounds) > 2 and abs(course[bounds[-1]] - course[bounds[-2]]) < least.cut * angle:
            del bounds[-2]
        whole = np.abs(np.diff(course[bounds]))[1:-1]
        usual = LEAST_SHARE * float(np.median(whole)) if len(whole) else 0.0
        if usual <= angle:
            return bounds
        angle = usual


def _changes_of_side(course: Array, least: float) -> list[int]:
    """Return the indices of the ends and of the changes of side between them.

    Of all sequences of sides the most likely is taken (Viterbi): it has the largest sum of changes of course to the
    turns' own sides, less ``least`` for each change of side.  So a turn changes the course by more than ``least``, and
    one that the run's start or end cuts off by more than half of it.
    """
    flat = np.flatnonzero(np.diff(np.sign(np.diff(course)))) + 1
    extrema = np.unique(np.r_[0, flat, len(course) - 1])
    rises = np.diff(course[extrema])
    gains = np.stack([rises, -rises], axis=1)
    best, changed = gains[0], np.zeros((len(rises), 2), dtype=np.bool_)
    for i in range(1, len(rises)):
        after_change = best[::-1] - least
        changed[i] = after_change > best
        best = np.where(changed[i], after_change, best) + gains[i]
    side, bounds = int(np.argmax(best)), [len(course) - 1]
    for i in range(len(rises) - 1, 0, -1):
        if changed[i, side]:
            bounds.append(int(extrema[i]))
            side = 1 - side
    return [0, *bounds[::-1]]


def _split_at_traverses(
    course: Array, rate: Array, piece: tuple[int, int], least_angle: float
) -> list[tuple[int, int]]:
    """Split a change of course to one side where the skier goes straight for longer than turning, in its middle.

    The pieces are two turns to the same side with a traverse between them.  A shorter pause belongs to the turn.
    """
    first, last = piece
    quick = np.abs(rate[first : last + 1]) > STRAIGHT * np.max(np.abs(rate[first : last + 1]))
    pieces = list(_runs(quick))
    cuts = [first]
    for (_, stop), (begin, _) in pairwise(pieces):
        straight, turning = begin - stop, int(np.count_nonzero(quick[cuts[-1] - first :]))
        slowest = first + stop + int(np.argmin(np.abs(rate[first + stop : first + begin])))
        least = float(np.min(np.abs(course[[cuts[-1], last]] - course[slowest])))
        if straight > max(LONGEST_TRANSITION * RATE, turning) and least >= least_angle:
            cuts.append(slowest)
    cuts.append(last)
    return list(pairwise(cuts))


def _active(rate: Array, first: int, last: int) -> tuple[int, int]:
    """Return first and last index between two bounds where the skier turns and does not go straight."""
    part = np.abs(rate[first : last + 1])
    quick = np.flatnonzero(part > STRAIGHT * np.max(part))
    return first + int(quick[0]), first + int(quick[-1])


def _runs(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield first and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        yield int(first), int(after) - 1
