"""What the instruments measure of a run, and what they would measure of a simulated one.

``Track`` has the fixes' horizontal places alone, ``Measurements`` what hypotheses are compared by, ``Observation`` all
that is measured of a run with what a real skier does not leave over: the moment about the pelvis.  Each stacks its
instruments' readings as blocks of one vector; ``noise.BLOCKS_OF`` says which noise a block has.

Places are in the level frame (x along the fall line's azimuth, y left of it), metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Protocol

import numpy as np

from sssi_exudyn.core.frames import Array, level_to_enu, slope_to_level
from sssi_exudyn.core.noise import Scale, tail_weight
from sssi_exudyn.fitting.autocorrelated_noise import whiten
from sssi_exudyn.fitting.balance import Balance, moment_by_slip_noise
from sssi_exudyn.fitting.noise import BLOCKS_OF, HEIGHT_ORIGIN, NoiseLevels, UsualLevels, usual_levels
from sssi_exudyn.model.faults import gps_offset, insole_lateness, insole_readings
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.instruments.gps import VERTICAL, Gps
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun

_END: Final = 60
"""Samples of a simulation from which it is continued beyond its ends."""
_COMPARED: Final = ("x", "y", "height", "load", "difference")
"""Blocks of ``Measurements``."""
_OBSERVED: Final = tuple(block for blocks in BLOCKS_OF.values() for block in blocks)
"""Blocks of ``Observation``."""
INTERVAL: Final = 0.1
"""s over which the insoles' forces are averaged; faster changes are the capture's noise in accelerations."""
_LEAST_COUNT: Final = 1e-4
_MARGIN: Final = 0.3
"""s at both ends in which insoles and moment are not used: the simulated skier is still settling, splines end."""
_UNKNOWN_TURN: Final = 5.0
"""m/s² by which a skier's acceleration before the start or after the end differs from that at it: half of g across,
from one turn to the next."""


@dataclass(frozen=True)
class Track:
    """The fixes that a simulation from ``start`` to ``stop`` is held against.

    time : (n,) s, the recording's clock;  place : (n, 2) m in the level frame;  sigma : (n,) m of each component
    """

    time: Array
    place: Array
    sigma: Array


def track_of(gps: Gps, azimuth: float, start: float, stop: float, margin: float = 0.0) -> Track:
    """Return the fixes between ``start`` and ``stop`` (s), both shortened by ``margin``, on a slope that falls to
    ``azimuth`` (rad).
    """
    inside = gps.between(start + margin, stop - margin)
    place = gps.enu[inside] @ level_to_enu(azimuth)
    return Track(gps.time[inside], place[:, :2], gps.sigma[inside])


def predict_fixes(model: Model, time: Array, antenna: Array, fixes: Array) -> Array:
    """Return the simulated antenna (m, 3) at ``time`` (m,), slope frame, as places (n, 3) in the level frame at
    ``fixes`` (n,).

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
            course = _parabola_of((time[near] - time[end]).tobytes()) @ level[near]
            # without a jump where the run ends
            seen[outside] = level[end] + np.vander(at[outside] - time[end], 3)[:, :2] @ course[:2]
    return seen + gps_offset(model.sensors, fixes)


@lru_cache(maxsize=16)  # an estimate asks some thousand times for those of one run
def _parabola_of(time: bytes) -> Array:
    """Return (3, m) by which values at instants (m,) s, given by their bytes, give the parabola through them, the
    square's coefficient first.
    """
    return np.asarray(np.linalg.pinv(np.vander(np.frombuffer(time), 3)))


def _interpolate(at: Array, time: Array, values: Array) -> Array:
    """Interpolate (n, d) between the values (m, d) at ``time``, constant beyond its ends; complex numbers carry
    derivatives.
    """
    row = np.clip(np.searchsorted(time, at.real, side="right") - 1, 0, len(time) - 2)
    share = (at - time[row]) / (time[row + 1] - time[row])
    share = np.where(share.real < 0.0, 0.0, np.where(share.real > 1.0, 1.0, share))[:, None]
    return np.asarray((1.0 - share) * values[row] + share * values[row + 1])


def correct_fixes(gps: Gps, model: Model) -> Gps:
    """Return the fixes as they would be without the GPS faults that the model has."""
    azimuth = model.fall_line_azimuth
    offset = gps_offset(model.sensors, gps.time) @ level_to_enu(azimuth).T
    return replace(gps, time=gps.time - model.start.clock_offset, enu=gps.enu - offset)


class SimulatedRun(Protocol):
    """What is needed of a simulated run, full or reduced."""

    @property
    def time(self) -> Array: ...
    @property
    def antenna(self) -> Array | None: ...
    @property
    def sole_force(self) -> Array: ...


@dataclass(frozen=True)
class Measurements:
    """The measurements that a simulation from ``start`` to ``stop`` is held against.

    fixes : (n,) s;  place : (n, 3) m in the level frame;  gps_sigma : m, of a horizontal fix as its instrument says
    windows : (m,) s, middles of the insoles' intervals;  loads : (m, 2) N averages over them, left and right
    stated : (n,) what each fix counts by its own standard deviation, 1 for an ordinary one
    counts : (n,) the same, less where it is far off its neighbours (``objective.counts_of``)
    vertical : standard deviation of a fix's height over that of its place, as its instrument says
    """

    fixes: Array
    place: Array
    gps_sigma: float
    windows: Array
    loads: Array
    stated: Array
    counts: Array
    vertical: float = VERTICAL

    @property
    def scale(self) -> Scale:
        """Return by how much noisier each of the N measurements is than its instrument's usual ones.  Fixes are for
        seconds where they say so, and for themselves alone where they are off.
        """
        loads = np.ones(2 * len(self.windows))
        lasting, total = (1.0 / np.sqrt(np.maximum(counts, _LEAST_COUNT)) for counts in (self.stated, self.counts))
        return Scale(*(np.concatenate([fixes, fixes, fixes, loads]) for fixes in (lasting, total)))

    @property
    def measured(self) -> Array:
        """(N,) all blocks."""
        return _stack(self.place, self.loads)

    @property
    def blocks(self) -> dict[str, slice]:
        """Return where each block stands in the vector."""
        n, m = len(self.fixes), len(self.windows)
        edges = np.cumsum([0, n, n, n, m, m])
        return {name: slice(int(a), int(b)) for name, a, b in zip(_COMPARED, edges[:-1], edges[1:], strict=True)}

    @property
    def usual(self) -> UsualLevels:
        """The noise that instruments of the stated quality show."""
        stated = self.gps_sigma, self.vertical * self.gps_sigma
        return usual_levels(*stated, mean_load(self.loads), Uncertainty().residual_moment)

    def time_of(self, block: str) -> Array:
        """Return instants of a block's values (s)."""
        return self.windows if block in ("load", "difference") else self.fixes

    def stamped_by(self, clock_offset: float, start: float, stop: float) -> Measurements:
        """Return the same by a clock that is so late (s).  A fix of an instant outside the run is predicted the less
        well the farther away it is, by an unknown acceleration, and counts so.
        """
        at = self.fixes - clock_offset
        outside = np.maximum(np.maximum(start - at, at - stop), 0.0)
        off = 0.5 * _UNKNOWN_TURN * outside**2 / self.gps_sigma
        return replace(self, counts=self.counts / (1.0 + self.counts * off**2))

    def predict(self, model: Model, run: SimulatedRun) -> Array:
        """Return what the instruments would say of a simulated run, (N,)."""
        assert run.antenna is not None
        place = predict_fixes(model, run.time, run.antenna, self.fixes)
        return _stack(place, insole_loads(model, run.time, run.sole_force, self.windows))


def measurements_of(recording: Recording, model: Model, start: float, stop: float) -> Measurements:
    """Return the instruments of a recording between ``start`` and ``stop`` (s).  Raises ValueError without a GPS."""
    gps, insoles = recording.gps, recording.insoles
    if gps is None:
        raise ValueError("the recording has no GPS")
    inside = gps.between(start, stop)
    place = gps.enu[inside] @ level_to_enu(model.fall_line_azimuth)
    windows, loads = np.zeros(0), np.zeros((0, 2))
    if insoles is not None:
        first, last = max(start, insoles.time[0]) + _MARGIN, min(stop, insoles.time[-1]) - _MARGIN
        windows = np.arange(first, last, INTERVAL)
        loads = averages(insoles.time, np.stack([insoles.left, insoles.right], axis=1), windows)
    sigma = gps.sigma[inside]
    usual = float(np.median(sigma))
    stated = np.minimum(1.0, (usual / sigma) ** 2)
    return Measurements(gps.time[inside], place, usual, windows, loads, stated, stated, gps.vertical)


def averages(time: Array, values: Array, windows: Array, length: float = INTERVAL) -> Array:
    """Return averages (m, d) of ``values`` (n, d) at ``time`` (n,) s, over ``length`` (s) about ``windows`` (m,) s."""
    summed = np.zeros((len(time), values.shape[1]), dtype=values.dtype)
    summed[1:] = np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None], axis=0)
    edges = [[np.interp(windows + d, time, column) for column in summed.T] for d in (-0.5 * length, 0.5 * length)]
    return (np.array(edges[1]) - np.array(edges[0])).T / length


def insole_loads(model: Model, time: Array, sole: Array, windows: Array) -> Array:
    """Return what the insoles would read (m, 2) N on average about ``windows`` (m,) s, of the forces ``sole`` (n, 2) N
    square to the soles at ``time`` (n,).
    """
    return insole_readings(model.sensors, late_averages(model, time, sole, windows))


def late_averages(model: Model, time: Array, values: Array, windows: Array) -> Array:
    """Return averages (m, d) of ``values`` (n, d) about ``windows`` (m,) s by the clock of the model's insoles.

    Late ones are between neighbouring averages, by a cubic (Catmull and Rom): a load jumps by half from one instant to
    the next, so that a derivative by time is of nothing that lasts.
    """
    shift = -insole_lateness(model.sensors) / INTERVAL
    whole = np.floor(np.real(shift))
    s = shift - whole
    weights = (-s + 2 * s**2 - s**3, 2 - 5 * s**2 + 3 * s**3, s + 4 * s**2 - 3 * s**3, s**3 - s**2)
    within = time[0] + 0.5 * INTERVAL, time[-1] - 0.5 * INTERVAL
    parts = [
        0.5 * weight * averages(time, values, np.clip(windows + (whole + k) * INTERVAL, *within))
        for k, weight in zip((-1, 0, 1, 2), weights, strict=True)
        if weight != 0.0
    ]
    return np.asarray(sum(parts))


def mean_load(loads: Array) -> float:
    """Return the mean (N) of both soles' total of loads (m, 2); 1 without any."""
    return max(float(loads.sum(axis=1).mean()) if len(loads) else 0.0, 1.0)


def total_and_difference(loads: Array) -> Array:
    """Return (2m,) of loads (m, 2): both feet's total, then left less right."""
    return np.concatenate([loads.sum(axis=1), loads[:, 0] - loads[:, 1]])


def _stack(place: Array, loads: Array) -> Array:
    return np.concatenate([*place.T, total_and_difference(loads)])


@dataclass(frozen=True)
class Observation:
    """What is measured, N numbers in blocks.

    mass : kg of the skier, as stated
    measured : (N,);  blocks : where each stands;  times : of each block's rows (s)
    scale : by how much noisier each row is than its block
    usual : noise that instruments of the stated quality show
    """

    mass: float
    measured: Array
    blocks: Mapping[str, slice]
    times: Mapping[str, Array]
    scale: Scale
    usual: UsualLevels

    @property
    def has_heights(self) -> bool:
        """Return whether the fixes' heights are among the measurements."""
        return self.times["height"].size > 0

    @property
    def moments(self) -> slice:
        """Return where the moments stand."""
        return slice(self.blocks["moment_f"].start, self.blocks["moment_n"].stop)

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Blocks by instrument, of those that are measured."""
        return {
            instrument: names
            for instrument, names in BLOCKS_OF.items()
            if self.blocks[names[0]].stop > self.blocks[names[0]].start
        }

    def time_of(self, block: str) -> Array:
        """Return instants of a block's values (s)."""
        return self.times[block]

    def predict(self, model: Model, run: ReducedRun, balance: Balance, prepared: Prepared) -> Array:
        """Return what would be measured of a run of the reduced model, (N,), which may carry a complex step.

        The moment is that of the stated mass: a lighter skier is not better balanced.
        """
        seen = self.predict_instruments(model, run.time.real, run.antenna, run.sole_force)
        left_over = averages(run.time.real, balance.residual(run, prepared), self.times["moment_f"])
        return np.concatenate([seen, *(self.mass / model.skier.mass * left_over).T])

    def predict_instruments(self, model: Model, time: Array, antenna: Array, sole: Array) -> Array:
        """Return what the instruments would measure of antenna (n, 3) m and soles (n, 2) N at ``time`` (n,), (N −
        moments,).
        """
        place = predict_fixes(model, time, antenna, self.times["x"])
        heights = place[: len(self.times["height"]), 2]
        moving = np.zeros((2, 0))
        if self.times["speed_x"].size:
            speed = np.gradient(antenna, time, axis=0) @ slope_to_level(model.inclination).T
            moving = _interpolate(self.times["speed_x"] - model.start.clock_offset, time, speed[:, :2]).T
        loads = insole_loads(model, time, sole, self.times["load"])
        return np.concatenate([*place[:, :2].T, heights, *moving, total_and_difference(loads)])

    def weighed(self, residual: Array, levels: NoiseLevels) -> Observation:
        """Return the same with less weight for rows that a residual (N,) shows far off, except fixes, which have their
        counts.  A ski strikes a bump, an insole slips: that lasts; a height is far off for itself alone, and from the
        median of all, as heights count from an origin that is not known.
        """
        more = np.ones(len(residual))
        for name, place in self.blocks.items():
            if name not in BLOCKS_OF["gps"]:
                off = residual[place]
                if name == "height" and len(off):
                    off = off - np.median(off)
                far = off / (self.scale.total[place] * levels.of(name).sigma)
                more[place] = 1.0 / np.sqrt(tail_weight(far**2, 1))
        lasting = more.copy()
        lasting[self.blocks["height"]] = 1.0
        return replace(self, scale=Scale(self.scale.lasting * lasting, self.scale.total * more))

    def with_slip_noise(self, model: Model, run: ReducedRun) -> Observation:
        """Return the same with moments that count less where the feet's slip is not known well enough for them."""
        more = np.ones(len(self.measured))
        noise = averages(run.time, moment_by_slip_noise(model, run)[:, None], self.times["moment_f"])[:, 0]
        for block in ("moment_f", "moment_l"):
            more[self.blocks[block]] = np.hypot(1.0, noise / self.usual.of(block).sigma)
        return replace(self, scale=Scale(self.scale.lasting * more, self.scale.total * more))

    def whiten(self, levels: NoiseLevels, columns: Array) -> Array:
        """Return columns (N, c) in units of independent noise.  The origin of heights, known to ``HEIGHT_ORIGIN``, is
        part of the heights' noise.
        """
        out = np.array(columns, dtype=np.float64)
        for name, place in self.blocks.items():
            if place.stop > place.start:
                out[place] = whiten(self.times[name], out[place], levels.of(name), self.scale[place])
        if self.has_heights:
            place, noise = self.blocks["height"], levels.of("height")
            origin = whiten(self.times["height"], self.height_origin[place], noise, self.scale[place])[:, 0]
            square = float(origin @ origin)
            share = 1.0 - 1.0 / np.sqrt(1.0 + square)
            out[place] -= share / square * np.outer(origin, origin @ out[place])
        return out

    @property
    def height_origin(self) -> Array:
        """(N, 1) what heights are higher by with an origin that is higher by ``HEIGHT_ORIGIN``; (N, 0) without any."""
        column = np.zeros((len(self.measured), int(self.has_heights)))
        column[self.blocks["height"]] = HEIGHT_ORIGIN
        return column


def observation_of(
    recording: Recording, model: Model, motion: Motion, counts: Array, *, balanced: bool = True, heights: bool = False
) -> Observation:
    """Return the measurements of a recording; ``counts`` (n,) is what each fix counts (``counts_of``).  A skier who is
    taken to be ``balanced`` has the residual moment, zero, among them; the fixes' ``heights`` are where they have not
    shown the snow surface beforehand.

    Raises ValueError when the recording has no GPS.
    """
    seen = measurements_of(recording, model, motion.start, motion.stop)
    velocity_time, velocity = _measured_velocity(recording, model, motion)
    windows = np.arange(motion.start + _MARGIN, motion.stop - _MARGIN, INTERVAL) if balanced else np.zeros(0)
    high = slice(None) if heights else slice(0)
    fixes = (*[seen.fixes] * 2, seen.fixes[high])
    times = (*fixes, *[velocity_time] * 2, *[seen.windows] * 2, *[windows] * 3)
    edges = np.cumsum([0, *(len(time) for time in times)])
    measured = np.concatenate(
        [
            *seen.place[:, :2].T,
            seen.place[high, 2],
            *velocity.T,
            total_and_difference(seen.loads),
            np.zeros(3 * len(windows)),
        ]
    )
    of_fixes = replace(seen, counts=counts).scale[: sum(len(time) for time in fixes)]
    others = np.ones(len(measured) - len(of_fixes.total))
    return Observation(
        mass=recording.skier.mass,
        measured=measured,
        blocks={name: slice(int(a), int(b)) for name, a, b in zip(_OBSERVED, edges[:-1], edges[1:], strict=True)},
        times=dict(zip(_OBSERVED, times, strict=True)),
        scale=Scale(*(np.concatenate([part, others]) for part in (of_fixes.lasting, of_fixes.total))),
        usual=usual_levels(
            seen.gps_sigma,
            seen.vertical * seen.gps_sigma,
            mean_load(seen.loads),
            recording.uncertainty.residual_moment,
        ),
    )


def _measured_velocity(recording: Recording, model: Model, motion: Motion) -> tuple[Array, Array]:
    """Return instants (n,) s and the receiver's velocities over ground (n, 2) m/s, level frame; none where it gave
    none.
    """
    gps = recording.gps
    if gps is None or gps.speed is None or gps.course is None:
        return np.zeros(0), np.zeros((0, 2))
    inside = gps.between(motion.start, motion.stop)
    speed, course = gps.speed[inside], gps.course[inside]
    enu = np.stack([speed * np.sin(course), speed * np.cos(course), np.zeros(len(speed))], axis=1)
    return gps.time[inside], (enu @ level_to_enu(model.fall_line_azimuth))[:, :2]
