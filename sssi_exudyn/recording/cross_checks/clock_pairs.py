"""What two instruments see of the same turns: the comparisons that show the rate of one clock on another.

A skier in balance leans into a turn as the track accelerates, the feet carry gravity and that acceleration, and the
outside foot carries more the more the skier leans.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.recording.cross_checks.check import Evidence
from sssi_exudyn.recording.cross_checks.turning import TrackTurning, direction_of_skis, turning_of_track, window_of
from sssi_exudyn.recording.instruments.bvh import joint_positions, world_rotations
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.slope_and_heading import COARSE, local_fit

_MOST: Final = 400
"""Maximum number of moments that are compared."""
_FEWEST: Final = 8
_SHORTEST: Final = 6.0
"""Least duration, s, over which turns are compared: one turn alone fits at any pace."""
_FEWEST_TURNS: Final = 3
"""Least number of turns that are compared."""
_STRAIGHT: Final = 0.5
"""Sideways acceleration, m/s², below which a track is straight."""
_LEAST_TURNED: Final = float(np.deg2rad(8.0))
"""Standard deviation of the course, rad, below which a run has no turns to compare."""
_COVERED: Final = 0.7
"""Share of the moments that has to lie within the other instrument's time for a pair of rate and offset to count."""
_WINDOW: Final = 0.5
"""Half width, s, of the fits from which fixes of 2 cm noise are differentiated twice; capture and loads alike."""
_CAPTURE_STEP: Final = 0.04
"""Least step of a capture and of loads, s, for what is smoothed over half a second."""
_ABOVE_HIPS: Final = 0.1
"""Height of a skier's centre of mass above the hips' joint, m."""
_SKID: Final = (-0.12, 0.0)
"""Range of the angle by which skis point out of their course, clockwise, rad for each m/s² of acceleration to the left:
-0.11 in a wedge, -0.01 where they carve.
"""


@dataclass(frozen=True)
class SkisAlongCourse:
    """The direction of the skis in the capture, predicted by the course of the track.

    Skis skid: they turn farther than the course, and into the turn as the track accelerates.  So their direction is
    regressed on the course and on the sideways acceleration, within what skidding does (``_SKID``); without these
    bounds, even turns would be explained at any offset.
    """

    track: TrackTurning
    time: Array
    skis: Array
    floor: float = 0.012
    """Skidding changes from turn to turn: by 1.05 % at most in 23 recordings whose clocks agree."""

    @property
    def middle(self) -> float:
        """Return the middle of the compared fixes, s."""
        return 0.5 * float(self.track.time[0] + self.track.time[-1])

    @property
    def span(self) -> float:
        """Return the duration of the compared fixes, s."""
        return float(np.ptp(self.track.time))

    def left(self, rate: float, offsets: Array) -> Array:
        """Return the share of the skis' turning that the track leaves unexplained."""
        at, inside = _moments(self.track.time, self.middle, rate, offsets, self.time)
        count = np.maximum(np.sum(inside, axis=1), 1.0)

        def centred(values: Array) -> Array:
            return np.asarray(inside * (values - (np.sum(inside * values, axis=1) / count)[:, None]))

        turned = centred(np.interp(at, self.time, self.skis))
        course = centred(np.broadcast_to(self.track.course, inside.shape))
        pull = centred(np.broadcast_to(self.track.to_left, inside.shape))
        cc, ca, aa = (np.sum(one * two, axis=1) for one, two in ((course, course), (course, pull), (pull, pull)))
        tc, ta, tt = (np.sum(turned * other, axis=1) for other in (course, pull, turned))
        skid = np.clip((ta * cc - tc * ca) / np.maximum(aa * cc - ca**2, 1e-12), *_SKID)
        gain = np.maximum((tc - skid * ca) / np.maximum(cc, 1e-12), 0.0)  # skis turn with the course, not against it
        left = tt - 2.0 * (gain * tc + skid * ta) + gain**2 * cc + 2.0 * gain * skid * ca + skid**2 * aa
        share = left / np.maximum(tt, 1e-12)
        return np.where(count >= _COVERED * inside.shape[1], share, 1.0)


@dataclass(frozen=True)
class _ComparedMoments:
    """The moments at which two instruments are compared: ``time`` (n,) s, on the clock that counts as right."""

    time: Array

    @property
    def middle(self) -> float:
        """Return the middle of the compared moments, s."""
        return 0.5 * float(self.time[0] + self.time[-1])

    @property
    def span(self) -> float:
        """Return the duration of the compared moments, s."""
        return float(np.ptp(self.time))


@dataclass(frozen=True)
class LeanOfTurns(_ComparedMoments):
    """The track's sideways acceleration, predicted by the lean of the skier in the capture.

    Attributes
    ----------
    time, acceleration : (n,) s and (n, 3) m/s² east-north-up of the antenna, from the fixes
    capture_time : (k,) s
    azimuth : (k,) rad of the skis, clockwise from north
    body : (k, 3) m east-north-up, the centre of mass from the middle of both ski bases
    body_acceleration : (k, 3) m/s² of the centre of mass against the antenna
    """

    acceleration: Array
    capture_time: Array
    azimuth: Array
    body: Array
    body_acceleration: Array
    floor: float = 0.005
    """Where a skier does not stand in balance: by 0.4 % (rms), by 1.0 % at most in 23 recordings whose clocks agree."""

    def left(self, rate: float, offsets: Array) -> Array:
        """Return the share of the sideways acceleration that the lean leaves unexplained."""
        at, inside = _moments(self.time, self.middle, rate, offsets, self.capture_time)

        def of_capture(values: Array) -> Array:
            return np.stack([np.interp(at, self.capture_time, column) for column in values.T], axis=-1)

        azimuth, body = np.interp(at, self.capture_time, self.azimuth), of_capture(self.body)
        total = self.acceleration + of_capture(self.body_acceleration) / rate**2
        to_right = np.stack([np.cos(azimuth), -np.sin(azimuth)], axis=-1)
        lean = np.sum(body[..., :2] * to_right, axis=-1) / body[..., 2]
        pull = np.sum(total[..., :2] * to_right, axis=-1) / np.maximum(total[..., 2] + GRAVITY, 0.2 * GRAVITY)
        return _unexplained(pull, lean, inside)


@dataclass(frozen=True)
class LoadsOf(_ComparedMoments):
    """Loads under the feet, predicted by what another instrument sees.

    Attributes
    ----------
    time, predictor : (n,) s of that instrument and what it sees
    load_time, load : (k,) s and what the insoles see of it
    """

    predictor: Array
    load_time: Array
    load: Array
    floor: float

    def left(self, rate: float, offsets: Array) -> Array:
        """Return the share of the loads that stays unexplained."""
        at, inside = _moments(self.time, self.middle, rate, offsets, self.load_time)
        load = np.interp(at, self.load_time, self.load)
        return _unexplained(load, np.broadcast_to(self.predictor, load.shape), inside)


def skis_along_course(evidence: Evidence) -> SkisAlongCourse | None:
    """Return the comparison of capture and fixes by the skis' direction; None where there are no turns."""
    track = turns_of_track(evidence)
    if track is None or evidence.bvh is None:
        return None
    return SkisAlongCourse(track, evidence.bvh.time, direction_of_skis(evidence.bvh))


def lean_of_turns(evidence: Evidence) -> LeanOfTurns | None:
    """Return the comparison of capture and fixes by balance; None without turns, and without a heading."""
    gps, heading = evidence.gps, _heading(evidence)
    track = turns_of_track(evidence)
    if gps is None or evidence.bvh is None or heading is None or track is None:
        return None
    body = _Body.of(evidence, heading)
    chosen = np.isin(gps.time, track.time)
    return LeanOfTurns(
        gps.time[chosen], acceleration_of(gps)[chosen], body.time, body.azimuth, body.centre, body.acceleration
    )


def loads_of_acceleration(evidence: Evidence) -> LoadsOf | None:
    """Return the comparison of insoles and fixes by the total load; None without turns."""
    gps, insoles, track = evidence.gps, evidence.insoles, turns_of_track(evidence)
    if gps is None or insoles is None or track is None:
        return None
    total, heading = acceleration_of(gps) + [0.0, 0.0, GRAVITY], _heading(evidence)
    if evidence.bvh is not None and heading is not None:
        body = _Body.of(evidence, heading)
        total += np.column_stack([np.interp(gps.time, body.time, axis) for axis in body.acceleration.T])
    chosen = np.isin(gps.time, track.time)
    time, load = _smooth(insoles.time, insoles.left + insoles.right)
    # by 0.2 % at most in the recordings whose clocks agree
    return LoadsOf(gps.time[chosen], np.linalg.norm(total, axis=1)[chosen], time, load, floor=0.002)


def loads_of_lean(evidence: Evidence) -> LoadsOf | None:
    """Return the comparison of insoles and capture by the left foot's share of the load; None without turns."""
    bvh, insoles = evidence.bvh, evidence.insoles
    if bvh is None or insoles is None:
        return None
    body = _Body.of(evidence, _heading(evidence) or 0.0)
    to_right = np.column_stack([np.cos(body.azimuth), -np.sin(body.azimuth)])
    lean = np.sum(body.centre[:, :2] * to_right, axis=1) / body.centre[:, 2]
    inside = (body.time >= evidence.start) & (body.time <= evidence.stop)
    lean, capture_time = lean[inside], body.time[inside]
    leaning = lean - np.mean(lean) if len(lean) else lean
    sides = np.sign(leaning[np.abs(leaning) > _STRAIGHT / GRAVITY])
    if len(lean) < _FEWEST or np.ptp(capture_time) < _SHORTEST or 1 + np.count_nonzero(np.diff(sides)) < _FEWEST_TURNS:
        return None
    share = (insoles.left - insoles.right) / np.maximum(insoles.left + insoles.right, 1.0)
    time, load = _smooth(insoles.time, share)
    every = 1 + len(lean) // _MOST
    # by 1.8 % at most in the recordings whose clocks agree: a skier also shifts the weight without leaning
    return LoadsOf(capture_time[::every], lean[::every], time, load, floor=0.009)


def turns_of_track(evidence: Evidence) -> TrackTurning | None:
    """Return the turns of the track at so many moments as are compared; None where it has hardly any."""
    if evidence.gps is None:
        return None
    track = turning_of_track(evidence.gps, evidence.start, evidence.stop)
    every = 1 + len(track.time) // _MOST
    track = TrackTurning(track.time[::every], track.course[::every], track.to_left[::every])
    if len(track.time) < _FEWEST or np.ptp(track.time) < _SHORTEST or np.std(track.course) < _LEAST_TURNED:
        return None
    turns = 1 + np.count_nonzero(np.diff(np.sign(track.to_left[np.abs(track.to_left) > _STRAIGHT])))
    return track if turns >= _FEWEST_TURNS else None


def acceleration_of(gps: Gps) -> Array:
    """Return the antenna's acceleration (n, 3) m/s² east-north-up, level where only a receiver's own speed is exact."""
    sigma, step = float(np.median(gps.sigma)), float(np.median(np.diff(gps.time)))
    if sigma > COARSE and gps.speed is not None and gps.course is not None:
        velocity = np.column_stack([gps.speed * np.sin(gps.course), gps.speed * np.cos(gps.course)])
        level = local_fit(gps.time, velocity, max(_WINDOW, 2.0 * step))[1]
        return np.column_stack([level, np.zeros(len(level))])
    return np.asarray(local_fit(gps.time, gps.enu, window_of(gps, _WINDOW, 1.0))[2])


@dataclass(frozen=True)
class _Body:
    """The centre of mass in the capture, smoothed and east-north-up; as ``LeanOfTurns`` has it."""

    time: Array
    azimuth: Array
    centre: Array
    acceleration: Array

    @staticmethod
    def of(evidence: Evidence, heading: float) -> _Body:
        bvh, gps = evidence.bvh, evidence.gps
        assert bvh is not None
        world = world_rotations(bvh)
        joints = joint_positions(bvh, world)
        down = np.array([0.0, -evidence.equipment.ankle_to_ski_base, 0.0])
        feet = [bvh.index(name) for name in ("LeftFoot", "RightFoot")]
        middle = 0.5 * sum(joints[:, foot] + world[:, foot] @ down for foot in feet)
        centre = np.array([0.0, _ABOVE_HIPS, 0.0]) - middle
        antenna = np.zeros_like(centre)
        if gps is not None:
            carrier = bvh.index(gps.segment)
            antenna = joints[:, carrier] + world[:, carrier] @ gps.offset - middle
        every = _every(bvh.time)
        time = bvh.time[::every]
        both = np.hstack([_level(centre, heading), _level(centre - antenna, heading)])[::every]
        value, _, second = local_fit(time, both, _WINDOW)
        azimuth = heading + direction_of_skis(bvh)[::every]
        return _Body(time, azimuth, value[:, :3], second[:, 3:] if gps is not None else np.zeros_like(value[:, 3:]))


def _level(vectors: Array, heading: float) -> Array:
    """Return vectors (n, 3) of the capture (x left, y up, z forward) east-north-up."""
    left, up, forward = vectors.T
    sine, cosine = np.sin(heading), np.cos(heading)
    return np.column_stack([forward * sine - left * cosine, forward * cosine + left * sine, up])


def _heading(evidence: Evidence) -> float | None:
    if evidence.heading is not None:
        return evidence.heading
    return None if evidence.setting.heading is None else evidence.setting.heading.value


def _every(time: Array) -> int:
    return max(1, int(_CAPTURE_STEP / float(np.median(np.diff(time)))))


def _smooth(time: Array, values: Array) -> tuple[Array, Array]:
    every = _every(time)
    return time[::every], local_fit(time[::every], values[::every, None], _WINDOW)[0, :, 0]


def _moments(time: Array, middle: float, rate: float, offsets: Array, other: Array) -> tuple[Array, Array]:
    """Return the times (m, n) of the other clock at ``time`` (n,) for each offset (m,), and 1 where it measured."""
    at = middle + (time[None, :] - middle - offsets[:, None]) / rate
    return at, ((at >= other[0]) & (at <= other[-1])).astype(float)


def _unexplained(values: Array, predictor: Array, inside: Array) -> Array:
    """Return the share (m,) of values (m, n) that a positive multiple of the predictor leaves unexplained."""
    count = np.maximum(np.sum(inside, axis=1), 1.0)

    def centred(of: Array) -> Array:
        return np.asarray(inside * (of - (np.sum(inside * of, axis=1) / count)[:, None]))

    values, predictor = centred(values), centred(predictor)
    both, own = np.sum(values * predictor, axis=1), np.sum(predictor**2, axis=1)
    total = np.maximum(np.sum(values**2, axis=1), 1e-12)
    share = 1.0 - np.maximum(both, 0.0) ** 2 / np.maximum(own * total, 1e-12)
    return np.where(count >= _COVERED * inside.shape[1], share, 1.0)
