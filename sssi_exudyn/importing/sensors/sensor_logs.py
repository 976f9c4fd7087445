"""Loggers' tables of single sensors, made into the files of a recording of few sensors.

A file is given with its place, ``left_ski=imu_left.csv``, ``barometer=baro.csv`` or ``insoles=foot.csv``.  Columns are
recognised by the names that loggers give them: ``t_s``, ``seconds_elapsed`` or ``Time``, ``ax … az``, ``gx … gz``,
``Gyroscope x``, ``Acceleration x``, ``qw … qz``, or ``x``, ``y``, ``z`` in a file named after its instrument.  A unit
in brackets may follow.  Other columns, text among them, are left out.  Gyroscope and accelerometer may be two files of
one place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.sensors.opensense import SUFFIX as ORIENTATIONS
from sssi_exudyn.importing.sensors.opensense import read_orientations
from sssi_exudyn.io.bounds import MAX_COLUMNS, check_samples
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.io.separators import pieces_of_table, rows_of_table
from sssi_exudyn.io.table import TORN_LINES, Table, bridge_gaps, check_time, in_order, numbers, parsed_rows
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as CAMERAS
from sssi_exudyn.recording.instruments.gopro import read_telemetry
from sssi_exudyn.recording.instruments.imu import PLACES, check_channels, read_barometer, read_imu
from sssi_exudyn.recording.instruments.insoles import read_insoles

BAROMETER, PRESSURE = "barometer", "insoles"
_RATE: Final = {axis: f"rate_{axis}_radps" for axis in "xyz"}
_FORCE: Final = {axis: f"acceleration_{axis}_mps2" for axis in "xyz"}
_GRAVITY: Final = {axis: f"gravity_{axis}_mps2" for axis in "xyz"}
_NAMES: Final = {
    "t_s": "time_s",
    "seconds_elapsed": "time_s",
    "Time": "time_s",
    "pressure": "pressure_hPa",
    "Pressure": "pressure_hPa",
    **{written: _FORCE[axis] for axis in "xyz" for written in (f"a{axis}", f"Acceleration {axis}")},
    **{written: _RATE[axis] for axis in "xyz" for written in (f"g{axis}", f"Gyroscope {axis}")},
    **{f"Acceleration {axis.upper()}": _FORCE[axis] for axis in "xyz"},
    **{f"Gyroscope {axis.upper()}": _RATE[axis] for axis in "xyz"},
    **{f"q{part}": f"orientation_{part}" for part in "wxyz"},
}
_BY_FILE: Final = {"gyro": _RATE, "accel": _FORCE, "gravity": _GRAVITY}
"""Channels behind ``x``, ``y`` and ``z``, by a word in the file's name."""
_CHANNELS: Final = ("time_s", "acceleration_", "rate_", "orientation_", "pressure_", "gravity_")
_LISTED: Final = 300
"""Characters of a header that an error quotes."""
_NO_ROWS: Final = (np.empty((0, 0)), np.empty(0, bool))
_UNITS: Final = {
    "time_s": ("s",),
    "acceleration": ("m/s2", "m/s^2", "m/s²"),
    "rate": ("rad/s",),
    "pressure": ("hPa", "mbar"),
    "gravity": ("m/s2", "m/s^2", "m/s²"),
}
"""Units that a column's brackets may name."""
_SIDES: Final = {"L": "left", "R": "right"}


@dataclass(frozen=True)
class Log:
    """A sensor's table under the names of a recording.

    place : where the sensor sits;  began : UTC of ``time_s`` = 0, s since 1970, None where the file does not have it
    notes : oddities, in words
    """

    place: str
    table: Table
    began: float | None
    notes: tuple[str, ...] = ()


def split_place(file: Path) -> tuple[str, Path] | None:
    """Split ``PLACE=FILE`` into a place and the file of its sensor; return None for a file alone."""
    place, is_placed, name = str(file).partition("=")
    return (place, Path(name)) if is_placed and place in (*PLACES, BAROMETER, PRESSURE) else None


def read_logs(files: Sequence[tuple[str, Path]]) -> list[Log]:
    """Read the sensors of every (place, file) except pressure cells, one per place.

    A gyroscope and an accelerometer in two files are joined, and gravity in a third is added to an acceleration without
    it.  Raises InputError for two sensors on one place and for faulty files, with the place in the file that was given.
    """
    places: dict[str, list[Log]] = {}
    for place, path in files:
        if place != PRESSURE:
            places.setdefault(place, []).extend(_logs_of(place, path))
    logs = []
    for several in places.values():
        whole = _with_gravity(several)
        for log in whole:
            check_channels(log.table)  # of every file alone, whose name an error has
        logs.append(reduce(_together, whole))
        _check_whole(logs[-1])
    return logs


def cut_log(log: Log, first: Log, start: float, stop: float) -> Log:
    """Return the part of a log from ``start`` to ``stop`` (s on the clock of the first log); its time begins there."""
    columns = dict(log.table.columns)
    columns["time_s"] = columns["time_s"] + _later(first, log) - start
    inside = (columns["time_s"] >= 0.0) & (columns["time_s"] <= stop - start)
    began = None if first.began is None else first.began + start
    return replace(log, table=replace(log.table, columns=columns).rows(inside), began=began)


def _with_gravity(logs: list[Log]) -> list[Log]:
    """Return the logs of a place with gravity, which an app may write apart, in the acceleration.

    Raises InputError for gravity without an acceleration.
    """
    apart = [log for log in logs if _GRAVITY["x"] in log.table.columns]
    if not apart:
        return logs
    gravity, others = apart[0], [log for log in logs if log not in apart]
    bare = [log for log in others if _FORCE["x"] in log.table.columns]
    if len(apart) > 1 or not bare:
        fix = f"add the accelerometer's file as {gravity.place}=FILE too, or leave this out"
        raise InputError(gravity.table.file, "header", "it holds gravity alone", fix)
    table, shift = bare[0].table, 0.0 if gravity.began is None else gravity.began - (bare[0].began or gravity.began)
    time = gravity.table.columns["time_s"] + shift
    columns = dict(table.columns)
    inside = (columns["time_s"] >= time[0]) & (columns["time_s"] <= time[-1])
    if np.count_nonzero(inside) < 3:
        problem = f"it has no time in common with {table.file}"
        raise InputError(gravity.table.file, "", problem, "give two files of one run")
    for axis, name in _FORCE.items():
        columns[name] = columns[name] + np.interp(columns["time_s"], time, gravity.table.columns[_GRAVITY[axis]])
    whole = replace(table, columns=columns).rows(inside)
    return [replace(log, table=whole) if log is bare[0] else log for log in others]


def covered_by(logs: Sequence[Log]) -> tuple[float, float]:
    """Return the stretch (s) that all sensors cover, on the clock of the first."""
    ends = []
    for log in logs:
        time = log.table.columns["time_s"] + _later(logs[0], log)
        ends.append((float(time[0]), float(time[-1])))
    return max(start for start, _ in ends), min(stop for _, stop in ends)


def _later(first: Log, log: Log) -> float:
    """Return by how much (s) a log's zero is later than the first one's; 0 where files do not know it."""
    return 0.0 if log.began is None or first.began is None else round(log.began - first.began, 3)


def write_sensors(logs: Sequence[Log], folder: Path) -> dict[str, Any]:
    """Write ``sensors/<place>.csv`` for every log into ``folder``.

    Returns the tables ``[[sensors]]`` and ``[barometer]`` of its ``recording.toml``.  Clocks are those of the first
    log, where files know the time of day.  Raises InputError for faulty channels.
    """
    (folder / "sensors").mkdir()
    sensors: list[dict[str, Any]] = []
    tables: dict[str, Any] = {"sensors": sensors}
    for log in logs:
        name = f"sensors/{log.place}.csv"
        _write(folder / name, log.table.columns)
        later = _later(logs[0], log)
        offset = {"time_offset_s": later} if later else {}
        try:  # errors name the file that was given
            if log.place == BAROMETER:
                read_barometer(folder / name)
                tables[BAROMETER] = {"file": name, **offset}
            else:
                read_imu(folder / name, log.place)
                sensors.append({"file": name, "on": log.place, **offset})
        except InputError as error:
            raise InputError(log.table.file, error.place, error.problem, error.fix) from None
    return tables


def write_pressure(path: Path, folder: Path, mass: float, cut: tuple[float, float] | None = None) -> None:
    """Write ``insoles.csv`` from a pressure logger's counts.

    Its columns are ``t_s,side`` (L or R) and one per cell, named ``…_adc``; the feet alternate.

    Counts are not newtons.  They are scaled so that all cells together carry the skier's weight (``mass`` kg) on
    average, which keeps the cells' share between the feet.  Of the stretch ``cut`` (s), time counts from its start.

    Raises InputError for other tables.
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
        if cut is not None:
            by_side[side] = _cut_counts(path, by_side[side], *cut)
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


def _cut_counts(path: Path, counts: Array, start: float, stop: float) -> Array:
    """Return the rows (n, 1 + cells) of a stretch, whose time begins there.  Raises InputError where there are none."""
    inside = counts[(counts[:, 0] >= start) & (counts[:, 0] <= stop)]
    if len(inside) < 3:
        problem = f"{len(inside)} samples from {start:.0f} to {stop:.0f} s"
        raise InputError(path, "column t_s", problem, "leave the insoles out, or give those of the run")
    return np.asarray(inside - np.array([start, *np.zeros(counts.shape[1] - 1)]))


def _cells(path: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of every line that is not empty, with its number.

    Raises InputError for more cells than any run has.
    """
    lines = rows_of_table(path)
    widest = 1 + max(line.count(",") for _, line in lines)
    if widest > MAX_COLUMNS:
        raise InputError(path, "header", "more columns than any instrument has", "export the file again")
    check_samples(path, "", len(lines), widest)
    return [(number, line.split(",")) for number, line in lines]


def _logs_of(place: str, path: Path) -> list[Log]:
    """Read what a file holds of the sensor at a place."""
    if path.suffix.lower() in CAMERAS:
        return _camera_logs(place, path)
    if path.suffix.lower() == ORIENTATIONS:
        table = read_orientations(path, place)
        return [Log(place, table, None, table.notes)]
    return [_read_log(place, path)]


def _camera_logs(place: str, path: Path) -> list[Log]:
    """Read gyroscope and accelerometer of a film.  Raises InputError where the film has not both."""
    telemetry = read_telemetry(path)
    logs = []
    for rows, channels, word in ((telemetry.rate, _RATE, "gyroscope"), (telemetry.force, _FORCE, "accelerometer")):
        if len(rows) < 3:
            raise InputError(path, "", f"the film's telemetry has no {word}", "use another camera or sensor")
        check_samples(path, word, len(rows), 4)
        columns = dict(zip(("time_s", *channels.values()), rows.T, strict=True))
        table = in_order(Table(path, columns, tuple(range(1, len(rows) + 1)), notes=telemetry.notes))
        logs.append(Log(place, table, None, table.notes))
    return logs


def _read_log(place: str, path: Path) -> Log:
    """Read a logger's table; torn lines and samples whose time stands still or runs back are left out and noted."""
    names: list[str] = []
    used: list[int] = []
    clock: int | None = None
    parts: list[Array] = []
    lines: list[int] = []
    torn: list[str] = []
    for piece in pieces_of_table(path):
        rows = piece
        if not names:
            header = _titles(path, piece[0])
            names, used = _channels_of(path, header)
            clock = header.index("time") if "seconds_elapsed" in header and "time" in header else None
            rows = piece[1:]
        kept = used if clock is None else [*used, clock]
        values, good = parsed_rows(rows, len(names), kept, () if clock is None else (clock,)) if rows else _NO_ROWS
        parts.append(values[good])
        lines += [number for (number, _), keep in zip(rows, good.tolist(), strict=True) if keep]
        torn += [f"line {number}" for (number, _), keep in zip(rows, good.tolist(), strict=True) if not keep]
    repairs = Repairs(path)
    repairs.add(TORN_LINES, torn, len(lines) + len(torn))
    if len(lines) < 3:
        raise InputError(path, "", f"{len(lines)} samples are no recording", "export the whole run")
    values = np.concatenate([part for part in parts if len(part)])
    columns = {names[column]: values[:, i] for i, column in enumerate(used)}
    began = None
    if clock is not None and np.any(np.isfinite(values[:, -1])):
        first = int(np.argmax(np.isfinite(values[:, -1])))
        began = float(1e-9 * values[first, -1] - columns["time_s"][first])  # ns since 1970
    if "pressure_hPa" in columns:
        columns["pressure_Pa"] = 100.0 * columns.pop("pressure_hPa")
    table = in_order(Table(path, columns, tuple(lines), notes=repairs.notes))
    return Log(place, table, began, table.notes)


def holds_channels(path: Path) -> bool:
    """Return whether a table has time and channels of a gyroscope or an accelerometer, and no places on Earth."""
    titles = titles_in(path)
    names = [_channel_name(path, title) for title in titles]
    placed = any(title.lower().startswith("lat") for title in titles)
    sensed = any(name.startswith(("rate_", "acceleration_", "gravity_")) for name in names)
    return "time_s" in names and sensed and not placed


def titles_in(path: Path) -> list[str]:
    """Return the titles of a table's columns.  Raises InputError for more than any instrument has."""
    for piece in pieces_of_table(path):
        return _titles(path, piece[0])
    return []


def _titles(path: Path, row: tuple[int, str]) -> list[str]:
    """Return the titles of a table's columns.  Raises InputError for more than any instrument has."""
    number, line = row
    if line.count(",") >= MAX_COLUMNS:
        problem = "more columns than any instrument has"
        raise InputError(path, f"line {number}", problem, "export the file again")
    return _titles_of(line)


def _titles_of(line: str) -> list[str]:
    return [title.strip().strip('"') for title in line.split(",")]


def _channels_of(path: Path, header: list[str]) -> tuple[list[str], list[int]]:
    """Return a recording's name of every column, and the columns of time and channels.

    Raises InputError where these are missing.
    """
    names = [_channel(path, title) for title in header]
    used = [column for column, name in enumerate(names) if name.startswith(_CHANNELS)]
    if "time_s" not in names or len(used) < 2:
        listed = one_line(", ".join(header), _LISTED)
        raise InputError(path, "header", f"no time and channels among {listed}", "name them t_s, ax … az, gx … gz")
    twice = sorted({name for name in names if names.count(name) > 1 and name.startswith(_CHANNELS)})
    if twice:
        raise InputError(path, "header", f"two columns of {twice[0]}", "leave one of them")
    return names, used


def _channel(path: Path, written: str) -> str:
    """Return a recording's name for a column, or the written name; raises InputError for another unit."""
    channel = _channel_name(path, written)
    name, _, unit = (part.strip(" )") for part in written.partition("("))
    units = _UNITS.get(channel if channel == "time_s" else channel.partition("_")[0])
    if channel.startswith(_CHANNELS) and unit and units is not None and unit not in units:
        raise InputError(path, f"header, {name}", f"its unit is {unit!r}", f"convert it to {units[0]}")
    return channel


def _channel_name(path: Path, written: str) -> str:
    name = written.partition("(")[0].strip()
    axes = [of for word, of in _BY_FILE.items() if word in path.stem.lower()]
    axis = name.lower()
    return axes[0][axis] if len(axes) == 1 and axis in axes[0] else _NAMES.get(name, name)


def _check_whole(log: Log) -> None:
    """Raise InputError for a gyroscope or an accelerometer alone."""
    channels = log.table.columns.keys()
    missing = "rates" if _RATE["x"] not in channels else "acceleration" if len(channels) == 1 + len(_RATE) else ""
    if missing and log.place != BAROMETER:
        fix = f"add the other instrument's file as {log.place}=FILE too"
        raise InputError(log.table.file, "header", f"it holds no {missing}", fix)


def _together(one: Log, other: Log) -> Log:
    """Join two files of one sensor: the accelerometer's values are interpolated linearly to the gyroscope's times."""
    first, second = (one, other) if _RATE["x"] in one.table.columns else (other, one)
    rates, forces = first.table, second.table
    path = other.table.file
    if not set(_RATE.values()) <= rates.columns.keys() or forces.columns.keys() != {"time_s", *_FORCE.values()}:
        problem = f"there is a sensor on {other.place!r} already, {one.table.file}"
        raise InputError(path, "", problem, "give one of them, or a gyroscope's file and an accelerometer's")
    if rates.columns.keys() & set(_FORCE.values()):
        raise InputError(forces.file, "", f"{rates.file} has the acceleration already", "give one of them")
    clock = bridge_gaps(forces.file, forces.columns["time_s"])
    time = forces.columns["time_s"][clock.keep]
    if first.began is not None and second.began is not None:
        time = time + (second.began - first.began)
    inside = (rates.columns["time_s"] >= time[0]) & (rates.columns["time_s"] <= time[-1])
    if np.count_nonzero(inside) < 3:
        raise InputError(path, "", f"it has no time in common with {one.table.file}", "give two files of one run")
    columns = {name: column[inside] for name, column in rates.columns.items()}
    for name in _FORCE.values():
        columns[name] = np.interp(columns["time_s"], time, forces.columns[name][clock.keep])
    lines = tuple(line for line, keep in zip(rates.lines, inside, strict=True) if keep)
    notes = (*one.notes, *other.notes, *clock.notes)
    return Log(one.place, Table(rates.file, columns, lines), first.began, notes)


def _write(path: Path, columns: dict[str, Array]) -> None:
    """Write a table; times have microseconds, however long ago the clock of the logger began."""
    row = ",".join("%.6f" if name == "time_s" else "%.9g" for name in columns)
    body = "\n".join(row % tuple(values) for values in np.column_stack(list(columns.values())).tolist())
    path.write_text(",".join(columns) + "\n" + body + "\n", encoding="utf-8")
