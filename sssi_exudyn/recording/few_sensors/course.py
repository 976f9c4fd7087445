"""The skier's course from slow fixes and a fast yaw rate: lag of the receiver's clock, course, speed, acceleration.

A receiver filters its course and gives it late, a telephone by more than a second.  A gyroscope on the body is prompt,
but it turns with the body, not with the course.  Both show the same turns: the lag is where they agree best, and

    course(t) = gain · ∫ yaw rate dt + slow(t)

follows the fixes in its slow part and the gyroscope between two fixes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_array, hstack

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import lowpass
from sssi_exudyn.recording.few_sensors.attitude import solve_spline, spline_columns
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.slope_and_heading import local_fit

SLOWEST: Final = 1.0
"""Lowest speed of skiing, m/s; below it a course is noise."""
_SLOW_SHARE: Final = 0.25
"""Share of the run's high speed (its 95th percentile) below which the skier stands or walks."""
_REST: Final = 5.0
"""Longest time for which a skier may be slower on a run, s."""
_LEVEL: Final = 2.0
"""Difference of heights, m, within which a stretch counts as level."""
_LAGS: Final = (-1.0, 4.0)
"""Range of a receiver's lag, s: telephones filter over up to 2 s, clocks may differ by a second."""
_LAG_STEP: Final = 0.02
_LEAD: Final = 0.2
"""Lead of skidding skis' turns over the course, s: 0.15 and 0.24 s in recordings with a known lag."""
_FEWEST: Final = 8
"""Minimum number of fixes from which a lag, a gain and an offset are estimated."""
_SLOW_KNOTS: Final = 3.0
"""Intervals of fixes between the knots of the slow part."""
_SWING_CUTOFF: Final = 1.0
"""Cut-off of a trunk's swing, Hz; turns are slower, and the trunk's faster motion is not the skis'."""
_LEAN_CUTOFF: Final = 0.8
"""Cut-off of the lean, Hz; a body cannot balance faster: √(g/l)/2π = 0.5 Hz for a pendulum of a metre."""


@dataclass(frozen=True)
class Lag:
    """The lag of a receiver's time stamps, s, its standard deviation, and the correlation of both turnings."""

    value: float
    sigma: float
    correlation: float


@dataclass(frozen=True)
class Course:
    """The course of the skis at n instants, level.

    azimuth : (n,) rad clockwise from north, unwrapped;  speed : (n,) m/s over ground
    acceleration : (n, 3) m/s² east-north-up, without that of the height
    gain : ratio of the course's turning to the body's, None without a yaw rate
    sigma : rad, root mean square difference to the fixes' course
    """

    time: Array
    azimuth: Array
    speed: Array
    acceleration: Array
    gain: float | None
    sigma: float


def skiing_stretch(time: Array, speed: Array, height: Array) -> tuple[float, float]:
    """Return the first and last time (s) of the stretch at a skier's speed, short rests included, that goes down most.

    A way up on a lift is no skiing.  Of stretches that all are level, or lead up, the longest is taken.

    Parameters
    ----------
    speed : (n,) m/s over ground;  height : (n,) m

    Raises SssiError when no stretch of skiing lasts five seconds.
    """
    fast = np.flatnonzero(speed > max(SLOWEST, _SLOW_SHARE * float(np.percentile(speed, 95.0))))
    if len(fast) > 1:
        ends = np.flatnonzero(np.diff(time[fast]) > _REST)
        starts, stops = fast[np.r_[0, ends + 1]], fast[np.r_[ends, len(fast) - 1]]
        lasting = time[stops] - time[starts]
        down = np.where(height[starts] - height[stops] > _LEVEL, height[starts] - height[stops], 0.0)
        long = np.flatnonzero(lasting >= 5.0)
        if len(long):
            best = max(long.tolist(), key=lambda i: (down[i], lasting[i]))
            return float(time[starts[best]]), float(time[stops[best]])
    raise SssiError(f"the fixes are never faster than {SLOWEST:g} m/s for five seconds")


def note_what_is_left_out(gps: Gps, first: float, last: float) -> list[str]:
    """Return a sentence on the time before and after the stretch of skiing from ``first`` to ``last`` (s) in which the
    skier goes down as well; none where he hardly does.
    """
    inside = gps.between(first, last)
    apart = (gps.enu[gps.time <= first, 2], gps.enu[gps.time >= last, 2])
    drops = [float(heights[0] - heights[-1]) if len(heights) > 1 else 0.0 for heights in apart]
    lengths = (first - float(gps.time[0]), float(gps.time[-1]) - last)
    left_out = [
        f"{length:.0f} s {side} it, {drop:.0f} m down"
        for length, drop, side in zip(lengths, drops, ("before", "after"), strict=True)
        if length > _REST and drop > _LEVEL
    ]
    if not left_out or not np.any(inside):
        return []
    return [
        f"the run is {first:.1f} to {last:.1f} s; {' and '.join(left_out)}, are left out, as the skier is slow for more"
        f" than {_REST:g} s in between: cut the files there and import that part as a run of its own"
    ]


def velocity_of(gps: Gps) -> Array:
    """Return the velocity (n, 2) m/s, north and east, at the fixes.

    It is the receiver's own speed and course where it gives them, else the track's.
    """
    if gps.speed is not None and gps.course is not None:
        return np.asarray(gps.speed[:, None] * np.stack([np.cos(gps.course), np.sin(gps.course)], axis=1))
    # as in the estimates of the heading: the window that the noise of the fixes requires, four fixes at least
    window = max(0.8 * (float(np.median(gps.sigma)) / 0.02) ** (2.0 / 7.0), 4.0 * float(np.median(np.diff(gps.time))))
    return np.asarray(local_fit(gps.time, gps.enu, window)[1][:, [1, 0]])


def find_lag(time: Array, velocity: Array, gyro_time: Array, yaw_rate: Array) -> Lag:
    """Estimate the lag of fixes (n,) s with ``velocity`` (n, 2) m/s behind a yaw rate (m,) rad/s, left positive.

    From fix to fix the course turns by gain · (the body's turn a lag earlier).  The estimate is the lag that leaves the
    least residual.  Its standard deviation is that of least squares, plus the lead of skis that turn before the course.
    """
    course = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (yaw_rate[1:] + yaw_rate[:-1]) * np.diff(gyro_time))])
    fast = np.minimum(*np.linalg.norm([velocity[1:], velocity[:-1]], axis=2)) > SLOWEST
    lags = np.arange(*_LAGS, _LAG_STEP)
    left = np.full(len(lags), np.inf)
    for i, lag in enumerate(lags):
        pairs = fast & (time[:-1] - lag >= gyro_time[0]) & (time[1:] - lag <= gyro_time[-1])
        if np.count_nonzero(pairs) < _FEWEST:
            continue
        seen = -np.diff(course)[pairs]
        body = np.diff(np.interp(time - lag, gyro_time, turned))[pairs]
        seen, body = seen - seen.mean(), body - body.mean()
        share = max(0.0, float(body @ seen)) ** 2 / max(float(body @ body) * float(seen @ seen), 1e-12)
        left[i] = 1.0 - share  # of the course's turning: not explained by a body that turns in the same direction
        fixes = len(seen)
    if not np.any(np.isfinite(left)):
        raise SssiError(f"fewer than {_FEWEST} fixes of the skiing lie within the sensor's time")
    left = np.where(np.isfinite(left), left, 1.0)
    best = int(np.clip(np.argmin(left), 1, len(lags) - 2))
    bend = (left[best + 1] - 2.0 * left[best] + left[best - 1]) / _LAG_STEP**2
    shift = -0.5 * (left[best + 1] - left[best - 1]) / _LAG_STEP / bend if bend > 0.0 else 0.0
    variance = max(left[best], 0.0) / max(1, fixes - 3)
    sigma = float(np.sqrt(2.0 * variance / bend)) if bend > 0.0 else _LAGS[1] - _LAGS[0]
    return Lag(
        value=float(lags[best] + np.clip(shift, -_LAG_STEP, _LAG_STEP)),
        sigma=float(np.hypot(sigma, _LEAD)),
        correlation=float(np.sqrt(max(0.0, 1.0 - left[best]))),
    )


def fused_course(gps: Gps, velocity: Array, time: Array, yaw_rate: Array | None, gain: float | None = None) -> Course:
    """Return course, speed and acceleration at evenly spaced ``time`` (m,).

    Parameters
    ----------
    gps : fixes with the lag already taken off;  velocity : (n, 2) m/s north and east at them, of the skis
    yaw_rate : (m,) rad/s about up, left positive; None without a gyroscope
    gain : gain of the yaw rate; None: the best fit
    """
    speed = np.linalg.norm(velocity, axis=1)
    course = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    rate = 1.0 / float(time[1] - time[0])
    columns = np.zeros((len(gps.time), 0))
    body = np.zeros((len(time), 0))
    if yaw_rate is not None:
        smooth = lowpass(yaw_rate, rate, _SWING_CUTOFF)
        turned = -np.concatenate([[0.0], np.cumsum(0.5 * (smooth[1:] + smooth[:-1])) / rate])
        body = turned[:, None]
        columns = np.interp(gps.time, time, turned)[:, None]
    spacing = _SLOW_KNOTS * float(np.median(np.diff(gps.time)))
    pieces = max(2, round(float(time[-1] - time[0]) / max(spacing, 1.0)))
    inner = np.linspace(time[0], time[-1], pieces + 1)
    knots = np.r_[[inner[0]] * 3, inner, [inner[-1]] * 3]
    inside = gps.between(time[0], time[-1])
    at = np.clip(gps.time[inside], time[0], time[-1])  # within the knots, whatever rounding leaves
    basis = spline_columns(at, knots)
    weight = np.minimum(speed[inside] / 3.0, 1.0)  # a course is the more certain, the faster the skier
    known = course[inside]
    if gain is not None:
        known = known - gain * columns[inside].sum(axis=1)
    else:
        turning = np.asarray(columns[inside])
        if isinstance(basis, csr_array):
            basis = csr_array(hstack([basis, csr_array(turning)]))
        else:
            basis = np.hstack([basis, turning])
    count = len(knots) - 4
    bend = np.zeros((count - 2, basis.shape[1]))
    bend[:, :count] = 0.1 * np.diff(np.eye(count), 2, axis=0)  # holds the curve where fixes are slow or missing
    coefficients = solve_spline(basis, known, weight**2, bend.T @ bend)
    slow = BSpline(knots, coefficients[:count], 3)
    used = gain if gain is not None else (float(coefficients[count]) if yaw_rate is not None else 0.0)
    azimuth = slow(time) + used * body.sum(axis=1)
    apart = np.interp(at, time, azimuth) - course[inside]
    # a spline through the fixes' speeds, as smooth as turns are
    quick = lowpass(np.interp(time, gps.time, speed), rate, min(_LEAN_CUTOFF, 0.4 * rate))
    flat = quick[:, None] * np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)
    pull = lowpass(np.gradient(flat, time, axis=0), rate, _LEAN_CUTOFF)
    return Course(
        time=time,
        azimuth=azimuth,
        speed=quick,
        acceleration=np.column_stack([pull, np.zeros(len(time))]),
        gain=None if yaw_rate is None else used,
        sigma=float(np.sqrt(np.average(apart**2, weights=weight**2))),
    )
