"""What the command line does, as functions: each reads a recording, works, and leaves a folder of plain files.

All raise InputError for bad input and SimulationDiverged when the solver gives up.  A command that was interrupted
goes on where it was when it is given again: every simulation of a fit is kept in the result's ``cache`` folder until
it is done.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sssi_exudyn.analysis.biomechanics import biomechanics, labelled, summary_of
from sssi_exudyn.commands.recordings import _read
from sssi_exudyn.contact.backends.backend import Backend
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.fitting.fit import Fitted, Method, problem_of
from sssi_exudyn.fitting.fit import fit as fit_problem
from sssi_exudyn.fitting.gps_observation import corrected_fixes
from sssi_exudyn.io.writing import folder_lock, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import round_trip_table
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.reports.few_sensors_section import counted
from sssi_exudyn.reports.html import Section
from sssi_exudyn.reports.report import render, render_pdf, write_run
from sssi_exudyn.results.folder import OPENSIM, complete_summary
from sssi_exudyn.results.measured import measured_table
from sssi_exudyn.results.opensim import opensim_texts
from sssi_exudyn.results.stored import Run, read_run
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.simulation.full import simulate as simulate_model
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.validation.agreement import judged

_CACHE = "cache"
_SILENT = Progress()


def simulate(
    folder: Path,
    out: Path,
    *,
    model: Path | None = None,
    backend: Backend = "fastest",
    progress: Progress = _SILENT,
) -> dict[str, Any]:
    """Simulate a recording once, with ``model`` (a ``model.toml``) or with default friction, into ``out``; its
    summary.
    """
    with folder_lock(out):
        recording, motion = _read(folder, progress)
        chosen = read_model(model) if model else model_of(recording, motion)
        settings = {"command": "simulate", "backend": backend}
        return _simulated(recording, motion, chosen, out, None, settings, progress, backend)


def fit(
    folder: Path,
    out: Path,
    *,
    method: Method = "joint",
    model: Path | None = None,
    progress: Progress = _SILENT,
) -> dict[str, Any]:
    """Fit friction (and, with ``joint``, start and heading) to the GPS track, into ``out``; the summary of the fitted
    run.  ``model`` (a ``model.toml``) has what else acts, such as what a diagnosis found.
    """
    with folder_lock(out):
        recording, motion = _read(folder, progress)
        if recording.gps is None:
            raise InputError(folder / "recording.toml", "[gps]", "there is no GPS to fit to", "add it, or use simulate")
        chosen = read_model(model) if model else model_of(recording, motion)
        problem = problem_of(recording, motion, chosen, method)
        with progress.stage("fit") as stage:
            fitted = fit_problem(problem, motion, method, cache=Cache(out / _CACHE), progress=stage.advance)
        sections: list[Section] = []
        figures: dict[str, Any] = {}
        if recording.completed is not None:
            with progress.stage("posture"):
                fitted, figures, section = counted(recording, motion, problem, fitted)
            sections.append(section)
        settings = {"command": "fit", "method": method}
        summary = _simulated(
            recording, motion, fitted.model, out, fitted, settings, progress, sections=sections, more=figures
        )
        shutil.rmtree(out / _CACHE, ignore_errors=True)
        return summary


def run(folder: Path, out: Path, *, progress: Progress = _SILENT) -> dict[str, Any]:
    """The whole chain: fit where there is a GPS, simulate, validate, report, into ``out``; the summary."""
    recording = read_recording(folder)
    if recording.gps is None:
        return simulate(folder, out, progress=progress)
    return fit(folder, out, progress=progress)


def validate(folder: Path, result: Path, out: Path, *, progress: Progress = _SILENT) -> dict[str, Any]:
    """Judge the run in the folder ``result`` against the recording's GPS and insoles, into ``out``; the new summary."""
    with folder_lock(out), progress.stage("validate"):
        recording = read_recording(folder)
        run = read_run(result)
        summary = complete_summary({**run.summary, **judged(run.series, recording.gps, recording.insoles)})
        measured = measured_table(recording.gps, recording.insoles)
        exported = {name: (result / name).read_text(encoding="utf-8") for name in OPENSIM if (result / name).is_file()}
        write_run(out, replace(run, summary=summary, measured=measured), opensim=exported)
        return summary


def report(results: Sequence[Path], out: Path) -> Path:
    """The report of one result folder, or of several side by side, in the file ``out``, a page (.html) or a document to
    print (.pdf); that file's path.  Raises InputError for another ending.
    """
    if out.suffix not in (".html", ".pdf"):
        raise InputError(out, "", "neither a page nor a document", "end its name in .html or .pdf")
    runs = [read_run(result) for result in results]
    names = [run.name for run in runs]
    for index, (run, result) in enumerate(zip(runs, results, strict=True)):
        if names.count(run.name) > 1:  # two results of one recording
            distinguished = {**run.summary, "recording": f"{run.name} ({result.resolve().name})"}
            runs[index] = replace(run, summary=distinguished)
    write_atomically(out, render(runs) if out.suffix == ".html" else render_pdf(runs))
    return out


def _simulated(
    recording: Recording,
    motion: Motion,
    model: Model,
    out: Path,
    fitted: Fitted | None,
    settings: dict[str, Any],
    progress: Progress,
    backend: Backend = "fastest",
    *,
    sections: Sequence[Section] = (),
    more: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Run the model and write all that a result folder holds; a run that diverges leaves what it has, and raises."""
    failure = None
    with progress.stage("simulate") as stage:
        try:
            result = simulate_model(model, motion, backend=backend, progress=stage.advance)
        except SimulationDiverged as error:
            if not isinstance(error.partial, SimulationResult):
                raise
            failure, result = error, error.partial
    figures = {
        "friction": _friction(model, fitted),
        "fit": _fit_figures(fitted),
        "diverged": None if failure is None else str(failure),
        **(more or {}),
    }
    summary = _left(recording, motion, model, result, figures, out, settings, sections=sections)
    if failure is not None:
        raise failure
    return summary


def _left(
    recording: Recording,
    motion: Motion,
    model: Model,
    result: SimulationResult,
    figures: dict[str, Any],
    out: Path,
    settings: dict[str, Any],
    *,
    diagnosis: dict[str, Any] | None = None,
    sections: Sequence[Section] = (),
) -> dict[str, Any]:
    """Write a result folder from a run; its summary."""
    result = result.moved(_height_of_track(recording, result))
    series = result.to_frame(slope_to_enu(model.inclination, model.fall_line_azimuth))
    found = biomechanics(result, model.skier.mass)
    series = labelled(series, found.turns)
    gps = recording.gps and corrected_fixes(recording.gps, model)
    summary = complete_summary(
        {
            "recording": recording.name,
            "friction": figures["friction"],
            **judged(series, gps, recording.insoles),
            "fit": figures["fit"],
            "solver": {"simulated_s": float(np.ptp(result.time)), **result.statistics},
            "energy": {
                "closure_percent": result.closure_percent,
                "work_J": {name: float(work[-1] - work[0]) for name, work in result.energy.items()},
            },
            **summary_of(result, found),
            "capture": {"round_trip": round_trip_table(motion)},
            "diverged": None,
            **figures,
            "notices": list(recording.notices),
            "provenance": provenance(recording.hashes, settings, seed=0),
        }
    )
    measured = measured_table(gps, recording.insoles)
    run = Run(summary, series, model, measured, motion.geometry, found.table)
    texts = opensim_texts(result, motion.geometry, model.inclination)
    write_run(out, run, diagnosis=diagnosis, opensim=texts, sections=sections)
    return summary


def _height_of_track(recording: Recording, result: SimulationResult) -> Array:
    """(3,) m along the slope's normal: heights count from the antenna's at the start, as in the fit
    (``seen_by_gps``).
    """
    if recording.gps is None or result.antenna is None:
        return np.zeros(3)
    return np.array([0.0, 0.0, -result.antenna[0, 2]])


def _friction(model: Model, fitted: Fitted | None) -> dict[str, Any]:
    friction = model.friction
    return {
        name: {
            "value": getattr(friction, name),
            "se": fitted.standard_error(f"friction.{name}") if fitted else None,
        }
        for name in ("mu_t", "mu_n")
    }


def _fit_figures(fitted: Fitted | None) -> dict[str, Any]:
    if fitted is None:
        return {}
    errors = fitted.standard_errors
    return {
        "method": fitted.method,
        "converged": fitted.optimum.converged,
        "reason": fitted.optimum.reason,
        "evaluations": fitted.optimum.evaluations,
        "evaluations_reduced": fitted.reduced.evaluations,
        "wall_s": fitted.wall,
        "parameters": {
            name: {"value": float(value), "se": float(se)}
            for name, value, se in zip(fitted.names, fitted.values, errors, strict=True)
        },
        "correlation": fitted.correlation.tolist(),
        "residual_noise": {"sigma_m": fitted.noise.sigma, "correlation_s": fitted.noise.correlation_time},
    }
