"""Parameter sweeps: many runs, on one machine or a cluster, of which none is lost and none done twice.

In a script, call ``sweep`` below ``if __name__ == "__main__":``, since worker processes import the script.
"""

from __future__ import annotations

import json
import os
import time as clock
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pandas as pd
import tomli_w

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import folder_lock, is_locked, to_json, write_atomically
from sssi_exudyn.runtime.progress import Progress, Stage
from sssi_exudyn.sweeps.file import SweepFile, read_sweep, sweep_from
from sssi_exudyn.sweeps.page import PAGE, render_sweep
from sssi_exudyn.sweeps.plan import Plan, Run, planned
from sssi_exudyn.sweeps.pools import Cluster, pool_of
from sssi_exudyn.sweeps.records import DONE, STATUSES, Record, gather, last_records, tidy
from sssi_exudyn.sweeps.scheduler import do_all
from sssi_exudyn.sweeps.sensitivity_indices import indices_of
from sssi_exudyn.sweeps.table import origin_of, same_versions, write_tables

FILE: Final = "sweep.toml"
"""The copy of a sweep's file in its folder, a whole sweep file itself."""
ORIGIN: Final = "sweep.json"
INDICES: Final = "indices.csv"
_SILENT: Final = Progress()


def sweep(
    file: Path | Mapping[str, Any],
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
) -> dict[str, Any]:
    """Do the sweep of a file, or of the same content as a mapping, into ``out``; where that holds it already, go on.

    Parameters
    ----------
    file : paths in it count from its folder, in a mapping from the working directory
    workers : processes; None for one a core
    scheduler : address of a Dask scheduler, whose workers see ``out`` and the recordings under the same paths
    cluster : a Dask cluster to start

    Returns counts of the runs, by how they ended.  Raises InputError for a mistake in the file, before the first run,
    and for a folder that holds another sweep; SssiError for a package or a scheduler that is missing.
    """
    read = read_sweep(file) if isinstance(file, Path) else sweep_from(file, Path("sweep"))
    return _go_on(read, out, workers, scheduler, cluster, progress)


def resume(
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
) -> dict[str, Any]:
    """Go on with the sweep in ``out``: runs that have ended are not done again.  See ``sweep``."""
    _origin(out)
    return _go_on(read_sweep(out / FILE), out, workers, scheduler, cluster, progress)


def retry(
    out: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    cluster: Cluster | None = None,
    progress: Progress = _SILENT,
) -> dict[str, Any]:
    """Do the runs of the sweep in ``out`` that are not done once more, those that failed too.  See ``sweep``."""
    _origin(out)
    return _go_on(read_sweep(out / FILE), out, workers, scheduler, cluster, progress, again=True)


def status(out: Path) -> dict[str, Any]:
    """How far the sweep in ``out`` is: counts, rate (runs a minute) and time left (s), and whether it is running.

    Raises InputError where there is none.
    """
    origin = _origin(out)
    records, repeated = last_records(out)
    found = _counts(origin, records, repeated)
    running = is_locked(out)
    rate = _rate(records)
    left = found["left"] / rate if running and rate else None
    return found | {"running": running, "per_minute": 60.0 * rate if rate else None, "time_left_s": left}


def _go_on(
    file: SweepFile,
    out: Path,
    workers: int | None,
    scheduler: str | None,
    cluster: Cluster | None,
    progress: Progress,
    *,
    again: bool = False,
) -> dict[str, Any]:
    pool = pool_of(scheduler, cluster)
    plan = planned(file)
    out = out.resolve()
    with folder_lock(out):
        origin = _begun(plan, out)
        gather(out)
        records, _ = last_records(out)
        todo = _to_do(plan, records, again)
        with progress.stage("sweep") as stage:
            told = _Teller(stage, len(todo))
            do_all(out, plan.job, todo, pool, min(workers or os.cpu_count() or 1, max(1, len(todo))), told)
        with progress.stage("tables"):
            gather(out)
            tidy(out)
            records, repeated = last_records(out)
            _told(out, plan, write_tables(out, plan, records))
    return _counts(origin, records, repeated)


def _told(out: Path, plan: Plan, table: pd.DataFrame) -> None:
    """Leave the indices and the page of the sweep's table."""
    indices = indices_of(plan, table)
    write_atomically(out / INDICES, indices.to_csv(index=False, lineterminator="\n"))
    write_atomically(out / PAGE, render_sweep(plan, table, indices))


def _begun(plan: Plan, out: Path) -> dict[str, Any]:
    """What the folder says of its sweep; written first where there is none."""
    origin = {
        "format": 1,
        "name": plan.file.name,
        "rows": len(plan.keys),
        "runs": len(set(plan.keys)),
        **origin_of(plan),
    }
    path = out / ORIGIN
    if not path.exists():
        write_atomically(out / FILE, tomli_w.dumps(plan.file.portable(out)))
        write_atomically(path, to_json(origin))
        return origin
    found = _origin(out)
    if found["identity"] != plan.job.identity:
        raise InputError(out, "", "the folder holds another sweep", "choose another folder with --out")
    if not same_versions(plan, found):
        problem = "the sweep was begun with other versions of the program or its packages"
        raise InputError(path, "versions", problem, "install those, or begin anew in another folder")
    return found


def _origin(out: Path) -> dict[str, Any]:
    path = out / ORIGIN
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise InputError(out, "", "the folder holds no sweep", "give the --out of a sweep") from None
    if not isinstance(found, dict) or found.get("format") != 1:
        raise InputError(path, "format", "not a sweep of format 1", "begin anew with this version")
    return found


def _to_do(plan: Plan, records: Mapping[str, Record], again: bool) -> list[Run]:
    """The runs that have not ended and, to be done ``again``, those that failed, with the number of the attempt."""
    todo = []
    for run in plan.runs():
        record = records.get(run.key)
        if record is None:
            todo.append(run)
        elif again and record["status"] != DONE:
            todo.append(replace(run, attempt=record["attempt"] + 1))
    return todo


class _Teller:
    """Says how far it is: done, failed, rate, time left."""

    def __init__(self, stage: Stage, count: int) -> None:
        self.stage, self.count = stage, count
        self.ended: Counter[str] = Counter()
        self.begin = clock.monotonic()

    def __call__(self, _run: Run, status: str) -> None:
        self.ended[status] += 1
        ended = self.ended.total()
        rate = ended / max(clock.monotonic() - self.begin, 1e-9)
        left = (self.count - ended) / rate
        failed = ended - self.ended[DONE]
        self.stage.advance(
            ended / self.count,
            f"{ended} of {self.count} runs, {failed} failed, {60.0 * rate:.0f} a minute, {_duration(left)} left",
        )


def _counts(origin: Mapping[str, Any], records: Mapping[str, Record], repeated: int) -> dict[str, Any]:
    ended = Counter(record["status"] for record in records.values())
    return {
        "name": origin["name"],
        "runs": origin["runs"],
        **{word: ended[word] for word in STATUSES},
        "left": origin["runs"] - len(records),
        "repeated": repeated,
    }


def _rate(records: Mapping[str, Record]) -> float | None:
    """Runs a second, over the last hundred or the whole."""
    ends = sorted(record["end"] for record in records.values())[-100:]
    if len(ends) < 2 or ends[-1] <= ends[0]:
        return None
    return float((len(ends) - 1) / (ends[-1] - ends[0]))


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"
