"""Single sensors on ski, boot or body: angular rate, specific force and, where the device fuses them, orientation.

A file has one line per sample: ``time_s``; ``rate_x_radps``, ``rate_y_radps``, ``rate_z_radps``; and at least one of
``acceleration_x_mps2`` … (specific force, gravity's reaction included) and ``orientation_w`` … ``orientation_z``
(quaternion, sensor to a world whose z is up).  Axes are the sensor's own, however it was mounted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.io.bounds import MAX_SENSOR, check_samples
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.io.table import Clock, Table, bridge_gaps, in_order, read_table

PLACES: Final = ("left_ski", "right_ski", "left_boot", "right_boot", "chest", "pelvis", "pocket", "helmet")
"""Places where a sensor may sit."""
LOOSE: Final = ("pocket", "helmet")
"""Places where it turns with the body, but not rigidly with a segment of the assumed posture."""
FEET: Final = {"left": ("left_ski", "left_boot"), "right": ("right_ski", "right_boot")}
"""Places that move rigidly with each foot."""
_RATE: Final = tuple(f"rate_{axis}_radps" for axis in "xyz")
_FORCE: Final = tuple(f"acceleration_{axis}_mps2" for axis in "xyz")
_ORIENTATION: Final = tuple(f"orientation_{part}" for part in "wxyz")
_CHANNELS: Final = ("time_s", *_RATE, *_FORCE, *_ORIENTATION)
_SLOWEST: Final = 5.0
"""Minimum rate of a sensor, Hz; below it turns of two seconds hardly show."""
_FASTEST_RATE: Final = 70.0
"""Largest angular rate, rad/s, beyond all gyroscopes in use (4000 °/s); numbers in °/s usually exceed it."""
_SPIKES: Final = 0.01
"""Largest share of samples beyond all gyroscopes that are single errors, and not another unit."""
_FALL: Final = (0.5 * GRAVITY, 3.0 * GRAVITY)
"""Range, m/s², of the median specific force of anything that is worn on a run."""
_PRESSURE: Final = (3e4, 1.1e5)
"""Range of pressures outdoors, Pa: the top of the highest mountain, the lowest valley."""


@dataclass(frozen=True)
class Imu:
    """The channels of one sensor, evenly sampled; axes are the sensor's own.

    name : name of the file;  place : where the sensor sits, one of ``PLACES``
    time : (n,) s on the recording's clock
    rate : (n, 3) rad/s
    force : (n, 3) m/s² specific force, None where it was not recorded
    orientation : (n, 4) unit quaternions (w, x, y, z), sensor → a world with z up, None where the device gives none
    notes : changes of the data, in words
    """

    name: str
    place: str
    time: Array
    rate: Array
    force: Array | None
    orientation: Array | None
    notes: tuple[str, ...] = ()

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Barometer:
    """The air pressure: (n,) s on the recording's clock and (n,) Pa."""

    time: Array
    pressure: Array
    notes: tuple[str, ...] = ()

    @property
    def altitude(self) -> Array:
        """Altitude (n,) m above the first sample, by the international standard atmosphere (ISO 2533)."""
        height = 44330.8 * (1.0 - (self.pressure / 101325.0) ** 0.190263)
        return np.asarray(height - height[0])


def read_imu(path: Path, place: str, time_offset: float = 0.0) -> Imu:
    """Read a sensor's file; ``time_offset`` (s) is added to its times.

    Single bad lines are left out and noted.  Raises InputError for missing columns, more bad lines than ``Repairs``
    allows, samples too far apart, rates in degrees, forces in g, a channel that never changes, and the faults of
    ``read_table``.
    """
    path = Path(path)
    table = read_table(path, lambda _: (_CHANNELS, ()))
    _require(path, table, ("time_s", *_RATE))
    force, orientation = ([name for name in names if name in table.columns] for names in (_FORCE, _ORIENTATION))
    if not orientation or force:
        _require(path, table, _FORCE)
    if orientation:
        _require(path, table, _ORIENTATION)
    table = _without_spikes(in_order(table))
    time, clock = _clock(path, table)
    if np.median(np.diff(time)) > 1.0 / _SLOWEST:
        raise InputError(
            path,
            "time_s",
            f"samples {np.median(np.diff(time)):.2g} s apart do not show turns",
            "record at 10 Hz or more",
        )
    check_channels(table)
    even = np.linspace(clock.time[0], clock.time[-1], len(clock.time))
    notes = table.notes + clock.notes
    if table.unused:
        notes += (f"{path.name}: columns not used: {', '.join(table.unused)}",)
    quaternion = None
    if orientation:
        quaternion = _at(even, time, clock, _without_sign_jumps(path, table))
        quaternion = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return Imu(
        name=path.name,
        place=place,
        time=even + time_offset,
        rate=_at(even, time, clock, _columns(table, _RATE)),
        force=_at(even, time, clock, _columns(table, _FORCE)) if force else None,
        orientation=quaternion,
        notes=notes,
    )


def check_channels(table: Table) -> None:
    """Raise InputError for faulty channels among a sensor's channels that ``table`` has.

    Faults are rates in degrees, forces in g or without gravity, and channels that never change.
    """
    _check_rates(table)
    for name in (*_RATE, *_FORCE):
        if name in table.columns and np.ptp(table.columns[name]) == 0.0:
            raise InputError(table.file, f"column {name}", "it never changes: a dead channel", "use another sensor")
    if table.columns.keys() >= set(_FORCE):
        _check_force(table)


def read_barometer(path: Path, time_offset: float = 0.0) -> Barometer:
    """Read ``time_s,pressure_Pa``; ``time_offset`` (s) is added to its times.

    Raises InputError for missing columns, pressures that no mountain has, a constant pressure, and more bad lines than
    ``Repairs`` allows.
    """
    path = Path(path)
    table = read_table(path, lambda _: (("time_s", "pressure_Pa"), ()))
    _require(path, table, ("time_s", "pressure_Pa"))
    table = in_order(table)
    time, clock = _clock(path, table)
    pressure = table.columns["pressure_Pa"]
    bad = (pressure < _PRESSURE[0]) | (pressure > _PRESSURE[1])
    if np.any(bad):
        first = int(np.argmax(bad))
        hint = "give pascals, not hectopascals" if pressure[first] < 1200.0 else "correct the value or its unit"
        raise InputError(
            path, f"line {table.lines[first]}, pressure_Pa", f"{pressure[first]:g} is no pressure outdoors", hint
        )
    if np.ptp(pressure) == 0.0:
        raise InputError(path, "column pressure_Pa", "it never changes: a dead channel", "leave the barometer out")
    return Barometer(
        clock.time + time_offset, _at(clock.time, time, clock, pressure[:, None])[:, 0], table.notes + clock.notes
    )


def _require(path: Path, table: Table, names: tuple[str, ...]) -> None:
    missing = [name for name in names if name not in table.columns]
    if missing:
        raise InputError(
            path,
            "header",
            f"missing columns {', '.join(missing)}; found {', '.join(table.columns)}",
            f"name the columns {','.join(names)}",
        )


def _without_spikes(table: Table) -> Table:
    """Leave out single samples beyond all gyroscopes; many of them are rates in another unit (``check_channels``)."""
    spikes = np.any(np.abs(_columns(table, _RATE)) > _FASTEST_RATE, axis=1)
    if np.mean(spikes) > _SPIKES:
        return table
    repairs = Repairs(table.file)
    repairs.add_at(f"line(s) with a rate beyond {_FASTEST_RATE:g} rad/s", spikes, table.places)
    return replace(table.rows(~spikes), notes=table.notes + repairs.notes)


def _clock(path: Path, table: Table) -> tuple[Array, Clock]:
    time = table.columns["time_s"]
    clock = bridge_gaps(path, time, len(table.columns))
    check_samples(path, "time_s, with gaps filled", len(clock.time), limit=MAX_SENSOR)
    return time, clock


def _columns(table: Table, names: tuple[str, ...]) -> Array:
    return np.column_stack([table.columns[name] for name in names])


def _at(times: Array, time: Array, clock: Clock, values: Array) -> Array:
    """Interpolate kept ``values`` (n, d) to ``times`` (m,), linearly."""
    return np.column_stack([np.interp(times, time[clock.keep], column[clock.keep]) for column in values.T])


def _without_sign_jumps(path: Path, table: Table) -> Array:
    """Return the quaternions (n, 4) without jumps of sign."""
    quaternions = _columns(table, _ORIENTATION)
    size = np.linalg.norm(quaternions, axis=1)
    bad = np.abs(size - 1.0) > 0.05  # four decimals leave 1e-4; beyond some percent it is something else
    if np.any(bad):
        first = int(np.argmax(bad))
        raise InputError(
            path,
            f"line {table.lines[first]}, {_ORIENTATION[0]} …",
            f"a quaternion of length {size[first]:.3g}",
            "give unit quaternions, w first",
        )
    flips = np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(quaternions * np.concatenate([[1.0], np.cumprod(flips)])[:, None])


def _check_rates(table: Table) -> None:
    for name in _RATE:
        fast = np.abs(table.columns.get(name, np.zeros(1))) > _FASTEST_RATE
        if np.any(fast):
            first = int(np.argmax(fast))
            raise InputError(
                table.file,
                f"line {table.lines[first]}, {name}",
                f"{table.columns[name][first]:g} rad/s is more than any gyroscope measures",
                "give rad/s, not degrees a second",
            )


def _check_force(table: Table) -> None:
    middle = float(np.median(np.linalg.norm(_columns(table, _FORCE), axis=1)))
    if not _FALL[0] <= middle <= _FALL[1]:
        problem = f"the specific force is {middle:.3g} m/s² in the middle"
        raise InputError(table.file, _FORCE[0] + " …", problem, "give m/s², not g, and gravity included")
