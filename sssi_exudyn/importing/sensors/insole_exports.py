"""Text exports of pressure insoles: Moticon OpenGo, novel loadsol and novel pedar.

====== =====================================================================================================
system what its export looks like
====== =====================================================================================================
OpenGo lines with ``#``, the last of which names the columns: ``time``, ``left total force[N]``, … (tabs or commas)
loadsol a row of names (``ABCD-L:heel``, …, ``ABCD-L`` for the sum) above one of units, in which every insole has its
       own ``Time[sec]`` and ``N`` or ``Force[N]`` columns (tabs)
pedar  a row ``time[secs] 1 2 … 198``: the pressures of 99 cells of the left and then of the right insole (tabs)
====== =====================================================================================================

Missing values (empty, ``-``, ``nan``) are interpolated between those of the same foot.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.bounds import MAX_COLUMNS, check_samples
from sssi_exudyn.io.long_table import Rows, pieces_of_lines
from sssi_exudyn.io.repairs import REPEATED, UNKNOWN, Repairs, rising_records
from sssi_exudyn.recording.instruments.fixes import number_of

SUFFIXES: Final = (".txt", ".csv", ".asc")
_HEAD: Final = 40
"""Number of lines among which the names of the columns are."""
_TOTAL: Final = re.compile(r"(left|right) total force ?\[N\]", re.IGNORECASE)
_CLOCK: Final = re.compile(r"time(?: ?\[(s|secs?|ms)\])?", re.IGNORECASE)
_NEWTON: Final = re.compile(r"N|(?:[Ff]orce ?)?\[N\]")
_SIDE: Final = re.compile(r"(?:^|[^A-Za-z])(l|left|r|right)(?:$|[^A-Za-z])", re.IGNORECASE)
_CELLS: Final = 99
"""Cells of a pedar insole."""
_FEET: Final = ("left", "right")


@dataclass(frozen=True)
class InsoleExport:
    """The loads under both feet.

    time : (n,) s;  left, right : (n,) N, or in arbitrary units where ``is_force`` is False
    notes : what was left out or assumed, in words
    """

    time: Array
    left: Array
    right: Array
    is_force: bool
    notes: tuple[str, ...]

    def table(self, mass: float, cut: tuple[float, float] | None) -> str:
        """Return the text of ``insoles.csv``; of the stretch ``cut`` (s), time counts from its start.

        Pressures are scaled so that both feet carry the weight of ``mass`` (kg) on average.
        """
        start, stop = cut if cut is not None else (0.0, np.inf)
        kept = (self.time >= start) & (self.time <= stop) if cut is not None else np.ones(len(self.time), bool)
        left, right = self.left[kept], self.right[kept]
        scale = 1.0 if self.is_force else mass * GRAVITY / max(float(np.mean(left + right)) if len(left) else 0.0, 1e-9)
        rows = np.column_stack([self.time[kept] - start, scale * left, scale * right]).tolist()
        return "time_s,left_N,right_N\n" + "".join(f"{t:.6f},{a:.4f},{b:.4f}\n" for t, a, b in rows)


def is_insole_export(path: Path) -> bool:
    """Return whether a text is an export of one of the systems."""
    return path.suffix.lower() in SUFFIXES and path.is_file() and _layout(_head(path)) is not None


def read_insole_export(path: Path) -> InsoleExport:
    """Read an export.

    Raises InputError for another text, a foot without loads, and more bad rows than ``Repairs`` allows.
    """
    layout = _layout(_head(path))
    if layout is None:
        raise InputError(path, "", "no export of insoles that is known", "export time and total force of both feet")
    if layout.only is not None:
        raise InputError(path, "", f"loads of the {layout.only} foot alone", "export both insoles of one measurement")
    rows = _rows(path, layout)
    values = np.array([[number_of(word) for word in words] for _, words in rows]).reshape(-1, layout.width)
    repairs = Repairs(path)
    feet = [_foot(path, repairs, values, rows, layout, foot) for foot in _FEET]
    (time, left), (other, right) = feet
    inside = (time >= other[0]) & (time <= other[-1])
    if np.count_nonzero(inside) < 3:
        raise InputError(path, "", "the feet have no time in common", "export both insoles of one measurement")
    if not layout.is_force:
        repairs.add_all(
            "pressures without areas are scaled to the skier's weight; they give the share between the feet"
        )
    right = np.interp(time[inside], other, right)
    return InsoleExport(time[inside], left[inside], right, layout.is_force, repairs.notes)


@dataclass(frozen=True)
class _Layout:
    """Where the columns are.

    first : line number of the first row of numbers;  separator : between cells;  width : number of cells
    clocks, loads : column of time, and columns that are summed, of the left and the right foot
    scale : of the times, to s
    only : the foot whose loads are there without the other's
    """

    first: int
    separator: str
    width: int
    clocks: tuple[int, int]
    loads: tuple[tuple[int, ...], tuple[int, ...]]
    scale: float = 1.0
    is_force: bool = True
    only: str | None = None


def _head(path: Path) -> Rows:
    """Return the first lines that are not empty."""
    return next(iter(pieces_of_lines(path)), [])[:_HEAD]


def _layout(head: Rows) -> _Layout | None:
    """Return where the columns are, None for another text."""
    for at, (number, line) in enumerate(head):
        separator = "\t" if "\t" in line else ","
        if line.count(separator) >= MAX_COLUMNS:
            return None
        cells = [cell.strip().strip('"') for cell in line.lstrip("# ").split(separator)]
        above = [cell.strip().strip('"') for cell in head[at - 1][1].split(separator)] if at else []
        for recognise in (_opengo, _loadsol, _pedar):
            layout = recognise(number, separator, cells, above)
            if layout is not None:
                return layout
    return None


def _opengo(number: int, separator: str, cells: Sequence[str], _above: Sequence[str]) -> _Layout | None:
    totals = {match[1].lower(): column for column, cell in enumerate(cells) if (match := _TOTAL.fullmatch(cell))}
    clock = next((column for column, cell in enumerate(cells) if _CLOCK.fullmatch(cell)), None)
    if clock is None or not totals:
        return None
    match = _CLOCK.fullmatch(cells[clock])
    scale = 1e-3 if match and match[1] == "ms" else 1.0
    left, right = (totals.get(foot, 0) for foot in _FEET)
    return _Layout(
        number + 1, separator, len(cells), (clock, clock), ((left,), (right,)), scale, only=_the_only_one(totals)
    )


def _loadsol(number: int, separator: str, cells: Sequence[str], above: Sequence[str]) -> _Layout | None:
    forces = [bool(_NEWTON.fullmatch(cell)) for cell in cells]
    clocks = [column for column, cell in enumerate(cells) if _CLOCK.fullmatch(cell)]
    if not clocks or not any(forces) or len(above) < len(cells) - 1:
        return None
    feet: dict[str, tuple[int, int]] = {}
    for column, (is_force, name) in enumerate(zip(forces, above, strict=False)):
        side = _SIDE.search(name.partition(":")[0])
        if is_force and side is not None and ":" not in name:  # the sum of an insole's areas
            before = [clock for clock in clocks if clock < column]
            feet.setdefault(
                "left" if side[1].lower().startswith("l") else "right", (before[-1] if before else 0, column)
            )
    if not feet:
        return None
    (left_clock, left), (right_clock, right) = (feet.get(foot, (0, 0)) for foot in _FEET)
    clocks_of_feet = left_clock, right_clock
    return _Layout(number + 1, separator, len(cells), clocks_of_feet, ((left,), (right,)), only=_the_only_one(feet))


def _the_only_one(feet: Collection[str]) -> str | None:
    """Return the foot that is there without the other; None where both are."""
    return next(iter(feet)) if len(feet) == 1 else None


def _pedar(number: int, separator: str, cells: Sequence[str], _above: Sequence[str]) -> _Layout | None:
    names = [str(cell) for cell in range(1, 2 * _CELLS + 1)]
    if not _CLOCK.fullmatch(cells[0]) or list(cells[1 : 2 * _CELLS + 1]) != names:
        return None
    left, right = tuple(range(1, _CELLS + 1)), tuple(range(_CELLS + 1, 2 * _CELLS + 1))
    return _Layout(number + 1, separator, 2 * _CELLS + 1, (0, 0), (left, right), is_force=False)


def _rows(path: Path, layout: _Layout) -> list[tuple[int, list[str]]]:
    """Return line number and cells of the rows of numbers; rows of another length are left out."""
    needed = max(*layout.clocks, *layout.loads[0], *layout.loads[1])
    rows: list[tuple[int, list[str]]] = []
    for piece in pieces_of_lines(path):
        for number, line in piece:
            if number < layout.first or line.startswith("#"):
                continue
            words = line.split(layout.separator, layout.width)[: layout.width]
            if len(words) > needed:
                rows.append((number, [*words, *[""] * (layout.width - len(words))]))
        check_samples(path, "", len(rows), layout.width)
    if len(rows) < 3:
        raise InputError(path, "", f"{len(rows)} samples are no recording", "export the whole run")
    return rows


def _foot(
    path: Path, repairs: Repairs, values: Array, rows: list[tuple[int, list[str]]], layout: _Layout, foot: str
) -> tuple[Array, Array]:
    """Return the times and loads of a foot where both are known, in order."""
    side = _FEET.index(foot)
    time = layout.scale * values[:, layout.clocks[side]]
    load = np.sum(values[:, layout.loads[side]], axis=1)
    known = np.isfinite(time) & np.isfinite(load)
    places = [f"line {number}" for number, _ in rows]
    repairs.add_at(f"row(s) without a load of the {foot} foot", ~known, places, most=UNKNOWN)
    lines = [place for place, keep in zip(places, known.tolist(), strict=True) if keep]
    rising = rising_records(time[known])
    words = f"row(s) whose time stands still or runs back ({foot} foot)"
    repairs.add_at(words, ~rising, lines, most=REPEATED)
    if np.count_nonzero(rising) < 3:
        problem = one_line(f"{np.count_nonzero(rising)} loads of the {foot} foot are no recording")
        raise InputError(path, "", problem, "export both insoles of the measurement")
    return time[known][rising], load[known][rising]
