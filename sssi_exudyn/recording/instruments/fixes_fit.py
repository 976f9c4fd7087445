"""Fixes in FIT files, as sports watches write them: the messages ``record``."""

from __future__ import annotations

import io
from pathlib import Path
from time import process_time
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_FIT
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_of_rows
from sssi_exudyn.runtime.optional import library

_DEGREES: Final = 180.0 / 2**31
"""Size of a semicircle, the format's unit of angle, in degrees."""
_EPOCH: Final = 631065600.0
"""Seconds from 1970 to 1989-12-31, the format's zero of time."""
_SECONDS: Final = 6.0
"""Limit of computing time, s; a day's log takes three."""
_POWER_ON: Final = 0x10000000
"""Time stamps below it count from the device's power-on (FIT protocol, ``date_time``)."""
_TIES: Final = {
    "timestamp_correlation": ("timestamp", "system_timestamp"),
    "gps_metadata": ("utc_timestamp", "timestamp"),
}
"""Messages that state one moment by both clocks, the more exact first, and their fields of UTC and since power-on."""
_BEFORE_DAMAGE: Final = 10
"""Minimum number of records that are read of a file that is damaged behind them."""
_NAMES: Final = ("timestamp", "position_lat", "position_long", "altitude", "enhanced_altitude", "speed")


def fixes_fit(path: Path) -> Fixes:
    """Read the records with a place and a height; watches write at most one per second.

    Of a file that ends too early or is damaged, what comes before is read, with a note.  Cameras count time from
    power-on; a message that has both clocks gives the date, and without one the fixes have none.

    Raises InputError where the library is missing, the file is damaged from its start, or it holds less than three
    fixes.
    """
    fitdecode = library("fitdecode", path)
    rows: list[list[float]] = []
    ahead: dict[str, float] = {}
    repairs = Repairs(path)
    stream = io.BytesIO(read_bytes(path, MAX_FIT))
    began = process_time()
    try:
        with fitdecode.FitReader(
            stream, processor=None, check_crc=fitdecode.CrcCheck.RAISE, error_handling=fitdecode.ErrorHandling.IGNORE
        ) as frames:
            for frame in frames:
                if process_time() - began > _SECONDS:
                    raise InputError(path, "", "more messages than any run has", "export the run alone")
                if frame.frame_type != fitdecode.FIT_FRAME_DATA:
                    continue
                if frame.name == "record":
                    rows.append(_row(frame))
                elif frame.name in _TIES and frame.name not in ahead:
                    ahead |= _ahead(frame)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - damaged files get through the library's own checks in many ways
        place = f"record {len(rows) + 1}"
        if len(rows) < _BEFORE_DAMAGE:
            raise InputError(path, place, "the file is damaged", "copy it from the watch again") from None
        crc = isinstance(error, fitdecode.FitCRCError)
        repairs.add_end("a wrong checksum" if crc else "the file is damaged or ends too early", place, len(rows))
    values = np.array(rows).reshape(-1, 5)
    for name in _TIES:
        if name in ahead:
            values[values[:, 0] < _POWER_ON, 0] += ahead[name]
            break
    known = np.isfinite(values)
    placed = np.all(known[:, 1:3], axis=1)
    number = np.count_nonzero(placed)
    if number < 3:
        raise InputError(path, "", f"{number} records with a place are no recording", "export the run with GPS")
    if np.count_nonzero(placed & known[:, 3]) < 3:
        problem = f"{number} records have a place, but only {np.count_nonzero(placed & known[:, 3])} of them a height"
        raise InputError(path, "", problem, "export the same activity with elevation, as GPX or TCX")
    zero = float(values[int(np.argmax(placed & known[:, 0] & known[:, 3])), 0])
    values[:, 1:3] *= _DEGREES
    places = tuple(f"record {number}" for number in range(1, len(rows) + 1))
    if zero < _POWER_ON:
        repairs.add_all("no date: its clock counts from power-on, and no message ties that to UTC")
    return fixes_of_rows(repairs, values, places, "record(s)", zero, None if zero < _POWER_ON else _EPOCH + zero)


def _row(frame: Any) -> list[float]:  # Any: an untyped library's message
    """Return time, latitude, longitude (semicircles), altitude and speed of a record; NaN where it has none."""
    value = {name: frame.get_value(name, fallback=None, raw_value=name == "timestamp") for name in _NAMES}
    speed = frame.get_value("enhanced_speed", fallback=None)
    high = value["enhanced_altitude"] if value["enhanced_altitude"] is not None else value["altitude"]
    speed = speed if speed is not None else value["speed"]
    fix = (value["timestamp"], value["position_lat"], value["position_long"], high, speed)
    return [np.nan if number is None else float(number) for number in fix]


def _ahead(frame: Any) -> dict[str, float]:  # Any: an untyped library's message
    """Return by how much (s) UTC is ahead of the clock since power-on, by a message's name; empty where unknown."""
    fields = _TIES[frame.name]
    utc, uptime = (frame.get_value(name, fallback=None, raw_value=True) for name in fields)
    if utc is None or uptime is None or not 0 <= uptime < _POWER_ON <= utc < 2**32:
        return {}
    after, before = (frame.get_value(f"{name}_ms", fallback=None) or 0 for name in fields)
    if not (0 <= after < 1000 and 0 <= before < 1000):
        return {}
    return {frame.name: float(utc - uptime) + 1e-3 * (after - before)}
