"""All that is measured of a run as one vector, with its noise: fixes, the receiver's speed, the soles' loads, and the
moment about the pelvis, which a real skier does not leave over; heights where the snow surface is estimated along.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array, level_to_enu, slope_to_level
from sssi_exudyn.core.noise import ExponentialNoise, Scale, tail_weight
from sssi_exudyn.fitting.autocorrelated_noise import log_divisors, whiten
from sssi_exudyn.fitting.balance import Balance
from sssi_exudyn.fitting.gps_observation import predict_fixes
from sssi_exudyn.fitting.observations import (
    HEIGHT_ORIGIN,
    averages,
    height_noise,
    measurements_of,
    total_and_difference,
)
from sssi_exudyn.model.faults import insole_readings
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.recording.uncertainty import Uncertainty
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun

GROUPS: Final = {
    "fixes": ("x", "y"),
    "height": ("height",),
    "speed": ("speed_x", "speed_y"),
    "load": ("load",),
    "load difference": ("difference",),
    "moment": ("moment_f", "moment_l", "moment_n"),
}
"""Blocks whose noise is of one size."""
BLOCKS: Final = tuple(name for group in GROUPS.values() for name in group)
_MARGIN: Final = 0.3
"""s at both ends in which the moment is not used: splines end, the simulated skier settles."""
_INTERVAL: Final = 0.1
"""s between the moments that are used, each an average."""
_FIXES_MEMORY: Final = 2.0
"""s; correlation of a receiver's error of place."""
SPEED: Final = ExponentialNoise(0.10, 1.0)
"""m/s and s: a receiver's Doppler speed (Zhang et al., J. Navig. 59 (2006) 293: 0.03 to 0.2 m/s)."""
LOADS: Final = {"load": (0.03, 0.05), "difference": (0.05, 0.3)}
"""Noise of the insoles' total and difference: shares of the mean total, and correlation times (s)."""
_MOMENT_MEMORY: Final = 0.2
"""s over which what is left over of the moment is correlated: the capture is filtered at 6 Hz."""
_ALIKE: Final = 1.0
"""s for which the model itself is wrong alike: masses are elsewhere, skis press elsewhere, for most of a turn.  So many
moments count as one.  Believed one by one they would outweigh the track, and move μ_t by 0.004."""


@dataclass(frozen=True)
class Observation:
    """What is measured, N numbers in blocks.

    mass : kg of the skier, as stated
    measured : (N,);  blocks : where each stands;  times : of each block's rows (s)
    scale : by how much noisier each row is than its block
    usual : noise that instruments of the stated quality show, by block
    """

    mass: float
    measured: Array
    blocks: Mapping[str, slice]
    times: Mapping[str, Array]
    scale: Scale
    usual: Mapping[str, ExponentialNoise]

    @property
    def has_heights(self) -> bool:
        """Whether the fixes' heights are among the measurements."""
        return self.times["height"].size > 0

    @property
    def moments(self) -> slice:
        """Where the moments stand."""
        return slice(self.blocks["moment_f"].start, self.blocks["moment_n"].stop)

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Those of ``GROUPS`` that are measured."""
        return {
            group: names for group, names in GROUPS.items() if self.blocks[names[0]].stop > self.blocks[names[0]].start
        }

    def predict(self, model: Model, run: ReducedRun, balance: Balance, prepared: Prepared) -> Array:
        """(N,) what would be measured of a run of the reduced model, which may carry a complex step.

        The moment is that of the stated mass: a lighter skier is not better balanced.
        """
        seen = self.predict_instruments(model, run.time.real, run.antenna, run.sole_force)
        left_over = averages(run.time.real, balance.residual(run, prepared), self.times["moment_f"])
        return np.concatenate([seen, *(self.mass / model.skier.mass * left_over).T])

    def predict_instruments(self, model: Model, time: Array, antenna: Array, sole: Array) -> Array:
        """(N − moments,) what the instruments would measure of antenna (n, 3) m and soles (n, 2) N at ``time`` (n,)."""
        place = predict_fixes(model, time, antenna, self.times["x"])
        heights = place[: len(self.times["height"]), 2]
        speed = np.gradient(antenna, time, axis=0) @ slope_to_level(model.inclination).T
        at = self.times["speed_x"] - float(np.real(model.start.clock_offset))
        moving = [np.interp(at, time, column) for column in speed[:, :2].T]
        loads = insole_readings(model.sensors, averages(time, sole, self.times["load"]))
        return np.concatenate([*place[:, :2].T, heights, *moving, total_and_difference(loads)])

    def weighed(self, residual: Array, levels: Mapping[str, ExponentialNoise]) -> Observation:
        """The same where a row that a residual (N,) shows far off counts less, but for fixes, which have their counts:
        a ski that strikes a bump, an insole that slips.  That lasts; a height is far off for itself alone.
        """
        more = np.ones(len(residual))
        for name, place in self.blocks.items():
            if name not in GROUPS["fixes"]:
                far = residual[place] / (self.scale.total[place] * levels[name].sigma)
                more[place] = 1.0 / np.sqrt(tail_weight(far**2, 1))
        lasting = more.copy()
        lasting[self.blocks["height"]] = 1.0
        return replace(self, scale=Scale(self.scale.lasting * lasting, self.scale.total * more))

    def whiten(self, levels: Mapping[str, ExponentialNoise], columns: Array) -> Array:
        """Columns (N, c) in units of independent noise, with the origin of heights, known to ``HEIGHT_ORIGIN``, as part
        of the heights' noise.
        """
        out = np.array(columns, dtype=np.float64)
        for name, place in self.blocks.items():
            if place.stop > place.start:
                out[place] = whiten(self.times[name], out[place], levels[name], self.scale[place])
        if self.has_heights:
            place, origin = self.blocks["height"], self._origin(levels)
            square = float(origin @ origin)
            share = 1.0 - 1.0 / np.sqrt(1.0 + HEIGHT_ORIGIN**2 * square)
            out[place] -= share / square * np.outer(origin, origin @ out[place])
        return out

    def _origin(self, levels: Mapping[str, ExponentialNoise]) -> Array:
        """(n,) one metre of all heights, in units of independent noise."""
        time = self.times["height"]
        return whiten(time, np.ones((len(time), 1)), levels["height"], self.scale[self.blocks["height"]])[:, 0]

    def log_volume(self, levels: Mapping[str, ExponentialNoise]) -> float:
        """Σ log of what ``whiten`` divides by."""
        origin = 0.0
        if self.has_heights:
            origin = 0.5 * float(np.log1p(HEIGHT_ORIGIN**2 * np.sum(self._origin(levels) ** 2)))
        return origin + sum(
            log_divisors(self.times[name], levels[name], self.scale[place])
            for name, place in self.blocks.items()
            if place.stop > place.start
        )


def observation_of(
    recording: Recording, model: Model, motion: Motion, counts: Array, *, balanced: bool = True, heights: bool = False
) -> Observation:
    """The measurements of a recording; ``counts`` (n,) is what each fix counts (``counts_of``).  That nothing is left
    over of the moment is among them for a skier who is taken to be ``balanced``; the fixes' ``heights`` are where they
    have not shown the snow surface beforehand.

    Raises ValueError when the recording has no GPS.
    """
    seen = measurements_of(recording, model, motion.start, motion.stop)
    velocity_time, velocity = _measured_velocity(recording, model, motion)
    windows = np.arange(motion.start + _MARGIN, motion.stop - _MARGIN, _INTERVAL) if balanced else np.zeros(0)
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
    load = max(float(seen.loads.sum(axis=1).mean()) if len(seen.loads) else 0.0, 1.0)
    return Observation(
        mass=recording.skier.mass,
        measured=measured,
        blocks={name: slice(int(a), int(b)) for name, a, b in zip(BLOCKS, edges[:-1], edges[1:], strict=True)},
        times=dict(zip(BLOCKS, times, strict=True)),
        scale=Scale(*(np.concatenate([part, others]) for part in (of_fixes.lasting, of_fixes.total))),
        usual=_usual_noise(seen.gps_sigma, load, recording.uncertainty) | {"height": height_noise(seen)},
    )


def _measured_velocity(recording: Recording, model: Model, motion: Motion) -> tuple[Array, Array]:
    """Instants (n,) s and the receiver's velocities over ground (n, 2) m/s, level frame; none where it gave none."""
    gps = recording.gps
    if gps is None or gps.speed is None or gps.course is None:
        return np.zeros(0), np.zeros((0, 2))
    inside = (gps.time >= motion.start) & (gps.time <= motion.stop)
    speed, course = gps.speed[inside], gps.course[inside]
    enu = np.stack([speed * np.sin(course), speed * np.cos(course), np.zeros(len(speed))], axis=1)
    return gps.time[inside], (enu @ level_to_enu(model.fall_line_azimuth))[:, :2]


def _usual_noise(sigma: float, load: float, about: Uncertainty) -> dict[str, ExponentialNoise]:
    """By block; ``sigma`` (m) of a fix, ``load`` (N) the mean of both soles' together."""
    fixes = ExponentialNoise(sigma, _FIXES_MEMORY)
    counted = float(np.sqrt(_ALIKE / _MOMENT_MEMORY))
    moment = ExponentialNoise(counted * about.residual_moment, _MOMENT_MEMORY)
    loads = {name: ExponentialNoise(share * load, memory) for name, (share, memory) in LOADS.items()}
    by_group = {"fixes": fixes, "speed": SPEED, "moment": moment}
    found = {name: by_group[group] for group in by_group for name in GROUPS[group]}
    return {**found, **loads}
