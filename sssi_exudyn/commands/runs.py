"""What the command line does, as functions: each reads a recording, works, and leaves a folder of plain files.

All raise InputError for bad input and SimulationDiverged when the solver gives up.  A command that was interrupted
goes on where it was when it is given again: every simulation of a fit is kept in the result's ``cache`` folder until
it is done.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from sssi_exudyn.biomechanics import biomechanics, labelled, summary_of
from sssi_exudyn.bodies.muscles import muscles_table
from sssi_exudyn.bodies.ski import ski_to_table
from sssi_exudyn.bodies.ski_identify import identify_ski
from sssi_exudyn.bodies.ski_measurements import read_measurements
from sssi_exudyn.cache import Cache
from sssi_exudyn.contact.backend import Backend
from sssi_exudyn.contact.registry import terms_table
from sssi_exudyn.errors import InputError, SimulationDiverged
from sssi_exudyn.fitting.fit import Fitted, Method, problem_of
from sssi_exudyn.fitting.fit import fit as fit_problem
from sssi_exudyn.fitting.observe import mended
from sssi_exudyn.fitting.recorded import model_of
from sssi_exudyn.frames import Array, slope_to_enu
from sssi_exudyn.importing import Answers, import_recording
from sssi_exudyn.inspection import Inspection, inspect_recording, plot_inspection
from sssi_exudyn.model import Model, read_model
from sssi_exudyn.motion import Motion, motion_from_recording, round_trip_table
from sssi_exudyn.opensim_files import opensim_texts
from sssi_exudyn.progress import Progress
from sssi_exudyn.provenance import provenance
from sssi_exudyn.recording import Recording, read_recording
from sssi_exudyn.report import render, render_pdf, write_run
from sssi_exudyn.result import SimulationResult
from sssi_exudyn.result_folder import (
    DIAGNOSIS,
    OPENSIM,
    REPORT,
    SUMMARY,
    amend_result,
    complete_summary,
    locked,
    read_report,
    said_clearly,
    to_json,
    write_atomically,
)
from sssi_exudyn.simulation import simulate as simulate_model
from sssi_exudyn.validation.benchmark import base_of, run_benchmark
from sssi_exudyn.validation.day import day_to_dict, weigh_day
from sssi_exudyn.validation.day_page import day_page, sentence_of_day
from sssi_exudyn.validation.diagnosis import Diagnosis, diagnosis_to_dict
from sssi_exudyn.validation.diagnosis import diagnose as find_missing
from sssi_exudyn.validation.diagnosis_page import diagnosis_section
from sssi_exudyn.validation.few_sensors_page import counted
from sssi_exudyn.validation.known import compared, read_truth
from sssi_exudyn.validation.measured import measured_table
from sssi_exudyn.validation.muscle_page import muscles_section
from sssi_exudyn.validation.muscle_run import figures as muscle_figures
from sssi_exudyn.validation.muscle_run import muscles_of, storages, with_muscles
from sssi_exudyn.validation.page import Section, added
from sssi_exudyn.validation.run import Run, read_run
from sssi_exudyn.validation.validate import judged

_CACHE = "cache"
_SILENT = Progress()


def inspect(folder: Path, picture: Path | None = None) -> Inspection:
    """What is in a recording: durations, rates, gaps, overlaps, estimated slope and heading; drawn to ``picture`` if
    given.
    """
    recording = read_recording(folder)
    if picture is not None:
        plot_inspection(recording, picture)
    return inspect_recording(recording)


def import_files(files: Sequence[Path], out: Path, answers: Answers) -> Inspection:
    """Make a recording's folder ``out`` out of files of other formats; what is in it."""
    return inspect_recording(import_recording(files, out, answers))


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
    with locked(out):
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
    with locked(out):
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


def diagnose(folder: Path, out: Path, *, progress: Progress = _SILENT) -> dict[str, Any]:
    """Find what physics was left out, or which instrument is at fault, and leave the extended model's run in ``out``;
    what ``diagnosis.json`` holds.
    """
    told = diagnosis_to_dict(_diagnosed(folder, out, progress)[1])
    shutil.rmtree(out / _CACHE, ignore_errors=True)
    return told


def diagnose_day(folders: Sequence[Path], out: Path, *, progress: Progress = _SILENT) -> dict[str, Any]:
    """Diagnose several runs of one day, each into a folder of its recording's name in ``out``, and weigh them together;
    what ``out``'s ``day.json`` holds.

    Raises InputError where two folders have the same name.
    """
    names = [folder.resolve().name for folder in folders]
    for name in names:
        if names.count(name) > 1:
            raise InputError(out / name, "", "two recordings would leave their results here", "rename one's folder")
    with locked(out):
        found = {name: _diagnosed(folder, out / name, progress) for folder, name in zip(folders, names, strict=True)}
        with progress.stage("weigh together"):
            weighed = weigh_day([diagnosis.own() for _, diagnosis in found.values()])
        sentence = sentence_of_day(weighed, len(names), found[names[0]][1].model)
        hashes = {f"{name}/{file}": made for name, (files, _) in found.items() for file, made in files.items()}
        origin = provenance(hashes, {"command": "diagnose", "recordings": names}, seed=0)
        day = day_to_dict(names, weighed, sentence) | {"provenance": origin}
        write_atomically(out / "day.json", to_json(day))
        write_atomically(out / "report.html", day_page(names, weighed, sentence))
        for name in names:  # kept until now, so that an interrupted day goes on where it was
            shutil.rmtree(out / name / _CACHE, ignore_errors=True)
        return day


def _diagnosed(folder: Path, out: Path, progress: Progress) -> tuple[dict[str, str], Diagnosis]:
    """Diagnose into ``out``, the cache stays; hashes of what was read, and the answer."""
    with locked(out):
        recording, motion = _read(folder, progress)
        if recording.gps is None:
            raise InputError(
                folder / "recording.toml", "[gps]", "there is no GPS to hold the simulation against", "add it"
            )
        with progress.stage("diagnose") as stage:
            found = find_missing(
                recording, motion, model_of(recording, motion), cache=Cache(out / _CACHE), say=stage.advance
            )
        assert found.result is not None
        told = diagnosis_to_dict(found)
        errors = np.sqrt(np.diag(found.fit.covariance))
        parameters = {
            name: {"value": float(value), "se": float(se)}
            for p, value, se in zip(found.fit.parameters, found.fit.values, errors, strict=True)
            for name in p.names
        }
        figures = {
            "friction": {name: parameters[f"friction.{name}"] for name in ("mu_t", "mu_n")},
            "fit": {"method": "diagnosis", "converged": True, "parameters": parameters},
            "diagnosis": {key: told[key] for key in ("verdict", "sentence")},
        }
        settings = {"command": "diagnose"}
        section = diagnosis_section(found)
        _left(recording, motion, found.model, found.result, figures, out, settings, diagnosis=told, sections=[section])
        return recording.hashes, found


def diagnose_known(folder: Path, out: Path, *, progress: Progress = _SILENT) -> list[dict[str, str]]:
    """Diagnose every recording in ``folder`` that its ``truth.json`` names, each into a folder of its own in ``out``;
    what was said against what is hidden, a row a recording.  Those that ``out`` has already are not done again.
    """
    truth = read_truth(folder)
    said = {}
    for name in sorted(truth):
        made = out / name
        if not (made / DIAGNOSIS).is_file():
            diagnose(folder / name, made, progress=progress)
        said[name] = json.loads((made / DIAGNOSIS).read_text(encoding="utf-8"))
    return compared(truth, said)


def benchmark(
    recordings: Sequence[Path], out: Path, *, cases: int, seed: int, full: int, progress: Progress = _SILENT
) -> dict[str, Any]:
    """Judge the diagnosis blindly on ``cases`` made from the movements of ``recordings``, the first ``full`` of them
    with the full model, into ``out``; the scores.
    """
    with locked(out):
        bases = []
        for folder in recordings:
            recording, motion = _read(folder, progress)
            if recording.gps is None:
                raise InputError(folder / "recording.toml", "[gps]", "there is no GPS to start from", "add it")
            bases.append(base_of(recording, motion, model_of(recording, motion)))
        with progress.stage("benchmark") as stage:
            workers = os.cpu_count() or 1
            return run_benchmark(out, bases, count=cases, seed=seed, full=full, workers=workers, say=stage.advance)


def validate(folder: Path, result: Path, out: Path, *, progress: Progress = _SILENT) -> dict[str, Any]:
    """Judge the run in the folder ``result`` against the recording's GPS and insoles, into ``out``; the new summary."""
    with locked(out), progress.stage("validate"):
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
            told_apart = {**run.summary, "recording": f"{run.name} ({result.resolve().name})"}
            runs[index] = replace(run, summary=told_apart)
    write_atomically(out, render(runs) if out.suffix == ".html" else render_pdf(runs))
    return out


def terms() -> list[dict[str, str | float]]:
    """Every force term and its parameters."""
    return terms_table()


def muscles(folder: Path, out: Path | None, *, power: int = 2, progress: Progress = _SILENT) -> dict[str, Any]:
    """The forces of 284 muscles that made a run's joint moments; the summary, with its group ``muscles``.

    ``folder`` is a result, which gets them into its series, its page and files of its own, or is copied to ``out``
    first; or a recording, which is run into ``out`` first.
    """
    if not (folder / SUMMARY).is_file():
        if out is None:
            raise InputError(folder, "", "this is not a result", "give a result's folder, or a recording's and --out")
        run(folder, out, progress=progress)
    elif out is not None and out.resolve() != folder.resolve():
        with locked(folder), locked(out), said_clearly(out):
            shutil.copytree(folder, out, ignore=shutil.ignore_patterns(".*", _CACHE), dirs_exist_ok=True)
    made = out or folder
    with locked(made), progress.stage("muscles") as stage:
        result = read_run(made)
        found = muscles_of(result, made, power)
        stage.advance(1.0, f"{len(found.time)} samples")
        summary = {**result.summary, "muscles": muscle_figures(found)}
        texts = storages(found)
        page = read_report(made)
        if page is not None:
            texts[REPORT] = added(page, muscles_section(found, result.series))
        amend_result(made, summary, with_muscles(result.series, found), texts)
        return summary


def muscles_list() -> list[dict[str, str | float]]:
    """Every muscle of the skier with its figures, not scaled to anyone."""
    return muscles_table()


def identify(folder: Path, out: Path | None = None) -> list[dict[str, str | float]]:
    """What bench tests say of a ski, a row a number with its 95 % interval; the ski itself to the file ``out`` if
    given.
    """
    found = identify_ski(read_measurements(folder))
    if out is not None:
        write_atomically(out, tomli_w.dumps({out.stem: ski_to_table(found.ski)}))
    estimates = {
        "density": (found.density, "kg/m^3"),
        "young_modulus": (found.young_modulus, "Pa"),
        "damping_ratio": (found.damping_ratio, "1"),
        "frequency": (found.frequency, "Hz"),
    }
    return [
        {"name": name, "unit": unit, "value": each.value, "se": each.se, "low": each.low, "high": each.high}
        for name, (each, unit) in estimates.items()
    ]


def _read(folder: Path, progress: Progress) -> tuple[Recording, Motion]:
    with progress.stage("read") as stage:
        recording = read_recording(folder)
        motion = motion_from_recording(recording)
        stage.advance(1.0, f"{motion.stop - motion.start:.1f} s of {recording.name}")
    return recording, motion


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
    gps = recording.gps and mended(recording.gps, model)
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
