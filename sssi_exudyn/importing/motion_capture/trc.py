"""Points of TRC files (Motion Analysis), as OpenSim, Pose2Sim and OpenCap write them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.motion_capture.c3d_points import UNITS, Points
from sssi_exudyn.io.bounds import MAX_COLUMNS, check_samples
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.repairs import REPEATED, Repairs, rising_records
from sssi_exudyn.io.table import TORN_LINES
from sssi_exudyn.recording.instruments.fixes import number_of

_NAMES, _FIRST = "Frame#", 2
"""Title of the first column, and the number of columns before the points."""
_FARTHEST: Final = 1e4
"""Distance from the origin, m, beyond which no point of a capture is."""
_RATES: Final = (20.0, 2000.0)


def read_trc(path: Path) -> tuple[Points, tuple[str, ...]]:
    """Read the points, and what was left out, in words; an empty place, and zeros, are of a lost point.

    Frames that the file leaves out are lost.  Raises InputError for another text, units that are none of length, and
    more torn lines than ``Repairs`` allows.
    """
    lines = list(enumerate(read_text(path).split("\n"), 1))
    titles = next((at for at, (_, line) in enumerate(lines) if line.startswith(_NAMES)), 0)
    if titles < 1:
        raise InputError(path, "header", "no line begins with Frame#: this is no TRC file", "export the points again")
    names = [name.strip() for name in lines[titles][1].split("\t")[_FIRST:] if name.strip()]
    if not names or len(names) > MAX_COLUMNS // 3:
        raise InputError(path, f"line {titles + 1}", f"{len(names)} points are no capture", "export the points again")
    unit = _unit(path, [line for _, line in lines[:titles]])
    width = _FIRST + 3 * len(names)
    rows = [(number, line.split("\t", width)) for number, line in lines[titles + 2 :] if line.strip()]
    check_samples(path, "", len(rows), width)
    repairs = Repairs(path)
    table, places = _numbers(repairs, rows, width)
    kept = rising_records(table[:, 0])
    words = "frame(s) whose time stands still or runs back"
    repairs.add_at(words, ~kept, places, most=REPEATED)
    table = table[kept]
    rate = 1.0 / float(np.median(np.diff(table[:, 0]))) if len(table) > _FIRST else 0.0
    if not _RATES[0] <= rate <= _RATES[1]:
        problem = f"{len(table)} frames at {rate:.3g} Hz are no capture"
        raise InputError(path, "Time", problem, "export the whole run, with times in seconds")
    frame = np.round((table[:, 0] - table[0, 0]) * rate)
    check_samples(path, "Time", float(frame[-1]) + 1.0, width)
    where = np.full((int(frame[-1]) + 1, len(names), 3), np.nan)
    where[frame.astype(int)] = unit * table[:, 1:].reshape(len(table), -1, 3)
    where[np.all(where == 0.0, axis=2) | np.any(np.abs(where) > _FARTHEST, axis=2)] = np.nan
    return Points(rate, tuple(name.rsplit(":", 1)[-1] for name in names), where, {}), repairs.notes


def _unit(path: Path, head: list[str]) -> float:
    """Return the file's unit of length in m.  Raises InputError where there is none."""
    cells = [[cell.strip().lower() for cell in line.split("\t")] for line in head]
    for above, below in pairwise(cells):
        if "units" in above and above.index("units") < len(below):
            unit = below[above.index("units")]
            if unit in UNITS:
                return UNITS[unit]
            raise InputError(path, "Units", f"{unit[:20]!r} is no unit of length", "export in mm or m")
    raise InputError(path, "header", "it names no units", "export the points with their header")


def _numbers(repairs: Repairs, rows: list[tuple[int, list[str]]], width: int) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return times and coordinates (n, 1 + 3 points) of whole rows, NaN where a cell is empty, and their places."""
    table = np.full((len(rows), width - 1), np.nan)
    torn: list[str] = []
    for i, (number, cells) in enumerate(rows):
        filled = [*cells[:width], *[""] * (width - len(cells))]
        table[i] = [number_of(cell) for cell in filled[1:]]
        if len(cells) < width - 2 or not np.isfinite(table[i, 0]):  # empty cells at the end may be missing
            torn.append(f"line {number}")
            table[i, 0] = np.nan
    repairs.add(TORN_LINES, torn, len(rows))
    whole = np.isfinite(table[:, 0])
    return table[whole], tuple(f"line {number}" for (number, _), keep in zip(rows, whole.tolist(), strict=True) if keep)
