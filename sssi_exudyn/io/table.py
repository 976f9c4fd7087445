"""Tables of numbers against time, as instruments write them: their reading, clocks and gaps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_COLUMNS, MAX_NAME, MOST_FILLED, check_samples
from sssi_exudyn.io.files import read_text

SHORT_GAP: Final = 1.0
"""Longest gap that is interpolated, s; longer ones split the run.  In this time a skier moves by less than a turn."""


@dataclass(frozen=True)
class Table:
    """The columns of a CSV file by name, and the file's line number of each row."""

    file: Path
    columns: dict[str, Array]
    lines: tuple[int, ...]


@dataclass(frozen=True)
class Clock:
    """The times of one instrument's samples after its gaps were treated.

    Attributes
    ----------
    keep : the samples (slice of the file's) of the longest stretch without a long gap
    time : (m,) s, the kept samples' times together with those of the bridged gaps
    bridged : (m,) True where the sample has to be interpolated
    gap : (m,) s, the length of the gap that a bridged sample lies in, 0 elsewhere
    notes : what was done, in words
    """

    keep: slice
    time: Array
    bridged: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    gap: Array
    notes: tuple[str, ...]


def read_table(path: Path) -> Table:
    """Read a CSV file: one header line of names, commas, decimal points, one sample a line.

    Raises InputError for a missing header, other separators, rows of another length, and text, NaN or nothing in a
    number's place, each with its line.
    """
    rows = [(number, line) for number, line in enumerate(read_text(path).split("\n"), 1) if line.strip()]
    line, header = rows[0]
    if header.count(",") >= MAX_COLUMNS:
        raise InputError(path, f"line {line}", "more columns than any instrument has", "export the file again")
    names = [name.strip().strip('"') for name in header.split(",")]
    longest = max(names, key=len)
    if len(longest) > MAX_NAME:
        raise InputError(path, f"line {line}", f"{longest!r} is no name of a column", "export the file again")
    if ";" in header or "\t" in header:
        raise InputError(
            path, f"line {line}", "columns are not separated by commas", "export with commas and decimal points"
        )
    if not any(name and not _is_number(name) for name in names):
        raise InputError(path, f"line {line}", "the header is missing", "put the columns' names on the first line")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(path, f"line {line}", f"column {twice[0]!r} appears twice", "leave one of them")
    if len(rows) < 3:
        raise InputError(path, "", f"{len(rows) - 1} samples are no recording", "export the whole run")
    values = numbers(path, rows[1:], len(names), ",")
    return Table(path, dict(zip(names, values.T.copy(), strict=True)), tuple(number for number, _ in rows[1:]))


def numbers(path: Path, rows: list[tuple[int, str]], width: int, separator: str | None) -> Array:
    """Read finite numbers (len(rows), width) from text lines; ``rows`` holds (line number, text).

    Raises InputError that names the first line (and column) without ``width`` finite numbers.  Raises it too for more
    numbers than any run has.
    """
    check_samples(path, "", len(rows), width)
    try:
        values = np.loadtxt((line for _, line in rows), delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        values = np.empty((0, 0))
    if values.shape != (len(rows), width) or not np.all(np.isfinite(values)):
        for number, line in rows:
            _check_row(path, number, line.split(separator), width)
        raise InputError(path, "", "the numbers cannot be read", "export the file again")
    return values


def _check_row(path: Path, number: int, words: list[str], width: int) -> None:
    if len(words) != width:
        raise InputError(
            path,
            f"line {number}",
            f"{len(words)} values where {width} are due",
            "delete the line if it is torn, or export the file again",
        )
    for column, word in enumerate(words, 1):
        if not _is_number(word) or not np.isfinite(float(word)):
            raise InputError(
                path,
                f"line {number}, column {column}",
                f"{word.strip()[:30]!r} is not a number",
                "correct it, or export the file again",
            )


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def check_time(path: Path, time: Array, places: tuple[str, ...]) -> None:
    """Raise InputError where time stands still or runs back; ``places`` names each sample's place in the file."""
    steps = np.diff(time)
    if np.all(steps > 0.0):
        return
    bad = int(np.argmax(steps <= 0.0)) + 1
    what = "stands still" if steps[bad - 1] == 0.0 else "runs back"
    raise InputError(
        path,
        places[bad],
        f"time {what}: {time[bad]:g} s after {time[bad - 1]:g} s",
        "delete the repeated samples, or sort and export the file again",
    )


def bridge_gaps(path: Path, time: Array, width: int = 1) -> Clock:
    """Find the gaps in rising ``time`` (n,) s: short ones get new sample times, long ones split the run.

    A gap is an interval of more than one and a half median ones.  It is short where up to ``SHORT_GAP`` is missing, or
    up to two samples of a slow instrument.  The longest part of a split run is kept.

    Parameters
    ----------
    width : count of numbers in one sample, for the bound on the filled samples

    Raises InputError when the longest part is shorter than ``SHORT_GAP``, and when its gaps would take more samples
    than any run has.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    longest_bridge = max(SHORT_GAP + 1.25 * usual, 3.25 * usual)  # a quarter interval for the jitter of the clock
    notes: list[str] = []
    cuts = np.flatnonzero(steps > longest_bridge) + 1
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(time)]
    best = int(np.argmax(time[stops - 1] - time[starts]))
    keep = slice(int(starts[best]), int(stops[best]))
    kept = time[keep]
    if len(kept) < 3 or kept[-1] - kept[0] < SHORT_GAP:
        raise InputError(
            path, "time_s", f"no stretch of {SHORT_GAP:g} s is without a long gap", "export the run without gaps"
        )
    if len(cuts):
        where = ", ".join(f"{time[cut - 1]:.2f} to {time[cut]:.2f} s" for cut in cuts[:5])
        notes.append(
            f"{path.name}: {len(cuts)} gap(s) too long to bridge ({where}) split the run;"
            f" its longest part, {kept[0]:.2f} to {kept[-1]:.2f} s, is kept"
        )
    steps = np.diff(kept)
    holes = np.flatnonzero(steps > 1.5 * usual)
    with np.errstate(over="ignore"):  # beyond all floats is beyond the bound too
        filled = len(kept) + float(np.sum(np.round(steps[holes] / usual) - 1.0))
    place = f"time_s, steps of {usual:.3g} s with gaps between them"
    check_samples(path, place, filled, width)
    if filled > (1 + MOST_FILLED) * len(kept):
        problem = f"{len(kept)} samples, and {filled - len(kept):.0f} missing between them"
        raise InputError(path, place, problem, "export the samples at even steps")
    pieces, marks, gaps, last = [], [], [], 0
    for hole in holes:
        missing = max(round(steps[hole] / usual) - 1, 1)
        new = np.linspace(kept[hole], kept[hole + 1], missing + 2)[1:-1]
        pieces += [kept[last : hole + 1], new]
        marks += [np.zeros(hole + 1 - last, bool), np.ones(missing, bool)]
        gaps += [np.zeros(hole + 1 - last), np.full(missing, steps[hole])]
        last = int(hole) + 1
    pieces.append(kept[last:])
    marks.append(np.zeros(len(kept) - last, bool))
    gaps.append(np.zeros(len(kept) - last))
    if len(holes):
        where = ", ".join(f"{kept[hole]:.2f} to {kept[hole + 1]:.2f} s" for hole in holes[:5])
        more = ", …" if len(holes) > 5 else ""
        notes.append(f"{path.name}: {len(holes)} short gap(s) interpolated ({where}{more})")
    return Clock(keep, np.concatenate(pieces), np.concatenate(marks), np.concatenate(gaps), tuple(notes))
