"""Loggers' tables of single sensors, made into the files of a recording of few sensors.

A file is given with its place, ``left_ski=imu_left.csv``, ``barometer=baro.csv`` or ``insoles=foot.csv``.  Columns are
known by the names that loggers give them: ``t_s`` or ``seconds_elapsed``, ``ax … az``, ``gx … gz`` (a unit in brackets
may follow), ``qw … qz``; other columns, text among them, are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.io.bounds import MAX_COLUMNS, check_samples
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.table import check_time, numbers
from sssi_exudyn.recording.instruments.imu import PLACES, read_barometer, read_imu
from sssi_exudyn.recording.instruments.insoles import read_insoles

BAROMETER, PRESSURE = "barometer", "insoles"
_NAMES: Final = {
    "t_s": "time_s",
    "seconds_elapsed": "time_s",
    **{f"a{axis}": f"acceleration_{axis}_mps2" for axis in "xyz"},
    **{f"g{axis}": f"rate_{axis}_radps" for axis in "xyz"},
    **{f"q{part}": f"orientation_{part}" for part in "wxyz"},
}
_CHANNELS: Final = ("time_s", "acceleration_", "rate_", "orientation_", "pressure_Pa")
_SIDES: Final = {"L": "left", "R": "right"}


def split_place(file: Path) -> tuple[str, Path] | None:
    """A place and the file of its sensor, where they are written as ``PLACE=FILE``; None for a file alone."""
    place, is_placed, name = str(file).partition("=")
    return (place, Path(name)) if is_placed and place in (*PLACES, BAROMETER, PRESSURE) else None


def write_sensors(files: Sequence[tuple[str, Path]], folder: Path) -> list[dict[str, str]]:
    """Write ``sensors/<place>.csv`` for every (place, file) into ``folder``; the tables ``[[sensors]]`` of its
    ``recording.toml``.

    Raises InputError for two sensors on one place and for faulty files.
    """
    (folder / "sensors").mkdir()
    tables: list[dict[str, str]] = []
    for place, path in files:
        if place == PRESSURE:
            continue
        name = f"sensors/{place}.csv"
        if (folder / name).exists():
            raise InputError(path, "", f"there is a sensor on {place!r} already", "give one of them")
        _write(folder / name, _channels(path))
        try:  # errors name the file that was given
            if place == BAROMETER:
                read_barometer(folder / name)
            else:
                read_imu(folder / name, place)
                tables.append({"file": name, "on": place})
        except InputError as error:
            raise InputError(path, error.place, error.problem, error.fix) from None
    return tables


def write_pressure(path: Path, folder: Path, mass: float) -> None:
    """Write ``insoles.csv`` of a pressure logger's counts: ``t_s,side`` (L or R) and a column a cell, named
    ``…_adc``, feet in turn.

    Counts are no newtons: they are scaled so that all cells together carry the skier's weight (``mass`` kg) on average,
    which leaves the share between the feet as the cells have it.  Raises InputError for other tables.
    """
    lines = _cells(path)
    names = [name.strip() for name in lines[0][1]]
    cells = [column for column, name in enumerate(names) if name.endswith("_adc")]
    if "t_s" not in names or "side" not in names or not cells:
        raise InputError(path, "header", "these are no counts of cells", "name the columns t_s,side,…_adc")
    by_side: dict[str, Array] = {}
    for side in _SIDES:
        rows = [
            (number, ",".join([words[names.index("t_s")], *(words[cell] for cell in cells)]))
            for number, words in lines[1:]
            if len(words) == len(names) and words[names.index("side")].strip() == side
        ]
        if len(rows) < 3:
            raise InputError(path, "column side", f"{len(rows)} samples of side {side}", "log both feet, L and R")
        by_side[side] = numbers(path, rows, 1 + len(cells), ",")
        check_time(path, by_side[side][:, 0], tuple(f"line {number}" for number, _ in rows))
    start, stop = (pick(float(table[end, 0]) for table in by_side.values()) for pick, end in ((max, 0), (min, -1)))
    step = float(np.median([np.median(np.diff(table[:, 0])) for table in by_side.values()]))
    check_samples(path, "column t_s", (stop - start) / step, 2 * len(cells))
    time = np.arange(start, stop, step)
    columns = {"time_s": time}
    for side, word in _SIDES.items():
        table = by_side[side]
        for cell in range(len(cells)):
            columns[f"{word}_{cell + 1}_N"] = np.interp(time, table[:, 0], table[:, 1 + cell])
    total = sum((column for name, column in columns.items() if name != "time_s"), np.zeros(len(time)))
    scale = mass * GRAVITY / max(float(np.mean(total)), 1e-9)
    _write(
        folder / "insoles.csv",
        {name: column * (1.0 if name == "time_s" else scale) for name, column in columns.items()},
    )
    try:
        read_insoles(folder / "insoles.csv")
    except InputError as error:
        raise InputError(path, error.place, error.problem, error.fix) from None


def _cells(path: Path) -> list[tuple[int, list[str]]]:
    """The cells of every line that is not empty, with its number.  Raises InputError for more than any run has."""
    lines = [(number, line) for number, line in enumerate(read_text(path).split("\n"), 1) if line.strip()]
    widest = 1 + max(line.count(",") for _, line in lines)
    if widest > MAX_COLUMNS:
        raise InputError(path, "header", "more columns than any instrument has", "export the file again")
    check_samples(path, "", len(lines), widest)
    return [(number, line.split(",")) for number, line in lines]


def _channels(path: Path) -> dict[str, Array]:
    """The channels of a logger's table under the names of a recording; samples that repeat a time are left out."""
    lines = _cells(path)
    names = [_NAMES.get(name.split("(")[0].strip(), name.strip()) for name in lines[0][1]]
    used = [column for column, name in enumerate(names) if name.startswith(_CHANNELS)]
    if "time_s" not in names or len(used) < 2:
        found = ", ".join(name.strip() for name in lines[0][1])
        raise InputError(path, "header", f"no time and channels among {found}", "name them t_s, ax … az, gx … gz")
    for number, words in lines:
        if len(words) != len(names):
            raise InputError(
                path, f"line {number}", f"{len(words)} values where {len(names)} are due", "export it again"
            )
    rows = [(number, ",".join(words[column] for column in used)) for number, words in lines[1:]]
    values = numbers(path, rows, len(used), ",")
    at = [names[column] for column in used].index("time_s")
    fresh = np.r_[True, np.diff(values[:, at]) != 0.0]
    return {names[column]: values[fresh, i] for i, column in enumerate(used)}


def _write(path: Path, columns: dict[str, Array]) -> None:
    rows = np.column_stack(list(columns.values())).tolist()
    body = "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows)
    path.write_text(",".join(columns) + "\n" + body + "\n", encoding="utf-8")
