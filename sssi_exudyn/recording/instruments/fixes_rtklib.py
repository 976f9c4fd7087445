"""Fixes in solutions of RTKLIB (``.pos``): latitude, longitude and height, or geocentric coordinates, of every epoch.

A line that begins with ``%`` names the columns, such as ``%  GPST  latitude(deg) longitude(deg)  height(m)   Q  ns
sdn(m)  sde(m)  sdu(m)``.  Source: RTKLIB 2.4.2 manual, "Positioning solution file".
"""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import pymap3d

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_FIXES, check_samples
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.io.table import TORN_LINES
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_of_moments, number_of

_DATE: Final = re.compile(r"\s*(\d{4})/(\d\d?)/(\d\d?)[ ,;\t]+(\d\d?):(\d\d?):(\d\d?(?:\.\d*)?)[ ,;\t]+")
_WEEK: Final = re.compile(r"\s*(\d{1,4})[ ,;\t]+(\d{1,6}(?:\.\d*)?)[ ,;\t]+")
_GPS_0: Final = 315964800.0
"""UTC of 1980-01-06, where GPS weeks begin, s since 1970."""
_LEAPS: Final = ((1483228800.0, 18.0), (1435708800.0, 17.0), (1341100800.0, 16.0), (1230768000.0, 15.0), (0.0, 14.0))
"""UTC from which GPS time is ahead of it by so many seconds (IERS Bulletin C)."""
_JST: Final = 9.0 * 3600.0
_INSIDE: Final = 6e6
"""Distance from the Earth's centre, m, below which no receiver is."""
_PLACES: Final = {"latitude(deg)": 3, "latitude(d'\")": 7, "x-ecef(m)": 3, "e-baseline(m)": 3}
"""First column of the place, and the number of values in a line that the place has; angles in minutes have three."""
_BASELINE: Final = "e-baseline(m)"


def fixes_rtklib(path: Path) -> Fixes:
    """Read the epochs of a solution; torn lines are left out and noted.

    The standard deviation of a fix is that of one direction in the plane.  Times without a date are GPS weeks and
    seconds; GPS time is converted to UTC.

    Raises InputError for a file without titles, baselines without a place on Earth, and fewer than three fixes.
    """
    titles: list[str] = []
    rows: list[tuple[int, list[float]]] = []
    torn: list[str] = []
    for number, line in enumerate(read_text(path).split("\n"), 1):
        if line.startswith("%"):
            words = re.split(r"[ ,;\t]+", line[1:].strip())
            titles = words if words[0] in ("GPST", "UTC", "JST") else titles
        elif line.strip():
            check_samples(path, f"line {number}", len(rows) + len(torn) + 1, limit=MAX_FIXES)
            numbers = _numbers(line) if titles else None
            if numbers is None:
                torn.append(f"line {number}")
            else:
                rows.append((number, numbers))
    if not titles:
        problem = "no line that begins with % names the columns"
        raise InputError(path, "", problem, "write the solution with its header (out-outhead = on)")
    repairs = Repairs(path)
    repairs.add(TORN_LINES, torn, len(rows) + len(torn), fix="write the solution again")
    values, places = _values(path, repairs, titles, rows)
    if titles[0] == "GPST" and len(values):
        values[:, 0] -= next(leap for begins, leap in _LEAPS if values[0, 0] - leap >= begins or not begins)
    elif titles[0] == "JST":
        values[:, 0] -= _JST
    fixes = fixes_of_moments(repairs, values, places, "fix(es)") if len(values) else None
    if fixes is None or len(fixes.places) < 3:
        raise InputError(path, "", f"{len(values)} fixes are no recording", "solve the whole run")
    return fixes


def _numbers(line: str) -> list[float] | None:
    """Return the time (s since 1970 of the file's clock) and the numbers of a line, None of a torn one."""
    date = _DATE.match(line)
    try:
        if date is not None:
            year, month, day, hour, minute = (int(date[group]) for group in range(1, 6))
            midnight = datetime(year, month, day, tzinfo=UTC).timestamp()
            moment, rest = midnight + 3600.0 * hour + 60.0 * minute + float(date[6]), line[date.end() :]
        else:
            week = _WEEK.match(line)
            if week is None:
                return None
            moment, rest = _GPS_0 + 604800.0 * int(week[1]) + float(week[2]), line[week.end() :]
    except (ValueError, OverflowError):
        return None
    return [moment, *(number_of(word) for word in re.split(r"[ ,;\t]+", rest.strip()))]


def _values(
    path: Path, repairs: Repairs, titles: list[str], rows: list[tuple[int, list[float]]]
) -> tuple[Array, tuple[str, ...]]:
    """Return time, latitude, longitude, height, speed, course and standard deviation (n, 7) of whole rows."""
    place = next((name for name in _PLACES if name in titles), "")
    if not place or place == _BASELINE:
        holds = "distances from a base" if place else "no latitude"
        raise InputError(path, "header", f"it holds {holds}", "write the solution as latitude, longitude and height")
    shift = _PLACES[place] - 3  # values of a line that have no title of their own
    names = titles[1:]
    whole = [(number, row) for number, row in rows if len(row) >= 1 + _PLACES[place]]
    short = [f"line {number}" for number, row in rows if len(row) < 1 + _PLACES[place]]
    repairs.add("line(s) that end too early", short, len(rows), fix="write the solution again")
    values = np.full((len(whole), 7), np.nan)
    for i, (_, row) in enumerate(whole):
        values[i, :4] = [row[0], *_degrees(place, row[1 : 1 + _PLACES[place]])]
        of = dict(zip(names[3:], row[4 + shift :], strict=False))
        north, east = of.get("vn(m/s)", np.nan), of.get("ve(m/s)", np.nan)
        values[i, 4:6] = np.hypot(north, east), np.degrees(np.arctan2(east, north)) % 360.0
        sigmas = [of[name] for name in ("sdn(m)", "sde(m)", "sdx(m)", "sdy(m)", "sdz(m)") if name in of]
        values[i, 6] = math.hypot(*sigmas) / math.sqrt(len(sigmas)) if sigmas else np.nan
    return values, tuple(f"line {number}" for number, _ in whole)


def _degrees(place: str, numbers: list[float]) -> list[float]:
    """Return latitude, longitude (degrees) and height (m) of a place as the solution writes it."""
    if place == "x-ecef(m)":
        if np.linalg.norm(numbers) < _INSIDE:
            return [np.nan, np.nan, np.nan]
        return [float(value) for value in pymap3d.ecef2geodetic(*numbers)]
    if place == "latitude(deg)":
        return numbers
    angles = [
        float(np.copysign(abs(degree) + minute / 60.0 + second / 3600.0, degree))
        for degree, minute, second in (numbers[:3], numbers[3:6])
    ]
    return [*angles, numbers[6]]
