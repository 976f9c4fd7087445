"""The prescribed motion: a recording's 28 joint and pelvis angles as smooth functions of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from sssi_exudyn.anatomy import (
    CAPTURED_BY,
    Capture,
    capture_in_body_axes,
    chain_angles,
    mean_in,
    segment_of_joint,
    skier_geometry,
)
from sssi_exudyn.chain import PRESCRIBED, SEGMENT, Geometry, Poses, Rates, forward_kinematics, rates
from sssi_exudyn.few_sensors import FootSigma
from sssi_exudyn.frames import Array, level_to_enu, slope_to_level
from sssi_exudyn.gps import Gps
from sssi_exudyn.recording import Recording
from sssi_exudyn.rotations import angles_between, nearest_rotation, smooth_rotations

_DEGREE: Final = 5
"""Quintic: angles have four continuous derivatives, so inertia forces have no kinks at the knots."""


@dataclass(frozen=True)
class Antenna:
    """The GPS antenna: index of the segment that carries it, and its place (3,) m in that segment's frame."""

    segment: int
    offset: Array


@dataclass(frozen=True)
class RoundTrip:
    """How well one segment of the chain, rebuilt from the 28 angles, agrees with the capture over all frames.

    segment, joint : the chain's segment and the captured joint that moves with it
    filtered_rms, filtered_max : angle between rebuilt and captured orientation in space, rad, the capture filtered
    raw_rms, raw_max : the same, the capture as recorded
    place_rms, place_max : distance between rebuilt and captured joint, relative to the pelvis, m, against the filtered
        capture
    """

    segment: str
    joint: str
    filtered_rms: float
    filtered_max: float
    raw_rms: float
    raw_max: float
    place_rms: float
    place_max: float


@dataclass(frozen=True)
class Motion:
    """The skier's geometry and prescribed angles; plain arrays, so it crosses process boundaries.

    geometry : lengths of the chain
    inclination : of the slope, rad
    knots, coefficients : (m,) s and (m − 6, 28) rad, quintic B-splines of the coordinates `chain.PRESCRIBED`
    antenna : where the GPS antenna sits; None without a GPS
    round_trip : agreement with the capture, one row a captured segment
    start, stop : the part of the clock that all instruments cover, s
    foot_sigma : how unsure the feet are where most of the posture was assumed; None for a whole capture
    """

    geometry: Geometry
    inclination: float
    knots: Array
    coefficients: Array
    antenna: Antenna | None
    round_trip: tuple[RoundTrip, ...]
    start: float
    stop: float
    foot_sigma: FootSigma | None = None

    def evaluate(self, time: Array) -> tuple[Array, Array, Array]:
        """Angles, rates and accelerations, each (…, 28) rad, rad/s, rad/s², at ``time`` (…) s."""
        spline = BSpline.construct_fast(self.knots, self.coefficients, _DEGREE)
        return spline(time), spline(time, nu=1), spline(time, nu=2)


def spline_motion(geometry: Geometry, inclination: float, time: Array, angles: Array) -> Motion:
    """A motion through ``angles`` (n, 28) rad at increasing ``time`` (n,) s, n ≥ 6; without antenna and round trip.

    The third and fourth derivatives are zero at both ends, so the ends do not swing.
    """
    # Any: scipy takes a list of conditions at each end, its stubs do not know it.
    ends: Any = [(3, np.zeros(len(PRESCRIBED))), (4, np.zeros(len(PRESCRIBED)))]
    spline = make_interp_spline(time, angles, k=_DEGREE, bc_type=(ends, ends))
    return Motion(geometry, inclination, spline.t, spline.c, None, (), float(time[0]), float(time[-1]))


def motion_from_recording(recording: Recording, cutoff_hz: float = 6.0) -> Motion:
    """The prescribed motion of a recorded run.

    The capture's joint rotations are filtered (4th-order zero-lag Butterworth, −3 dB at ``cutoff_hz``; rotations, not
    angles, so that captures near gimbal lock do no harm), the chain is fitted to them frame by frame, and quintic
    splines are laid through the angles at the frames' times.

    Raises ValueError for a cut-off of half the frame rate or more.
    """
    bvh = recording.bvh
    rate = float((len(bvh.time) - 1) / (bvh.time[-1] - bvh.time[0]))
    smooth = replace(bvh, rotations=smooth_rotations(bvh.rotations, rate, cutoff_hz))
    raw, capture = capture_in_body_axes(bvh), capture_in_body_axes(smooth)
    equipment, slope = recording.equipment, recording.slope
    geometry = skier_geometry(capture, recording.skier.height, equipment.ankle_to_ski_base)
    level_from_capture = level_to_enu(slope.fall_line_azimuth).T @ level_to_enu(recording.heading.value)
    slope_from_capture = slope_to_level(slope.inclination).T @ level_from_capture
    angles = chain_angles(capture, geometry, level_from_capture)
    motion = spline_motion(geometry, slope.inclination, bvh.time, angles)
    poses, _ = relative_poses(motion, bvh.time)
    return replace(
        motion,
        antenna=None if recording.gps is None else _antenna(recording.gps, capture, poses),
        round_trip=_round_trip(raw, capture, geometry, poses, slope_from_capture),
        start=max(recording.start, motion.start),
        stop=min(recording.stop, motion.stop),
        foot_sigma=None if recording.completed is None else recording.completed.sigma,
    )


def relative_poses(motion: Motion, time: Array) -> tuple[Poses, Rates]:
    """Poses and rates of all segments in the slope frame at ``time`` (…), with the pelvis' origin held at zero."""
    free = np.zeros((*np.shape(time), 3))
    q, qd, qdd = (np.concatenate([free, part], axis=-1) for part in motion.evaluate(time))
    poses = forward_kinematics(motion.geometry, q, motion.inclination)
    return poses, rates(poses, qd, qdd)


def antenna_offset(motion: Motion, time: Array) -> tuple[Array, Array]:
    """The antenna's place (…, 3) m and velocity (…, 3) m/s from the pelvis' origin, slope frame, at ``time`` (…) s.

    Raises ValueError when the motion has no antenna.
    """
    if motion.antenna is None:
        raise ValueError("this motion has no GPS antenna")
    poses, moving = relative_poses(motion, time)
    at = motion.antenna.segment
    arm = poses.rotation[..., at, :, :] @ motion.antenna.offset
    return poses.origin[..., at, :] + arm, moving.velocity[..., at, :] + np.cross(
        moving.angular_velocity[..., at, :], arm
    )


def antenna_carrier(motion: Motion, time: Array) -> tuple[Array, Array]:
    """Rotation (…, 3, 3) to the slope frame and spin (…, 3) rad/s of the segment that carries the antenna.

    Raises ValueError when the motion has no antenna.
    """
    if motion.antenna is None:
        raise ValueError("this motion has no GPS antenna")
    poses, moving = relative_poses(motion, time)
    return poses.rotation[..., motion.antenna.segment, :, :], moving.angular_velocity[..., motion.antenna.segment, :]


def turned(motion: Motion, yaw: Callable[[Array], Array]) -> Motion:
    """The same motion turned about gravity by ``yaw`` ((n,) s → (n,) rad), a straight line in time, to the left when
    positive.

    A spline whose coefficients lie on a line over their knots' averages (Greville's abscissae) is that line.
    """
    count = len(motion.coefficients)
    greville = np.array([motion.knots[i + 1 : i + 1 + _DEGREE].mean() for i in range(count)])
    coefficients = motion.coefficients.copy()
    coefficients[:, PRESCRIBED.index("pelvis_rotation")] += yaw(greville)
    return replace(motion, coefficients=coefficients)


def _pelvis_frame(poses: Poses) -> tuple[Array, Array]:
    """Rotations (n, 21, 3, 3) and origins (n, 21, 3) relative to the pelvis."""
    back = np.swapaxes(poses.rotation[:, :1], -1, -2)
    origin = poses.origin - poses.origin[:, :1]
    return back @ poses.rotation, (back @ origin[..., None])[..., 0]


def _antenna(gps: Gps, capture: Capture, poses: Poses) -> Antenna:
    """The antenna on the chain: where the capture has it on average, seen from the segment that carries it."""
    segment = SEGMENT[segment_of_joint(capture.bvh, gps.segment)]
    rotation, origin = _pelvis_frame(poses)
    return Antenna(segment, mean_in(rotation[:, segment], origin[:, segment], capture.point(gps.segment, gps.offset)))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _round_trip(
    raw: Capture, filtered: Capture, geometry: Geometry, poses: Poses, slope_from_capture: Array
) -> tuple[RoundTrip, ...]:
    """The agreement of poses (n, …) with the capture, recorded and filtered, segment by segment.

    The chain holds the head fixed on the torso, in its mean attitude of the run: its row is the deviation from that.
    Top of the spine and head are no joints of the chain; their mean place on the torso stands for them.
    """
    rotation, origin = _pelvis_frame(poses)
    rows = []
    for segment in CAPTURED_BY:
        i, joint = SEGMENT[segment], filtered.joint(segment)
        recorded, smooth = (slope_from_capture @ c.pelvis @ c.rotation[:, joint] for c in (raw, filtered))
        rebuilt, point = poses.rotation[:, i], np.zeros(3)
        if segment.startswith("tibia"):  # its frame is the knee's; the shank is turned against it as the ankle joint is
            rebuilt = rebuilt @ geometry.attitude_in_parent[SEGMENT[segment.replace("tibia", "talus")]]
        if segment in ("torso", "head"):
            point = mean_in(rotation[:, i], origin[:, i], filtered.place[:, joint])
        if segment == "head":
            rebuilt = rebuilt @ nearest_rotation(np.mean(np.swapaxes(rebuilt, -1, -2) @ smooth, axis=0))
        against_smooth, against_recorded = angles_between(rebuilt, smooth), angles_between(rebuilt, recorded)
        missed = np.linalg.norm(origin[:, i] + rotation[:, i] @ point - filtered.place[:, joint], axis=-1)
        rows.append(
            RoundTrip(
                segment=segment,
                joint=filtered.bvh.names[joint],
                filtered_rms=_rms(against_smooth),
                filtered_max=float(against_smooth.max()),
                raw_rms=_rms(against_recorded),
                raw_max=float(against_recorded.max()),
                place_rms=_rms(missed),
                place_max=float(missed.max()),
            )
        )
    return tuple(rows)


def round_trip_table(motion: Motion) -> list[dict[str, str | float]]:
    """The round trip as rows for people: segment and captured joint, angles in degrees, places in millimetres."""
    return [
        {
            "segment": row.segment,
            "joint": row.joint,
            "filtered_rms_deg": float(np.degrees(row.filtered_rms)),
            "filtered_max_deg": float(np.degrees(row.filtered_max)),
            "raw_rms_deg": float(np.degrees(row.raw_rms)),
            "raw_max_deg": float(np.degrees(row.raw_max)),
            "place_rms_mm": 1e3 * row.place_rms,
            "place_max_mm": 1e3 * row.place_max,
        }
        for row in motion.round_trip
    ]
