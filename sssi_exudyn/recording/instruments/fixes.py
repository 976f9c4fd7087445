"""Fixes of a receiver as its file has them: columns of numbers, not yet checked for plausibility.

Each format has one reader.  Units are degrees and WGS84; time counts in seconds from the first fix or as in the file.
"""

from __future__ import annotations

from collections.abc import Callable
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
from sssi_exudyn.io.markup import TornMarkup, elements, text_below
from sssi_exudyn.io.repairs import UNKNOWN, Repairs
from sssi_exudyn.io.table import Table, read_table

REQUIRED: Final = ("time_s", "latitude_deg", "longitude_deg", "altitude_m")
OPTIONAL: Final = ("speed_mps", "course_deg", "sigma_m")

_PHONE: Final = {
    "seconds_elapsed": "time_s", "latitude": "latitude_deg", "longitude": "longitude_deg", "altitude": "altitude_m",
    "speed": "speed_mps", "bearing": "course_deg", "horizontalAccuracy": "sigma_m",
}  # fmt: skip
"""Our names of the columns of Sensor Logger's Location.csv."""
_PHYPHOX: Final = {
    "Time (s)": "time_s", "Latitude (°)": "latitude_deg", "Longitude (°)": "longitude_deg", "Height (m)": "altitude_m",
    "Velocity (m/s)": "speed_mps", "Direction (°)": "course_deg", "Horizontal Accuracy (m)": "sigma_m",
}  # fmt: skip
"""Our names of the columns of phyphox's Location.csv."""
_LOGGED: Final = {
    "t_s": ("time_s", 1.0), "lat": ("latitude_deg", 1.0), "lon": ("longitude_deg", 1.0), "alt_m": ("altitude_m", 1.0),
    "bearing_deg": ("course_deg", 1.0), "course_rad": ("course_deg", 180.0 / np.pi),
    "hacc_m": ("sigma_m", 1.0), "herr_m": ("sigma_m", 1.0),
}  # fmt: skip
"""Our names of the columns of loggers' tables, and the factor between their units."""
_FLAT: Final = ("east_m", "north_m")
_EPOCH: Final = "time"
"""Sensor Logger's column of the time of day, ns since 1970."""
_GPX: Final = ("time", "ele", "speed", "course")
"""Elements of a track point, in the order of our columns."""
_BEFORE_TEAR: Final = 10
"""Minimum number of points that are read of a file whose end is missing."""
_UNSURE: Final = ("altitude_m", *OPTIONAL)
"""Columns in which a receiver may leave a cell empty."""
_SOMEWHERE: Final = (46.0, 8.0)
"""Latitude and longitude (°) at which local coordinates are placed; a slope's place on Earth has no effect here."""
RADIUS: Final = float(np.sqrt(-2.0 * np.log(1.0 - 0.68)))
"""Radius around 68 % of fixes, in standard deviations of one direction: a telephone's accuracy (Android,
Location.getHorizontalAccuracyMeters).
"""
WORST: Final = 100.0
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
    clock_of_sensors : whether ``time_s`` counts from the same zero as the sensors that the same app exported with it
    notes : oddities, in words
    """

    columns: dict[str, Array]
    places: tuple[str, ...]
    began: float | None = None
    common_clock: bool = False
    clock_of_sensors: bool = False
    notes: tuple[str, ...] = ()


def fixes_csv(path: Path) -> Fixes:
    """Read a CSV file of fixes.

    Its columns are ``time_s,latitude_deg,longitude_deg,altitude_m`` and optionally ``speed_mps,course_deg,sigma_m``, or
    those of ``Location.csv`` as the telephones' apps Sensor Logger and phyphox write it.  Cells of altitude and of
    optional columns may be empty.

    Raises InputError for missing columns and for every fault described in ``read_table``.
    """
    table = read_table(path, _columns_of_fixes)
    for names in (_PHONE, _PHYPHOX):
        if set(names) <= table.columns.keys():
            return _fixes_phone(path, table, names)
    table, local = _rename_columns(table)
    missing = [name for name in REQUIRED if name not in table.columns]
    if missing:
        raise InputError(
            path,
            "header",
            f"missing columns {', '.join(missing)}; found {', '.join((*table.columns, *table.unused))}",
            f"name the columns {','.join(REQUIRED)}",
        )
    notes = table.notes + local
    if table.unused:
        notes += (f"{path.name}: columns not used: {', '.join(table.unused)}",)
    return Fixes(table.columns, table.places, common_clock=True, notes=notes)


def _columns_of_fixes(names: list[str]) -> tuple[set[str], set[str]]:
    """Return the columns of a table of fixes that are needed, and those that may have empty cells."""
    for phone in (_PHONE, _PHYPHOX):
        if phone.keys() <= set(names):
            sparse = {theirs for theirs, ours in phone.items() if ours in _UNSURE}
            return phone.keys() - sparse, sparse | {_EPOCH}
    ours = {name: _LOGGED.get(name, (name, 1.0))[0] for name in names}
    taken = {name for name in names if ours[name] in (*REQUIRED, *OPTIONAL)}
    if not {"latitude_deg", "longitude_deg"} <= set(ours.values()):
        taken |= set(_FLAT) & set(names)
    sparse = {name for name in taken if ours[name] in _UNSURE}
    return taken - sparse, sparse


def _rename_columns(table: Table) -> tuple[Table, tuple[str, ...]]:
    """Rename a logger's columns to ours and convert ``east_m`` and ``north_m`` to degrees; describe it in words."""
    columns = {}
    for name, column in table.columns.items():
        ours, factor = _LOGGED.get(name, (name, 1.0))
        columns[ours] = column * factor
    if not set(_FLAT) <= columns.keys():
        return replace(table, columns=columns), ()
    flat = [columns.pop(name) for name in _FLAT]
    columns["latitude_deg"], columns["longitude_deg"], _ = pymap3d.enu2geodetic(
        *flat, np.zeros(len(flat[0])), *_SOMEWHERE, 0.0
    )
    return replace(table, columns=columns), (f"{table.file.name}: local coordinates, set down at 46°N 8°E",)


def _fixes_phone(path: Path, table: Table, names: dict[str, str]) -> Fixes:
    """Read the fixes of a telephone; those with a poor or no accuracy are left out and noted."""
    columns = {ours: table.columns[theirs] for theirs, ours in names.items()}
    columns["sigma_m"] = columns["sigma_m"] / RADIUS
    good = (columns["sigma_m"] > 0.0) & (columns["sigma_m"] <= WORST)
    if np.count_nonzero(good) < 3:
        raise InputError(
            path, "column of the accuracy", f"no three fixes are exact to {WORST:g} m", "record again in the open"
        )
    began = None
    epoch = table.columns.get(_EPOCH, np.array([np.nan]))  # ns since 1970
    if np.any(np.isfinite(epoch)):
        first = int(np.argmax(np.isfinite(epoch)))
        began = float(1e-9 * epoch[first] - columns["time_s"][first])
    return Fixes(columns, table.places, began=began, clock_of_sensors=names is _PHYPHOX, notes=table.notes)


def fixes_gpx(path: Path) -> Fixes:
    """Read the track points of a GPX 1.0 or 1.1 file; see ``fixes_of_points``."""
    return fixes_of_points(path, "trkpt", lambda point: [number_of(point.get(name)) for name in ("lat", "lon")], _GPX)


def fixes_of_points(path: Path, tag: str, place: Callable[[Element], list[float]], below: tuple[str, ...]) -> Fixes:
    """Read the points of an XML file; time counts from the first of them that has one.

    Points without place, height or time are left out and noted, and so is a torn end.

    Parameters
    ----------
    tag : name of a point's element
    place : function of a point that returns latitude and longitude, degrees, NaN where unknown
    below : names of the elements that hold time, altitude and columns of ``OPTIONAL`` in their order

    Raises InputError for XML that ``elements`` refuses, fewer than three points, and more bad points than ``Repairs``
    allows.
    """
    rows: list[list[float]] = []
    repairs = Repairs(path)
    clock, *others = below
    try:
        for number, point in enumerate(elements(path, (tag,)), 1):
            check_samples(path, f"{tag} {number}", number, limit=MAX_FIXES)
            moment = time_of(text_below(point, clock))
            rows.append([moment, *place(point), *(number_of(text_below(point, name)) for name in others)])
    except TornMarkup as torn:
        if len(rows) < _BEFORE_TEAR:
            raise
        repairs.add_end("the file ends too early", torn.place, len(rows))
    if len(rows) < 3:
        raise InputError(path, "", f"{len(rows)} track points are no recording", "export the whole run as a track")
    places = tuple(f"{tag} {number}" for number in range(1, len(rows) + 1))
    return fixes_of_moments(repairs, np.array(rows), places, "point(s)")


def fixes_of_moments(repairs: Repairs, values: Array, places: tuple[str, ...], records: str) -> Fixes:
    """Make fixes of records (n, 4 to 7) whose times are UTC, s since 1970; see ``fixes_of_rows``.

    Time counts from the first record that has one.  Raises InputError where none has.
    """
    timed = np.isfinite(values[:, 0])
    if not np.any(timed):
        raise InputError(repairs.path, places[0], "no time", "export the track with the time of every point")
    zero = float(values[timed, 0][0])
    return fixes_of_rows(repairs, values, places, records, zero, began=zero)


def fixes_of_rows(
    repairs: Repairs, values: Array, places: tuple[str, ...], records: str, zero: float, began: float | None
) -> Fixes:
    """Make fixes of records (n, 4 to 7), NaN where a record has no value; without time, place or height it goes.

    Parameters
    ----------
    repairs : takes the notes
    values : time (s), latitude, longitude (degrees), altitude (m), then columns of ``OPTIONAL`` in their order
    places : each record's place in the file;  records : their name, in words
    zero : s, the time that counts as 0;  began : its UTC, s since 1970

    Raises InputError where too many records have no time, place or height, or less than three have all of them.
    """
    known = np.isfinite(values[:, :4])
    for name, lost in (
        ("time", ~known[:, 0]),
        ("fix", known[:, 0] & ~np.all(known[:, 1:3], axis=1)),
        ("height", np.all(known[:, :3], axis=1) & ~known[:, 3]),
    ):
        fix = f"export the run again, with the {name} of every record"
        repairs.add_at(f"{records} without a {name}", lost, places, most=UNKNOWN, fix=fix)
    whole = np.all(known, axis=1)
    fix = "export the run alone, with time, place and height of every record"
    repairs.check_rest(int(np.count_nonzero(whole)), fix)
    columns = {"time_s": values[whole, 0] - zero}
    for name, column in zip((*REQUIRED[1:], *OPTIONAL), values.T[1:], strict=False):
        if name in REQUIRED or np.any(np.isfinite(column)):
            columns[name] = column[whole]
    kept = tuple(place for place, keep in zip(places, whole.tolist(), strict=True) if keep)
    return Fixes(columns, kept, began=began, notes=repairs.notes)


def number_of(text: str | None) -> float:
    """Return the number of a text from outside, NaN where there is none."""
    try:
        value = float("" if text is None or "_" in text else text)
    except ValueError:
        return np.nan
    return value if np.isfinite(value) else np.nan


def time_of(text: str | None) -> float:
    """Return the time of an ISO 8601 text, s since 1970, NaN where there is none; without a zone it is UTC."""
    try:
        moment = datetime.fromisoformat(text if text is not None else "")
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return np.nan
