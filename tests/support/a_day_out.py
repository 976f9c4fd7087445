"""A day of skiing as a telephone's app exports it: one run skied twice, with a lift, queues and a rest between."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
from strapped import LAG, strapped

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.recording.recording import Recording

BEGAN = 1.7e9
"""UTC of the app's zero, s since 1970."""
QUEUE, RIDE = 90.0, 240.0
"""Time in a queue and on the lift, s."""


def write_day(recording: Recording, folder: Path, runs: int = 2, split: bool = True) -> list[float]:
    """Write Sensor Logger's files of a day; return the time (s) at which each run begins.

    Parameters
    ----------
    split : whether gravity stands in a file of its own, without ``TotalAcceleration.csv``
    """
    one, gps = strapped(recording, "pocket", 3), recording.gps
    assert gps is not None
    step = float(one.time[1] - one.time[0])
    fixes, track = gps.time[::5], gps.enu[::5]
    rest = np.arange(0.0, QUEUE, step)
    noise = np.random.default_rng(5)
    level = np.array([0.0, 0.0, GRAVITY])
    begins, sensor, places = [], list[Array](), list[Array]()
    clock = 0.0

    def idle(lasting: float, start: Array, stop: Array) -> None:
        """Stand, or ride in a straight line."""
        nonlocal clock
        count = round(lasting / step)
        held = np.hstack([noise.normal(0.0, 0.01, (count, 3)), level + noise.normal(0.0, 0.2, (count, 3))])
        sensor.append(np.column_stack([clock + step * np.arange(count), held]))
        seconds = np.arange(0.0, lasting, 1.0)
        between = start + np.outer(seconds / lasting, stop - start)
        places.append(np.column_stack([clock + LAG + seconds, between + noise.normal(0.0, 0.1, (len(seconds), 3))]))
        clock += count * step

    assert len(rest)
    for _ in range(runs):
        idle(QUEUE, track[0], track[0])
        begins.append(clock)
        sensor.append(np.column_stack([clock + one.time - one.time[0], one.rate, one.force]))
        places.append(np.column_stack([clock + LAG + fixes - fixes[0], track]))
        clock += float(one.time[-1] - one.time[0]) + step
        idle(QUEUE, track[-1], track[-1])
        idle(RIDE, track[-1], track[0])
    _write(folder, np.concatenate(sensor), np.concatenate(places), gps.origin, split)
    return begins


def _write(folder: Path, sensor: Array, places: Array, origin: tuple[float, float, float], split: bool) -> None:
    """Write the tables with both clocks, and files that an export has besides."""
    latitude, longitude, altitude = pymap3d.enu2geodetic(*places[:, 1:].T, *origin)
    location = pd.DataFrame({"latitude": latitude, "longitude": longitude, "altitude": altitude})
    location = location.assign(speed=-1.0, bearing=-1.0, horizontalAccuracy=0.5)
    folder.mkdir(parents=True)
    _with_clock(places[:, 0], location).to_csv(folder / "Location.csv", index=False)
    time, rate, force = sensor[:, 0], sensor[:, 1:4], sensor[:, 4:]
    gravity = force / np.linalg.norm(force, axis=1, keepdims=True) * GRAVITY
    tables = {"Gyroscope": rate, "Accelerometer": force - gravity, "Gravity": gravity, "Magnetometer": 40.0 * rate}
    if not split:
        del tables["Gravity"]
        tables["TotalAcceleration"] = force
    for name, values in tables.items():
        _write_channels(folder / f"{name}.csv", time, values)
    (folder / "Metadata.csv").write_text("version,device name\n3,phone\n", encoding="utf-8")


def _write_channels(path: Path, time: Array, values: Array) -> None:
    """Write readings (n, 3) of x, y, z; a row at a time, since pandas takes four times as long."""
    clocks = zip(_utc(time), np.round(time, 6).tolist(), values.tolist(), strict=True)
    rows = [f"{utc},{elapsed:.9g},{z:.9g},{y:.9g},{x:.9g}" for utc, elapsed, (x, y, z) in clocks]
    path.write_text("\n".join(["time,seconds_elapsed,z,y,x", *rows, ""]), encoding="utf-8")


def _utc(time: Array) -> list[str]:
    """Return times (n,) s since the app's zero as it writes them, ns since 1970."""
    return [f"{round((BEGAN + moment) * 1e9)}" for moment in time.tolist()]


def _with_clock(time: Array, table: pd.DataFrame) -> pd.DataFrame:
    table.insert(0, "seconds_elapsed", np.round(time, 6))
    table.insert(0, "time", _utc(time))
    return table
