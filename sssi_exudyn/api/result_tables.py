"""Tables of a result: joint angles, moments, forces, turns in percent, and files for other programs."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from sssi_exudyn.api.arguments import RecordingOrFolder, recording_of
from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import csv_cell, csv_of, did_you_mean
from sssi_exudyn.io.writing import check_file_name, folder_lock, write_atomically
from sssi_exudyn.reports.gltf import gltf_bytes
from sssi_exudyn.reports.track_export import TRACK_FORMATS, track_text
from sssi_exudyn.results.data_dictionary import Column, describe, unit_of
from sssi_exudyn.results.folder import COLUMNS, CSV, DRAWS, MEASURED, SECOND_HALF, SERIES, TURNS
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import summary_to_dict
from sssi_exudyn.runtime.optional import import_for

_FORCES: Final = ("_load_", "_sole_", "_friction_", "_snow_force_", "_pole_", "_drag_")
"""Parts of the names of forces in a series."""
_MOST_POINTS: Final = 10_001
_LARGE: Final = 1e5
"""From which on numbers have fifteen digits instead of nine: clocks that count from 1970 have nine before the point."""


class ResultTables:
    """Methods that give tables of a stored run."""

    stored: StoredRun

    @property
    def angles(self) -> pd.DataFrame:
        """Return the 28 joint angles (degrees) as ``hip_flexion_r_deg`` …, one row a sample with ``time_s`` first."""
        return self._columns([f"{name}_deg" for name in PRESCRIBED])

    @property
    def moments(self) -> pd.DataFrame:
        """Return the moments of the 28 joint angles (N m) as ``hip_flexion_r_moment_Nm`` …, with ``time_s`` first.

        Those of the pelvis are the residual moment.
        """
        return self._columns([f"{name}_moment_Nm" for name in PRESCRIBED])

    @property
    def forces(self) -> pd.DataFrame:
        """Return all forces of snow, air and poles (N) with ``time_s`` first; vectors are east, north, up."""
        names = [str(name) for name in self.stored.series]
        forces = [name for name in names if name.endswith("_N") and any(part in f"_{name}" for part in _FORCES)]
        return self._columns(forces)

    @property
    def turns(self) -> pd.DataFrame | None:
        """Return the table of turns, one row a turn and phase; None for a result without turns."""
        return None if self.stored.turn_table is None else with_units(self.stored.turn_table)

    @checked
    def over_turns(self, columns: Sequence[str] | str | None = None, *, points: int = 101) -> pd.DataFrame:
        """Return columns of the series at even percentages of each complete turn.

        Parameters
        ----------
        columns : names in ``series``; every number if left out
        points : rows a turn, from 0 to 100 %

        Returns a table with the index ``turn`` and ``percent``, the column ``side`` and the interpolated columns.
        Raises InputError for a column that the series does not have, and for a run without a complete turn.

        Examples
        --------
        >>> loads = result.over_turns(["left_load_N", "right_load_N"])
        >>> loads.groupby(["side", "percent"]).mean(numeric_only=True)
        """
        series = self.stored.series
        numbers = [str(name) for name in series.select_dtypes("number") if name not in ("turn", "time_s")]
        wanted = numbers if columns is None else [columns] if isinstance(columns, str) else list(columns)
        for name in wanted:
            if name not in numbers:
                raise InputError("over_turns", name, "the series has no such number", did_you_mean(name, numbers))
        if not 2 <= points <= _MOST_POINTS:
            raise InputError("over_turns", "points", f"{points} rows a turn", f"use 2 to {_MOST_POINTS}")
        turns = [(count, turn) for count, turn in enumerate(self.stored.turns.turns, 1) if turn.complete]
        if not turns:
            raise InputError("over_turns", self.stored.name, "the run has no complete turn", "use series")
        percent, parts = np.linspace(0.0, 100.0, points), []
        for count, turn in turns:
            time = turn.start + percent / 100.0 * turn.duration
            table = pd.DataFrame({name: np.interp(time, self.stored.time, series[name]) for name in wanted})
            table.insert(0, "side", turn.side)
            table.index = pd.MultiIndex.from_product([[count], percent], names=["turn", "percent"])
            parts.append(table)
        return with_units(pd.concat(parts))

    @checked
    def to_csv(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write every table of the result as CSV into a folder, and return the files' paths.

        ``columns.csv`` has the unit, the frame and the meaning of every column.  Raises InputError where a file cannot
        be written.

        Examples
        --------
        >>> result.to_csv("results/beginner")
        """
        out, written = Path(folder), []
        with folder_lock(out):
            for name, table in self._tables().items():
                path = out / CSV.get(name, TURNS[0])
                write_atomically(path, _clean(table).to_csv(index=False, float_format=_digits))
                written.append(path)
            if not (out / COLUMNS).exists():  # a result's folder has one, which describes all of its files
                write_atomically(out / COLUMNS, csv_of(self._described(), Column))
                written.append(out / COLUMNS)
        return written

    @checked
    def to_excel(self, file: str | os.PathLike[str]) -> Path:
        """Write figures and tables as one workbook with a sheet each, and return that file's path.

        Raises InputError for another ending than .xlsx, SssiError where openpyxl is not installed.

        Examples
        --------
        >>> result.to_excel("beginner.xlsx")
        """
        path = Path(file)
        if path.suffix != ".xlsx":
            raise InputError(path, "", "no workbook", "end its name in '.xlsx'")
        check_file_name(path)
        import_for("to_excel", "openpyxl", "export")
        sheets = {"figures": pd.DataFrame(_flat(summary_to_dict(self.stored.summary)), columns=["figure", "value"])}
        sheets |= {name.partition(".")[0]: table for name, table in self._tables().items()}
        sheets["columns"] = pd.DataFrame([asdict(column) for column in self._described()])
        buffer = io.BytesIO()
        with pd.ExcelWriter(buffer, engine="openpyxl") as writer:
            for name, table in sheets.items():
                _clean(table).to_excel(writer, sheet_name=name, index=False, freeze_panes=(1, 1))
        write_atomically(path, buffer.getvalue())
        return path

    @checked
    def to_track(self, file: str | os.PathLike[str], recording: RecordingOrFolder) -> Path:
        """Write the simulated track of the antenna for maps (.gpx, .kml or .geojson), and return that file's path.

        Parameters
        ----------
        file : its ending chooses the format
        recording : the recording or its folder, whose GPS has the place of the origin

        Raises InputError for another ending and for a recording without GPS, SssiError where the library of the format
        is not installed.

        Examples
        --------
        >>> result.to_track("beginner.kml", "examples/beginner")
        """
        from sssi_exudyn.recording.read import read_recording

        path = Path(file)
        if path.suffix not in TRACK_FORMATS:
            raise InputError(path, "", "no format of tracks", f"end its name in {', '.join(TRACK_FORMATS)}")
        check_file_name(path)
        given = recording_of(recording)
        whole = read_recording(given) if isinstance(given, Path) else given
        if whole.gps is None:
            raise InputError("to_track", whole.name, "the recording has no GPS, so its place is unknown", "add it")
        write_atomically(path, track_text(self.stored, whole.gps.origin, path.suffix))
        return path

    @checked
    def to_gltf(self, file: str | os.PathLike[str]) -> Path:
        """Write the run as an animated 3D scene (.glb) and return that file's path.

        It has a node a segment and ski.  Raises InputError for another ending and for a result without a skeleton,
        SssiError where pygltflib is not installed.

        Examples
        --------
        >>> result.to_gltf("beginner.glb")
        """
        path = Path(file)
        if path.suffix != ".glb":
            raise InputError(path, "", "no binary glTF", "end its name in '.glb'")
        check_file_name(path)
        write_atomically(path, gltf_bytes(self.stored))
        return path

    def _columns(self, names: Sequence[str]) -> pd.DataFrame:
        return with_units(self.stored.series[["time_s", *names]])

    def _tables(self) -> dict[str, pd.DataFrame]:
        run = self.stored
        tables = {
            SERIES: run.series,
            TURNS[1]: run.turn_table,
            MEASURED: run.measured,
            SECOND_HALF: run.second_half,
            DRAWS: run.draws,
        }
        return {name: table for name, table in tables.items() if table is not None}

    def _described(self) -> list[Column]:
        return [column for name, table in self._tables().items() for column in describe(name, map(str, table.columns))]


def with_units(table: pd.DataFrame) -> pd.DataFrame:
    """Return the same table, with the units of its columns of numbers in ``attrs["units"]``."""
    described = table.copy(deep=False)
    units = {str(name): unit_of(str(name)) for name in table.columns}
    described.attrs["units"] = {name: unit for name, unit in units.items() if unit is not None}
    return described


def _flat(value: object, name: str = "") -> list[tuple[str, object]]:
    """Return nested figures as rows, named by their path such as ``friction.mu_t.value``."""
    if isinstance(value, dict):
        return [row for key, part in value.items() for row in _flat(part, f"{name}.{key}" if name else str(key))]
    if isinstance(value, list | tuple):
        return [row for count, part in enumerate(value, 1) for row in _flat(part, f"{name}.{count}")]
    return [(name, value)]


def _digits(value: Any) -> str:  # Any: pandas calls it with an object, which is a number
    """Return the text of a number in a table."""
    return f"{value:.15g}" if abs(value) >= _LARGE else f"{value:.9g}"


def _clean(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with text that a spreadsheet cannot take for a formula."""
    texts = table.select_dtypes(["object", "string", "category"]).columns
    return table.assign(**{name: table[name].map(csv_cell) for name in texts})
