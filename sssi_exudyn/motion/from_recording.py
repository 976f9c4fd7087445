"""The prescribed motion of a recorded run, and the chain's agreement with the capture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT, Geometry, Poses
from sssi_exudyn.core.frames import Array, level_to_enu, slope_to_level
from sssi_exudyn.core.rotations import angles_between, nearest_rotation, smooth_rotations
from sssi_exudyn.motion.capture_to_chain import (
    CAPTURED_BY,
    Capture,
    capture_in_body_axes,
    chain_angles,
    mean_in,
    segment_of_joint,
    skier_geometry,
)
from sssi_exudyn.motion.motion import Antenna, Motion, RoundTrip, relative_poses, spline_motion
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.recording import Recording


def motion_from_recording(recording: Recording, cutoff_hz: float = 6.0) -> Motion:
    """Return the prescribed motion of a recorded run.

    The capture's joint rotations are filtered (4th-order zero-lag Butterworth, −3 dB at ``cutoff_hz``).  Rotations are
    filtered, not angles, so that captures near gimbal lock do no harm.  The chain is fitted to them frame by frame, and
    quintic splines are laid through the angles at the frames' times.

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


def _pelvis_frame(poses: Poses) -> tuple[Array, Array]:
    """Return rotations (n, 21, 3, 3) and origins (n, 21, 3) relative to the pelvis."""
    back = np.swapaxes(poses.rotation[:, :1], -1, -2)
    origin = poses.origin - poses.origin[:, :1]
    return back @ poses.rotation, (back @ origin[..., None])[..., 0]


def _antenna(gps: Gps, capture: Capture, poses: Poses) -> Antenna:
    """Return the antenna on the chain: its mean place in the capture, seen from the segment that carries it."""
    segment = SEGMENT[segment_of_joint(capture.bvh, gps.segment)]
    rotation, origin = _pelvis_frame(poses)
    return Antenna(segment, mean_in(rotation[:, segment], origin[:, segment], capture.point(gps.segment, gps.offset)))


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _round_trip(
    raw: Capture, filtered: Capture, geometry: Geometry, poses: Poses, slope_from_capture: Array
) -> tuple[RoundTrip, ...]:
    """Compare poses (n, …) with the capture, recorded and filtered, segment by segment.

    The chain holds the head fixed on the torso, in its mean attitude of the run; its row is the deviation from that.
    Top of the spine and head are not joints of the chain; their mean place on the torso represents them.
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
    """Return the round trip as rows for people: segment and captured joint, angles in degrees, places in mm."""
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
