"""Parameter sweeps: many runs, on one machine or a cluster; none is lost and none done twice.

In a script, call ``sweep`` below ``if __name__ == "__main__":``, since worker processes import the script.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TypedDict

import pandas as pd
import tomli_w

from sssi_exudyn.core.choices import Cluster
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import convert, read_json
from sssi_exudyn.io.writing import folder_lock, is_locked, to_json, write_atomically
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.threads import cores_used
from sssi_exudyn.sweeps.file import SweepFile, read_sweep, sweep_from
from sssi_exudyn.sweeps.outputs import Column
from sssi_exudyn.sweeps.page import PAGE, render_sweep
from sssi_exudyn.sweeps.plan import Plan, SweepRun, plan_of, plan_sweep
from sssi_exudyn.sweeps.records import DONE, Record, gather, last_records, tidy
from sssi_exudyn.sweeps.sensitivity_indices import indices_of
from sssi_exudyn.sweeps.table import origin_of, read_table, table_columns, write_tables
from sssi_exudyn.sweeps.workers.pools import CREDENTIALS, pool_of, this_process
from sssi_exudyn.sweeps.workers.scheduler import Countdown, Work, do_all
from sssi_exudyn.sweeps.workers.worker import perform

FILE: Final = "sweep.toml"
"""The copy of a sweep's file in its folder, itself a complete sweep file."""
ORIGIN: Final = "sweep.json"
INDICES: Final = "indices.csv"
_SILENT: Final = Progress()


@dataclass(frozen=True)
class Origin:
    """``sweep.json``: rows of the sweep's table, its runs, its hash, and the files and versions at its start."""

    format: int
    name: str
    rows: int
    runs: int
    identity: str
    inputs: dict[str, str]
    versions: dict[str, str]
    settings: dict[str, Any]
    seed: int | None
    platform: dict[str, str]


class Counts(TypedDict):
    """The runs of a sweep by status, those that are left, and those that ended twice (always 0)."""

    name: str
    runs: int
    done: int
    diverged: int
    failed: int
    crashed: int
    left: int
    repeated: int


class Status(Counts):
    """Counts, whether the sweep is running, its rate (runs a minute) and the time left (s), None where unknown."""

    running: bool
    per_minute: float | None
    time_left_s: float | None


def sweep(
    file: Path | Mapping[str, Any],
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
    in_this_process: bool = False,
) -> Counts:
    """Do the sweep of a file, or of a mapping of the same content, into ``out``, or continue it there.

    Parameters
    ----------
    file : paths in it count from its folder, in a mapping from the working directory
    workers : processes; None for one for each core
    scheduler : address of a Dask scheduler, whose workers see ``out`` and the recordings under the same paths
    cluster : a Dask cluster to start
    in_this_process : do the runs one by one here, without starting a process: a run that kills it ends the sweep

    Returns the counts of the runs by status.  Raises InputError for a mistake in the file, before the first run, and
    for a folder that holds another sweep; SssiError for a missing package or a scheduler that does not answer.
    """
    swept = read_sweep(file) if isinstance(file, Path) else sweep_from(file, Path("sweep"))
    return _do_sweep(swept, out, workers, scheduler, cluster, progress, in_this_process=in_this_process)


def resume(
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
) -> Counts:
    """Continue the sweep in ``out``: runs that have ended are not done again.  See ``sweep``."""
    _read_origin(out)
    return _do_sweep(read_sweep(out / FILE), out, workers, scheduler, cluster, progress)


def retry(
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
) -> Counts:
    """Continue the sweep in ``out``, and do its failed runs again.  See ``sweep``."""
    _read_origin(out)
    return _do_sweep(read_sweep(out / FILE), out, workers, scheduler, cluster, progress, again=True)


def status(out: Path) -> Status:
    """Report the progress of the sweep in ``out``.  Raises InputError where there is none."""
    origin = _read_origin(out)
    records, repeated = last_records(out)
    counts = _count(origin, records, repeated)
    running = is_locked(out)
    rate = _rate(records)
    left = counts["left"] / rate if running and rate else None
    return {**counts, "running": running, "per_minute": 60.0 * rate if rate else None, "time_left_s": left}


def render_folder(out: Path) -> str:
    """Return the page of the sweep in ``out``, made from its files; its recordings are not needed.

    Raises InputError where there is no sweep, or none whose runs have ended.
    """
    origin = _read_origin(out)
    plan, table = _read_table(out, origin)
    return render_sweep(plan, table, indices_of(plan, table), origin.versions)


def read_swept(out: Path) -> tuple[pd.DataFrame, tuple[Column, ...]]:
    """Read the table of the sweep in ``out`` and its columns with units and meanings, without its recordings.

    Raises InputError where there is no sweep, or none whose runs have ended.
    """
    plan, table = _read_table(out, _read_origin(out))
    return table, tuple(column for column in table_columns(plan) if column.name in table)


def read_indices(out: Path) -> pd.DataFrame:
    """Read the indices of the sweep in ``out``, with columns as ``COLUMNS`` of ``sensitivity_indices``."""
    return pd.read_csv(out / INDICES)


def _read_table(out: Path, origin: Origin) -> tuple[Plan, pd.DataFrame]:
    plan = plan_of(read_sweep(out / FILE), origin.inputs)
    return plan, read_table(out, plan)


def is_sweep(folder: Path) -> bool:
    """Tell whether a folder holds a sweep."""
    return (folder / ORIGIN).is_file()


def _do_sweep(
    file: SweepFile,
    out: Path,
    workers: int | None,
    scheduler: str | None,
    cluster: Cluster | None,
    progress: Progress,
    *,
    again: bool = False,
    in_this_process: bool = False,
) -> Counts:
    out = out.resolve()
    pool = this_process if in_this_process else pool_of(scheduler, cluster, out)
    plan = plan_sweep(file)
    for plugin in plan.job.plugins if not in_this_process else ():
        if not plugin.source:
            problem = f"worker processes cannot load the law of {plugin.name!r}, which is in no file of its own"
            raise InputError(
                file.path, "[[term]]", problem, "put it into a plug-in's file, or give workers=1 in Python"
            )
    with folder_lock(out):
        origin = _open_folder(plan, out)
        for stale in out.glob(f"{CREDENTIALS}*"):  # of a sweep that was killed
            shutil.rmtree(stale, ignore_errors=True)
        gather(out)
        records, _ = last_records(out)
        runs = _runs_left(plan, records, again)
        with progress.stage("sweep") as stage:
            count = min(cores_used(workers), max(1, len(runs)))
            work = Work(out, plan.job, perform, "'sssi sweep resume'")
            do_all(work, runs, pool, count, Countdown(stage, len(runs)))
        with progress.stage("tables"):
            gather(out)
            tidy(out)
            records, repeated = last_records(out)
            _write_summary(out, plan, write_tables(out, plan, records), origin)
    return _count(origin, records, repeated)


def _write_summary(out: Path, plan: Plan, table: pd.DataFrame, origin: Origin) -> None:
    """Write the indices and the page of the sweep's table."""
    indices = indices_of(plan, table)
    write_atomically(out / INDICES, indices.to_csv(index=False, lineterminator="\n"))
    write_atomically(out / PAGE, render_sweep(plan, table, indices, origin.versions))


def _open_folder(plan: Plan, out: Path) -> Origin:
    """Return the origin of the folder's sweep; written first where there is none."""
    path = out / ORIGIN
    if not path.exists():
        head = {"format": 1, "name": plan.file.name, "rows": len(plan.keys), "runs": len(set(plan.keys))}
        origin = convert({**head, **origin_of(plan)}, Origin)
        write_atomically(out / FILE, tomli_w.dumps(plan.file.portable(out)))
        write_atomically(path, to_json(origin))
        return origin
    origin = _read_origin(out)
    if origin.identity != plan.job.identity:
        raise InputError(out, "", "the folder holds another sweep", "choose another folder with --out")
    if origin.versions != dict(plan.job.versions):
        problem = "the sweep was started with other versions of the program or its packages"
        raise InputError(path, "versions", problem, "install those, or start again in another folder")
    return origin


def _read_origin(out: Path) -> Origin:
    path = out / ORIGIN
    if not path.exists():
        raise InputError(out, "", "the folder holds no sweep", "give the --out of a sweep")
    origin = read_json(path, Origin)
    if origin.format != 1:
        raise InputError(path, "format", "not a sweep of format 1", "start again with this version")
    return origin


def _runs_left(plan: Plan, records: Mapping[str, Record], again: bool) -> list[SweepRun]:
    """Return the runs that have not ended and, to be done ``again``, the failed ones, with the attempt's number."""
    runs = []
    for run in plan.runs():
        record = records.get(run.key)
        if record is None:
            runs.append(run)
        elif again and record.status != DONE:
            runs.append(replace(run, attempt=record.attempt + 1))
    return runs


def _count(origin: Origin, records: Mapping[str, Record], repeated: int) -> Counts:
    ended = Counter(record.status for record in records.values())
    return {
        "name": origin.name,
        "runs": origin.runs,
        "done": ended[DONE],
        "diverged": ended["diverged"],
        "failed": ended["failed"],
        "crashed": ended["crashed"],
        "left": origin.runs - len(records),
        "repeated": repeated,
    }


def _rate(records: Mapping[str, Record]) -> float | None:
    """Return the runs a second, over the last hundred or over all."""
    ends = sorted(record.end for record in records.values())[-100:]
    if len(ends) < 2 or ends[-1] <= ends[0]:
        return None
    return float((len(ends) - 1) / (ends[-1] - ends[0]))
