"""The turns of the skis against those of the track: a clock that is off, or runs at another rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.cross_checks.turning import TrackTurning, direction_of_skis, turning_of_track

_RATES: Final = np.exp(np.linspace(np.log(0.7), np.log(1.0 / 0.7), 73))
"""Factors between two clocks that are tried, 1 % apart: 25 frames a second for 30, 60 for 50."""
_LATEST: Final = 4.0
_STEP: Final = 0.1
"""Largest offset of the clocks, s, that is tried, and the steps."""
_MOST: Final = 400
"""Maximum number of fixes that are compared."""
_FEWEST: Final = 8
_SHORTEST: Final = 6.0
"""Least duration, s, over which turns are compared: one turn alone fits at any pace."""
_FEWEST_TURNS: Final = 3
"""Least number of turns that are compared."""
_STRAIGHT: Final = 0.5
"""Sideways acceleration, m/s², below which a track is straight."""
_COVERED: Final = 0.7
"""Share of the fixes that has to lie within the motion for a pair of rate and offset to count."""
_SKID: Final = (-0.12, 0.0)
"""Range of the angle by which skis point out of their course, clockwise, rad for each m/s² of acceleration to the left:
-0.11 in a wedge, -0.01 where they carve.
"""
_LEAST_TURNED: Final = float(np.deg2rad(8.0))
"""Standard deviation of the course, rad, below which a run has no turns to compare."""
EXPLAINED: Final = 0.3
"""Share of the skis' turning that may be left unexplained where the clocks agree."""
_AS_GOOD: Final = 2.0
"""Ratio to the least that is left within which two offsets are as good."""
_TURN: Final = 0.5
"""Distance of two offsets, s, between which no turn lies."""
_BETTER: Final = 3.0
"""Ratio of what is left with the clocks as they are to what the best clocks leave, from which on these are believed."""
_LEAST_RATE: Final = 0.03
LEAST_OFFSET: Final = 0.6
"""Smallest errors of rate and offset (s) that are reported: skis turn up to 0.25 s before the course."""


@dataclass(frozen=True)
class Pace:
    """How the turns of skis and track fit: the share of the skis' turning that the track leaves unexplained.

    as_is : with the clocks as they are
    offset, with_offset : s, the offset that leaves least, and what it leaves
    rate, with_rate : the factor of the motion's time that leaves least, with its own offset, and what is left
    """

    as_is: float
    offset: float
    with_offset: float
    rate: float
    with_rate: float


class TurningPace:
    """Motion and fixes that turn at different times, or at a different pace."""

    compares = "turns of the skis in the capture with those of the track: offset and rate of the clocks"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a doubt with the best rate or offset, where it fits far better than the clocks as they are."""
        pace = pace_of_turns(evidence)
        if pace is None:
            return ()
        path = evidence.files["motion"]
        off_pace = abs(np.log(pace.rate)) > _LEAST_RATE and pace.with_rate * _BETTER < pace.with_offset
        if off_pace and pace.with_rate < EXPLAINED:
            problem = f"motion and fixes do not turn at the same pace: the best factor of its time is {pace.rate:.2f}"
            return (Finding(path, "", problem, "check the frame rate (Frame Time) and the fixes' times"),)
        late = abs(pace.offset) > LEAST_OFFSET and pace.with_offset * _BETTER < pace.as_is
        if late and pace.with_offset < EXPLAINED:
            words = "later" if pace.offset > 0.0 else "earlier"
            problem = f"the skis turn like the track {abs(pace.offset):.1f} s {words} than by the clocks"
            return (Finding(path, "", problem, f"check time_offset_s: add {pace.offset:+.1f} s to that of [motion]"),)
        return ()


def pace_of_turns(evidence: Evidence) -> Pace | None:
    """Compare the turns of skis and track; None where there are none to compare."""
    bvh, gps = evidence.bvh, evidence.gps
    if bvh is None or gps is None:
        return None
    track = turning_of_track(gps, evidence.start, evidence.stop)
    every = 1 + len(track.time) // _MOST
    track = TrackTurning(track.time[::every], track.course[::every], track.to_left[::every])
    if len(track.time) < _FEWEST or np.ptp(track.time) < _SHORTEST or np.std(track.course) < _LEAST_TURNED:
        return None
    turns = 1 + np.count_nonzero(np.diff(np.sign(track.to_left[np.abs(track.to_left) > _STRAIGHT])))
    if turns < _FEWEST_TURNS:
        return None
    offsets = np.arange(-_LATEST, _LATEST + 0.5 * _STEP, _STEP)
    skis, time = direction_of_skis(bvh), bvh.time
    none = int(np.argmin(np.abs(_RATES - 1.0)))
    left = np.array([_left(track, time, skis, float(rate), offsets) for rate in _RATES])
    # even turns fit again a turn later: the smallest offset of about the best ones is meant
    near = np.flatnonzero(left[none] <= _AS_GOOD * np.min(left[none]))
    around = np.abs(offsets - offsets[near[np.argmin(np.abs(offsets[near]))]]) <= _TURN
    best = int(np.argmin(np.where(around, left[none], np.inf)))
    rate, _ = np.unravel_index(int(np.argmin(left)), left.shape)
    return Pace(
        as_is=float(left[none, int(np.argmin(np.abs(offsets)))]),
        offset=float(offsets[best]),
        with_offset=float(left[none, best]),
        rate=float(_RATES[rate]),
        with_rate=float(np.min(left)),
    )


def _left(track: TrackTurning, time: Array, skis: Array, rate: float, offsets: Array) -> Array:
    """Return the share of the skis' turning that the track leaves unexplained, for each of the offsets (m,).

    Skis skid: they turn farther than the course, and into the turn as the track accelerates.  So their direction is
    regressed on the course and on the sideways acceleration, within what skidding does (``_SKID``); without these
    bounds, even turns would be explained at any offset.
    """
    at = time[0] + (track.time[None, :] - time[0] - offsets[:, None]) / rate
    inside = ((at >= time[0]) & (at <= time[-1])).astype(float)
    count = np.maximum(np.sum(inside, axis=1), 1.0)

    def centred(values: Array) -> Array:
        return np.asarray(inside * (values - (np.sum(inside * values, axis=1) / count)[:, None]))

    turned = centred(np.interp(at, time, skis))
    course = centred(np.broadcast_to(track.course, inside.shape))
    pull = centred(np.broadcast_to(track.to_left, inside.shape))
    cc, ca, aa = (np.sum(one * two, axis=1) for one, two in ((course, course), (course, pull), (pull, pull)))
    tc, ta, tt = (np.sum(turned * other, axis=1) for other in (course, pull, turned))
    skid = np.clip((ta * cc - tc * ca) / np.maximum(aa * cc - ca**2, 1e-12), *_SKID)
    gain = np.maximum((tc - skid * ca) / np.maximum(cc, 1e-12), 0.0)  # skis turn with the course, not against it
    left = tt - 2.0 * (gain * tc + skid * ta) + gain**2 * cc + 2.0 * gain * skid * ca + skid**2 * aa
    share = left / np.maximum(tt, 1e-12)
    return np.where(count >= _COVERED * len(track.time), share, 1.0)
