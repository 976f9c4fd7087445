"""The model of a recorded skier before anything is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.core.frames import slope_to_enu
from sssi_exudyn.model.model import Model, Start
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.equipment import read_equipped_ski
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.recording.slope_and_heading import COARSE


def model_of(recording: Recording, motion: Motion) -> Model:
    """The paper's model of a recorded skier, with default friction, started from the GPS."""
    model = Model(
        name=recording.name,
        skier=recording.skier,
        equipment=recording.equipment,
        ski=read_equipped_ski(recording.equipment, recording.folder, recording.folder / FILE),
        inclination=recording.slope.inclination,
        fall_line_azimuth=recording.slope.fall_line_azimuth,
        terms=PAPER_TERMS,
    )
    if recording.gps is None:
        return model
    return replace(model, start=first_guess(recording.gps, motion, model.inclination, model.fall_line_azimuth))


_FAR = 6.0
"""Of the median distance of the first fixes from a line through them: one normal error in a billion is beyond."""
_FIRST = 1.2
"""s of fixes from which place and velocity at the start are guessed; long against the noise, short against a turn."""


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
    apart = np.linalg.norm(slope[near, :2] - np.polynomial.polynomial.polyval(since, line).T, axis=1)
    kept = apart <= _FAR * float(np.median(apart))
    if np.count_nonzero(kept) >= order + 3 and not np.all(kept):  # single fixes that are far off
        line = np.polynomial.polynomial.polyfit(since[kept], slope[near[kept], :2], order)
    return Start(f=float(line[0, 0]), l=float(line[0, 1]), velocity_f=float(line[1, 0]), velocity_l=float(line[1, 1]))
