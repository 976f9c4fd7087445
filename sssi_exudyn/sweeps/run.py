"""One run of a sweep, in any process: build its model, simulate or fit it, write its record."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

from sssi_exudyn.bodies.ski.ski import Ski, ski_named
from sssi_exudyn.contact.registry import term_named
from sssi_exudyn.core.errors import InputError, SimulationDiverged, SssiError
from sssi_exudyn.fitting.estimate import estimate, is_estimated
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import fit_few_sensors
from sssi_exudyn.fitting.first_fit import fit, problem_of
from sssi_exudyn.fitting.misfit import believable_estimate, believable_fit
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.plugins import use_plugins
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.runtime.plugins import require
from sssi_exudyn.runtime.posix import pages
from sssi_exudyn.runtime.provenance import versions
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import Prepared, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.turns.steady_turn import NoSteadyTurn, edges_of, start_rolling, steady_turn
from sssi_exudyn.sweeps.outputs import (
    AnyRun,
    Figures,
    figures_of_fit,
    figures_of_run,
    figures_of_turn,
    series_of_run,
)
from sssi_exudyn.sweeps.parameters import change, change_turn, is_shape, numbers_of
from sssi_exudyn.sweeps.plan import SKI, Job, SweepRun, fingerprint_ski
from sssi_exudyn.sweeps.records import DONE, Record, claim, is_recorded, write_record, write_series
from sssi_exudyn.sweeps.what_ifs import answer_figures

BUSY = "busy"
Shape = tuple[tuple[str, float | str], ...]
"""Numbers for which ``is_shape``, by name."""
_KEPT = 4
"""Number of models kept for the next runs; the tables of a run of 15 s take 3 MB."""


def perform_run(folder: Path, job: Job, run: SweepRun) -> str:
    """Do the run and write its record into ``folder``, unless it is there, and return its status.

    The status is ``BUSY`` where another process is doing the run.

    Raises InputError where this process does not see the sweep's folder or sees other recordings, SssiError for
    other versions of the program than the sweep began with.
    """
    _check_process(folder, job)
    if job.task == "turn":
        _read_ski(job.recordings[run.recording], job.hashes[run.recording])
    elif job.task != "whatif":
        _read_recording(job.recordings[run.recording], job.hashes[run.recording])
    return do_once(folder, run, lambda: record_of(job, run, folder))


def do_once(folder: Path, run: SweepRun, do: Callable[[], Record]) -> str:
    """Do a run unless it is recorded, write its record into ``folder``, and return its status.

    The status is ``BUSY`` where another process is doing the run.
    """
    with claim(folder, run.row) as mine:
        if not mine:
            return BUSY
        if is_recorded(folder, run.key, run.attempt):
            return DONE
        record = do()
        write_record(folder, record)
    return record.status


def record_of(job: Job, run: SweepRun, folder: Path) -> Record:
    """Do the run and return its record, whatever happens in it.  Its series is written into ``folder`` first."""

    def compute(figures: Figures) -> None:
        computed, simulated = _compute(job, run)
        figures |= computed
        if simulated is not None and job.series:
            frame = series_of_run(simulated)
            write_series(folder, run.key, pa.Table.from_pandas(frame, preserve_index=False))

    return record_computed(folder, run, compute)


def record_computed(folder: Path, run: SweepRun, compute: Callable[[Figures], None]) -> Record:
    """Call ``compute`` and return the run's record, whatever happens in it.

    ``compute`` fills in the run's figures; what it has put there before an error is kept.  Raises InputError where
    ``folder`` cannot be written.
    """
    start, begin, busy = clock.time(), clock.perf_counter(), clock.process_time()
    status, message = DONE, ""
    figures: Figures = {}
    try:
        compute(figures)
    except (SimulationDiverged, NoSteadyTurn) as error:
        status, message = "diverged", str(error)
    except InputError as error:
        if error.file.startswith(str(folder)):  # a full disk is no property of the run
            raise
        status, message = "failed", str(error)
    except SssiError as error:
        status, message = "failed", str(error)
    except Exception as error:  # noqa: BLE001 - a sweep goes on; the table gives the error
        status, message = "failed", f"{type(error).__name__}: {error}"
    return Record(
        key=run.key,
        attempt=run.attempt,
        status=status,
        error=message,
        figures=figures,
        wall_s=clock.perf_counter() - begin,
        cpu_s=clock.process_time() - busy,
        worker=os.getpid(),
        memory_MB=_resident(),
        begin=start,
        end=clock.time(),
    )


def crash_record(run: SweepRun) -> Record:
    """Return the record of a run whose worker died of it."""
    now = clock.time()
    return Record(
        key=run.key,
        attempt=run.attempt,
        status="crashed",
        error="the process that ran it died, alone and more than once",
        figures={},
        wall_s=None,
        cpu_s=None,
        worker=None,
        memory_MB=None,
        begin=now,
        end=now,
    )


@lru_cache(maxsize=1)
def _check_process(folder: Path, job: Job) -> None:
    """Raise where this process cannot do the sweep's runs; see ``perform_run``."""
    if not folder.is_dir():
        raise InputError(folder, "", "a worker does not see the sweep's folder", "put it where all workers see it")
    differing = [f"{name} {theirs}" for name, theirs in job.versions if versions().get(name) != theirs]
    if differing:
        raise SssiError(f"a worker has other versions than the sweep began with: {', '.join(differing)}")
    use_plugins(plugin.source for plugin in job.plugins if plugin.source)  # that the user named where the sweep began
    require(job.plugins, folder / "sweep.toml")


def _compute(job: Job, run: SweepRun) -> tuple[Figures, AnyRun | None]:
    """Return the figures of the run, and the simulation where it is one."""
    if job.task == "whatif":
        place = job.recordings[run.recording], job.hashes[run.recording]
        return answer_figures(*place, dict(run.values), job.keep, job.duration), None
    numbers = numbers_of(dict(run.values))
    if job.task == "turn":
        ski, case = change_turn(_read_ski(job.recordings[run.recording], job.hashes[run.recording]), numbers)
        return figures_of_turn(steady_turn(case, start_rolling(edges_of(ski)))[0]), None
    shape = tuple((name, value) for name, value in numbers.items() if is_shape(name))
    recording, motion, model = _changed_model(job, run.recording, shape)
    rest: dict[str, Any] = {name: value for name, value in numbers.items() if not is_shape(name)}
    model = model.with_values(rest)
    if job.task == "fit":
        if recording.completed is not None:
            few = fit_few_sensors(recording, motion, model, job.method)
            return figures_of_fit(believable_fit(few.fitted, recording, few.unled_fit)), None
        if job.method == "joint" and job.model is None:
            model = on_snow_surface(model, recording, motion)
        problem, full = problem_of(recording, motion, model, job.method), job.tier == "full"
        if is_estimated(recording, job.method):
            return figures_of_fit(believable_estimate(estimate(problem, recording, motion, full=full))), None
        fitted = fit(problem, motion, job.method, full=full)
        return figures_of_fit(believable_fit(fitted, recording)), None
    simulated: AnyRun
    if job.tier == "full":
        simulated = simulate(model, motion)
    else:
        simulated = simulate_reduced(model, _tables(job, run.recording, shape))
    return figures_of_run(simulated, model, recording), simulated


@lru_cache(maxsize=_KEPT)
def _changed_model(job: Job, number: int, shape: Shape) -> tuple[Recording, Motion, Model]:
    recording, motion = _read_recording(job.recordings[number], job.hashes[number])
    base = None if job.model is None else read_model(Path(job.model))
    terms = tuple(term_named(name)(**dict(values)) for name, values in job.terms)
    recording, motion, model = change(recording, motion, base, terms, dict(shape))
    model = model.with_heading(job.heading)
    if job.duration is not None:
        motion = replace(motion, stop=min(motion.stop, motion.start + job.duration))
    return recording, motion, model


@lru_cache(maxsize=_KEPT)
def _tables(job: Job, number: int, shape: Shape) -> Prepared:
    _, motion, model = _changed_model(job, number, shape)
    return prepare(model, motion)


@lru_cache(maxsize=_KEPT)
def _read_recording(folder: str, digest: str) -> tuple[Recording, Motion]:
    recording = read_recording(Path(folder))
    if fingerprint(recording.hashes) != digest:
        raise InputError(recording.folder, "", "the recording has changed since the sweep began", "begin a new sweep")
    return recording, motion_from_recording(recording)


@lru_cache(maxsize=_KEPT)
def _read_ski(name: str, digest: str) -> Ski:
    if fingerprint({SKI: fingerprint_ski(name)}) != digest:
        raise InputError(name, "", "the ski has changed since the sweep began", "begin a new sweep")
    return ski_named(name, Path(), "sweep", "skis")


def _resident() -> float | None:
    """Return the memory of this process now, MB; None where the system does not report it."""
    sizes = pages()
    return None if sizes is None else sizes[1] / 1e6
