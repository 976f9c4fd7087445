"""Slope and heading estimated from the recording itself: used where they are not given, a check where they are.

The slope is a robust plane through the track of the feet.  The heading combines two measurements with different errors,
weighted by their uncertainties: the course against the skis' direction, and the acceleration against the body's lean.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_positions, world_rotations
from sssi_exudyn.recording.instruments.gps import Gps

Complex = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]

CAPTURE_HEADING_SIGMA: Final = float(np.deg2rad(1.0))
"""Wander of an inertial capture's own heading, rad, however well its mean is known."""
_TRAVERSE_SIGMA: Final = float(np.tan(np.deg2rad(20.0)))
"""Tangent of the usual angle between the fall line and the straight line from start to end of a run."""
COARSE: Final = 0.5
"""Standard deviation of fixes, m, above which a receiver's own velocity (by Doppler shifts) is better than theirs."""
_ENOUGH: Final = 64
"""Maximum number of fixes in a window; if there are more, every second, third … is used."""
_BLOCK: Final = 1024
"""Number of windows that are fitted at once."""
_SLOW: Final = 1.5
"""Speed, m/s, below which skis point anywhere and the course is noise."""


@dataclass(frozen=True)
class Estimate:
    """A number and its standard deviation, in the same unit."""

    value: float
    sigma: float


@dataclass(frozen=True)
class SlopeEstimate:
    """Inclination and fall-line azimuth (clockwise from north), rad."""

    inclination: Estimate
    azimuth: Estimate


@dataclass(frozen=True)
class SlopeAndHeading:
    """Heading and slope as estimated from motion and fixes; None where no estimate is possible, with the reason."""

    heading: Estimate | None
    slope: SlopeEstimate | None
    why_not: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stance:
    """The input of the estimates from the capture, at the times of the fixes; BVH axes of the capture's world.

    Attributes
    ----------
    time : (n,) s, the fixes within the capture
    fixes : (n,) their indices in the Gps
    antenna : (n, 3) m, the antenna from the middle of both ski bases
    body : (n, 3) m, the hips from the middle of both ski bases
    forward : (n, 3) mean forward axis of the feet
    """

    time: Array
    fixes: np.ndarray[tuple[int, ...], np.dtype[np.intp]]
    antenna: Array
    body: Array
    forward: Array


def estimate_slope_and_heading(
    bvh: Bvh, gps: Gps, ankle_to_ski_base: float, heading: float | None = None
) -> SlopeAndHeading:
    """Estimate heading and slope from motion and fixes.

    Parameters
    ----------
    ankle_to_ski_base : m, along the foot's up axis
    heading : rad, the given azimuth of the BVH +z axis; the skis' track uses it, else the estimate
    """
    stance = stance_at_fixes(bvh, gps, ankle_to_ski_base)
    if len(stance.time) < 5:
        return SlopeAndHeading(None, None, ("fewer than five fixes lie within the motion capture",))
    why_not: list[str] = []
    estimate: Estimate | None = None
    slope: SlopeEstimate | None = None
    try:
        estimate = estimate_heading(stance, gps)
    except SssiError as error:
        why_not.append(str(error))
    azimuth = heading if heading is not None else (estimate.value if estimate is not None else 0.0)
    try:
        slope = estimate_slope(track_of_skis(stance, gps, azimuth), float(np.median(gps.sigma)))
    except SssiError as error:
        why_not.append(str(error))
    return SlopeAndHeading(estimate, slope, tuple(why_not))


def stance_at_fixes(bvh: Bvh, gps: Gps, ankle_to_ski_base: float) -> Stance:
    """Return antenna, hips and ski direction at the times of the fixes.

    Parameters
    ----------
    ankle_to_ski_base : m, from the ankle joint to the running surface along the foot's up axis
    """
    world = world_rotations(bvh)
    joints = joint_positions(bvh, world)
    down = np.array([0.0, -ankle_to_ski_base, 0.0])
    left, right, carrier = bvh.index("LeftFoot"), bvh.index("RightFoot"), bvh.index(gps.segment)
    bases = [joints[:, foot] + world[:, foot] @ down for foot in (left, right)]
    middle = 0.5 * (bases[0] + bases[1])
    antenna = joints[:, carrier] + world[:, carrier] @ gps.offset - middle
    forward = world[:, left, :, 2] + world[:, right, :, 2]
    fixes = np.flatnonzero(gps.between(bvh.time[0], bvh.time[-1]))
    time = gps.time[fixes]

    def at_fixes(values: Array) -> Array:
        return np.column_stack([np.interp(time, bvh.time, column) for column in values.T])

    return Stance(time, fixes, at_fixes(antenna), at_fixes(-middle), at_fixes(forward))


def track_of_skis(stance: Stance, gps: Gps, heading: float) -> Array:
    """Return the track (n, 3) m of the middle of both ski bases, east-north-up.

    It is the fixes less the antenna's place above the skis.  ``heading`` is the azimuth of the BVH +z axis, rad.
    """
    horizontal = _rotate(_level(stance.antenna), heading)
    above = np.column_stack([horizontal.imag, horizontal.real, stance.antenna[:, 1]])
    return gps.enu[stance.fixes] - above


def estimate_slope(track: Array, sigma: float) -> SlopeEstimate:
    """Fit the plane u = c + g·(e, n) through a track by robust least squares.

    Heights are Huber-weighted, and their noise is taken to be correlated as their residuals are.  So a drifting
    altitude widens the uncertainty.  A narrow track hardly shows the gradient across it.  There a prior takes over: the
    line from start to end departs from the fall line by 20° (one sigma).  A drift of the height from start to end
    cannot be distinguished from the slope and shows in no residual, so it is added from ``sigma``.

    Parameters
    ----------
    track : (n, 3) m east-north-up
    sigma : m, standard deviation of a horizontal fix; a height's is taken as twice that

    Raises SssiError when the track does not lead downhill.
    """
    end_to_end = track[-1, :2] - track[0, :2]
    if float(np.linalg.norm(end_to_end)) < 2.0:
        raise SssiError("the track leads nowhere")
    along = end_to_end / np.linalg.norm(end_to_end)
    across = np.array([-along[1], along[0]])
    plan = track[:, :2] - track[:, :2].mean(axis=0)
    columns = np.column_stack([np.ones(len(track)), plan @ along, plan @ across])
    fitted, covariance = _robust_fit(columns, track[:, 2], np.ones(len(track)))
    drift = np.diag([(2.0 * sigma * np.sqrt(2.0) / np.linalg.norm(end_to_end)) ** 2, 0.0])
    gradient, information = fitted[1:], np.linalg.inv(covariance[1:, 1:] + drift)
    prior = np.diag([0.0, 1.0 / (_TRAVERSE_SIGMA * gradient[0]) ** 2])
    covariance = np.linalg.inv(information + prior)
    gradient = covariance @ information @ gradient
    steep = float(np.linalg.norm(gradient))
    if gradient[0] >= 0.0:
        raise SssiError("the track does not lead downhill")
    downhill = -(gradient[0] * along + gradient[1] * across)
    fall, side = gradient / steep, np.array([-gradient[1], gradient[0]]) / steep
    return SlopeEstimate(
        Estimate(float(np.arctan(steep)), float(np.sqrt(fall @ covariance @ fall)) / (1.0 + steep**2)),
        Estimate(float(np.arctan2(downhill[0], downhill[1])), float(np.sqrt(side @ covariance @ side)) / steep),
    )


def estimate_heading(stance: Stance, gps: Gps) -> Estimate:
    """Estimate the azimuth of the BVH +z axis, rad, clockwise from north.

    Two measurements are combined by their uncertainties:

    * The skis point where the skier goes.  This measurement is the course minus the ski direction, speed-weighted.
      Skis skid, so the regression carries two terms that change sign from a left to a right turn: lateral acceleration
      and direction of travel across the run.  The constant that remains is the heading.
    * The body leans into the turn along the horizontal acceleration.  The acceleration's direction in the world and the
      lean's in the capture differ by the heading.  Skidding does not matter here, but a straight run shows nothing.

    Raises SssiError when the skier hardly moves.
    """
    velocity, acceleration = _motion_of_antenna(stance, gps)
    skis = _unit(_level(stance.forward))
    swing = _level(local_fit(stance.time, stance.antenna, 0.6)[1])
    fast = np.abs(velocity) > _SLOW
    if np.count_nonzero(fast) < 5:
        raise SssiError(f"the skier hardly ever moves faster than {_SLOW:g} m/s")
    heading = float(np.angle(np.sum(velocity * np.conj(skis))))
    for _ in range(3):  # the antenna's swing about the feet has to be turned by the heading that is sought
        of_feet = velocity - _rotate(swing, heading)
        heading = float(np.angle(np.sum((of_feet * np.conj(skis))[fast])))
    by_course = _heading_by_course(stance.time[fast], of_feet[fast], skis[fast], heading)
    by_lean = _heading_by_lean(stance, acceleration, skis, heading)
    weights = np.array([by_course.sigma**-2, by_lean.sigma**-2])
    difference = _wrap(by_lean.value - by_course.value)
    value = by_course.value + difference * weights[1] / weights.sum()
    return Estimate(_wrap(value), float(np.hypot(weights.sum() ** -0.5, CAPTURE_HEADING_SIGMA)))


def ski_direction_misfits(stance: Stance, gps: Gps) -> tuple[float, float]:
    """Return the speed-weighted mean of 1 − cos(course − ski direction − heading) at the heading that fits best.

    It is 0 where both agree.  The second number is that of the track with east and north exchanged, as swapped
    coordinates would have it.
    """
    velocity, _ = _motion_of_antenna(stance, gps)
    skis = np.conj(_unit(_level(stance.forward)))

    def misfit(course: Complex) -> float:
        return float(1.0 - np.abs(np.sum(course * skis) / np.sum(np.abs(course))))

    return misfit(velocity), misfit(velocity.imag + 1j * velocity.real)


def _heading_by_course(time: Array, velocity: Complex, skis: Complex, heading: float) -> Estimate:
    course = np.unwrap(np.angle(velocity))
    lateral = np.gradient(course, time) * np.abs(velocity)
    run = np.angle(np.sum(velocity))
    columns = np.column_stack([np.ones(len(time)), lateral, np.sin(course - run)])
    slip = np.angle(velocity * np.conj(skis) * np.exp(-1j * heading))
    fitted, covariance = _robust_fit(columns, slip, np.abs(velocity))
    return Estimate(heading + float(fitted[0]), float(np.sqrt(covariance[0, 0])))


def _heading_by_lean(stance: Stance, acceleration: Array, skis: Complex, heading: float) -> Estimate:
    """Fit a_h/(g + a_u) = exp(i·heading)·(k·lean + (p + i·q)·skis).

    k is how the load is shared; p and q are how far the skier is off balance.
    """
    pull = (acceleration[:, 1] + 1j * acceleration[:, 0]) / (GRAVITY + acceleration[:, 2])
    lean = _level(stance.body) / stance.body[:, 1]
    sides = [1j * _rotate(lean, heading), _rotate(lean, heading), _rotate(skis, heading), 1j * _rotate(skis, heading)]
    columns = np.column_stack([np.r_[side.real, side.imag] for side in sides])
    fitted, covariance = _robust_fit(columns, np.r_[pull.real, pull.imag], np.ones(len(columns)))
    # k·exp(i·d) = fitted[1] + i·fitted[0]: d is the error of the first guess of the heading
    along = float(np.hypot(fitted[0], fitted[1])) + 1e-9  # a body that never leans shows nothing
    side = np.array([fitted[1], -fitted[0]]) / along**2
    sigma = float(np.sqrt(side @ covariance[:2, :2] @ side))
    return Estimate(heading + float(np.arctan2(fitted[0], fitted[1])), min(sigma, float(np.pi)))


def _motion_of_antenna(stance: Stance, gps: Gps) -> tuple[Complex, Array]:
    """Return the antenna's horizontal velocity (north + i·east, m/s) and acceleration (n, 3) m/s².

    A receiver's own speed and course are taken where its fixes are too coarse to be differentiated.
    """
    sigma = float(np.median(gps.sigma))
    # noise of a slope over a window T goes with sigma/T^1.5, its bias with T²: the best T goes with sigma^(2/7)
    window = max(0.8 * (sigma / 0.02) ** (2.0 / 7.0), 4.0 * float(np.median(np.diff(gps.time))))
    fitted = local_fit(stance.time, gps.enu[stance.fixes], window)
    velocity = fitted[1, :, 1] + 1j * fitted[1, :, 0]
    if sigma > COARSE and gps.speed is not None and gps.course is not None:
        velocity = gps.speed[stance.fixes] * np.exp(1j * gps.course[stance.fixes])
    return velocity, fitted[2]


def local_fit(time: Array, values: Array, window: float) -> Array:
    """Fit quadratics to ``values`` (n, k) within about ±``window`` s of each time.

    Returns value, first and second derivative (3, n, k).  Where the window holds fewer than four samples, it is as wide
    as the four nearest.
    """
    count = len(time)
    around = np.arange(count)[:, None] + np.arange(-3, 4)  # the four nearest are among them
    apart = np.abs(time[np.clip(around, 0, count - 1)] - time[:, None])
    apart[(around < 0) | (around >= count)] = np.inf
    reach = np.maximum(window, np.sort(apart, axis=1)[:, min(3, count - 1)])
    edge = reach * (1.0 + 1e-9)  # the ends included
    first, last = np.searchsorted(time, time - edge), np.searchsorted(time, time + edge)
    stride = 1 + (last - first) // _ENOUGH
    derivatives = np.empty((3, *values.shape))
    for block in range(0, count, _BLOCK):
        rows = slice(block, block + _BLOCK)
        widest = int(np.max((last[rows] - first[rows]) / stride[rows])) + 1
        near = first[rows, None] + stride[rows, None] * np.arange(widest)
        inside = near < last[rows, None]
        near = np.minimum(near, count - 1)
        apart = (time[near] - time[rows, None]) / reach[rows, None]
        columns = np.stack([np.ones_like(apart), apart, 0.5 * apart**2], axis=-1)
        weighted = np.swapaxes(columns * np.where(inside, np.exp(-6.0 * apart**2), 0.0)[..., None], -1, -2)
        fitted = np.linalg.pinv(weighted @ columns, hermitian=True) @ (weighted @ values[near])
        derivatives[:, rows] = np.moveaxis(fitted, 1, 0)
    return np.asarray(derivatives / reach[:, None] ** np.arange(3.0)[:, None, None])


def _robust_fit(columns: Array, data: Array, weights: Array) -> tuple[Array, Array]:
    """Solve Huber-weighted least squares; return the coefficients and their covariance.

    The covariance is widened by the residuals' integrated correlation time, as noise of positions is correlated over
    seconds and skidding over a turn.
    """
    robust: Array = np.ones(len(data))
    for _ in range(20):
        fitted = _least_squares(columns, data, weights * robust)
        residual = data - columns @ fitted
        scale = 1.4826 * float(np.median(np.abs(residual))) + 1e-12  # a perfect fit must not divide by nothing
        robust = np.minimum(1.0, 1.345 * scale / np.maximum(np.abs(residual), 1e-12))
    total = weights * robust
    variance = float(np.sum(total * residual**2) / np.sum(total)) * len(data) / (len(data) - columns.shape[1])
    normal = columns.T @ (columns * (total / total.mean())[:, None])
    normal += 1e-9 * np.trace(normal) * np.eye(len(normal))  # what the data do not determine comes out very uncertain
    covariance: Array = variance * _correlation(residual) * np.linalg.inv(normal)
    return fitted, covariance


def _least_squares(columns: Array, data: Array, weights: Array) -> Array:
    """Return coefficients (c,) or (c, k) that minimise Σ weights·(data − columns·coefficients)²."""
    root = np.sqrt(weights).reshape(-1, 1)
    sides = data.reshape(len(data), -1) * root
    coefficients = np.asarray(np.linalg.lstsq(columns * root, sides, rcond=None)[0], dtype=np.float64)
    return coefficients.reshape(-1, *data.shape[1:])


def _correlation(residual: Array) -> float:
    """Return 1 + 2·Σρ up to the first negative autocorrelation: the number of samples that count as one."""
    length = len(residual)
    spectrum = np.abs(np.fft.rfft(residual - residual.mean(), 2 * length)) ** 2
    rho = np.fft.irfft(spectrum)[: length // 2]
    rho = rho / max(float(rho[0]), 1e-300)
    stop = int(np.argmax(rho < 0.0)) or len(rho)
    return float(1.0 + 2.0 * np.sum(rho[1:stop]))


def _level(vectors: Array) -> Complex:
    """Return the horizontal parts of BVH vectors (x left, y up, z forward) as forward + i·right.

    So azimuths add as angles.
    """
    return vectors[..., 2] - 1j * vectors[..., 0]


def _rotate(vectors: Complex, heading: float) -> Complex:
    """Rotate forward + i·right in the capture to north + i·east."""
    turned: Complex = vectors * np.exp(1j * heading)
    return turned


def _unit(vectors: Complex) -> Complex:
    unit: Complex = vectors / np.abs(vectors)
    return unit


def angle_between(one: float, other: float) -> float:
    """Return the angle (rad) between two azimuths."""
    return abs(_wrap(one - other))


def _wrap(angle: float) -> float:
    """Return the same angle within ±π."""
    return float(np.angle(np.exp(1j * angle)))
