"""Tables of numbers against time, as instruments write them: their reading, clocks and gaps."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_COLUMNS, MAX_NAME, MOST_FILLED, check_samples
from sssi_exudyn.io.repairs import REPEATED, Mask, Repairs, rising_records
from sssi_exudyn.io.separators import rows_of_table

SHORT_GAP: Final = 1.0
"""Longest gap that is interpolated, s; longer ones split the run.  In this time a skier moves by less than a turn."""

TORN_LINES: Final = "line(s) that are torn or hold no number in a needed column"
"""Bad rows in words."""
Choose = Callable[[list[str]], tuple[Collection[str], Collection[str]]]
"""Function of the names of a table's columns; returns those that are needed, and those that may have empty cells."""


@dataclass(frozen=True)
class Table:
    """The columns of a CSV file by name, and the file's line number of each row.

    unused : names of the columns that were not read;  notes : rows that were left out, in words
    """

    file: Path
    columns: dict[str, Array]
    lines: tuple[int, ...]
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Return the place of each row, for messages."""
        return tuple(f"line {line}" for line in self.lines)

    def rows(self, kept: Mask) -> Table:
        """Return the table of the rows that are ``kept`` (n,)."""
        columns = {name: column[kept] for name, column in self.columns.items()}
        return replace(self, columns=columns, lines=tuple(np.array(self.lines)[kept].tolist()))


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


def read_table(path: Path, choose: Choose | None = None) -> Table:
    """Read a CSV file: one header line of names, one sample a line; separators are those of ``rows_of_table``.

    Parameters
    ----------
    choose : function of the header's names that returns the needed columns, and those that may have empty cells (NaN).
        Other columns may hold text or nothing, and rows without numbers in needed columns are left out and noted.
        Without it all columns are read, and every row must be whole

    Raises InputError for a missing header, and more bad rows than ``Repairs`` allows.  Without
    ``choose`` it raises it for rows of another length, and text, NaN or nothing in a number's place, with the line.
    """
    rows = rows_of_table(path)
    names = _header(path, *rows[0])
    if len(rows) < 3:
        raise InputError(path, "", f"{len(rows) - 1} samples are no recording", "export the whole run")
    if choose is None:
        values = numbers(path, rows[1:], len(names), ",")
        return Table(path, dict(zip(names, values.T.copy(), strict=True)), tuple(number for number, _ in rows[1:]))
    needed, sparse = choose(names)
    chosen = [column for column, name in enumerate(names) if name in needed or name in sparse]
    blank = tuple(column for column in chosen if names[column] not in needed)
    repairs = Repairs(path)
    values, lines = good_rows(repairs, rows[1:], len(names), chosen, blank)
    if len(lines) < 2:
        raise InputError(path, "", f"{len(lines)} samples are no recording", "export the whole run")
    columns = {names[column]: values[:, i].copy() for i, column in enumerate(chosen)}
    unused = tuple(name for name in names if name not in columns)
    return Table(path, columns, lines, unused, repairs.notes)


def _header(path: Path, line: int, header: str) -> list[str]:
    """Return the names of a CSV file's columns.  Raises InputError for a header that names none, or one twice."""
    if header.count(",") >= MAX_COLUMNS:
        raise InputError(path, f"line {line}", "more columns than any instrument has", "export the file again")
    names = [name.strip().strip('"') for name in header.split(",")]
    longest = max(names, key=len)
    if len(longest) > MAX_NAME:
        raise InputError(path, f"line {line}", f"{longest!r} is no name of a column", "export the file again")
    if not any(name and not _is_number(name) for name in names):
        raise InputError(path, f"line {line}", "the header is missing", "put the columns' names on the first line")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(path, f"line {line}", f"column {twice[0]!r} appears twice", "leave one of them")
    return names


def good_rows(
    repairs: Repairs, rows: list[tuple[int, str]], width: int, chosen: list[int], blank: tuple[int, ...] = ()
) -> tuple[Array, tuple[int, ...]]:
    """Read the ``chosen`` columns of comma-separated rows; rows without numbers there are left out and noted.

    Parameters
    ----------
    repairs : takes the note
    rows : (line number, text) of each;  width : number of columns
    chosen : the columns that are read;  blank : those of them that may be empty, which gives NaN

    Returns the numbers (k, len(chosen)) and the line numbers (k) of the good rows.  Raises InputError where more rows
    are bad than ``Repairs`` allows, and for more numbers than any run has.
    """
    check_samples(repairs.path, "", len(rows), width)
    values, good = parsed_rows(rows, width, chosen, blank)
    places = tuple(f"line {number}" for number, _ in rows)
    repairs.add_at(TORN_LINES, ~good, places)
    return values[good], tuple(number for (number, _), keep in zip(rows, good.tolist(), strict=True) if keep)


def parsed_rows(
    rows: list[tuple[int, str]], width: int, chosen: list[int], blank: tuple[int, ...] = ()
) -> tuple[Array, Mask]:
    """Read the ``chosen`` columns of comma-separated rows; parameters are those of ``good_rows``.

    Returns the numbers (n, len(chosen)), NaN where there is none, and which rows (n,) have all that are needed.
    """
    whole = [line.count(",") + 1 == width for _, line in rows]
    try:
        if not all(whole):
            raise ValueError
        values = np.loadtxt((line for _, line in rows), delimiter=",", usecols=chosen, comments=None, ndmin=2)
    except ValueError:
        values = np.full((len(rows), len(chosen)), np.nan)
        for row, (_, line) in enumerate(rows):
            words = line.split(",") if whole[row] else []
            values[row] = [_number(words[column]) for column in chosen] if words else np.nan
    needed = [i for i, column in enumerate(chosen) if column not in blank]
    values[~np.isfinite(values)] = np.nan
    return values, np.asarray(np.array(whole) & np.all(np.isfinite(values[:, needed]), axis=1))


def in_order(table: Table) -> Table:
    """Return the table with rising ``time_s``: rows whose time stands still or runs back are left out and noted.

    Raises InputError where more of them are out of order than ``Repairs`` allows.
    """
    repairs, kept = Repairs(table.file), rising_records(table.columns["time_s"])
    fix = "sort and export the file again"
    repairs.add_at("line(s) whose time stands still or runs back", ~kept, table.places, most=REPEATED, fix=fix)
    return replace(table.rows(kept), notes=table.notes + repairs.notes)


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


def _number(word: str) -> float:
    """Return the number of a cell, which may stand in quotes; NaN for anything else."""
    try:
        return np.nan if "_" in word else float(word.strip().strip('"'))
    except ValueError:
        return np.nan


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


def bridge_gaps(path: Path, time: Array, width: int = 1, merit: Callable[[slice], float] | None = None) -> Clock:
    """Find the gaps in rising ``time`` (n,) s: short ones get new sample times, long ones split the run.

    A gap is an interval of more than one and a half median ones.  It is short where up to ``SHORT_GAP`` is missing, or
    up to two samples of a slow instrument.  The best part of a split run is kept, the longest without ``merit``.

    Parameters
    ----------
    width : count of numbers in one sample, for the bound on the filled samples
    merit : function of a part (slice of the samples); the part with the largest is kept, of equal ones the longest

    Raises InputError when all or that part is shorter than ``SHORT_GAP``, and when its gaps would take more samples
    than any run has.
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    longest_bridge = max(SHORT_GAP + 1.25 * usual, 3.25 * usual)  # a quarter interval for the jitter of the clock
    notes: list[str] = []
    cuts = np.flatnonzero(steps > longest_bridge) + 1
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(time)]
    parts = [slice(int(start), int(stop)) for start, stop in zip(starts, stops, strict=True)]
    lasting = [float(time[part.stop - 1] - time[part.start]) for part in parts]
    best = max(range(len(parts)), key=lambda i: (0.0 if merit is None else merit(parts[i]), lasting[i]))
    keep = parts[best]
    kept = time[keep]
    if not len(cuts) and kept[-1] - kept[0] < SHORT_GAP:
        problem = f"{kept[-1] - kept[0]:.2g} s are too short for a run"
        raise InputError(path, "time_s", problem, f"export the whole run, at least {SHORT_GAP:g} s of it")
    if len(kept) < 3 or kept[-1] - kept[0] < SHORT_GAP:
        raise InputError(
            path, "time_s", f"no stretch of {SHORT_GAP:g} s is without a long gap", "export the run without gaps"
        )
    if len(cuts):
        others = [part for part in parts if part != keep]
        where = ", ".join(f"{time[part.start]:.2f} to {time[part.stop - 1]:.2f} s" for part in others[:5])
        more = ", …" if len(others) > 5 else ""
        which = "longest part" if merit is None else "part that the other instruments cover, downhill,"
        notes.append(
            f"{path.name}: {len(cuts)} gap(s) too long to bridge split the run; its {which}"
            f" {kept[0]:.2f} to {kept[-1]:.2f} s is kept, the others are left out: {where}{more}"
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
