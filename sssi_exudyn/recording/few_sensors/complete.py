"""A whole capture from few sensors: their measurements, and a skier's plausible posture for the rest.

Course and speed come from the fixes, sharpened by the best yaw rate.  Edge angles come from sensors on skis or boots,
else from the lean that the turn's radius and speed require.  The trunk's lean comes from a sensor on the chest, else
from balance.  Everything else comes from `posture_model`.  `Completed` lists what was measured and what was assumed,
with standard deviations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from sssi_exudyn.core.errors import SssiError
from sssi_exudyn.core.frames import BODY_FROM_BVH, GRAVITY, Array, level_to_enu
from sssi_exudyn.core.rotations import lowpass
from sssi_exudyn.recording.few_sensors.attitude import Alignment, Attitude, align_sensor, attitude_of
from sssi_exudyn.recording.few_sensors.course import (
    Course,
    Lag,
    find_lag,
    fused_course,
    note_what_is_left_out,
    skiing_stretch,
    velocity_of,
)
from sssi_exudyn.recording.few_sensors.posture_model import (
    FLEXION,
    Body,
    Coordinates,
    SkiingPosture,
    capture_from_posture,
    rotation_about_x,
    solve_posture,
)
from sssi_exudyn.recording.instruments.bvh import Bvh, joint_positions, world_rotations
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import FEET, LOOSE, Barometer, Imu
from sssi_exudyn.recording.slope_and_heading import SlopeEstimate, estimate_slope

_RATE: Final = 50.0
"""Rate of the completed capture's frames, Hz: the lowest rate of inertial captures."""
_LONGEST: Final = 2000.0
"""Maximum duration of skiing that is completed at once, s."""
_EDGE_CUTOFF: Final = 2.0
"""Cut-off of edging, Hz; edging takes a second, and faster motion of a ski is chatter that does not change its path."""
_SWING_CUTOFF: Final = 1.0
"""Cut-off of the body's swing over the skis, Hz."""
_ROUNDS: Final = 3
"""Rounds of the antenna's swing over the skis, whose course decides the lean: three change no angle by 0.1°."""
_LARGEST_EDGE: Final = float(np.radians(70.0))
"""Edge angles of racers, rad; a sensor that shows more has slipped."""
_RECEIVER_WANDER, _BAROMETER_WANDER = 2.0, 0.5
"""Wander of a height, m, as `estimate_slope` counts it: 5.7 and 1.4 m from start to end of a run."""
_LAG_CLEAR: Final = 0.3
"""Correlation of both turnings, below which an estimated lag is not reliable and is left at zero."""

_ASSUMED_EDGE: Final = float(np.radians(13.0))
_MEASURED_EDGE: Final = float(np.radians(4.0))
_PITCH: Final = float(np.radians(2.0))
_LEAST_YAW: Final = float(np.radians(2.0))
_ASSUMED_STEERING: Final = float(np.radians(12.0))
_MEAN_STEERING: Final = float(np.radians(3.0))
_HEIGHT: Final = 0.006
"""Standard deviations, see docs/theory/few-sensors.md: rad of a foot's edge, pitch and heading, m of its height."""


@dataclass(frozen=True)
class FootSigma:
    """Standard deviations of each foot's turns about its axes (rad) and of its height against the other's (m)."""

    roll: float
    pitch: float
    yaw: float
    height: float


@dataclass(frozen=True)
class Completed:
    """A capture made from few sensors.

    bvh : motion as from a whole capture, its +z axis along the fall line's azimuth
    gps : the fixes with the receiver's lag taken off
    measured, assumed : coordinates of the posture, in words
    sigma : standard deviations of the feet
    steered : whether the skis' own heading was measured, not only their course
    lag : lag of the receiver, None where no sensor shows it
    turning : the sensor that turns most as the course does; None where none does
    course, edge, lean, unbalanced : input of the posture's solution, and its balance, at ``bvh.time``
    start, stop : s, the stretch of skiing
    notes : what was done, in words
    """

    bvh: Bvh
    gps: Gps
    measured: tuple[str, ...]
    assumed: tuple[str, ...]
    sigma: FootSigma
    steered: bool
    lag: Lag | None
    turning: Attitude | None
    course: Course
    edge: Array
    lean: Array
    unbalanced: Array
    start: float
    stop: float
    notes: tuple[str, ...]

    @property
    def heading_sigma(self) -> float:
        """Standard deviation, rad, of the skis' mean heading about the course's: no skier skids alike to both sides."""
        return float(np.hypot(_MEAN_STEERING, self.course.sigma))


@dataclass(frozen=True)
class Ground:
    """The plane that was skied: inclination and fall line's azimuth, rad."""

    inclination: float
    azimuth: float


def complete(imus: tuple[Imu, ...], gps: Gps, ground: Ground, body: Body) -> Completed:
    """Complete a skier's posture beyond what the sensors measured.

    Raises SssiError where sensors and fixes do not overlap, or where there is no skiing.
    """
    attitudes = [attitude_of(imu) for imu in imus]
    best, lag = _best_lag(attitudes, gps)
    notes = [note for imu in imus for note in imu.notes]
    if lag is not None:
        gps = replace(gps, time=gps.time - lag.value)
    velocity = velocity_of(gps)
    first, last = skiing_stretch(gps.time, np.linalg.norm(velocity, axis=1), gps.enu[:, 2])
    start = max(first, *(imu.time[0] for imu in imus))
    stop = min(last, *(imu.time[-1] for imu in imus))
    if stop - start < 5.0:
        raise SssiError("sensors and fixes have less than five seconds of skiing in common")
    if stop - start > _LONGEST:
        raise SssiError(f"{stop - start:.0f} s of skiing are more than one run")
    time = start + np.arange(int((stop - start) * _RATE) + 1) / _RATE
    yaw = np.interp(time, attitudes[best].time, attitudes[best].yaw_rate) if lag is not None else None
    swing = np.zeros((len(time), 2))
    for _ in range(_ROUNDS):
        moved = np.column_stack([np.interp(gps.time, time, column) for column in swing.T])
        course = fused_course(gps, velocity - moved, time, yaw)
        pull = course.acceleration @ level_to_enu(ground.azimuth)
        frames, lean = _snow_frames(course.azimuth, pull, ground)
        seen = {imu.place: _segment_attitude(imu, course, frames, lean, pull) for imu in imus if imu.place not in LOOSE}
        feet = [next((seen[place] for place in places if place in seen), None) for places in FEET.values()]
        frames, lean = _snow_frames(course.azimuth + _steering(feet, frames), pull, ground)
        trunk = lowpass(_roll(seen["chest"], frames), _RATE, _EDGE_CUTOFF) if "chest" in seen else None
        coordinates = Coordinates(frames, _edges(feet, frames, lean), lean, trunk)
        posture = solve_posture(coordinates, body)
        bvh = capture_from_posture(posture, frames, time, body.height)
        swing = _swing(bvh, gps, body, ground.azimuth)
    measured, assumed, sigma = _sources_of_posture(feet, trunk, course, lag)
    notes += _describe(imus, attitudes, seen, lag, course, posture) + note_what_is_left_out(gps, first, last)
    return Completed(
        bvh=bvh,
        gps=gps,
        measured=measured,
        assumed=assumed,
        sigma=sigma,
        steered=any(foot is not None for foot in feet),
        lag=lag,
        turning=None if lag is None else attitudes[best],
        course=course,
        edge=coordinates.edge,
        lean=lean,
        unbalanced=posture.unbalanced,
        start=start,
        stop=float(time[-1]),
        notes=tuple(notes),
    )


_FEWEST_COVERED: Final = 10
"""Minimum number of fixes that a barometer has to cover, so that its heights can be joined to the receiver's."""
_AROUND: Final = 10
"""Number of fixes over which the two are aligned at an end."""
_FEET: Final = 1.0 / 0.3048
"""Feet in a metre."""
_FEET_SHOW: Final = 50.0
"""Height, m, over which feet are three times more than a receiver's heights wander."""


def use_barometer_heights(gps: Gps, barometer: Barometer) -> tuple[Gps, tuple[str, ...]]:
    """Replace the fixes' heights by the barometer's, which wander less, and describe the change in words.

    Outside the barometer's stretch the receiver's heights stay, shifted so that both are the same on average around
    each end of the stretch.
    """
    inside = gps.between(barometer.time[0], barometer.time[-1])
    if np.count_nonzero(inside) < _FEWEST_COVERED:
        return gps, ("the barometer covers hardly a fix; the receiver's own heights are used",)
    first, last = (int(end) for end in np.flatnonzero(inside)[[0, -1]])
    height = np.interp(gps.time, barometer.time, barometer.altitude)
    difference = height - gps.enu[:, 2]
    scatter = float(np.std(difference[inside]))
    height[:first] = gps.enu[:first, 2] + np.mean(difference[first : first + _AROUND])
    height[last + 1 :] = gps.enu[last + 1 :, 2] + np.mean(difference[max(first, last + 1 - _AROUND) : last + 1])
    enu = np.column_stack([gps.enu[:, :2], height - height[0]])
    words = f"heights are the barometer's; the receiver's scatter about them by {scatter:.1f} m"
    if np.all(inside[first : last + 1]) and np.count_nonzero(inside) < len(inside):
        words += f"; from {gps.time[first]:.0f} s to {gps.time[last]:.0f} s, before and after them the receiver's"
    if np.ptp(height[inside]) > _FEET_SHOW:
        ratio = np.polynomial.polynomial.polyfit(height[inside], gps.enu[inside, 2], 1)[1]
        if abs(ratio / _FEET - 1.0) < 0.15:
            words += f"; these change {ratio:.2f} times as much: they look like feet, give the altitude in metres"
    return replace(gps, enu=enu, barometric=bool(np.all(inside))), (words,)


def ground_of(gps: Gps, barometric: bool) -> SlopeEstimate:
    """Fit the plane through the skied track.  Raises SssiError where that leads nowhere or uphill.

    The heights' wander from start to end is a property of the instrument, not of a single fix.
    """
    first, last = skiing_stretch(gps.time, np.linalg.norm(velocity_of(gps), axis=1), gps.enu[:, 2])
    inside = gps.between(first, last)
    return estimate_slope(gps.enu[inside], _BAROMETER_WANDER if barometric else _RECEIVER_WANDER)


def _best_lag(attitudes: list[Attitude], gps: Gps) -> tuple[int, Lag | None]:
    """Return the sensor whose turning agrees best with the course's, and the lag that it shows."""
    velocity = velocity_of(gps)
    lags = [find_lag(gps.time, velocity, attitude.time, attitude.yaw_rate) for attitude in attitudes]
    best = max(range(len(lags)), key=lambda i: lags[i].correlation)
    return best, lags[best] if lags[best].correlation > _LAG_CLEAR else None


def _snow_frames(azimuth: Array, pull: Array, ground: Ground) -> tuple[Array, Array]:
    """Return frames of the snow under skis that point to ``azimuth`` (n,), and the lean of the snow's force.

    The frames (n, 3, 3) are forward, left, normal → level frame.  The lean (n,) is that of the force that the snow must
    give for the acceleration ``pull`` (n, 3), level frame; positive to the right.
    """
    to_left = ground.azimuth - azimuth
    flat = np.stack([np.cos(to_left), np.sin(to_left)], axis=1)
    forward = np.column_stack([flat, -np.tan(ground.inclination) * flat[:, 0]])
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    normal = np.broadcast_to([np.sin(ground.inclination), 0.0, np.cos(ground.inclination)], forward.shape)
    frames = np.stack([forward, np.cross(normal, forward), normal], axis=2)
    force = np.einsum("nji,nj->ni", frames, pull + [0.0, 0.0, GRAVITY])
    return frames, -np.arctan2(force[:, 1], force[:, 2])


def _segment_attitude(imu: Imu, course: Course, frames: Array, lean: Array, pull: Array) -> Alignment:
    """Estimate the rotation of the segment that a sensor sits on, at the course's times.

    The skier's acceleration ``pull`` (level frame) is taken off before the filter, once the sensor's rotation is known.
    """
    share = 0.5 if imu.place in ("chest", "pelvis") else 1.0  # trunks lean less than legs
    expected = frames @ rotation_about_x(share * lean)
    weights = np.minimum(course.speed / 3.0, 1.0) ** 2  # slow skis point anywhere
    aligned = align_sensor(course.time, _at(course.time, attitude_of(imu)), expected, weights)
    if imu.orientation is not None:
        return aligned
    sensor = np.einsum("nij,kj->nik", aligned.rotation, aligned.mounting)
    of_sensor = np.einsum("nji,nj->ni", sensor, pull)
    outside = (imu.time < course.time[0]) | (imu.time > course.time[-1])
    known = np.column_stack([np.interp(imu.time, course.time, column) for column in of_sensor.T])
    known[outside] = 0.0
    return align_sensor(course.time, _at(course.time, attitude_of(imu, known)), expected, weights)


def _at(time: Array, attitude: Attitude) -> Array:
    """Interpolate an attitude's rotations to other times."""
    between = Slerp(attitude.time, Rotation.from_matrix(attitude.rotation))
    return np.asarray(between(np.clip(time, attitude.time[0], attitude.time[-1])).as_matrix())


def _steering(feet: list[Alignment | None], frames: Array) -> Array:
    """Return by how much farther the skis point than the course, (n,) rad clockwise, mean of the measured skis."""
    seen = [np.swapaxes(frames, -1, -2) @ foot.rotation for foot in feet if foot is not None]
    if not seen:
        return np.zeros(len(frames))
    turned = np.mean([np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]) for rotation in seen], axis=0)
    return -lowpass(turned, _RATE, _EDGE_CUTOFF)


def _edges(feet: list[Alignment | None], frames: Array, lean: Array) -> Array:
    """Return the roll (n, 2) rad: measured, or that of the other foot if measured, or square to the snow's force."""
    seen = [None if foot is None else _roll(foot, frames) for foot in feet]
    known = [roll for roll in seen if roll is not None]
    other = known[0] if known else lean
    both = np.stack([other if roll is None else roll for roll in seen], axis=1)
    return np.clip(lowpass(both, _RATE, _EDGE_CUTOFF), -_LARGEST_EDGE, _LARGEST_EDGE)


def _roll(segment: Alignment, frames: Array) -> Array:
    """Return the turn (n,) rad about the direction of travel.

    It follows from the rise of the segment's left axis over the snow.
    """
    rising = np.einsum("ni,ni->n", frames[:, :, 2], segment.rotation[:, :, 1])
    return np.asarray(np.arcsin(np.clip(rising, -1.0, 1.0)))


def _swing(bvh: Bvh, gps: Gps, body: Body, azimuth: float) -> Array:
    """Return the antenna's velocity (n, 2) m/s, north and east, over the middle of the skis."""
    world = world_rotations(bvh)
    place = joint_positions(bvh, world)
    down = np.array([0.0, -body.ankle_to_ski_base, 0.0])
    feet = [bvh.index(side + "Foot") for side in ("Left", "Right")]
    middle = np.mean([place[:, foot] + world[:, foot] @ down for foot in feet], axis=0)
    carrier = bvh.index(gps.segment)
    over = (place[:, carrier] + world[:, carrier] @ gps.offset - middle) @ BODY_FROM_BVH.T
    moving = lowpass(np.gradient(over, bvh.time, axis=0), _RATE, _SWING_CUTOFF) @ level_to_enu(azimuth).T
    return np.asarray(moving[:, [1, 0]])


def _sources_of_posture(
    feet: list[Alignment | None], trunk: Array | None, course: Course, lag: Lag | None
) -> tuple[tuple[str, ...], tuple[str, ...], FootSigma]:
    """List what of the posture was measured and what was assumed, with the standard deviations of the feet."""
    edged = any(foot is not None for foot in feet)
    measured = ["speed and course: fixes" + (", and a yaw rate between them" if lag is not None else "")]
    assumed = []
    if edged:
        count = sum(foot is not None for foot in feet)
        measured.append(
            "edge angle and steering angle: " + ("both skis" if count == 2 else "one ski, the other like it")
        )
    else:
        assumed.append("edge angle: square to the force that the snow has to give")
        assumed.append("steering angle: skis point along the course")
    (assumed if trunk is None else measured).append(
        "trunk's lean: " + ("what balances in roll" if trunk is None else "chest sensor")
    )
    assumed += [
        f"knee flexion of the outside leg: {np.degrees(FLEXION):.0f}°",
        "stance: skis parallel, hips' width apart across the shins, none ahead",
        "pelvis: rolls by half of the edge angle",
        "fore and aft: centre of mass over the middle of the skis",
        "arms: held in front",
        "lengths: an average skier's of that height",
    ]
    sigma = FootSigma(
        roll=_MEASURED_EDGE if edged else _ASSUMED_EDGE,
        pitch=_PITCH,
        yaw=float(np.hypot(max(course.sigma, _LEAST_YAW), 0.0 if edged else _ASSUMED_STEERING)),
        height=_HEIGHT,
    )
    return tuple(measured), tuple(assumed), sigma


def _describe(
    imus: tuple[Imu, ...],
    attitudes: list[Attitude],
    seen: dict[str, Alignment],
    lag: Lag | None,
    course: Course,
    posture: SkiingPosture,
) -> list[str]:
    notes = []
    if lag is None:
        notes.append(
            "no sensor turns as the course does; the fixes' clock is taken to be right (where a sensor's acceleration"
            " points down at rest, change its sign)"
        )
    else:
        notes.append(
            f"the fixes lag the sensors by {lag.value:.2f} ± {lag.sigma:.2f} s (their turnings correlate"
            f" {lag.correlation:.2f}); taken off"
        )
    for imu, attitude in zip(imus, attitudes, strict=True):
        if imu.orientation is None:
            bias = np.degrees(attitude.bias)
            notes.append(
                f"{imu.name}: gyroscope bias {bias[0]:.2f}, {bias[1]:.2f}, {bias[2]:.2f}"
                f" ± {np.degrees(attitude.bias_sigma):.2f} °/s taken off"
            )
        if imu.place in seen:
            alignment = seen[imu.place]
            notes.append(
                f"{imu.name}: mounting estimated from the run; its rotation is {np.degrees(alignment.misfit):.0f}° from"
                f" the expected one, its heading drifted by {np.degrees(alignment.drift):.0f}°"
            )
    short = float(np.sqrt(np.mean(posture.unbalanced**2)))
    notes.append(f"the posture balances in roll to {short:.3f} m (root mean square)")
    return notes
