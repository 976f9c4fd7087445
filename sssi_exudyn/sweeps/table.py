"""The sweep's table: one row for each run, as a Parquet file that pandas, polars and DuckDB read.

The same file and seed give the same bytes, whichever workers did the runs in whatever order.  Data that differ between
two sweeps of one file (when, how long, by which process) are in a separate table.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.core.new_files import open_new, unfinished
from sssi_exudyn.io.parquet import read_parquet
from sssi_exudyn.io.writing import clear_errors, to_plain, write_atomically
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.sweeps.outputs import Column
from sssi_exudyn.sweeps.parameters import SKIS
from sssi_exudyn.sweeps.plan import Plan
from sssi_exudyn.sweeps.records import Record, series_path

TABLE: Final = "runs.parquet"
TIMINGS: Final = "timings.parquet"
COLUMNS: Final = "columns.csv"
_FIRST: Final = (
    Column("run", "1", "row of the design, through the recordings in order"),
    Column("recording", "", "folder of the recording, or the ski of a turn"),
)
_LAST: Final = (
    Column("status", "", "done, diverged, failed or crashed"),
    Column("error", "", "why the run is not done"),
    Column("series", "", "file of the run's time series, where one was kept"),
    Column("key", "", "hash of all inputs of the run"),
    Column("recording_sha256", "", "hash of the recording's files"),
    Column("sssi_exudyn", "", "version of this program"),
    Column("exudyn", "", "version of the solver"),
)
_TIMINGS: Final = {
    "begin": "s since 1970",
    "end": "s since 1970",
    "wall_s": "s of computing",
    "cpu_s": "s of a core's time",
    "worker": "process that did it",
    "memory_MB": "that process's memory at the end of the run",
    "attempt": "0 for the first",
}


def table_columns(plan: Plan) -> tuple[Column, ...]:
    """Return the table's columns in order, with units and meanings."""
    inputs = tuple(Column(axis.name, axis.parameter.unit, axis.parameter.meaning) for axis in plan.axes)
    return (*_FIRST, *inputs, *plan.columns, *_LAST)


def write_tables(folder: Path, plan: Plan, records: Mapping[str, Record]) -> pd.DataFrame:
    """Write table, timings and the list of columns, and return the table.

    Raises InputError where one cannot be written.

    Parameters
    ----------
    records : the last record of every run, by key
    """
    columns = table_columns(plan)
    table = table_of(plan, records)
    schema = pa.schema(
        [
            pa.field(
                column.name,
                pa.from_numpy_dtype(table[column.name].dtype) if _is_number(column) else pa.string(),
                metadata={"unit": column.unit, "meaning": column.meaning},
            )
            for column in columns
        ],
        metadata={"sssi_sweep": json.dumps(to_plain(origin_of(plan)), ensure_ascii=False, sort_keys=True)},
    )
    _write(
        folder / TABLE,
        pa.Table.from_pandas(table, schema, preserve_index=False).replace_schema_metadata(schema.metadata),
    )
    timings = pd.DataFrame(
        [{"key": key} | {name: getattr(records[key], name) for name in _TIMINGS} for key in sorted(records)]
    )
    _write(folder / TIMINGS, pa.Table.from_pandas(timings, preserve_index=False))
    listed = pd.DataFrame([(c.name, c.unit, c.meaning) for c in columns], columns=["name", "unit", "meaning"])
    write_atomically(folder / COLUMNS, listed.to_csv(index=False, lineterminator="\n"))
    return table


def read_table(folder: Path, plan: Plan) -> pd.DataFrame:
    """Read the part of the sweep's table in its folder that its page needs.

    Raises InputError where there is none, it cannot be read, or lacks a column.
    """
    needed = ("recording", "status", "error", *(axis.name for axis in plan.axes), *plan.outputs)
    names = [column.name for column in table_columns(plan) if not _is_number(column) and column.name != "error"]
    return read_parquet(folder / TABLE, needed, names, ("error",))


def table_of(plan: Plan, records: Mapping[str, Record]) -> pd.DataFrame:
    """Return one row for each run that has ended."""
    rows: list[dict[str, Any]] = []
    versions = dict(plan.job.versions)
    for number, key in enumerate(plan.keys):
        record = records.get(key)
        if record is None:
            continue
        run = plan.run(number)
        rows.append(
            {
                "run": number,
                "recording": plan.file.folders[run.recording].name,
                **dict(run.values),
                **{column.name: record.figures.get(column.name) for column in plan.columns},
                "status": record.status,
                "error": record.error,
                "series": _series(plan, record),
                "key": key,
                "recording_sha256": plan.job.hashes[run.recording],
                "sssi_exudyn": versions["sssi_exudyn"],
                "exudyn": versions["exudyn"],
            }
        )
    columns = table_columns(plan)
    table = pd.DataFrame(rows, columns=[column.name for column in columns])
    return table.astype({column.name: _dtype(column) for column in columns if _is_number(column)})


def origin_of(plan: Plan) -> dict[str, Any]:
    """Return settings, file hashes, versions and seed of the sweep; the same wherever its folder is."""
    file = plan.file
    places = "skis" if file.task == "turn" else "recordings"
    settings = {**file.settings, "name": file.name, places: [folder.name for folder in file.folders]}
    if file.model is not None:
        settings["model"] = file.model.name
    return {"identity": plan.job.identity, **provenance(plan.files, settings, plan.file.design.seed)}


def _series(plan: Plan, record: Record) -> str | None:
    if not plan.job.series or record.status != "done" or plan.job.task != "simulate":
        return None
    return series_path(Path(), record.key).as_posix()


def _is_number(column: Column) -> bool:
    return column.unit != "" and column.name != SKIS


def _dtype(column: Column) -> str:
    return "int64" if column.name == "run" else "float64"


def _write(path: Path, table: pa.Table) -> None:
    partial = unfinished(path)
    with clear_errors(path):
        with open_new(partial) as file:
            pq.write_table(table, file, compression="zstd")
        partial.replace(path)
