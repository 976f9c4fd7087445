"""Fixes in the logs of Google's GnssLogger for Android: the lines ``Fix`` among raw measurements."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_FIXES, check_samples
from sssi_exudyn.io.long_table import pieces_of_lines
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.recording.instruments.fixes import RADIUS, Fixes, fixes_of_moments, number_of

_FIX, _RAW = "Fix,", "Raw,"
_HEAD: Final = 200
"""Number of lines among which a log has a title or a record."""
_NAMES: Final = {
    "unixtimemillis": 0, "(utc)timeinms": 0, "latitudedegrees": 1, "latitude": 1, "longitudedegrees": 2, "longitude": 2,
    "altitudemeters": 3, "altitude": 3, "speedmps": 4, "speed": 4, "bearingdegrees": 5, "bearing": 5,
    "accuracymeters": 6, "accuracy": 6,
}  # fmt: skip
"""Our column of each title; titles differ between versions of the app."""
_TITLES: Final = (
    "Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,UnixTimeMillis"
)
"""Titles where a log has none."""
_BEST: Final = "gps"
"""Provider whose fixes are the receiver's own; others are filtered or of networks."""


def fixes_gnss_logger(path: Path) -> Fixes:
    """Read the fixes of one provider: the receiver's own where there are any, else those of which there are most.

    Fixes without place or height are left out and noted.  Raises InputError for a log without fixes.
    """
    titles = _TITLES
    rows: list[tuple[int, list[str]]] = []
    for piece in pieces_of_lines(path):
        for number, line in piece:
            if line.startswith(_FIX):
                rows.append((number, line.split(",", 40)))
                check_samples(path, f"line {number}", len(rows), limit=4 * MAX_FIXES)
            elif line.startswith("#") and line.lstrip("# ").startswith(_FIX):
                titles = line.lstrip("# ")
    providers = Counter(words[1].strip().lower() for _, words in rows if len(words) > 1)
    if not providers:
        fix = "log with Location (Fix) in GnssLogger, or give the file's place if it is a sensor's"
        raise InputError(path, "", "no line begins with Fix: it is no log of GnssLogger with fixes", fix)
    provider = _BEST if _BEST in providers else providers.most_common(1)[0][0]
    columns = [_NAMES.get(title.strip().lower()) for title in titles.split(",")]
    chosen = [(number, words) for number, words in rows if len(words) > 1 and words[1].strip().lower() == provider]
    values = np.full((len(chosen), 7), np.nan)
    for row, (_, words) in enumerate(chosen):
        for word, column in zip(words, columns, strict=False):
            if column is not None:
                values[row, column] = number_of(word)
    values[:, 0] *= 1e-3
    values[:, 6] = np.where(values[:, 6] > 0.0, values[:, 6] / RADIUS, np.nan)
    repairs = Repairs(path)
    if len(providers) > 1:
        others = ", ".join(f"{count} of {name}" for name, count in providers.most_common(5) if name != provider)
        repairs.add_all(f"fixes are those of the provider {provider}; others are left out: {others}")
    places = tuple(f"line {number}" for number, _ in chosen)
    fixes = fixes_of_moments(repairs, values, places, "fix(es)")
    if len(fixes.places) < 3:
        raise InputError(path, "", f"{len(fixes.places)} fixes are no recording", "record in the open, for a whole run")
    return fixes


def is_gnss_log(path: Path) -> bool:
    """Return whether a text begins as a log of GnssLogger does."""
    for piece in pieces_of_lines(path):
        return any(line.lstrip("# ").startswith((_FIX, _RAW)) for _, line in piece[:_HEAD])
    return False
