"""Fixes of a receiver as its file has them: columns of numbers, not yet checked for plausibility.

Each format has one reader.  Units are degrees and WGS84; time counts in seconds from the first fix or as in the file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np
import pymap3d

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_FIXES, check_samples
from sssi_exudyn.io.markup import elements, text_below
from sssi_exudyn.io.table import Table, read_table

REQUIRED: Final = ("time_s", "latitude_deg", "longitude_deg", "altitude_m")
OPTIONAL: Final = ("speed_mps", "course_deg", "sigma_m")

_PHONE: Final = {
    "seconds_elapsed": "time_s", "latitude": "latitude_deg", "longitude": "longitude_deg", "altitude": "altitude_m",
    "speed": "speed_mps", "bearing": "course_deg", "horizontalAccuracy": "sigma_m",
}  # fmt: skip
"""Our names of the columns of Sensor Logger's Location.csv."""
_LOGGED: Final = {
    "t_s": ("time_s", 1.0), "lat": ("latitude_deg", 1.0), "lon": ("longitude_deg", 1.0), "alt_m": ("altitude_m", 1.0),
    "bearing_deg": ("course_deg", 1.0), "course_rad": ("course_deg", 180.0 / np.pi),
    "hacc_m": ("sigma_m", 1.0), "herr_m": ("sigma_m", 1.0),
}  # fmt: skip
"""Our names of the columns of loggers' tables, and the factor between their units."""
_SOMEWHERE: Final = (46.0, 8.0)
"""Latitude and longitude (°) at which local coordinates are placed; a slope's place on Earth has no effect here."""
_RADIUS: Final = float(np.sqrt(-2.0 * np.log(1.0 - 0.68)))
"""Radius around 68 % of fixes, in standard deviations of one direction: a telephone's accuracy (Android,
Location.getHorizontalAccuracyMeters).
"""
_WORST: Final = 100.0
"""Largest standard deviation of a useful fix, m."""


@dataclass(frozen=True)
class Fixes:
    """The content of a file of fixes.

    Attributes
    ----------
    columns : (n,) each: ``REQUIRED`` and those of ``OPTIONAL`` that the receiver wrote; units in the names
    places : the place in the file of each fix, for messages
    began : UTC of ``time_s`` = 0, s since 1970; None where the file does not have it
    common_clock : whether ``time_s`` already counts on the recording's clock
    notes : oddities, in words
    """

    columns: dict[str, Array]
    places: tuple[str, ...]
    began: float | None = None
    common_clock: bool = False
    notes: tuple[str, ...] = ()


def fixes_csv(path: Path) -> Fixes:
    """Read a CSV file of fixes.

    Its columns are ``time_s,latitude_deg,longitude_deg,altitude_m`` and optionally ``speed_mps,course_deg,sigma_m``, or
    those of ``Location.csv`` as the telephones' app Sensor Logger writes it.

    Raises InputError for missing columns and for every fault described in ``read_table``.
    """
    table = read_table(path)
    if set(_PHONE) <= table.columns.keys():
        return _fixes_phone(path, table)
    table, local = _rename_columns(table)
    missing = [name for name in REQUIRED if name not in table.columns]
    if missing:
        raise InputError(
            path,
            "header",
            f"missing columns {', '.join(missing)}; found {', '.join(table.columns)}",
            f"name the columns {','.join(REQUIRED)}",
        )
    known = {name: column for name, column in table.columns.items() if name in REQUIRED + OPTIONAL}
    unknown = [name for name in table.columns if name not in known]
    notes = local + ((f"{path.name}: columns not used: {', '.join(unknown)}",) if unknown else ())
    return Fixes(known, tuple(f"line {line}" for line in table.lines), common_clock=True, notes=notes)


def _rename_columns(table: Table) -> tuple[Table, tuple[str, ...]]:
    """Rename a logger's columns to ours and convert ``east_m`` and ``north_m`` to degrees; describe it in words."""
    columns = {}
    for name, column in table.columns.items():
        ours, factor = _LOGGED.get(name, (name, 1.0))
        columns[ours] = column * factor
    if "latitude_deg" in columns or not {"east_m", "north_m"} <= columns.keys():
        return replace(table, columns=columns), ()
    flat = (columns.pop("east_m"), columns.pop("north_m"))
    columns["latitude_deg"], columns["longitude_deg"], _ = pymap3d.enu2geodetic(
        *flat, np.zeros(len(flat[0])), *_SOMEWHERE, 0.0
    )
    return replace(table, columns=columns), (f"{table.file.name}: local coordinates, set down at 46°N 8°E",)


def _fixes_phone(path: Path, table: Table) -> Fixes:
    """Read the fixes of a telephone; those with a poor or no accuracy are left out and noted."""
    radius = table.columns["horizontalAccuracy"]
    good = (radius > 0.0) & (radius / _RADIUS <= _WORST)
    if np.count_nonzero(good) < 3:
        raise InputError(
            path, "column horizontalAccuracy", f"no three fixes are exact to {_WORST:g} m", "record again in the open"
        )
    columns = {ours: table.columns[theirs][good] for theirs, ours in _PHONE.items()}
    columns["sigma_m"] = columns["sigma_m"] / _RADIUS
    for name in ("speed_mps", "course_deg"):
        if np.any(columns[name] < 0.0):  # the telephone's mark for an unknown value
            del columns[name]
    began = None
    if "time" in table.columns:  # ns since 1970
        began = float(1e-9 * table.columns["time"][good][0] - columns["time_s"][0])
    lost = len(good) - int(np.count_nonzero(good))
    notes = (f"{path.name}: {lost} fix(es) of poor or unknown accuracy left out",) if lost else ()
    places = tuple(f"line {line}" for line, keep in zip(table.lines, good, strict=True) if keep)
    return Fixes(columns, places, began=began, notes=notes)


def fixes_gpx(path: Path) -> Fixes:
    """Read the track points of a GPX 1.0 or 1.1 file; time counts from the first of them.

    Raises InputError for XML that ``elements`` refuses, fewer than three points, and points without place, ``ele`` or
    ``time``.
    """
    values: dict[str, list[float]] = {"lat": [], "lon": [], "ele": [], "speed": [], "course": []}
    clock: list[float] = []
    for number, point in enumerate(elements(path, ("trkpt",)), 1):
        check_samples(path, f"trkpt {number}", number, limit=MAX_FIXES)
        clock.append(_gpx_time(path, point, number))
        for name in ("lat", "lon", "ele"):
            values[name].append(_gpx_number(path, point, name, number))
        for name in ("speed", "course"):
            if text_below(point, name) is not None:
                values[name].append(_gpx_number(path, point, name, number))
    if len(clock) < 3:
        raise InputError(path, "", f"{len(clock)} track points are no recording", "export the whole run as a track")
    columns = {"time_s": np.array(clock) - clock[0]}
    for column, name in zip((*REQUIRED[1:], *OPTIONAL), values, strict=False):
        if len(values[name]) == len(clock):  # speed and course only where every point has them
            columns[column] = np.array(values[name])
    return Fixes(columns, tuple(f"trkpt {number}" for number in range(1, len(clock) + 1)), began=clock[0])


def _gpx_number(path: Path, point: Element, name: str, number: int) -> float:
    text = point.get(name) if name in ("lat", "lon") else text_below(point, name)
    try:
        value = float(text if text is not None else "")
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        what = f"no {name}" if text is None else f"{name} {text[:30]!r} is not a number"
        raise InputError(path, f"trkpt {number}", what, "export the track again, with elevation and time")
    return value


def _gpx_time(path: Path, point: Element, number: int) -> float:
    text = text_below(point, "time")
    try:
        moment = datetime.fromisoformat(text if text is not None else "")
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        what = "no time" if text is None else f"time {text[:40]!r} is not ISO 8601"
        raise InputError(path, f"trkpt {number}", what, "export the track with the time of every point") from None
