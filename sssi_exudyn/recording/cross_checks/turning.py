"""The turning of track, capture and loads on one clock: what several checks compare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.slope_and_heading import local_fit

_SLOW: Final = 1.5
"""Speed, m/s, below which a course is noise."""
_WINDOW: Final = 0.6
"""Half width, s, of the fits from which a track of 2 cm noise is differentiated."""


@dataclass(frozen=True)
class TrackTurning:
    """Course and sideways acceleration of a track at its fixes, where it is fast enough to have them.

    time : (n,) s;  course : (n,) rad clockwise, unwrapped;  to_left : (n,) m/s² of the acceleration across the course
    """

    time: Array
    course: Array
    to_left: Array


def turning_of_track(gps: Gps, start: float, stop: float) -> TrackTurning:
    """Return the turning of the fixes between ``start`` and ``stop`` (s), as smooth as their own noise requires."""
    window = window_of(gps, _WINDOW, 0.5)
    fitted = local_fit(gps.time, gps.enu[:, :2], window)
    velocity = fitted[1, :, 1] + 1j * fitted[1, :, 0]
    if gps.speed is not None and gps.course is not None:
        velocity = gps.speed * np.exp(1j * gps.course)
    course = np.unwrap(np.angle(velocity))
    to_left = -np.abs(velocity) * np.gradient(course, gps.time)
    inside = gps.between(start, stop) & (np.abs(velocity) > _SLOW)
    return TrackTurning(gps.time[inside], course[inside], to_left[inside])


def window_of(gps: Gps, usual: float, least: float) -> float:
    """Return the half width (s) of fits to fixes that balances their noise and the bias, at least two steps.

    Parameters
    ----------
    usual : s, for noise of 2 cm
    least : noise over 2 cm that is assumed at least
    """
    noise = 1.4826 * float(np.median(np.abs(np.diff(gps.enu[:, :2], 3, axis=0)))) / np.sqrt(20.0)
    # noise of a derivative over a window T goes with sigma/T^1.5, its bias with T²: the best T goes with sigma^(2/7)
    return float(max(usual * max(noise / 0.02, least) ** (2.0 / 7.0), 2.0 * float(np.median(np.diff(gps.time)))))


def direction_of_skis(bvh: Bvh) -> Array:
    """Return the azimuth (n,) rad of both feet in the capture's world, clockwise and unwrapped."""
    forward = np.zeros((len(bvh.time), 3))
    for name in ("LeftFoot", "RightFoot"):
        joint = bvh.index(name)
        axis = np.broadcast_to([0.0, 0.0, 1.0], forward.shape)
        while joint >= 0:
            axis = np.einsum("nij,nj->ni", bvh.rotations[:, joint], axis)
            joint = bvh.parents[joint]
        forward += axis
    return np.asarray(np.unwrap(np.arctan2(-forward[:, 0], forward[:, 2])))
