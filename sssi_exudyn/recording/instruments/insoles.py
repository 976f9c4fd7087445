"""Pressure insoles: the force of each cell, or one total, for each foot."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.separators import rows_of_table
from sssi_exudyn.io.table import Table, bridge_gaps, in_order, read_table

_CELL: Final = re.compile(r"(left|right)_([0-9]{1,4})_N")
_SHARE_STUCK: Final = 0.2
"""Share of the run for which a dead cell stays on one value while its foot is loaded."""

_SLOWEST: Final = 0.25
"""Largest step between samples, s; a turn of two seconds has eight of them."""
_LARGEST_FORCE: Final = 2e4
"""Largest force on one foot or cell, N; ten times what racers reach."""


@dataclass(frozen=True)
class Insoles:
    """The forces under both feet.

    Attributes
    ----------
    time : (n,) s on the recording's clock, rising
    left, right : (n,) N, the sum of each foot's living cells
    left_cells, right_cells : (n, c) N, all cells in the order of their numbers, dead ones too
    dead_cells : names of the cells that are not in the sums
    notes : changes of the data, in words
    """

    time: Array
    left: Array
    right: Array
    left_cells: Array
    right_cells: Array
    dead_cells: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read_insoles(path: Path, time_offset: float = 0.0) -> Insoles:
    """Read ``time_s`` and ``left_1_N … left_c_N, right_1_N … right_c_N`` (any c), or ``time_s,left_N,right_N``.

    Parameters
    ----------
    path : the file
    time_offset : s, added to the file's times

    Single dead cells are left out of the sums and noted, single torn lines and repeated times left out and noted.
    Raises InputError for missing columns, feet with different numbers of cells, more bad lines than ``Repairs`` allows,
    samples too far apart, and a foot whose cells are all dead.
    """
    path = Path(path)
    table = read_table(path, _chosen)
    left, right = _cell_names(table)
    table = in_order(table)
    time = table.columns["time_s"]
    values = np.column_stack([table.columns[name] for name in left + right])
    _check_forces(path, table, left + right, values)
    _check_step(path, time)
    dead = _dead(path, left, values[:, : len(left)]) + _dead(path, right, values[:, len(left) :])
    clock = bridge_gaps(path, time, len(left + right))
    kept = time[clock.keep]
    cells = np.column_stack([np.interp(clock.time, kept, column[clock.keep]) for column in values.T])
    living = {name: name not in dead for name in left + right}
    notes = [*table.notes, *clock.notes]
    if dead:
        notes.append(f"{path.name}: dead cells {', '.join(dead)} are left out of the sums; replace the insole's cells")
    unused = (*table.unused, *(name for name in table.columns if name != "time_s" and name not in living))
    if unused:
        notes.append(f"{path.name}: columns not used: {', '.join(unused)}")
    left_cells, right_cells = cells[:, : len(left)], cells[:, len(left) :]
    return Insoles(
        time=clock.time + time_offset,
        left=left_cells[:, [living[name] for name in left]].sum(axis=1),
        right=right_cells[:, [living[name] for name in right]].sum(axis=1),
        left_cells=left_cells,
        right_cells=right_cells,
        dead_cells=dead,
        notes=tuple(notes),
    )


def is_insoles(path: Path) -> bool:
    """Return whether a CSV file's header has columns of forces under feet."""
    names = [name.strip() for name in rows_of_table(path)[0][1].split(",")]
    return any(_CELL.fullmatch(name) or name in ("left_N", "right_N") for name in names)


def _chosen(names: list[str]) -> tuple[list[str], list[str]]:
    """Return the columns of times and forces."""
    totals = {"left_N", "right_N"}
    forces = totals if totals <= set(names) else {name for name in names if _CELL.fullmatch(name)}
    return ["time_s", *forces], []


def _cell_names(table: Table) -> tuple[list[str], list[str]]:
    """Return the columns of the left and the right foot, by cell number."""
    place = "header"
    if "time_s" not in table.columns:
        raise InputError(table.file, place, "column time_s is missing", "name the column of times time_s")
    if "left_N" in table.columns and "right_N" in table.columns:
        return ["left_N"], ["right_N"]
    cells: dict[str, list[tuple[int, str]]] = {"left": [], "right": []}
    for name in table.columns:
        match = _CELL.fullmatch(name)
        if match:
            cells[match[1]].append((int(match[2]), name))
    left, right = ([name for _, name in sorted(cells[foot])] for foot in ("left", "right"))
    if not left or len(left) != len(right):
        raise InputError(
            table.file,
            place,
            f"{len(left)} cells of the left foot and {len(right)} of the right",
            "name the columns left_1_N …, right_1_N …, as many on each foot, or left_N,right_N",
        )
    return left, right


def _check_step(path: Path, time: Array) -> None:
    """Raise InputError for samples too far apart to show turns, as times in milliseconds look."""
    step = float(np.median(np.diff(time)))
    if step > _SLOWEST:
        looks = "time_s looks like milliseconds: " if _SLOWEST > 1e-3 * step > 1e-3 else ""
        problem = f"{looks}{step:.3g} s between samples do not show turns"
        raise InputError(path, "column time_s", problem, "give time in seconds, at 4 Hz or more")


def _check_forces(path: Path, table: Table, names: list[str], values: Array) -> None:
    """Raise InputError for a force that no foot exerts."""
    sample, cell = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    if abs(values[sample, cell]) > _LARGEST_FORCE:
        raise InputError(
            path,
            f"line {table.lines[sample]}, {names[cell]}",
            f"{values[sample, cell]:g} N is no force of a foot",
            "correct the value or its unit",
        )
    half = len(names) // 2
    for foot, cells in (("left", values[:, :half]), ("right", values[:, half:])):
        mean = float(np.mean(cells)) * half
        if mean < 0.0:
            raise InputError(
                path, f"columns {foot}_…", f"the {foot} foot pulls: {mean:.3g} N on average", "correct the sign"
            )


def _dead(path: Path, names: list[str], values: Array) -> tuple[str, ...]:
    """Return the names of cells that stay on one value while the foot's other cells move; ``values`` (n, c) N."""
    total = values.sum(axis=1)
    dead = []
    for name, cell in zip(names, values.T, strict=True):
        start, stop = _longest_rest(cell)
        others = (total - cell)[start:stop]
        whole = stop - start == len(cell)
        # a lifted foot leaves its cells at rest as well: the others must carry what they usually carry
        loaded = len(names) > 1 and np.mean(others) > 0.5 * np.mean(total - cell) and np.ptp(others) > 0.0
        if whole or (stop - start > _SHARE_STUCK * len(cell) and loaded):
            dead.append(name)
    if len(dead) == len(names):
        raise InputError(
            path, f"column {dead[0]}", "the foot has no living cell", "leave [insoles] out, or repair and record again"
        )
    return tuple(dead)


def _longest_rest(values: Array) -> tuple[int, int]:
    """Return the first and past-the-last sample of the longest stretch of one value."""
    edges = np.r_[0, np.flatnonzero(np.diff(values) != 0.0) + 1, len(values)]
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]), int(edges[longest + 1])
