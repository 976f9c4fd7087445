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
from sssi_exudyn.recording.instruments.fixes import Fixes
from sssi_exudyn.runtime.optional import library

_DEGREES: Final = 180.0 / 2**31
"""Size of a semicircle, the format's unit of angle, in degrees."""
_EPOCH: Final = 631065600.0
"""Seconds from 1970 to 1989-12-31, the format's zero of time."""
_SECONDS: Final = 6.0
"""Limit of computing time, s; a day's log takes three."""


def fixes_fit(path: Path) -> Fixes:
    """Read the records with a place; watches write at most one per second.

    Raises InputError where the library is missing, the file is damaged, or it holds less than three fixes.
    """
    fitdecode = library("fitdecode", path)
    rows: list[tuple[float, float, float, float, float | None]] = []
    places: list[str] = []
    without = 0
    stream = io.BytesIO(read_bytes(path, MAX_FIT))
    began = process_time()
    try:
        with fitdecode.FitReader(
            stream, processor=None, check_crc=fitdecode.CrcCheck.RAISE, error_handling=fitdecode.ErrorHandling.RAISE
        ) as frames:
            for frame in frames:
                if process_time() - began > _SECONDS:
                    raise InputError(path, "", "more messages than any run has", "export the run alone")
                if frame.frame_type != fitdecode.FIT_FRAME_DATA or frame.name != "record":
                    continue
                row = _row(frame)
                if row is None:
                    without += 1
                else:
                    rows.append(row)
                    places.append(f"record {len(rows) + without}")
    except InputError:
        raise
    except Exception:  # noqa: BLE001 - damaged files get through the library's own checks in many ways
        place = f"record {len(rows) + without + 1}"
        raise InputError(path, place, "the file is damaged", "copy it from the watch again") from None
    if len(rows) < 3:
        raise InputError(path, "", f"{len(rows)} records with a place are no recording", "export the run with GPS")
    return _fixes(path, rows, tuple(places), without)


def _row(frame: Any) -> tuple[float, float, float, float, float | None] | None:  # Any: an untyped library's message
    """Return time, latitude, longitude (semicircles), altitude, speed of a record; None without time or place."""
    value = {
        name: frame.get_value(name, fallback=None, raw_value=name == "timestamp")
        for name in ("timestamp", "position_lat", "position_long", "altitude", "enhanced_altitude", "speed")
    }
    speed = frame.get_value("enhanced_speed", fallback=None)
    high = value["enhanced_altitude"] if value["enhanced_altitude"] is not None else value["altitude"]
    speed = speed if speed is not None else value["speed"]
    fix = (value["timestamp"], value["position_lat"], value["position_long"], high)
    if any(number is None for number in fix):
        return None
    return (*(float(number) for number in fix), None if speed is None else float(speed))  # type: ignore[return-value]


def _fixes(path: Path, rows: list[Any], places: tuple[str, ...], without: int) -> Fixes:
    time, latitude, longitude, altitude = np.array([row[:4] for row in rows]).T.copy()
    columns = {
        "time_s": time - time[0],
        "latitude_deg": _DEGREES * latitude,
        "longitude_deg": _DEGREES * longitude,
        "altitude_m": altitude,
    }
    speeds = [row[4] for row in rows]
    if all(speed is not None for speed in speeds):
        columns["speed_mps"] = np.array(speeds)
    notes = (f"{path.name}: {without} record(s) without a fix left out",) if without else ()
    return Fixes(columns, places, began=_EPOCH + float(time[0]), notes=notes)
