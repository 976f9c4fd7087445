"""The prescribed motion: a recording's 28 joint and pelvis angles as smooth functions of time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED, WHOLE, Geometry, Poses, Rates, forward_kinematics, path_to, rates
from sssi_exudyn.core.frames import Array, cross
from sssi_exudyn.recording.few_sensors.complete import FootSigma

_DEGREE: Final = 5
"""Degree of the splines: quintic, so four derivatives are continuous and inertia forces have no kinks at the knots."""


@dataclass(frozen=True)
class Antenna:
    """The GPS antenna: index of the segment that carries it, and its place (3,) m in that segment's frame."""

    segment: int
    offset: Array


@dataclass(frozen=True)
class RoundTrip:
    """The agreement of one segment of the chain, rebuilt from the 28 angles, with the capture over all frames.

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
    inclination : inclination of the slope, rad
    knots, coefficients : (m,) s and (m − 6, 28) rad, quintic B-splines of the coordinates `chain.PRESCRIBED`
    antenna : place of the GPS antenna; None without a GPS
    round_trip : agreement with the capture, one row per captured segment
    start, stop : the part of the clock that all instruments cover, s
    foot_sigma : standard deviations of the feet where most of the posture was assumed; None for a whole capture
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
        """Return angles, rates and accelerations, each (…, 28) rad, rad/s, rad/s², at ``time`` (…) s."""
        spline = BSpline.construct_fast(self.knots, self.coefficients, _DEGREE)
        return spline(time), spline(time, nu=1), spline(time, nu=2)


def spline_motion(geometry: Geometry, inclination: float, time: Array, angles: Array) -> Motion:
    """Make a motion through ``angles`` (n, 28) rad at increasing ``time`` (n,) s, n ≥ 6.

    It has neither antenna nor round trip.  The third and fourth derivatives are zero at both ends, so the ends do not
    swing.
    """
    # Any: scipy takes a list of conditions at each end, its stubs do not know it.
    ends: Any = [(3, np.zeros(len(PRESCRIBED))), (4, np.zeros(len(PRESCRIBED)))]
    spline = make_interp_spline(time, angles, k=_DEGREE, bc_type=(ends, ends))
    return Motion(geometry, inclination, spline.t, spline.c, None, (), float(time[0]), float(time[-1]))


def relative_poses(motion: Motion, time: Array, segments: Sequence[int] = WHOLE) -> tuple[Poses, Rates]:
    """Return poses and rates of the segments in the slope frame at ``time`` (…), as ``forward_kinematics`` takes them.

    The pelvis' origin is held at zero.
    """
    free = np.zeros((*np.shape(time), 3))
    q, qd, qdd = (np.concatenate([free, part], axis=-1) for part in motion.evaluate(time))
    poses = forward_kinematics(motion.geometry, q, motion.inclination, segments)
    return poses, rates(poses, qd, qdd, segments)


def antenna_offset(motion: Motion, time: Array) -> tuple[Array, Array]:
    """Return the antenna's place (…, 3) m and velocity (…, 3) m/s at ``time`` (…) s.

    Both count from the pelvis' origin, in the slope frame.

    Raises ValueError when the motion has no antenna.
    """
    place, velocity, _, _ = antenna_movement(motion, time)
    return place, velocity


def antenna_movement(motion: Motion, time: Array) -> tuple[Array, Array, Array, Array]:
    """Return the same place and velocity, and of the segment that carries the antenna rotation (…, 3, 3) to the slope
    frame and spin (…, 3) rad/s.

    Raises ValueError when the motion has no antenna.
    """
    if motion.antenna is None:
        raise ValueError("this motion has no GPS antenna")
    at = motion.antenna.segment
    poses, moving = relative_poses(motion, time, path_to(at))
    rotation, spin = poses.rotation[..., at, :, :], moving.angular_velocity[..., at, :]
    arm = rotation @ motion.antenna.offset
    return poses.origin[..., at, :] + arm, moving.velocity[..., at, :] + cross(spin, arm), rotation, spin


def turn_motion(motion: Motion, yaw: Callable[[Array], Array]) -> Motion:
    """Turn a motion about gravity by ``yaw`` ((n,) s → (n,) rad), a straight line in time, positive to the left.

    A spline whose coefficients lie on a line over their knots' averages (Greville's abscissae) is that line.
    """
    coefficients = motion.coefficients.copy()
    coefficients[:, PRESCRIBED.index("pelvis_rotation")] += yaw(greville_abscissae(motion))
    return replace(motion, coefficients=coefficients)


def greville_abscissae(motion: Motion) -> Array:
    """Return the times (m − 6,) s that the coefficients of the motion's splines stand for."""
    return np.asarray(np.convolve(motion.knots[1:-1], np.full(_DEGREE, 1.0 / _DEGREE), mode="valid"))
