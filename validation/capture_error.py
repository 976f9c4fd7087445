"""What errors of the motion capture do to a simulated run: responses to slow errors of the feet, one by one.

Each segment's orientation is wrong by a constant and by something that wanders over seconds, as sensors strapped to
limbs are.  What of that moves a run: each foot's turn about its three axes, and its height under the pelvis (errors of
shank, thigh and pelvis add up there), which shifts load from ski to ski.  The antenna rides on the torso and follows
that segment's error without anything being simulated.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.core.frames import Array, slope_to_level
from sssi_exudyn.core.rotations import rotations_about
from sssi_exudyn.fitting.measurements import Measurements
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, relative_poses
from sssi_exudyn.simulation.reduced import Prepared
from sssi_exudyn.simulation.sensitivities import sensitivities

SPACING: Final = 1.5
"""s between the supports of an error that wanders; its correlation time is twice that."""
_MOST: Final = 24
"""Supports at most, however long the run."""
USUAL: Final = float(np.radians(0.4))
"""rad by which a whole capture's segments are usually wrong, before the data speak."""
_SIDES: Final = ("l", "r")


@dataclass(frozen=True)
class CaptureError:
    """One way in which the capture may be wrong.

    kind : "roll", "pitch", "yaw" of a foot, or its "height"
    side : 0 left, 1 right;  support : centre and half-width of a hat in time (s); None for a constant
    scale : what one radian of a segment's error makes of it, rad or m
    """

    kind: str
    side: int
    support: tuple[float, float] | None
    scale: float

    def profile(self, time: Array) -> Array:
        """(n,) the error at ``time`` (n,), one where it is greatest."""
        if self.support is None:
            return np.ones(len(time))
        centre, width = self.support
        return np.maximum(0.0, 1.0 - np.abs(time - centre) / width)


def capture_errors(motion: Motion, prepared: Prepared) -> list[CaptureError]:
    """All of them for a run: constants, and hats that together follow whatever wanders slowly."""
    begin, end = float(prepared.time[0]), float(prepared.time[-1])
    count = min(_MOST, max(2, round((end - begin) / SPACING) + 1))
    centres = np.linspace(begin, end, count)
    width = centres[1] - centres[0]
    supports = [None, *((float(centre), float(width)) for centre in centres)]
    lift = _height_scales(motion, prepared.time[:: max(1, len(prepared.time) // 50)])
    sigma = motion.foot_sigma

    def scale(kind: str, side: int) -> float:
        """A posture that was assumed is wrong by what its makers say, where a captured one would be by the usual."""
        if sigma is not None:
            return float(getattr(sigma, kind)) / USUAL
        return lift[side] if kind == "height" else 1.0

    return [
        CaptureError(kind, side, support, scale(kind, side))
        for kind in ("roll", "pitch", "yaw", "height")
        for side in range(2)
        for support in supports
    ]


def with_error(prepared: Prepared, error: CaptureError, size: complex) -> Prepared:
    """The tables of a capture that is wrong by ``size`` (rad or m) times the error's profile; a complex size carries a
    derivative.
    """
    at = np.asarray(size * error.profile(prepared.time))
    rate = np.gradient(at, prepared.time)
    if error.kind == "height":
        place, velocity = prepared.foot_place.astype(at.dtype), prepared.foot_velocity.astype(at.dtype)
        acceleration = prepared.foot_acceleration.astype(at.dtype)
        place[:, error.side, 2] += at
        velocity[:, error.side, 2] += rate
        acceleration[:, error.side, 2] += np.gradient(rate, prepared.time)
        return replace(prepared, foot_place=place, foot_velocity=velocity, foot_acceleration=acceleration)
    axis = prepared.foot_rotation[:, error.side, :, ("roll", "pitch", "yaw").index(error.kind)]
    rotation, spin = prepared.foot_rotation.astype(at.dtype), prepared.foot_spin.astype(at.dtype)
    rotation[:, error.side] = rotations_about(axis, at) @ rotation[:, error.side]
    spin[:, error.side] += rate[:, None] * axis
    return replace(prepared, foot_rotation=np.ascontiguousarray(rotation), foot_spin=spin)


def responses(model: Model, prepared: Prepared, measurements: Measurements, errors: Sequence[CaptureError]) -> Array:
    """(N, errors) change of what the instruments would say, a radian of segments' error."""
    changes = [partial(_change, error) for error in errors]
    slopes = sensitivities(model, prepared, (), measurements.predict, changes)[1]
    return np.asarray(slopes * [error.scale for error in errors])


def _change(error: CaptureError, prepared: Prepared, size: complex) -> Prepared:
    return with_error(prepared, error, size)


def antenna_responses(motion: Motion, model: Model, measurements: Measurements) -> Array:
    """(N, 3·k) what the torso's errors about its three axes do to the antenna's place, a radian, hat by hat."""
    assert motion.antenna is not None
    time = measurements.fixes
    poses, _ = relative_poses(motion, time)
    torso = motion.antenna.segment
    arm = poses.rotation[:, torso] @ motion.antenna.offset
    scale = 1.0 if motion.foot_sigma is None else motion.foot_sigma.roll / USUAL
    count = min(_MOST, max(2, round((time[-1] - time[0]) / SPACING) + 1))
    centres = np.linspace(time[0], time[-1], count)
    columns = []
    for axis in range(3):
        moved = np.cross(poses.rotation[:, torso, :, axis], arm) @ slope_to_level(model.inclination).T
        for centre in centres:
            hat = np.maximum(0.0, 1.0 - np.abs(time - centre) / (centres[1] - centres[0]))
            column = np.zeros(len(measurements.measured))
            column[: 3 * len(time)] = scale * (moved * hat[:, None]).T.ravel()
            columns.append(column)
    return np.stack(columns, axis=1)


def _height_scales(motion: Motion, time: Array) -> tuple[float, float]:
    """m a radian: root of the summed squares of what a turn of shank, thigh and pelvis does to each foot's height."""
    poses, _ = relative_poses(motion, time)
    scales = []
    for side in _SIDES:
        chain = ("pelvis", f"femur_{side}", f"tibia_{side}", f"talus_{side}")
        places = [poses.origin[:, SEGMENT[name]] for name in chain]
        arms = [b - a for a, b in itertools.pairwise(places)]
        scales.append(float(np.sqrt(np.mean(sum(np.sum(arm[:, :2] ** 2, axis=1) for arm in arms)))))
    return scales[0], scales[1]
