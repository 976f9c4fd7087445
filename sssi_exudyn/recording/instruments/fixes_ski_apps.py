"""Fixes in the exports of telephones' ski apps: Ski Tracks (``.skiz``) and Slopes (``.slopes``).

Both are archives with a table without titles: time (s since 1970), latitude, longitude (degrees), altitude (m), course
(degrees), speed (m/s), and the radius of 68 % of fixes in the plane and in height (m).  What the telephone did not
know is negative.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.archive import member_of
from sssi_exudyn.io.bounds import MAX_FIXES, check_samples
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.io.table import TORN_LINES, parsed_rows
from sssi_exudyn.recording.instruments.fixes import RADIUS, Fixes, fixes_of_moments

SUFFIXES: Final = (".skiz", ".slopes")
_TABLES: Final = {".skiz": ("Nodes.csv",), ".slopes": ("RawGPS.csv", "GPS.csv")}
"""The app's table of fixes; Slopes's second one is smoothed."""
_COLUMNS: Final = 7
"""Columns that are read, with that of the radius in the plane."""
_PLACED: Final = 4
"""Columns that every row has: time, latitude, longitude, altitude."""


def fixes_ski_app(path: Path) -> Fixes:
    """Read the app's table of fixes; torn lines are left out and noted.

    Raises InputError for what ``member_of`` refuses, another table, and fewer than three fixes.
    """
    name, content = member_of(path, _TABLES[path.suffix.lower()])
    text = content.decode("utf-8-sig", errors="replace").replace("\r\n", "\n")
    rows = [(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip()]
    check_samples(path, name, len(rows), limit=MAX_FIXES)
    width = rows[len(rows) // 2][1].count(",") + 1 if rows else 0
    if width < _PLACED or len(rows) < 3:
        problem = f"{len(rows)} rows of {width} columns are no table of fixes"
        raise InputError(path, name, problem, "export it from the app again")
    chosen = list(range(min(width, _COLUMNS)))
    values, good = parsed_rows(rows, width, chosen, tuple(chosen[_PLACED - 1 :]))
    repairs = Repairs(path)
    repairs.add_at(TORN_LINES, ~good, [f"{name}, line {number}" for number, _ in rows])
    places = tuple(f"{name}, line {number}" for (number, _), keep in zip(rows, good.tolist(), strict=True) if keep)
    table = np.full((len(places), _COLUMNS), np.nan)
    table[:, chosen] = values[good]
    course, speed, radius = table[:, 4:].T
    sigma = np.where(radius > 0.0, radius / RADIUS, np.nan)
    fixes = fixes_of_moments(repairs, np.column_stack([table[:, :4], speed, course, sigma]), places, "fix(es)")
    if len(fixes.places) < 3:
        raise InputError(path, name, f"{len(fixes.places)} fixes are no recording", "export a whole day from the app")
    return fixes
