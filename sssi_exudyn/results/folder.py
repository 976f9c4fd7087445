"""A result on disk: a folder of plain files that other programs read.

``summary.json`` is put in place last.  All files are first written into a new folder and only then moved.  A full disk
or an interrupt therefore leaves the old result or the new one, a kill at the worst none, and never half a file.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import pandas as pd
import tomli_w

from sssi_exudyn.analysis.boots import cuff_column
from sssi_exudyn.bodies.skier.chain import COORDINATES, PRESCRIBED, TRANSLATIONS
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import csv_of, one_line
from sssi_exudyn.io.bounds import MAX_DURATION
from sssi_exudyn.io.parquet import check_finite, check_time, column_names, read_parquet
from sssi_exudyn.io.storage import storage_columns
from sssi_exudyn.io.typed import read_json, wrong_field
from sssi_exudyn.io.typed import read_table as read_json_table
from sssi_exudyn.io.writing import clear_errors, folder_lock, to_json, to_plain
from sssi_exudyn.motion.correction_file import FILE as POSTURE
from sssi_exudyn.results.data_dictionary import OPENSIM as DESCRIBED_OPENSIM
from sssi_exudyn.results.data_dictionary import Column, describe
from sssi_exudyn.results.summary import FORMAT, Summary, summary_from_dict, summary_to_dict
from sssi_exudyn.simulation.result import SIDES
from sssi_exudyn.terrain.file import FILE as SURFACE
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis

SUMMARY, SERIES, MODEL, DIAGNOSIS, REPORT = (
    "summary.json",
    "series.parquet",
    "model.toml",
    "diagnosis.json",
    "report.html",
)
TURNS: tuple[str, str] = ("turns.csv", "turns.parquet")
OPENSIM = (
    "coordinates.mot",
    "snow_forces.mot",
    "joint_moments.sto",
    "markers.trc",
    "skier.osim",
    "external_loads.xml",
    "inverse_dynamics.xml",
)
MUSCLES = ("muscle_activations.sto", "muscle_forces.sto")
MEASURED, SKELETON = "measured.parquet", "skeleton.json"
SECOND_HALF, DRAWS = "second_half.parquet", "draws.parquet"
COLUMNS: Final = "columns.csv"
"""What every column of the result's tables means."""
CSV: Final = {table: f"{table.removesuffix('.parquet')}.csv" for table in (SERIES, MEASURED, SECOND_HALF, DRAWS)}
"""Tables that are written as CSV too where that is asked for; the turns' always is."""
LAW: Final = "law"
"""Folder within a run of a day: the run's model with a law of friction that is in no list."""
FILES: Final = (
    *(
        SERIES,
        MODEL,
        SURFACE,
        POSTURE,
        DIAGNOSIS,
        REPORT,
        *TURNS,
        *OPENSIM,
        *MUSCLES,
        MEASURED,
        SKELETON,
        SECOND_HALF,
        DRAWS,
        COLUMNS,
        *CSV.values(),
    ),
    SUMMARY,
)
"""Every file of a result, the summary, which is put in place last, at the end."""
_NEW: Final = ".new."
_AXES: Final = ("east", "north", "up")


def _vector(name: str, unit: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}_{unit}" for axis in _AXES)


DRAW_ANGLES: Final = tuple(f"{name}_rad" for name in PRESCRIBED)
"""Columns of the draws: the angles added to the posture."""
DRAW_MASS: Final = "skier_mass_kg"
_MEASURED_BY_ANTENNA: Final = _vector("antenna", "m")
"""Columns of a series that are empty where there is no antenna."""
_SERIES: Final = (
    *("time_s", *_vector("com", "m"), *_vector("pelvis", "m"), *_vector("pelvis_velocity", "mps")),
    *(
        column
        for side in ("left", "right")
        for column in (
            *(f"{side}_{name}" for name in ("load_N", "sole_N", "tip_deflection_m", "tail_deflection_m")),
            *_vector(f"{side}_friction", "N"),
            *_vector(f"{side}_foot", "m"),
            *_vector(f"{side}_foot_velocity", "mps"),
        )
    ),
    *_vector("drag", "N"),
    *(f"{name}_m" for name in TRANSLATIONS),
    *(f"{name}_deg" for name in COORDINATES[len(TRANSLATIONS) :]),
    *(f"{name}_moment_Nm" for name in PRESCRIBED),
)
"""Columns of a series that commands and reports take, finite numbers in every row."""
_NUMBERS: Final[Mapping[str, tuple[str, ...]]] = {
    MEASURED: ("time_s",),
    SECOND_HALF: ("time_s", "measured_mps", "predicted_mps"),
    DRAWS: ("draw", "time_s", *DRAW_ANGLES, DRAW_MASS),
    TURNS[1]: ("turn", "complete", "start_s", "duration_s", "mean_speed_mps", "turn_radius_m", "outside_force_share"),
}
"""Columns that the other tables must have."""
_TOGETHER: Final = (("gps_east_m", "gps_north_m", "gps_up_m", "gps_sigma_m"), ("left_insole_N", "right_insole_N"))
"""Columns of the measurements that are all present or all absent."""
_TEXTS: Final = ("turn_side", "turn_phase", "side", "phase")
"""Columns of names."""

Render = Callable[[Path], str]
"""Function that returns the report of the result in a folder, as the text of a page."""


@dataclass(frozen=True)
class ResultContent:
    """What a result folder holds but for its report; files of what is left out are not written.

    summary : all figures
    series : one row a sample (``SimulationResult.to_frame``)
    model : the complete model as a table (written as TOML)
    model_files : the files that ``model`` names, by name: snow surface, posture correction
    measured : measurements of the recording's instruments, one row an instant (``results.measured``)
    skeleton : the skier's lengths (``chain.geometry_to_dict``)
    diagnosis : result of a diagnosis, as data
    turns : one row a turn and phase (``biomechanics``)
    second_half : speed predicted from the first half of the fixes (``results.posture``)
    draws : draws from the uncertainty of an estimate (``results.draws``)
    opensim : the texts of the files ``OPENSIM`` by name
    """

    summary: Summary
    series: pd.DataFrame
    model: Mapping[str, Any]
    model_files: Mapping[str, bytes] = field(default_factory=dict)
    measured: pd.DataFrame | None = None
    skeleton: Mapping[str, Any] | None = None
    diagnosis: object | None = None
    turns: pd.DataFrame | None = None
    second_half: pd.DataFrame | None = None
    draws: pd.DataFrame | None = None
    opensim: Mapping[str, str] = field(default_factory=dict)


def write_result(folder: Path, content: ResultContent, render: Render | None = None) -> None:
    """Write a whole result, replacing the one that may be there: its files would belong to another run.

    Parameters
    ----------
    folder : made when missing
    render : makes the report from the folder with all other files; without it there is none

    Raises InputError when the folder cannot be written or another process is writing it.
    """
    tables = {
        SERIES: content.series,
        MEASURED: content.measured,
        TURNS[1]: content.turns,
        SECOND_HALF: content.second_half,
        DRAWS: content.draws,
    }
    with _replacement(folder, None) as new:
        write_model(new, content.model, content.model_files)
        for name, table in tables.items():
            if table is not None:
                _write_parquet(new / name, table)
        if content.turns is not None:
            content.turns.to_csv(new / TURNS[0], index=False)
        for name, value in ((SKELETON, content.skeleton), (DIAGNOSIS, content.diagnosis)):
            if value is not None:
                (new / name).write_text(to_json(value), encoding="utf-8")
        for name, text in content.opensim.items():
            (new / name).write_text(text, encoding="utf-8")
        (new / SUMMARY).write_text(to_json(summary_to_dict(content.summary)), encoding="utf-8")
        if render is not None:
            (new / REPORT).write_text(render(new), encoding="utf-8")
        _write_columns(new)


def _write_columns(folder: Path) -> None:
    """Write what every column of the tables in a folder means; their files are known to be sound."""
    rows: list[object] = []
    for name in (SERIES, MEASURED, TURNS[1], SECOND_HALF, DRAWS):
        if (folder / name).exists():
            rows += describe(name, column_names(folder / name))
    for name in DESCRIBED_OPENSIM:
        if (folder / name).exists():
            rows += describe(name, storage_columns(folder / name))
    (folder / COLUMNS).write_text(csv_of(rows, Column), encoding="utf-8")


def _write_parquet(path: Path, table: pd.DataFrame) -> None:
    with path.open("wb") as file:  # Arrow opens no path that is not UTF-8
        table.to_parquet(file, index=False)


def write_model(folder: Path, model: Mapping[str, Any], files: Mapping[str, bytes]) -> None:
    """Write ``model.toml`` and the files that it names into an existing folder."""
    (folder / MODEL).write_text(tomli_w.dumps(model), encoding="utf-8")
    for name, content in files.items():
        (folder / name).write_bytes(content)


def amend_result(
    source: Path,
    folder: Path,
    groups: Mapping[str, Any],
    *,
    tables: Mapping[str, pd.DataFrame | None] | None = None,
    texts: Mapping[str, str] | None = None,
    render: Render,
) -> None:
    """Write the result in ``source``, with changed figures and files, to ``folder``, which may be the same.

    Parameters
    ----------
    groups : groups of the summary by name; all others stay, unknown ones too
    tables : Parquet files by name; None removes one
    texts : text files by name
    render : makes the report from the folder with all other files

    Raises InputError when the folder cannot be written or another process is writing it.
    """
    with _replacement(folder, source) as new:
        summary = _read_summary_table(new)
        (new / SUMMARY).write_text(to_json(summary | to_plain(groups)), encoding="utf-8")
        for name, table in (tables or {}).items():
            if table is None:
                (new / name).unlink(missing_ok=True)
            else:
                _write_parquet(new / name, table)
        for name, text in (texts or {}).items():
            (new / name).write_text(text, encoding="utf-8")
        (new / REPORT).write_text(render(new), encoding="utf-8")
        for changed in set(CSV) & set(tables or {}):
            (new / CSV[changed]).unlink(missing_ok=True)  # it would be another table's
        _write_columns(new)


@contextmanager
def _replacement(folder: Path, source: Path | None) -> Iterator[Path]:
    """Yield a new folder, whose files replace the result in ``folder`` at the end of the block.

    It begins with the files of the result ``source`` if given.

    The summary, which shows that all other files are complete, is removed before the first of them is moved.  So a kill
    in between leaves no result that is half the old one.
    """
    with folder_lock(folder), clear_errors(folder):
        for stale in folder.glob(f"{_NEW}*"):  # by a process that was killed
            if re.fullmatch(r"\d+", stale.name.removeprefix(_NEW)) and stale.is_dir() and not stale.is_symlink():
                shutil.rmtree(stale)
        new = folder / f"{_NEW}{os.getpid()}"
        try:
            new.mkdir()
            if source is not None:
                with folder_lock(source):
                    for path in source.iterdir():
                        if path.name in FILES and not path.is_file():
                            raise InputError(path, "", "this is not a file", "run again")
                        if path.is_file() and not path.is_symlink() and not path.name.startswith("."):
                            shutil.copyfile(path, new / path.name)
            yield new
            (folder / SUMMARY).unlink(missing_ok=True)
            for name in FILES:
                if not (new / name).exists():
                    (folder / name).unlink(missing_ok=True)
            for path in sorted(new.iterdir(), key=lambda path: (path.name == SUMMARY, path.name)):
                path.replace(folder / path.name)
        except InputError as error:  # of a file in the new folder, whose name the user does not know
            if source is None or not error.file.startswith(str(new)):
                raise
            file = f"{source}{error.file.removeprefix(str(new))}"
            raise InputError(file, error.place, error.problem, error.fix) from error
        finally:
            shutil.rmtree(new, ignore_errors=True)


def read_summary(folder: Path) -> Summary:
    """Read the summary of a result folder.

    Raises InputError when there is none, it is of another format, or a figure is of another type.
    """
    try:
        return summary_from_dict(_read_summary_table(folder))
    except ValueError as error:
        raise wrong_field(folder / SUMMARY, error) from None


def check_own(folder: Path | None, recording: str) -> None:
    """Raise InputError where a folder holds the results of another recording than that one: they would be lost."""
    if folder is None or not (folder / SUMMARY).is_file():
        return
    try:
        name = read_summary(folder).recording
    except InputError:  # results that cannot be read are replaced
        return
    if name != recording:
        problem = f"the folder holds the results of {one_line(name)}"
        raise InputError(folder, "", problem, "choose another folder with --out, or delete this one")


def _read_summary_table(folder: Path) -> dict[str, Any]:
    path = folder / SUMMARY
    table = read_json_table(_no_link(path))
    if table.get("format") != FORMAT:
        raise InputError(path, "format", f"not a summary of format {FORMAT}", "run again with this version")
    return table


_CUFFS: Final = tuple(cuff_column(side, "flexion") for side in SIDES)
"""Columns from which muscles are computed, only in results with boots."""
_SNOW: Final = tuple(column for side in SIDES for column in _vector(f"{side}_snow_force", "N"))
"""Columns that older results lack."""


def read_series(folder: Path) -> pd.DataFrame:
    """Read the time series of a result folder.

    Raises InputError when there is none or it cannot be read, a column is missing or holds what is not a finite number,
    or time does not rise.
    """
    path = _no_link(folder / SERIES)
    series = read_parquet(path, (*_SERIES, *_MEASURED_BY_ANTENNA), _TEXTS)
    if series.empty:
        raise InputError(path, "", "there is no sample", "run again")
    check_time(path, series, MAX_DURATION, strict=True)
    if len(set(_SNOW) & set(series.columns)) not in (0, len(_SNOW)):
        missing = next(name for name in _SNOW if name not in series)
        raise InputError(path, f"column {missing}", "the column is missing", "run again")
    check_finite(path, series, [*_SERIES, *(name for name in (*_CUFFS, *_SNOW) if name in series)])
    return series


def read_table(folder: Path, name: str) -> pd.DataFrame | None:
    """Read a Parquet file of a result, ``MEASURED``, ``SECOND_HALF``, ``DRAWS`` or the turns'; None where it has none.

    Raises InputError where it cannot be read, lacks a column, or its time falls.
    """
    path = folder / name
    if not _exists(path):
        return None
    table = read_parquet(_no_link(path), _NUMBERS[name], _TEXTS)
    if "time_s" in table:
        check_time(path, table, MAX_DURATION, strict=False)
    if name == DRAWS:
        check_finite(path, table, list(table.columns))
    if name == MEASURED:
        strange = set(table.columns).difference(_NUMBERS[MEASURED], *_TOGETHER)
        if strange:
            raise InputError(path, f"column {min(strange)}", "no instrument has such a column", "run again")
        for columns in _TOGETHER:
            known = [column for column in columns if column in table]
            if known and len(known) < len(columns):
                missing = next(column for column in columns if column not in known)
                raise InputError(path, f"column {missing}", "the column is missing", "run again")
            check_finite(path, table[table[known].notna().any(axis=1)], known)
    if name == TURNS[1] and not {"side", "phase"} <= set(table.columns):
        raise InputError(path, "columns side and phase", "a column is missing", "run again")
    return table


def read_skeleton(folder: Path) -> dict[str, Any] | None:
    """Read the skier's lengths as a table; None where the result has none.  Raises InputError if it is unreadable."""
    path = folder / SKELETON
    return read_json_table(_no_link(path)) if _exists(path) else None


def read_diagnosis(folder: Path) -> Diagnosis | None:
    """Read the result of a diagnosis; None where none was made.  Raises InputError when it cannot be read."""
    path = folder / DIAGNOSIS
    return read_json(_no_link(path), Diagnosis) if _exists(path) else None


def _exists(path: Path) -> bool:
    """Tell whether anything of that name exists, also a link that leads nowhere."""
    return os.path.lexists(path)


def _no_link(path: Path) -> Path:
    """Return the path.  Raises InputError for a symbolic link: a result is one folder of its own files."""
    if path.is_symlink():
        raise InputError(path, "", "this is a link", "put the file itself into the folder")
    return path
