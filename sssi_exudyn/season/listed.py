"""What the import of a season left without a recording: its rows of the table, and the tracks of listed runs."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pandas as pd

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.many import TABLE, ImportedRun
from sssi_exudyn.io.files import read_text
from sssi_exudyn.season.descent import track_of_fixes

LONGEST: Final = 300
"""Maximum number of characters of the reason why a run has no result."""
LISTED: Final = "listed"
_WITHOUT: Final = (LISTED, "failed", "not read")
"""Outcomes of an import that leave no recording."""
_FROM_IMPORT: Final = {
    "duration_s": "duration_s", "length_m": "track_length_m", "vertical_m": "vertical_m",
    "mean_speed_mps": "mean_mps", "top_speed_mps": "top_mps",
}  # fmt: skip
"""Columns of a run without a recording, and their names in the import's table."""


def rows_without_recording(folder: Path) -> list[dict[str, Any]]:
    """Return rows of the season's table of what has no recording."""
    rows: list[dict[str, Any]] = []
    for entry in _entries(folder):
        figures = {name: _number(entry[column]) for name, column in _FROM_IMPORT.items()}
        began = one_line(entry["start_utc"])
        words = {"run": one_line(entry["recording"]), "status": entry["status"]}
        words |= {"error": one_line(entry["error"], LONGEST), "began_utc": began, "day": began[:10]}
        rows.append({**words, **figures})
    return rows


def listed_tracks(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the name of each listed run whose fixes the import kept, and their file."""
    inside = folder.resolve()
    for entry in _entries(folder):
        path = folder / f"{entry['recording']}.csv"
        if entry["status"] == LISTED and path.is_file() and path.resolve().is_relative_to(inside):
            yield one_line(entry["recording"]), path


def read_listed_tracks(folder: Path) -> dict[str, pd.DataFrame]:
    """Return the tracks of listed runs by name; one that cannot be read is left out."""
    tracks = {}
    for name, path in listed_tracks(folder):
        try:
            tracks[name] = track_of_fixes(path).to_pandas()
        except InputError:  # its row says all that is known of it
            continue
    return tracks


def _entries(folder: Path) -> list[dict[str, str]]:
    """Return the rows of the import's table that left no recording; none where there is no such table."""
    path = folder / TABLE
    if not path.is_file():
        return []
    try:
        entries = list(csv.DictReader(read_text(path).splitlines()))
    except (InputError, csv.Error):  # of another program
        return []
    if not entries or not set(ImportedRun.__dataclass_fields__) <= set(entries[0]):
        return []
    return [entry for entry in entries if entry["status"] in _WITHOUT]


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
