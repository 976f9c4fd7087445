"""A simulated run as the GPS would have seen it: the antenna's horizontal place at the instants of the fixes.

Both are in the level frame (x along the fall line's azimuth, y left of it), metres.  Heights are left out: a fix'
height is several times less sure than its place, and the slope's plane holds the simulated one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sssi_exudyn.estimate import COARSE
from sssi_exudyn.frames import Array, level_to_enu, slope_to_enu, slope_to_level
from sssi_exudyn.gps import Gps
from sssi_exudyn.model import Model, Start
from sssi_exudyn.motion import Motion
from sssi_exudyn.sensors import gps_offset

_FIRST = 1.2
"""s of fixes from which place and velocity at the start are guessed; long against the noise, short against a turn."""
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


def seen_by_gps(model: Model, time: Array, antenna: Array, fixes: Array) -> Array:
    """The simulated antenna (m, 3) at ``time`` (m,), slope frame, as places (n, 3) in the level frame at ``fixes``
    (n,).

    Heights over the snow count from the antenna's at the start, where the model's start puts it on the measured track.
    A GPS clock that is late by c stamps at t + c what happened at t; the model's GPS faults displace what it reports.
    Before the start and after the end the antenna is taken to go on with the acceleration that it has there.
    """
    risen = antenna - [0.0, 0.0, antenna[0, 2]]
    level = risen @ slope_to_level(model.inclination).T
    at = fixes - model.start.clock_offset
    seen = np.stack([np.interp(at, time, level[:, axis]) for axis in range(3)], axis=1)
    for outside, near, end in ((at < time[0], slice(None, _END), 0), (at > time[-1], slice(-_END, None), -1)):
        if np.any(outside):
            course = np.polynomial.polynomial.polyfit(time[near], level[near], 2)
            gone_on = np.polynomial.polynomial.polyval(np.append(at[outside], time[end]), course).T
            seen[outside] = level[end] + gone_on[:-1] - gone_on[-1]  # without a jump where the run ends
    return seen + gps_offset(model.sensors, fixes)


def mended(gps: Gps, model: Model) -> Gps:
    """The fixes as they would be without the GPS faults that the model has."""
    azimuth = model.fall_line_azimuth
    offset = gps_offset(model.sensors, gps.time) @ level_to_enu(azimuth).T
    return replace(gps, time=gps.time - model.start.clock_offset, enu=gps.enu - offset)


def first_guess(gps: Gps, motion: Motion, inclination: float, azimuth: float) -> Start:
    """Place and velocity of the antenna at the motion's start, from a cubic through the first fixes (about 0.3 m/s in
    a turn); a receiver's own speed and course are taken where its fixes are too coarse to be differentiated.
    """
    slope = gps.enu @ slope_to_enu(inclination, azimuth)
    if float(np.median(gps.sigma)) > COARSE and gps.speed is not None and gps.course is not None:
        f, l, speed, course = (  # noqa: E741
            float(np.interp(motion.start, gps.time, values))
            for values in (slope[:, 0], slope[:, 1], gps.speed, gps.course)
        )
        # over ground; down the slope the way is longer
        along = speed * np.cos(course - azimuth) / np.cos(inclination)
        return Start(f=f, l=l, velocity_f=float(along), velocity_l=float(-speed * np.sin(course - azimuth)))
    apart = np.abs(gps.time - motion.start)
    near = np.argsort(apart)[: max(6, int(np.count_nonzero(apart <= _FIRST)))]
    since = gps.time[near] - motion.start
    order = min(3, max(1, len(since) - 3))
    line = np.polynomial.polynomial.polyfit(since, slope[near, :2], order)
    return Start(f=float(line[0, 0]), l=float(line[0, 1]), velocity_f=float(line[1, 0]), velocity_l=float(line[1, 1]))
