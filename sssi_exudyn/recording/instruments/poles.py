"""Load cells in the poles: the force along each shaft, and the times of pole plants."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.table import bridge_gaps, in_order, read_table

COLUMNS: Final = ("left_N", "right_N")
MOST_PLANTS: Final = 60
"""Maximum number of plants of a run that act in its model: the strongest."""
_LARGEST_FORCE: Final = 1e3
"""Largest force along a pole, N; ten times what plants at transitions reach."""
_PRESSED: Final = 15.0
"""Force above which a pole is planted, N: a pole of 0.25 kg that swings at twice gravity shows 5 N."""
_SHORTEST: Final = 0.03
"""Minimum duration of a plant, and of the pause between two, s."""
_DRIFT: Final = 5.0
"""Force of a resting cell from which on a note reports it, N."""


@dataclass(frozen=True)
class Poles:
    """The forces along both poles.

    time : (n,) s on the recording's clock, rising
    left, right : (n,) N, pressed is positive, counted from the cell's reading at rest
    notes : changes of the data, in words
    """

    time: Array
    left: Array
    right: Array
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plant:
    """A stretch of time in which a pole was pressed.

    side : 1 the left, −1 the right;  start, stop : s;  impulse : N s along the shaft
    """

    side: int
    start: float
    stop: float
    impulse: float


def read_poles(path: Path, time_offset: float = 0.0) -> Poles:
    """Read ``time_s,left_N,right_N``: the force along each shaft, pressed positive.

    Parameters
    ----------
    time_offset : s, added to the file's times

    A cell's reading at rest, its median, is subtracted.  Raises InputError for missing columns, more bad lines than
    ``Repairs`` allows, forces that no pole bears, and a cell that shows one value all the time.
    """
    path = Path(path)
    table = read_table(path, lambda _: (("time_s", *COLUMNS), ()))
    for name in ("time_s", *COLUMNS):
        if name not in table.columns:
            raise InputError(path, "header", f"column {name} is missing", "name the columns time_s,left_N,right_N")
    table = in_order(table)
    time = table.columns["time_s"]
    clock = bridge_gaps(path, time, len(COLUMNS))
    notes, forces = [*table.notes, *clock.notes], []
    for name in COLUMNS:
        values = table.columns[name]
        rest = float(np.median(values))
        worst = int(np.argmax(np.abs(values - rest)))
        if abs(values[worst] - rest) > _LARGEST_FORCE:
            problem = f"{values[worst]:g} N is no force along a pole"
            raise InputError(path, f"line {table.lines[worst]}, {name}", problem, "correct the value or its unit")
        if np.ptp(values) == 0.0:
            raise InputError(path, f"column {name}", "the cell shows one value", "leave [poles] out, or repair it")
        if abs(rest) > _DRIFT:
            notes.append(f"{path.name}: {name} shows {rest:.0f} N at rest, which is taken off")
        kept = values[clock.keep] - rest
        if kept.max() < -kept.min():
            raise InputError(path, f"column {name}", "the pole is pulled more than pressed", "correct the sign")
        forces.append(np.interp(clock.time, time[clock.keep], kept))
    return Poles(clock.time + time_offset, forces[0], forces[1], tuple(notes))


def plants_of(poles: Poles) -> tuple[Plant, ...]:
    """Return the plants of both poles in order of time; the strongest if there are more than ``MOST_PLANTS``."""
    plants = [
        plant for side, force in ((1, poles.left), (-1, poles.right)) for plant in _plants(side, poles.time, force)
    ]
    strongest = sorted(plants, key=lambda plant: plant.impulse, reverse=True)[:MOST_PLANTS]
    return tuple(sorted(strongest, key=lambda plant: plant.start))


def _plants(side: int, time: Array, force: Array) -> list[Plant]:
    """Return the stretches above ``_PRESSED``, extended to where the force ends, with close ones joined."""
    pressed = np.r_[False, force > _PRESSED, False]
    edges = np.flatnonzero(pressed[1:] != pressed[:-1])
    spans: list[list[int]] = []
    for first, last in zip(edges[::2].tolist(), (edges[1::2] - 1).tolist(), strict=True):
        while first > 0 and force[first] > 0.0:
            first -= 1
        while last < len(force) - 1 and force[last] > 0.0:
            last += 1
        if spans and time[first] - time[spans[-1][1]] < _SHORTEST:
            spans[-1][1] = max(last, spans[-1][1])
        else:
            spans.append([first, last])
    return [
        Plant(side, float(time[a]), float(time[b]), float(np.trapezoid(force[a : b + 1], time[a : b + 1])))
        for a, b in spans
        if time[b] - time[a] >= _SHORTEST
    ]
