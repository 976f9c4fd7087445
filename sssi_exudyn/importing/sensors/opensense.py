"""Orientations of inertial sensors in OpenSense's storage files (``.sto`` with ``DataType=Quaternion``).

A column is one sensor, named after the segment that it sits on, such as ``calcn_l_imu``; a cell is ``w,x,y,z``, sensor
to a world with z up.  Sensors on feet, trunk and pelvis become sensors of a recording, with the rates at which they
turn.  How they were mounted is estimated from the run, as of all sensors, so no calibration pose is needed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_COLUMNS, check_samples
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.io.table import TORN_LINES, Table, in_order
from sssi_exudyn.recording.instruments.fixes import number_of

SUFFIX: Final = ".sto"
_PLACES: Final = {"calcn_l": "left_boot", "calcn_r": "right_boot", "torso": "chest", "pelvis": "pelvis"}
"""Place of a sensor by the segment in its column's name."""
_ENDING, _KIND, _END = "_imu", "datatype=quaternion", "endheader"
_HEAD: Final = 2000
"""Number of characters within which a file states what it holds."""
_LENGTH: Final = 0.05
"""Deviation of a quaternion's length from one, beyond which it is none; four decimals leave 1e-4."""


def is_orientations(text: str) -> bool:
    """Return whether a storage file holds orientations of sensors."""
    return _KIND in text[:_HEAD].lower().replace(" ", "")


def places_in(path: Path) -> tuple[str, ...]:
    """Return the places of the sensors in a file, none for a file of something else.

    Raises InputError for orientations without a sensor at a place that a recording knows.
    """
    text = read_text(path)
    if not is_orientations(text):
        return ()
    _, columns = _table(path, text)
    places = tuple(place for place in _PLACES.values() if place in columns)
    if not places:
        problem = f"no sensor is on {', '.join(_PLACES)}"
        raise InputError(path, _END, problem, f"name columns such as calcn_l{_ENDING}")
    return places


def read_orientations(path: Path, place: str) -> Table:
    """Read the sensor at ``place``: orientation, and the angular rate that it has; torn lines are left out and noted.

    Raises InputError where no sensor is there, and for more torn lines than ``Repairs`` allows.
    """
    rows, columns = _table(path, read_text(path))
    if place not in columns:
        raise InputError(path, _END, f"no sensor is at {place}", f"it has {', '.join(columns) or 'none that is known'}")
    check_samples(path, "", len(rows), 8)
    values, torn, lines = [], [], []
    for number, line in rows:
        cells = line.split("\t", MAX_COLUMNS)
        words = cells[columns[place]].split(",") if len(cells) > columns[place] else []
        row = [number_of(cells[0]), *(number_of(word) for word in words)]
        if len(row) == 5 and np.all(np.isfinite(row)) and abs(np.linalg.norm(row[1:]) - 1.0) < _LENGTH:
            values.append(row)
            lines.append(number)
        else:
            torn.append(f"line {number}")
    repairs = Repairs(path)
    repairs.add(TORN_LINES, torn, len(rows))
    if len(values) < 3:
        raise InputError(path, "", f"{len(values)} samples are no recording", "export the whole run")
    names = ("time_s", *(f"orientation_{part}" for part in "wxyz"))
    table = in_order(Table(path, dict(zip(names, np.array(values).T, strict=True)), tuple(lines), notes=repairs.notes))
    rates = _rates(table.columns["time_s"], np.column_stack([table.columns[name] for name in names[1:]]))
    channels = {f"rate_{axis}_radps": column for axis, column in zip("xyz", rates.T, strict=True)}
    return Table(path, table.columns | channels, table.lines, notes=table.notes)


def _table(path: Path, text: str) -> tuple[list[tuple[int, str]], dict[str, int]]:
    """Return line number and text of the rows, and the column of the sensor at each place."""
    lines = text.split("\n")
    ends = next((at for at, line in enumerate(lines) if line.strip().lower() == _END), None)
    if ends is None or ends + 1 >= len(lines):
        raise InputError(path, "header", f"no line {_END!r} with a table after it", "write it again from OpenSim")
    titles = [title.strip().lower() for title in lines[ends + 1].split("\t", MAX_COLUMNS)]
    if titles[0] != "time":
        raise InputError(path, f"line {ends + 2}", "the first column is not time", "write it again from OpenSim")
    columns = {
        place: titles.index(segment + _ENDING) for segment, place in _PLACES.items() if segment + _ENDING in titles
    }
    return [(at + 1, line) for at, line in enumerate(lines) if at > ends + 1 and line.strip()], columns


def _rates(time: Array, quaternions: Array) -> Array:
    """Return the angular rate (n, 3) rad/s in the sensor's axes, over two steps each, one at the ends."""
    turned = Rotation.from_quat(quaternions, scalar_first=True)
    before = np.r_[0, np.arange(len(time) - 1)]
    after = np.r_[np.arange(1, len(time)), len(time) - 1]
    return np.asarray((turned[before].inv() * turned[after]).as_rotvec() / (time[after] - time[before])[:, None])
