"""The season's table: one row a run, as Parquet with units and meanings, and as CSV."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.new_files import open_new, unfinished
from sssi_exudyn.core.text import csv_cell, one_line
from sssi_exudyn.io.parquet import read_parquet
from sssi_exudyn.io.writing import clear_errors, to_plain, write_atomically
from sssi_exudyn.results.data_dictionary import SEASON as TABLE
from sssi_exudyn.results.data_dictionary import season_columns
from sssi_exudyn.season.descent import TRACK, points_of
from sssi_exudyn.season.figures import result_figures
from sssi_exudyn.season.listed import LONGEST, read_listed_tracks, rows_without_recording
from sssi_exudyn.season.outliers import add_outliers
from sssi_exudyn.season.places import local, places_of
from sssi_exudyn.season.plan import SeasonPlan
from sssi_exudyn.sweeps.records import DONE, Record, series_path

CSV: Final = "season.csv"


def season_table(
    folder: Path, out: Path, plan: SeasonPlan, records: Mapping[str, Record]
) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Return the table of all runs that have ended and all that the import left without one, and tracks by run.

    A track has the columns ``TRACK``.  Rows are in the order of time, those without a date last.
    """
    rows, tracks = [], dict[str, pd.DataFrame]()
    for index, (key, name) in enumerate(zip(plan.keys, plan.job.names, strict=True)):
        record = records.get(key)
        if record is None:
            continue
        rows.append(_row(out, plan, index, record))
        track = _track(out, key)
        if track is not None:
            tracks[name] = track
    rows += rows_without_recording(folder)
    tracks |= read_listed_tracks(folder)
    names = [column.name for column in season_columns()]
    numbers = {column.name: "float64" for column in season_columns() if column.unit}
    for row in rows:
        row |= {name: "" for name in names if name not in numbers and row.get(name) is None}
    table = pd.DataFrame(rows, columns=names).astype(numbers)
    undated = table["began_utc"] == ""
    table = table.assign(undated=undated).sort_values(["undated", "began_utc", "run"], kind="stable")
    table = table.drop(columns="undated").reset_index(drop=True)
    known = [name for name in table["run"] if name in tracks]
    places = dict(zip(known, places_of(local([points_of(tracks[name])[:, :2] for name in known])), strict=True))
    table["place"] = [places.get(name, "") for name in table["run"]]
    return add_outliers(table), tracks


def write_tables(out: Path, table: pd.DataFrame, origin: Mapping[str, Any]) -> None:
    """Write the table as Parquet and CSV.  Raises InputError where one cannot be written."""
    columns = season_columns()
    fields = [
        pa.field(
            column.name,
            pa.float64() if column.unit else pa.string(),
            metadata={"unit": column.unit, "meaning": column.meaning},
        )
        for column in columns
    ]
    about = json.dumps(to_plain(origin), ensure_ascii=False, sort_keys=True)
    schema = pa.schema(fields, metadata={"sssi_season": about})
    data = pa.Table.from_pandas(table, schema, preserve_index=False).replace_schema_metadata(schema.metadata)
    partial = unfinished(out / TABLE)
    with clear_errors(out / TABLE):
        with open_new(partial) as file:
            pq.write_table(data, file, compression="zstd")
        partial.replace(out / TABLE)
    safe = table.apply(lambda values: values.map(csv_cell))
    write_atomically(out / CSV, safe.to_csv(index=False, lineterminator="\n"))


def read_season_table(out: Path) -> pd.DataFrame:
    """Read the table of the season in ``out``.  Raises InputError where there is none or it cannot be read."""
    columns = season_columns()
    words = [column.name for column in columns if not column.unit]
    table = read_parquet(out / TABLE, [column.name for column in columns], words, words)
    table.attrs["units"] = {column.name: column.unit for column in columns if column.unit}
    return table


def _row(out: Path, plan: SeasonPlan, index: int, record: Record) -> dict[str, Any]:
    stated, name = plan.stated[index], plan.job.names[index]
    status, error = record.status, record.error
    figures: dict[str, Any] = dict(record.figures)
    if status == DONE:
        try:
            figures |= result_figures(out / name)
        except InputError as broken:  # a result that was removed or damaged after its run
            status, error = "failed", str(broken)
    vertical, length = figures.get("vertical_m"), figures.get("length_m")
    if vertical is not None and length:
        figures["slope_deg"] = math.degrees(math.asin(min(1.0, max(-1.0, vertical / length))))
    began = "" if stated.began is None else f"{datetime.fromtimestamp(stated.began, UTC):%Y-%m-%dT%H:%M:%SZ}"
    return {
        "run": one_line(name),
        "recording": stated.recording,
        "day": stated.day,
        "began_utc": began,
        "skier": stated.skier,
        "ski": stated.ski,
        "snow_kind": stated.snow_kind,
        "wax": stated.wax,
        "air_temperature_C": stated.air_temperature_C,
        "snow_temperature_C": stated.snow_temperature_C,
        "status": status,
        "error": one_line(error, LONGEST),
        **figures,
        "key": record.key,
        "recording_sha256": plan.digests[index],
    }


def _track(out: Path, key: str) -> pd.DataFrame | None:
    """Return the track of a run as it was kept; None where it has none."""
    try:
        track = read_parquet(series_path(out, key), TRACK)[list(TRACK)]
    except InputError:
        return None
    return track if len(track) > 1 and bool(np.all(np.isfinite(track.to_numpy(dtype=float)))) else None
