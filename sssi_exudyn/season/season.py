"""A season: every recording of a folder is fitted into a result of its own; none is lost and none done twice.

The runs go through the workers of sweeps.  A run is done again only where its files, the settings or the versions have
changed, which its key tells.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.contact.registry import term_named
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.io.files import sha256
from sssi_exudyn.io.typed import convert, read_json
from sssi_exudyn.io.writing import folder_lock, to_json, write_atomically
from sssi_exudyn.plugins import use_plugins
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.runtime.plugins import require
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance, versions
from sssi_exudyn.runtime.threads import cores_used
from sssi_exudyn.season.descent import descent_figures, points_of, track_of
from sssi_exudyn.season.joint_friction import JointFriction
from sssi_exudyn.season.listed import listed_tracks
from sssi_exudyn.season.page import PAGE, render_season
from sssi_exudyn.season.plan import Options, SeasonJob, SeasonPlan, plan_season
from sssi_exudyn.season.shared_descents import compare_descents
from sssi_exudyn.season.table import season_table, write_tables
from sssi_exudyn.sweeps.outputs import Figures
from sssi_exudyn.sweeps.plan import SweepRun
from sssi_exudyn.sweeps.records import Record, gather, last_records, tidy, write_series
from sssi_exudyn.sweeps.run import do_once, record_computed
from sssi_exudyn.sweeps.workers.pools import CREDENTIALS, Pool, this_process
from sssi_exudyn.sweeps.workers.scheduler import Countdown, Work, do_all

ORIGIN: Final = "season.json"
_REPEATED: Final = ("crashed",)
"""Ends of a run that may be an accident of the machine: the next command tries it again."""

Perform = Callable[[Path, bytes], str]
"""Function of a worker process: see ``sweeps.workers.scheduler.Work``."""
RunOne = Callable[[Recording, Path, Options, tuple[Term, ...]], None]
"""Function that makes the result of one recording in a folder."""


@dataclass(frozen=True)
class Season:
    """``season.json``: the runs by status, hashes of the recordings, versions and settings.

    runs : by how they ended, those that are left under "left"
    descents : what the runs of each descent show together
    """

    format: int
    runs: dict[str, int]
    provenance: Provenance
    descents: tuple[JointFriction, ...] = ()


@dataclass(frozen=True)
class Where:
    """Where runs are done: the pool of workers, and their number, None for one for each core."""

    pool: Pool
    workers: int | None


def run_season(
    folder: Path, out: Path, options: Options, terms: Sequence[Term], perform: Perform, where: Where, progress: Progress
) -> Season:
    """Fit every recording below ``folder`` into ``out``, or continue there, and write table and page.

    Raises InputError where there is no recording, or ``out`` cannot be written.
    """
    folder, out = folder.resolve(), out.resolve()
    with progress.stage("plan"):
        plan = plan_season(folder, out, options, terms)
    for plugin in plan.job.plugins if where.pool is not this_process else ():
        if not plugin.source:
            problem = f"worker processes cannot load the law of {plugin.name!r}, which is in no file of its own"
            raise InputError("terms", "", problem, "put it into a plug-in's file, or give workers=1 in Python")
    with folder_lock(out):
        for stale in out.glob(f"{CREDENTIALS}*"):  # of a season that was killed
            shutil.rmtree(stale, ignore_errors=True)
        gather(out)
        runs = _runs_left(out, plan)
        with progress.stage("season") as stage:
            count = min(cores_used(where.workers), max(1, len(runs)))
            work = Work(out, plan.job, perform, "the same command")
            do_all(work, runs, where.pool, count, Countdown(stage, len(runs)))
        with progress.stage("tables"):
            gather(out)
            tidy(out)
            return _write(folder, out, plan)


def perform_run(folder: Path, job: SeasonJob, run: SweepRun, run_one: RunOne) -> str:
    """Do a run in a worker process, write its record into the season's folder, and return its status.

    Raises InputError where this process does not see that folder, SssiError for other versions of the program.
    """
    if not folder.is_dir():
        raise InputError(folder, "", "a worker does not see the season's folder", "put it where all workers see it")
    differing = [f"{name} {theirs}" for name, theirs in job.versions if versions().get(name) != theirs]
    if differing:
        raise SssiError(f"a worker has other versions than the season began with: {', '.join(differing)}")
    use_plugins(plugin.source for plugin in job.plugins if plugin.source)
    require(job.plugins, folder / ORIGIN)

    def compute(figures: Figures) -> None:
        recording = read_recording(job.folders[run.recording])
        figures |= descent_figures(recording)
        track = track_of(recording)
        if track is not None:
            write_series(folder, run.key, track)
        terms = tuple(term_named(name)(**dict(numbers)) for name, numbers in job.options.terms)
        run_one(recording, folder / job.names[run.recording], job.options, terms)

    return do_once(folder, run, lambda: record_computed(folder, run, compute))


def read_season(out: Path) -> Season:
    """Read what a season's folder says of itself.  Raises InputError where there is no season."""
    path = out / ORIGIN
    if not path.exists():
        raise InputError(out, "", "the folder holds no season", "give the --out of sssi run of a folder of recordings")
    season = read_json(path, Season)
    if season.format != 1:
        raise InputError(path, "format", "not a season of format 1", "run again with this version")
    return season


def _runs_left(out: Path, plan: SeasonPlan) -> list[SweepRun]:
    """Return the runs that have not ended with these inputs, and those that may have ended by accident."""
    records, _ = last_records(out)
    runs = []
    for run in plan.runs():
        record = records.get(run.key)
        if record is None:
            runs.append(run)
        elif record.status in _REPEATED:
            runs.append(replace(run, attempt=record.attempt + 1))
    return runs


def _write(folder: Path, out: Path, plan: SeasonPlan) -> Season:
    """Write table, page and ``season.json``, and return the last."""
    records, _ = last_records(out)
    listed = {f"{name}.csv": sha256(path) for name, path in listed_tracks(folder)}
    inputs = dict(zip(plan.job.names, plan.digests, strict=True)) | listed
    origin = provenance(inputs, plan.job.options.settings, seed=0)
    table, tracks = season_table(folder, out, plan, records)
    write_tables(out, table, origin)
    season = convert({"format": 1, "runs": _count(plan, records), "provenance": origin}, Season)
    season = replace(season, descents=compare_descents(table, tracks))
    points = {name: points_of(track) for name, track in tracks.items()}
    write_atomically(out / PAGE, render_season(table, points, season.descents, season.provenance))
    write_atomically(out / ORIGIN, to_json(season))
    return season


def _count(plan: SeasonPlan, records: dict[str, Record]) -> dict[str, Any]:
    ended = Counter(records[key].status for key in plan.keys if key in records)
    statuses = ("done", "diverged", "failed", "crashed")
    return (
        {"runs": len(plan.keys)} | {name: ended[name] for name in statuses} | {"left": len(plan.keys) - ended.total()}
    )
