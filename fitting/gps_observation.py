"""A simulated run as the GPS would have seen it: the antenna's horizontal place at the instants of the fixes.

Both are in the level frame (x along the fall line's azimuth, y left of it), metres.  Heights are left out: a fix'
height is several times less sure than its place, and the slope's plane holds the simulated one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sssi_exudyn.core.frames import Array, level_to_enu, slope_to_level
from sssi_exudyn.model.faults import gps_offset
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.instruments.gps import Gps

_END = 60
"""Samples of a simulation from which it is continued beyond its ends."""


@dataclass(frozen=True)
class Track:
    """The fixes that a simulation from ``start`` to ``stop`` is held against.

    time : (n,) s, the recording's clock;  place : (n, 2) m in the level frame;  sigma : (n,) m of each component
    """

    time: Array
    place: Array
    sigma: Array


def track_of(gps: Gps, azimuth: float, start: float, stop: float, margin: float = 0.0) -> Track:
    """The fixes between ``start`` and ``stop`` (s), both shortened by ``margin``, on a slope that falls to
    ``azimuth`` (rad).
    """
    inside = (gps.time >= start + margin - 1e-9) & (gps.time <= stop - margin + 1e-9)
    place = gps.enu[inside] @ level_to_enu(azimuth)
    return Track(gps.time[inside], place[:, :2], gps.sigma[inside])


def predict_fixes(model: Model, time: Array, antenna: Array, fixes: Array) -> Array:
    """The simulated antenna (m, 3) at ``time`` (m,), slope frame, as places (n, 3) in the level frame at ``fixes``
    (n,).

    Heights over the snow count from the antenna's at the start, where the model's start puts it on the measured track.
    A GPS clock that is late by c stamps at t + c what happened at t; the model's GPS faults displace what it reports.
    Before the start and after the end the antenna is taken to go on with the acceleration that it has there.
    """
    risen = antenna - [0.0, 0.0, antenna[0, 2]]
    level = risen @ slope_to_level(model.inclination).T
    at = fixes - model.start.clock_offset
    seen = _interpolate(at, time, level)
    for outside, near, end in (
        (at.real < time[0], slice(None, _END), 0),
        (at.real > time[-1], slice(-_END, None), -1),
    ):
        if np.any(outside):
            course = np.linalg.pinv(np.vander(time[near] - time[end], 3)) @ level[near]
            # without a jump where the run ends
            seen[outside] = level[end] + np.vander(at[outside] - time[end], 3)[:, :2] @ course[:2]
    return seen + gps_offset(model.sensors, fixes)


def _interpolate(at: Array, time: Array, values: Array) -> Array:
    """(n, d) between the values (m, d) at ``time``, constant beyond its ends; complex numbers carry derivatives."""
    row = np.clip(np.searchsorted(time, at.real, side="right") - 1, 0, len(time) - 2)
    share = (at - time[row]) / (time[row + 1] - time[row])
    share = np.where(share.real < 0.0, 0.0, np.where(share.real > 1.0, 1.0, share))[:, None]
    return np.asarray((1.0 - share) * values[row] + share * values[row + 1])


def correct_fixes(gps: Gps, model: Model) -> Gps:
    """The fixes as they would be without the GPS faults that the model has."""
    azimuth = model.fall_line_azimuth
    offset = gps_offset(model.sensors, gps.time) @ level_to_enu(azimuth).T
    return replace(gps, time=gps.time - model.start.clock_offset, enu=gps.enu - offset)
