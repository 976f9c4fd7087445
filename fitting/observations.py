"""What the instruments say of a run, and what they would say of a simulated one: one vector each.

Blocks, in order: the GPS' places in the level frame, x and y one after the other; its heights; the insoles' total load
and their difference, left less right.  Blocks of instruments that a recording lacks are empty.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np

from sssi_exudyn.core.frames import Array, level_to_enu
from sssi_exudyn.core.noise import ExponentialNoise, Scale
from sssi_exudyn.fitting.gps_observation import predict_fixes
from sssi_exudyn.model.faults import insole_readings
from sssi_exudyn.model.model import Model
from sssi_exudyn.recording.instruments.gps import VERTICAL
from sssi_exudyn.recording.recording import Recording

BLOCKS: Final = ("x", "y", "height", "load", "difference")
INTERVAL: Final = 0.1
"""s over which the insoles' forces are averaged; faster changes are the capture's noise in accelerations."""
_LEAST_COUNT: Final = 1e-4
_HEIGHT_NOISE: Final = (1.4, 1.5)
"""Of a height, in standard deviations of a fix's place where heights are as much worse as usual, and its correlation
time (s)."""
HEIGHT_ORIGIN: Final = 100.0
"""m; standard deviation of where heights count from, which is the first fix: wider than any receiver's error, so that
heights alone decide, and a proper density, so that evidences with heights may be compared."""
_MARGIN: Final = 0.3
"""s at both ends in which the insoles are not used: the simulated skier is still settling, splines end."""


_UNKNOWN_TURN: Final = 5.0
"""m/s² by which a skier's acceleration before the start or after the end differs from that at it: half of g across,
from one turn to the next."""


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
        """By how much noisier each of the N measurements is than its instrument's usual ones: fixes are for seconds
        where they say so, and for themselves alone where they are off.
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
        """Where each block stands in the vector."""
        n, m = len(self.fixes), len(self.windows)
        edges = np.cumsum([0, n, n, n, m, m])
        return {name: slice(int(a), int(b)) for name, a, b in zip(BLOCKS, edges[:-1], edges[1:], strict=True)}

    def time_of(self, block: str) -> Array:
        """Instants of a block's values (s)."""
        return self.windows if block in ("load", "difference") else self.fixes

    def stamped_by(self, clock_offset: float, start: float, stop: float) -> Measurements:
        """The same by a clock that is so late (s): a fix of an instant outside the run is predicted the less well the
        farther away it is, by an acceleration that nobody knows, and counts so.
        """
        at = self.fixes - clock_offset
        outside = np.maximum(np.maximum(start - at, at - stop), 0.0)
        off = 0.5 * _UNKNOWN_TURN * outside**2 / self.gps_sigma
        return replace(self, counts=self.counts / (1.0 + self.counts * off**2))

    def predict(self, model: Model, run: SimulatedRun) -> Array:
        """(N,) what the instruments would say of a simulated run."""
        assert run.antenna is not None
        place = predict_fixes(model, run.time, run.antenna, self.fixes)
        return _stack(place, insole_readings(model.sensors, averages(run.time, run.sole_force, self.windows)))


def measurements_of(recording: Recording, model: Model, start: float, stop: float) -> Measurements:
    """The instruments of a recording between ``start`` and ``stop`` (s).  Raises ValueError without a GPS."""
    gps, insoles = recording.gps, recording.insoles
    if gps is None:
        raise ValueError("the recording has no GPS")
    inside = (gps.time >= start - 1e-9) & (gps.time <= stop + 1e-9)
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


def averages(time: Array, values: Array, windows: Array) -> Array:
    """(m, d) averages of ``values`` (n, d), known at ``time`` (n,), over ``INTERVAL`` about each of ``windows``
    (m,).
    """
    summed = np.zeros((len(time), values.shape[1]), dtype=values.dtype)
    summed[1:] = np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time)[:, None], axis=0)
    edges = [[np.interp(windows + d, time, column) for column in summed.T] for d in (-0.5 * INTERVAL, 0.5 * INTERVAL)]
    return (np.array(edges[1]) - np.array(edges[0])).T / INTERVAL


def height_noise(measurements: Measurements) -> ExponentialNoise:
    """What heights of fixes of the stated quality usually show."""
    worse = measurements.vertical / VERTICAL
    return ExponentialNoise(_HEIGHT_NOISE[0] * measurements.gps_sigma * worse, _HEIGHT_NOISE[1])


def total_and_difference(loads: Array) -> Array:
    """(2m,) of loads (m, 2): both feet's total, then left less right."""
    return np.concatenate([loads.sum(axis=1), loads[:, 0] - loads[:, 1]])


def _stack(place: Array, loads: Array) -> Array:
    return np.concatenate([*place.T, total_and_difference(loads)])
