"""One run of a sweep, in whatever process: build it, do it, keep what came out."""

from __future__ import annotations

import os
import time as clock
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

from sssi_exudyn.core.errors import InputError, SimulationDiverged, SssiError
from sssi_exudyn.fitting.fit import fit, problem_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.runtime.provenance import versions
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import Prepared, prepare, simulate_reduced
from sssi_exudyn.sweeps.outputs import AnyRun, Figures, figures_of_fit, figures_of_run, series_of_run
from sssi_exudyn.sweeps.parameters import changed, is_shape, numbers_of
from sssi_exudyn.sweeps.plan import Job, Run
from sssi_exudyn.sweeps.records import DONE, Record, claimed, is_recorded, write_record, write_series

BUSY = "busy"
_KEPT = 4
"""Bodies kept for the next runs; a 15 s run's tables take 3 MB."""


def performed(folder: Path, job: Job, run: Run) -> str:
    """Do the run and keep its record in ``folder``, unless that has been done; its status, or ``BUSY`` where another
    process is at it.

    Raises InputError where this process does not see the sweep's folder or its recordings as they were, SssiError for
    other versions of the program than the sweep began with.
    """
    _check_here(folder, job)
    _recorded(job.recordings[run.recording], job.hashes[run.recording])
    with claimed(folder, run.row) as mine:
        if not mine:
            return BUSY
        if is_recorded(folder, run.key, run.attempt):
            return DONE
        begin = clock.time()
        record = outcome_of(job, run, folder)
        record["begin"], record["end"] = begin, clock.time()
        write_record(folder, record)
    return str(record["status"])


def outcome_of(job: Job, run: Run, folder: Path) -> Record:
    """Do the run; its record, whatever happens in it.  A series is kept in ``folder`` first."""
    begin, busy = clock.perf_counter(), clock.process_time()
    status, told = DONE, ""
    figures: Figures = {}
    try:
        figures, simulated = _done(job, run)
        if simulated is not None and job.series:
            frame = series_of_run(simulated)
            write_series(folder, run.key, pa.Table.from_pandas(frame, preserve_index=False))
    except SimulationDiverged as error:
        status, told = "diverged", str(error)
    except InputError as error:
        if error.file.startswith(str(folder)):  # a full disk is no property of the run
            raise
        status, told = "failed", str(error)
    except SssiError as error:
        status, told = "failed", str(error)
    except Exception as error:  # noqa: BLE001 - a sweep goes on; the table tells what happened
        status, told = "failed", f"{type(error).__name__}: {error}"
    return {
        "key": run.key,
        "attempt": run.attempt,
        "status": status,
        "error": told,
        "figures": figures,
        "wall_s": clock.perf_counter() - begin,
        "cpu_s": clock.process_time() - busy,
        "worker": os.getpid(),
        "memory_MB": _resident() / 1e6,
    }


def crashed(run: Run) -> Record:
    """The record of a run whose worker died of it."""
    now = clock.time()
    return {
        "key": run.key,
        "attempt": run.attempt,
        "status": "crashed",
        "error": "the process that ran it died, alone and more than once",
        "figures": {},
        "wall_s": None,
        "cpu_s": None,
        "worker": None,
        "memory_MB": None,
        "begin": now,
        "end": now,
    }


@lru_cache(maxsize=1)
def _check_here(folder: Path, job: Job) -> None:
    """Raise where this process is not one for the sweep; see ``performed``."""
    if not folder.is_dir():
        raise InputError(folder, "", "a worker does not see the sweep's folder", "put it where all workers see it")
    differing = [f"{name} {theirs}" for name, theirs in job.versions if versions().get(name) != theirs]
    if differing:
        raise SssiError(f"a worker has other versions than the sweep began with: {', '.join(differing)}")


def _done(job: Job, run: Run) -> tuple[Figures, AnyRun | None]:
    """Figures of the run, and what was simulated."""
    numbers = numbers_of(dict(run.values))
    shape = tuple((name, value) for name, value in numbers.items() if is_shape(name))
    recording, motion, model = _bodies(job, run.recording, shape)
    rest: dict[str, Any] = {name: value for name, value in numbers.items() if not is_shape(name)}
    model = model.with_values(rest)
    if job.task == "fit":
        problem = problem_of(recording, motion, model, job.method)
        return figures_of_fit(fit(problem, motion, job.method, full=job.tier == "full")), None
    simulated: AnyRun
    if job.tier == "full":
        simulated = simulate(model, motion)
    else:
        simulated = simulate_reduced(model, _prepared(job, run.recording, shape))
    return figures_of_run(simulated, model, recording), simulated


@lru_cache(maxsize=_KEPT)
def _bodies(job: Job, number: int, shape: tuple[tuple[str, float | str], ...]) -> tuple[Recording, Motion, Model]:
    recording, motion = _recorded(job.recordings[number], job.hashes[number])
    base = None if job.model is None else read_model(job.model)
    recording, motion, model = changed(recording, motion, base, job.terms, dict(shape))
    if job.duration is not None:
        motion = replace(motion, stop=min(motion.stop, motion.start + job.duration))
    return recording, motion, model


@lru_cache(maxsize=_KEPT)
def _prepared(job: Job, number: int, shape: tuple[tuple[str, float | str], ...]) -> Prepared:
    _, motion, model = _bodies(job, number, shape)
    return prepare(model, motion)


@lru_cache(maxsize=_KEPT)
def _recorded(folder: Path, digest: str) -> tuple[Recording, Motion]:
    recording = read_recording(folder)
    if fingerprint(recording.hashes) != digest:
        raise InputError(folder, "", "the recording has changed since the sweep began", "begin a new sweep")
    return recording, motion_from_recording(recording)


def _resident() -> float:
    """Bytes of memory that this process has now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
