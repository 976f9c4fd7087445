"""The model of a recorded skier before any fit."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.bodies.skier.chain import FEET, SEGMENT
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.terms.body_forces import PlantedPole
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.model.model import Model, Start
from sssi_exudyn.motion.hands import hands_at
from sssi_exudyn.motion.motion import Motion, relative_poses
from sssi_exudyn.recording.equipment import read_equipped_ski
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.poles import plants_of
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.recording.slope_and_heading import COARSE


def model_of(recording: Recording, motion: Motion) -> Model:
    """Return the paper's model of a recorded skier.

    It has default friction, starts from the GPS, and has the pole plants that load cells felt.
    """
    model = Model(
        name=recording.name,
        skier=recording.skier,
        equipment=recording.equipment,
        ski=read_equipped_ski(recording.equipment, recording.folder, recording.folder / FILE),
        inclination=recording.slope.inclination,
        fall_line_azimuth=recording.slope.fall_line_azimuth,
        terms=(*PAPER_TERMS, *planted_poles(recording, motion)),
    )
    if recording.gps is None:
        return model
    return replace(model, start=first_guess(recording.gps, motion, model.inclination, model.fall_line_azimuth))


def planted_poles(recording: Recording, motion: Motion) -> tuple[PlantedPole, ...]:
    """Return the pole plants that the recording's load cells felt within the motion; none without load cells.

    Each plant has its measured impulse and times.  The tip's distance ahead of the hand, when the pole is set, follows
    from the hand's height over the snow and the pole's length.
    """
    plants = () if recording.poles is None else plants_of(recording.poles)
    about = quantities(PlantedPole)
    first, last = max(motion.start, about["t0"].low), min(motion.stop, about["t1"].high)
    within = [plant for plant in plants if first <= plant.start and plant.stop <= last]
    if not within:
        return ()
    begin = np.array([plant.start for plant in within])
    hands = hands_at(motion, begin).place
    poses, _ = relative_poses(motion, begin)
    down = np.array([0.0, 0.0, -motion.geometry.ankle_to_ski_base])
    ankles = np.stack([poses.origin[:, SEGMENT[f"talus_{side}"]] for side in "lr"], axis=1)
    soles = ankles + np.stack([poses.rotation[:, foot] @ down for foot in FEET], axis=1)
    snow = soles[..., 2].min(axis=1)
    length, most = recording.equipment.pole_length, about["ahead"].high
    poles = []
    for plant, hand, ground in zip(within, hands, snow, strict=True):
        height = hand[0 if plant.side > 0 else 1, 2] - ground
        ahead = float(np.sqrt(max(length**2 - height**2, 0.0)))
        press = 2.0 * plant.impulse / (plant.stop - plant.start)  # the mean of its course is half of its largest
        poles.append(
            PlantedPole(press, plant.start, plant.stop, min(ahead, most), length=length, side=float(plant.side))
        )
    return tuple(poles)


_FAR = 6.0
"""Limit of a fix's distance from a line through the first fixes, in medians: one normal error in a billion is beyond.
"""
_MOST_FAR = 2
"""Number of the first fixes that may be far off."""
VELOCITY_SIGMA = 0.5
"""Lowest standard deviation of a guessed velocity, m/s."""
_FIRST = 1.2
"""Duration of the fixes for the guess of the start, s; long against the noise, short against a turn."""
_FINE = 0.05
"""Noise of fixes, m, at which a cubic through them is wrong by half a metre per second at its end."""
_ACCELERATION, _TURN = 4.0, 1.0
"""Standard deviation of a skier's acceleration along each axis, m/s², and its correlation time, s: half a turn."""
_SPEED = 15.0
"""Standard deviation of a skier's velocity along each axis before any measurement, m/s."""
_SMOOTHED = 6.0
"""Duration of the coarse fixes about the start, s; those farther away say nothing of it."""
_CELL, _MOST_CELLS = 0.1, 500
"""Duration of a constant acceleration, s, and their greatest number; they are longer where fixes are hours apart."""


def first_guess(gps: Gps, motion: Motion, inclination: float, azimuth: float) -> Start:
    """Guess the antenna's place and velocity at the motion's start, from a cubic through the first fixes.

    The velocity is good to about 0.3 m/s in a turn.  Where fixes are too coarse to be differentiated, the receiver's
    own speed and course are taken; without these, the fixes are smoothed.
    """
    return guess_with_error(gps, motion, inclination, azimuth)[0]


def guess_with_error(gps: Gps, motion: Motion, inclination: float, azimuth: float) -> tuple[Start, float]:
    """Return ``first_guess`` and the standard deviation (m/s) of each component of its velocity."""
    slope, sigma = gps.enu @ slope_to_enu(inclination, azimuth), float(np.median(gps.sigma))
    if sigma > COARSE and gps.speed is not None and gps.course is not None:
        f, l, speed, course = (  # noqa: E741
            float(np.interp(motion.start, gps.time, values))
            for values in (slope[:, 0], slope[:, 1], gps.speed, gps.course)
        )
        # over ground; down the slope the path is longer
        along = speed * np.cos(course - azimuth) / np.cos(inclination)
        start = Start(f=f, l=l, velocity_f=float(along), velocity_l=float(-speed * np.sin(course - azimuth)))
        return start, VELOCITY_SIGMA
    apart = np.abs(gps.time - motion.start)
    if sigma > _FINE:
        near = np.flatnonzero(apart <= max(_SMOOTHED, float(np.sort(apart)[min(3, len(apart) - 1)])))
        line, error = _smooth_motion(gps.time[near] - motion.start, slope[near, :2], gps.sigma[near])
    else:
        near = np.argsort(apart)[: max(6, int(np.count_nonzero(apart <= _FIRST)))]
        line, error = _smooth_line(gps.time[near] - motion.start, slope[near, :2], sigma), VELOCITY_SIGMA
    f, l, velocity_f, velocity_l = map(float, line[:2].ravel())  # noqa: E741
    return Start(f=f, l=l, velocity_f=velocity_f, velocity_l=velocity_l), max(error, VELOCITY_SIGMA)


def _smooth_motion(time: Array, place: Array, sigma: Array) -> tuple[Array, float]:
    """Return the most probable place and velocity (2, 2) at time zero, and the velocity's standard deviation.

    They follow from places (n, 2) m at ``time`` (n,) s with noise of ``sigma`` (n,) m.  A skier's acceleration is a
    process with exponential correlation.

    Source: Rasmussen and Williams 2006, ch. 2, with the process integrated twice.
    """
    edge = float(np.max(np.abs(time))) + _CELL
    cell = max(_CELL, 2.0 * edge / _MOST_CELLS)
    cells = np.arange(-edge + 0.5 * cell, edge, cell)
    since, at = time[:, None], cells[None, :]
    between = (at * since > 0.0) & (np.abs(at) < np.abs(since))
    moved = np.where(between, np.abs(since - at), 0.0) * cell
    process = _ACCELERATION**2 * np.exp(-np.abs(cells[:, None] - cells[None, :]) / _TURN)
    far = float(np.ptp(place)) + float(sigma.max())
    begins = np.column_stack([far * np.ones_like(time), _SPEED * time])
    covariance = begins @ begins.T + moved @ process @ moved.T + np.diag(sigma**2)
    gain = np.linalg.solve(covariance, begins * [far, _SPEED]).T
    first = place[np.argmin(np.abs(time))]
    error = np.sqrt(max(_SPEED**2 - float(gain[1] @ (begins[:, 1] * _SPEED)), 0.0))
    return np.asarray(gain @ (place - first) + [first, np.zeros(2)]), float(error)


def _smooth_line(time: Array, place: Array, sigma: float) -> Array:
    """Return the coefficients (order + 1, 2) of a cubic, or a lower order for few places, by least squares.

    It goes through places (n, 2) m at ``time`` (n,) s, without single places that are far off for fixes of ``sigma``
    (m).  Least trimmed squares detect these: of all curves that leave out two places, the best one decides.  A place
    that is far off at the end would bend any curve that includes it.
    Source: Rousseeuw, J. Am. Stat. Assoc. 79 (1984) 871.
    """
    order = min(3, max(1, len(time) - 3))
    powers = np.vander(time, order + 1, increasing=True)

    def fit(kept: NDArray[np.intp]) -> Array:
        return np.asarray(np.linalg.lstsq(powers[kept], place[kept], rcond=None)[0])

    everything = np.arange(len(time))
    left_out = min(_MOST_FAR, len(time) - order - 3)
    if left_out <= 0:
        return fit(everything)
    subsets = [np.setdiff1d(everything, out) for out in combinations(range(len(time)), left_out)]
    best = min(subsets, key=lambda kept: float(np.sum((place[kept] - powers[kept] @ fit(kept)) ** 2)))
    apart = np.linalg.norm(place - powers @ fit(best), axis=1)
    return fit(np.flatnonzero(apart <= _FAR * max(float(np.median(apart)), sigma)))
