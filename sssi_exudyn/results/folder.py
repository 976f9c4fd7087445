"""A result on disk: a folder of plain files that other programs read.

``summary.json`` is put in place last.  All files are first written under other names and only then moved, so that a
full disk or an interrupt leaves the old result or the new one, a kill at the worst none, and never half a file.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import _replace_together, clear_errors, folder_lock, to_json, to_plain

FORMAT = 1
SUMMARY, SERIES, MODEL, DIAGNOSIS, REPORT = (
    "summary.json",
    "series.parquet",
    "model.toml",
    "diagnosis.json",
    "report.html",
)
TURNS: tuple[str, str] = ("turns.csv", "turns.parquet")
OPENSIM = ("coordinates.mot", "snow_forces.mot", "joint_moments.sto", "markers.trc")
MUSCLES = ("muscle_activations.sto", "muscle_forces.sto")
MEASURED, SKELETON = "measured.parquet", "skeleton.json"

_FIGURES: Mapping[str, Any] = {
    "recording": None,
    "friction": {"mu_t": {"value": None, "se": None}, "mu_n": {"value": None, "se": None}},
    "trajectory": {"mean_error_m": None, "percent_of_length": None, "length_m": None},
    "pressure_ratio": {"correlation": None, "rmsd": None},
    "fit": {"converged": None, "evaluations": None, "wall_s": None},
    "solver": {"simulated_s": None, "wall_s": None, "steps": None, "backend": None},
    "energy": {"closure_percent": None},
    "turns": {"count": None, "complete": None},
    "residual_moment": {"peak_Nm": None, "rms_Nm": None},
    "provenance": {"inputs": {}, "versions": {}, "settings": {}, "seed": None},
}
"""Every figure of a summary.  One that does not apply is null, never missing."""


def complete_summary(figures: Mapping[str, Any]) -> dict[str, Any]:
    """A summary of format 1 from the figures there are: missing and not-a-number ones become null, others stay."""
    return {"format": FORMAT, **_merged(_FIGURES, to_plain(figures))}


def write_result(
    folder: Path,
    summary: Mapping[str, Any],
    series: pd.DataFrame,
    model: Mapping[str, Any],
    *,
    measured: pd.DataFrame | None = None,
    skeleton: Mapping[str, Any] | None = None,
    diagnosis: Mapping[str, Any] | None = None,
    report: str | None = None,
    turns: pd.DataFrame | None = None,
    opensim: Mapping[str, str] | None = None,
) -> None:
    """Write a whole result, replacing the one that may be there.

    Parameters
    ----------
    folder : made when missing
    summary : figures by group, completed by ``complete_summary``
    series : one row a sample (``SimulationResult.to_frame``)
    model : the complete model as a table (written as TOML)
    measured : what the recording's instruments say, one row an instant (``results.measured``)
    skeleton : the skier's lengths (``chain.geometry_to_dict``)
    turns : one row a turn and phase (``biomechanics``)
    opensim : the texts of the files ``OPENSIM`` by name
    measured … opensim : left out, older ones go away, since they would belong to another run

    Raises InputError when the folder cannot be written or another process is writing it.
    """
    text = to_json(complete_summary(summary))
    writers: dict[str, Callable[[Path], object]] = {
        SERIES: lambda path: series.to_parquet(path, index=False),
        MODEL: lambda path: path.write_text(tomli_w.dumps(model), encoding="utf-8"),
    }
    if measured is not None:
        instruments = measured
        writers[MEASURED] = lambda path: instruments.to_parquet(path, index=False)
    if skeleton is not None:
        lengths = to_json(skeleton)
        writers[SKELETON] = lambda path: path.write_text(lengths, encoding="utf-8")
    if diagnosis is not None:
        made = to_json(diagnosis)
        writers[DIAGNOSIS] = lambda path: path.write_text(made, encoding="utf-8")
    if report is not None:
        writers[REPORT] = lambda path: path.write_text(report, encoding="utf-8")
    if turns is not None:
        writers[TURNS[0]] = lambda path: turns.to_csv(path, index=False)
        writers[TURNS[1]] = lambda path: turns.to_parquet(path, index=False)
    for name, content in (opensim or {}).items():
        writers[name] = partial(Path.write_text, data=content, encoding="utf-8")
    writers[SUMMARY] = lambda path: path.write_text(text, encoding="utf-8")
    with folder_lock(folder), clear_errors(folder):
        stale = {MEASURED, SKELETON, DIAGNOSIS, REPORT, *TURNS, *OPENSIM, *MUSCLES} - writers.keys()
        for name in writers:  # what a kill left half written
            for left in folder.glob(f".{name}.*"):
                left.unlink(missing_ok=True)
        _replace_together(folder, writers, stale)


def amend_result(folder: Path, summary: Mapping[str, Any], series: pd.DataFrame, texts: Mapping[str, str]) -> None:
    """Put a new summary and series in place of a result's, and text files by their names; all else stays.

    Raises InputError when the folder cannot be written or another process is writing it.
    """
    text = to_json(complete_summary(summary))
    writers: dict[str, Callable[[Path], object]] = {SERIES: lambda path: series.to_parquet(path, index=False)}
    for name, content in texts.items():
        writers[name] = partial(Path.write_text, data=content, encoding="utf-8")
    writers[SUMMARY] = lambda path: path.write_text(text, encoding="utf-8")
    with folder_lock(folder), clear_errors(folder):
        _replace_together(folder, writers, set())


def read_report(folder: Path) -> str | None:
    """The page of a result folder; None where the result has none.  Raises InputError when it cannot be read."""
    path = folder / REPORT
    with clear_errors(path):
        return path.read_text(encoding="utf-8") if path.exists() else None


def read_summary(folder: Path) -> dict[str, Any]:
    """The summary of a result folder.  Raises InputError when there is none or it is of another format."""
    path = folder / SUMMARY
    summary = _read_json(path)
    if summary.get("format") != FORMAT:
        raise InputError(path, "format", f"not a summary of format {FORMAT}", "run again with this version")
    return summary


def _read_json(path: Path) -> dict[str, Any]:
    with clear_errors(path):
        try:
            table = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(path, "", f"not JSON ({error})", "run again") from error
    if not isinstance(table, dict):
        raise InputError(path, "", "holds no table of figures", "run again with this version")
    return table


def read_series(folder: Path) -> pd.DataFrame:
    """The time series of a result folder.  Raises InputError when there is none or it cannot be read."""
    return _read_parquet(folder / SERIES)


def read_measured(folder: Path) -> pd.DataFrame | None:
    """What the recording's instruments say; None where the result has none.  Raises InputError where unreadable."""
    return _read_parquet(folder / MEASURED) if (folder / MEASURED).exists() else None


def read_turns(folder: Path) -> pd.DataFrame | None:
    """One row a turn and phase; None where the result has none.  Raises InputError where unreadable."""
    return _read_parquet(folder / TURNS[1]) if (folder / TURNS[1]).exists() else None


def read_skeleton(folder: Path) -> dict[str, Any] | None:
    """The skier's lengths as a table; None where the result has none.  Raises InputError when it cannot be read."""
    path = folder / SKELETON
    return _read_json(path) if path.exists() else None


def _read_parquet(path: Path) -> pd.DataFrame:
    with clear_errors(path):
        try:
            return pd.read_parquet(path)
        except ValueError as error:  # pyarrow's ArrowInvalid is one
            raise InputError(path, "", "not a Parquet file", "run again") from error


def read_model(folder: Path) -> dict[str, Any]:
    """The model's table of a result folder.  Raises InputError when there is none or it is not TOML."""
    path = folder / MODEL
    with clear_errors(path):
        try:
            return tomllib.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(path, "", f"not TOML ({error})", "run again") from error


def _merged(template: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(template) | dict(given)
    for name, default in template.items():
        if isinstance(default, Mapping) and name in given:
            merged[name] = _merged(default, given[name] or {})
    return merged
