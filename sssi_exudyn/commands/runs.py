"""``sssi simulate``, ``fit``, ``run``, ``validate`` and ``report``: each reads folders and writes one.

All raise InputError for bad input and SimulationDiverged when the solver gives up.  A command that was interrupted
continues when it is given again: every simulation of a fit is kept in the result's ``cache`` folder until the fit ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.biomechanics import biomechanics, label_turns, residual_moment, turn_figures
from sssi_exudyn.analysis.boots import add_cuffs
from sssi_exudyn.commands.expected import expected_seconds
from sssi_exudyn.commands.recordings import SILENT, read_folder
from sssi_exudyn.contact.registry import check_together, combine_terms, is_carved, read_term
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.fitting.estimate import estimate, is_estimated
from sssi_exudyn.fitting.first_fit import Fitted, Method, problem_of
from sssi_exudyn.fitting.first_fit import fit as fit_problem
from sssi_exudyn.fitting.gps_observation import correct_fixes
from sssi_exudyn.fitting.more_parameters import seek_too
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.io.writing import folder_lock, to_plain, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.heading import HeadingMode, check_heading
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import round_trip_table
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.plugins import use_plugin
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.reports.report import render, render_folder, render_pdf, write_run
from sssi_exudyn.results.carving import carving_figures
from sssi_exudyn.results.draws import draws_table
from sssi_exudyn.results.folder import MEASURED, amend_result, read_series, read_summary
from sssi_exudyn.results.measured import measured_table
from sssi_exudyn.results.opensim import opensim_texts
from sssi_exudyn.results.posture import posture_figures, second_half_table
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.results.summary import (
    DiagnosisResult,
    Energy,
    Estimate,
    Fit,
    Friction,
    Posture,
    ResidualNoise,
    Summary,
    UncertaintyFigures,
    summary_from_dict,
)
from sssi_exudyn.results.uncertainty import uncertainty_figures
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.plugins import origin_of, origins_of
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.runtime.provenance import provenance
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces import Backend
from sssi_exudyn.simulation.full.run import simulate as simulate_model
from sssi_exudyn.simulation.reduced.balanced_lean import balance
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.sweeps.sweep import is_sweep
from sssi_exudyn.sweeps.sweep import render_folder as render_sweep_folder
from sssi_exudyn.terrain.profile import surface_figures
from sssi_exudyn.validation.agreement import judge_loads, judge_track
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.posture_uncertainty import second_half, shares_of

Snow = Literal["paper", "carving"]
SNOWS: Final[tuple[Snow, ...]] = ("paper", "carving")
"""What lies under the skis: friction at the foot as in the paper, or snow that edges cut."""
CACHE: Final = "cache"
"""Folder within a result that keeps what an interrupted command has computed."""


@dataclass(frozen=True)
class Made:
    """A run as a result's folder holds it.

    opensim : the texts of its files for OpenSim, by name
    """

    run: StoredRun
    opensim: Mapping[str, str]


def simulate(
    folder: Path,
    out: Path,
    *,
    model: Path | None = None,
    terms: Sequence[str] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    balanced: bool = False,
    backend: Backend = "fastest",
    progress: Progress = SILENT,
) -> Summary:
    """Simulate a recording once, with ``model`` (a ``model.toml``) or with default friction, into ``out``; its
    summary.  ``terms`` are names of force terms to add, ``snow`` is what lies under the skis, ``heading`` what holds
    the skier's heading there (the model's where it is left out).  ``balanced``: there the whole posture leans so that
    the skier is in balance.
    """
    added = terms_named(terms)
    made = make_simulation(
        folder,
        out,
        model=model,
        terms=added,
        snow=snow,
        heading=heading,
        balanced=balanced,
        backend=backend,
        progress=progress,
    )
    return made.run.summary


def make_simulation(
    source: Path | Recording,
    out: Path | None,
    *,
    model: Path | Model | None = None,
    terms: Sequence[Term] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    balanced: bool = False,
    backend: Backend = "fastest",
    progress: Progress = SILENT,
) -> Made:
    """``simulate`` of a recording or its folder; without ``out`` nothing is written."""
    with held(out):
        recording, motion = read_folder(source, progress)
        chosen = add_terms(_chosen(model) or model_of(recording, motion), (*_snow(snow), *terms))
        chosen = _with_heading(chosen, heading)
        settings: dict[str, Any] = {"command": "simulate", "backend": backend}
        settings |= {**_setting_of(snow), **_setting_of_heading(heading)}
        if balanced:
            if not is_carved(chosen.terms):
                problem = "the lean that balances a skier is sought on snow that edges cut"
                raise InputError("--balanced", "", problem, "add --snow carving, or leave it out")
            settings["balanced"] = True
            with progress.stage("balance") as stage:
                chosen = balance(chosen, motion, progress=stage.advance).model
        return _simulate_into(out, recording, motion, chosen, Outcome(settings), progress, backend)


def fit(
    folder: Path,
    out: Path,
    *,
    method: Method = "joint",
    model: Path | None = None,
    terms: Sequence[str] = (),
    parameters: Sequence[str] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    progress: Progress = SILENT,
) -> Summary:
    """Fit friction (and, with ``joint``, start and heading) to the GPS track, into ``out``; the summary of the fitted
    run.  ``model`` (a ``model.toml``) has what else acts, such as what a diagnosis found; ``terms`` are names of force
    terms to add, ``parameters`` numbers of terms to fit along, ``snow`` is what lies under the skis.  ``heading`` is
    that of the fit and of the fitted run, but that a free one is held by a spring while fitting.
    """
    return make_fit(
        folder,
        out,
        method=method,
        model=model,
        terms=terms_named(terms),
        parameters=parameters,
        snow=snow,
        heading=heading,
        progress=progress,
    ).run.summary


def make_fit(
    source: Path | Recording,
    out: Path | None,
    *,
    method: Method = "joint",
    model: Path | Model | None = None,
    terms: Sequence[Term] = (),
    parameters: Sequence[str] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    progress: Progress = SILENT,
) -> Made:
    """``fit`` of a recording or its folder; without ``out`` nothing is written, and an interrupted fit is lost."""
    with held(out):
        recording, motion = read_folder(source, progress)
        if recording.gps is None:
            raise InputError(recording.folder / FILE, "[gps]", "there is no GPS to fit to", "add it, or use simulate")
        chosen = add_terms(_chosen(model) or model_of(recording, motion), (*_snow(snow), *terms))
        chosen = _with_heading(chosen, heading)
        if is_carved(chosen.terms):
            _check_cutting(recording, method)
        if method == "joint" and model is None:
            chosen = on_snow_surface(chosen, recording, motion)
        problem = seek_too(problem_of(recording, motion, chosen, method), parameters)
        posture, predicted, uncertainty, draws = None, None, None, None
        cache = cache_in(out)
        work = "fit carving" if is_carved(chosen.terms) else "fit"
        with progress.stage("fit", expected_seconds(work, motion)) as stage:
            if is_estimated(recording, method):
                found = estimate(problem, recording, motion, cache=cache, progress=stage.advance)
                fitted, uncertainty = found.fitted, uncertainty_figures(found.posterior)
                draws = draws_table(found.posterior)
            else:
                fitted = fit_problem(problem, motion, method, cache=cache, progress=stage.advance)
        if recording.completed is not None:
            with progress.stage("posture"):
                shares = shares_of(fitted, problem, motion, recording.completed, recording.slope.sigma_inclination)
                half = second_half(fitted, problem, motion, recording.gps)
                posture = posture_figures(recording.completed, fitted.names, shares, half)
                predicted = second_half_table(half)
                fitted = replace(fitted, covariance=shares.covariance)
        settings = {"command": "fit", "method": method, **({"parameters": list(parameters)} if parameters else {})}
        settings |= {**_setting_of(snow), **_setting_of_heading(heading)}
        outcome = Outcome(settings, fit_figures(fitted), posture, predicted, uncertainty, draws)
        run_model = replace(fitted.model, heading=chosen.heading)
        made = _simulate_into(out, recording, motion, run_model, outcome, progress)
        if cache is not None:
            cache.remove()
        return made


def run(
    folder: Path,
    out: Path,
    *,
    terms: Sequence[str] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    progress: Progress = SILENT,
) -> Summary:
    """The whole chain: fit where there is a GPS, simulate, validate, report, into ``out``; the summary.  ``terms`` are
    names of force terms to add; ``snow`` and ``heading`` as in ``fit``.
    """
    return make_run(folder, out, terms=terms_named(terms), snow=snow, heading=heading, progress=progress).run.summary


def make_run(
    source: Path | Recording,
    out: Path | None,
    *,
    terms: Sequence[Term] = (),
    snow: Snow = "paper",
    heading: HeadingMode | None = None,
    progress: Progress = SILENT,
) -> Made:
    """``run`` of a recording or its folder; without ``out`` nothing is written."""
    recording = source if isinstance(source, Recording) else read_recording(source)
    make = make_simulation if recording.gps is None else make_fit
    return make(recording, out, terms=terms, snow=snow, heading=heading, progress=progress)


def _snow(snow: Snow) -> tuple[Term, ...]:
    """What is added to a model for that snow."""
    return (Carving(),) if snow == "carving" else ()


def _setting_of(snow: Snow) -> dict[str, str]:
    """For the result's origin; nothing for the paper's."""
    return {"snow": snow} if snow != "paper" else {}


def _with_heading(model: Model, mode: HeadingMode | None) -> Model:
    """The model with that heading, its own without one.  Raises InputError where its snow does not go with it."""
    held = model.with_heading(mode)
    check_heading(held.heading, held.terms, "--heading")
    return held


def _setting_of_heading(mode: HeadingMode | None) -> dict[str, str]:
    """For the result's origin; nothing where none was given."""
    return {} if mode is None else {"heading": mode}


def _check_cutting(recording: Recording, method: Method) -> None:
    """Raise InputError for a fit that edges that cut do not go with."""
    if method != "joint":
        raise InputError("--method", method, "the paper's method fits the paper's snow", "leave it out")
    if recording.completed is not None:
        problem = "edges that cut want a captured posture: what few sensors leave open is larger"
        raise InputError(recording.folder / FILE, "[motion]", problem, "leave --snow carving out")


def terms_named(names: Sequence[str]) -> tuple[Term, ...]:
    """Force terms by their names, with their default numbers.  Raises InputError for an unknown one."""
    return tuple(read_term(name, {}, "--term", "") for name in names)


def add_terms(model: Model, terms: Sequence[Term]) -> Model:
    """The model with further force terms, without those that they stand in the place of; classes of the caller's own
    are known by their names from here on, as their results are read back.

    Raises InputError where such a name is another term's, and for terms that do not act together.
    """
    for term in (*model.terms, *terms):
        if origin_of(type(term)) is not None:
            use_plugin(type(term))
    together = combine_terms(model.terms, terms)
    check_together(together, "--term")
    return replace(model, terms=together)


def held(out: Path | None) -> AbstractContextManager[None]:
    """The lock of a result's folder; of none where nothing is written."""
    return nullcontext() if out is None else folder_lock(out)


def cache_in(out: Path | None) -> Cache | None:
    """Where a result's folder keeps what an interrupted command has computed; None without a folder."""
    return None if out is None else Cache(out / CACHE)


def _chosen(model: Path | Model | None) -> Model | None:
    return read_model(model) if isinstance(model, Path) else model


def validate(folder: Path, result: Path, out: Path, *, progress: Progress = SILENT) -> Summary:
    """Compare the run in the folder ``result`` with the recording's GPS and insoles, into ``out``; the new summary."""
    with folder_lock(out), progress.stage("validate"):
        recording = read_recording(folder)
        series = read_series(result)
        groups = {
            "trajectory": judge_track(series, recording.gps),
            "pressure_ratio": judge_loads(series, recording.insoles),
        }
        figures = summary_from_dict(groups)  # so that figures which do not apply are null
        measured = measured_table(recording.gps, recording.insoles)
        amend_result(
            result,
            out,
            {name: getattr(figures, name) for name in groups},
            tables={MEASURED: measured},
            render=render_folder,
        )
        return read_summary(out)


def report(results: Sequence[Path], out: Path) -> Path:
    """The report of one result folder, or of several side by side, in the file ``out``, a page (.html) or a document to
    print (.pdf); of a sweep's folder its page.  Returns that file's path.  Raises InputError for another ending.
    """
    _check_ending(out)
    if is_sweep(results[0]):
        if len(results) > 1 or out.suffix != ".html":
            raise InputError(results[0], "", "this is a sweep", "give it alone, and a name that ends in .html")
        write_atomically(out, render_sweep_folder(results[0]))
        return out
    return write_report([(read_run(result), result.resolve().name) for result in results], out)


def write_report(results: Sequence[tuple[StoredRun, str]], out: Path) -> Path:
    """``report`` of results, each with a name that distinguishes it from others of the same recording."""
    _check_ending(out)
    names = [run.name for run, _ in results]
    runs = []
    for run, own in results:
        several = names.count(run.name) > 1  # results of one recording
        summary = replace(run.summary, recording=f"{run.name} ({own})") if several else run.summary
        runs.append(replace(run, summary=summary))
    write_atomically(out, render(runs) if out.suffix == ".html" else render_pdf(runs))
    return out


def _check_ending(out: Path) -> None:
    """Raise InputError where a report's file is neither a page nor a document."""
    if out.suffix not in (".html", ".pdf"):
        raise InputError(out, "", "neither a page nor a document", "end its name in .html or .pdf")


@dataclass(frozen=True)
class Outcome:
    """What a result holds besides its run.

    settings : what the user chose
    fit : how the fit ended, with the fitted parameters
    posture, second_half : of a recording of few sensors (``results.posture``)
    uncertainty, draws : what the fit leaves uncertain, and draws from it (``results.draws``)
    diagnosis : what a diagnosis found
    diverged : why the simulation stopped before the end
    """

    settings: Mapping[str, Any]
    fit: Fit = field(default_factory=Fit)
    posture: Posture | None = None
    second_half: pd.DataFrame | None = None
    uncertainty: UncertaintyFigures | None = None
    draws: pd.DataFrame | None = None
    diagnosis: Diagnosis | None = None
    diverged: str | None = None


def _simulate_into(
    out: Path | None,
    recording: Recording,
    motion: Motion,
    model: Model,
    outcome: Outcome,
    progress: Progress,
    backend: Backend = "fastest",
) -> Made:
    """Run the model and write all that a result folder holds; a run that diverges leaves what it has, and raises."""
    work = "simulate carving" if is_carved(model.terms) else "simulate"
    with progress.stage("simulate", expected_seconds(work, motion)) as stage:
        try:
            result = simulate_model(model, motion, backend=backend, progress=stage.advance)
        except SimulationDiverged as error:
            if isinstance(error.partial, SimulationResult):
                write_outcome(out, recording, motion, model, error.partial, replace(outcome, diverged=str(error)))
            raise
    return write_outcome(out, recording, motion, model, result, outcome)


def write_outcome(
    out: Path | None, recording: Recording, motion: Motion, model: Model, result: SimulationResult, outcome: Outcome
) -> Made:
    """All that a result's folder holds of a run, written into ``out`` if given."""
    result = result.shift(_height_of_track(recording, result))
    series = result.to_frame(slope_to_enu(model.inclination, model.fall_line_azimuth))
    found = biomechanics(result, model.skier.mass)
    series, boots = label_turns(series, found.turns), None
    if recording.completed is None:  # ankles that are assumed tell nothing of boots
        series, boots = add_cuffs(series, result, model)
    gps = recording.gps and correct_fixes(recording.gps, model)
    diagnosis = outcome.diagnosis
    summary = summary_from_dict(
        {
            "recording": recording.name,
            "friction": _friction(model, outcome.fit),
            "carving": carving_figures(model, result, outcome.fit.parameters or {}),
            "trajectory": judge_track(series, gps),
            "pressure_ratio": judge_loads(series, recording.insoles),
            "fit": outcome.fit,
            "solver": {"simulated_s": float(np.ptp(result.time)), **result.statistics},
            "energy": Energy(
                result.closure_percent, {name: float(work[-1] - work[0]) for name, work in result.energy.items()}
            ),
            "turns": turn_figures(found),
            "residual_moment": residual_moment(result),
            "provenance": provenance(recording.hashes, {**outcome.settings, **_plugins_of(model)}, seed=0),
            "capture": {"round_trip": round_trip_table(motion)},
            "diverged": outcome.diverged,
            "posture": outcome.posture,
            "uncertainty": outcome.uncertainty,
            "diagnosis": diagnosis and DiagnosisResult(diagnosis.verdict, diagnosis.sentence),
            "notices": recording.notices,
            "boots": boots,
            "surface": model.surface
            and surface_figures(
                model.surface, result.foot_position.mean(axis=1), model.inclination, 1 + len(recording.runs)
            ),
        }
    )
    measured = measured_table(gps, recording.insoles)
    turns = None if found.table.empty else found.table  # a run too short for a turn has a table without columns
    run = StoredRun(
        summary, series, model, measured, motion.geometry, turns, outcome.second_half, diagnosis, outcome.draws
    )
    made = Made(run, opensim_texts(result, Parts(model, motion)))
    if out is not None:
        write_run(out, run, made.opensim)
    return made


def _plugins_of(model: Model) -> dict[str, Any]:
    """The plug-ins that a model's laws come from, for the result's origin; nothing where there are none."""
    found = [plugin.as_table() for plugin in origins_of(type(term) for term in model.terms)]
    return {"plugins": found} if found else {}


def _height_of_track(recording: Recording, result: SimulationResult) -> Array:
    """(3,) m along the slope's normal: heights count from the antenna's at the start, as in the fit
    (``predict_fixes``).
    """
    if recording.gps is None or result.antenna is None:
        return np.zeros(3)
    return np.array([0.0, 0.0, -result.antenna[0, 2]])


def _friction(model: Model, fit: Fit) -> Friction:
    if is_carved(model.terms):
        return Friction()
    fitted = fit.parameters or {}

    def estimate(name: str) -> Estimate:
        return Estimate(model.value(f"friction.{name}"), fitted.get(f"friction.{name}", Estimate()).se)

    return Friction(estimate("mu_t"), estimate("mu_n"))


def fit_figures(fitted: Fitted) -> Fit:
    """The ``fit`` group of a summary."""
    return Fit(
        method=fitted.method,
        converged=fitted.optimum.converged,
        reason=fitted.optimum.reason,
        evaluations=fitted.optimum.evaluations,
        evaluations_reduced=fitted.reduced.evaluations,
        wall_s=fitted.wall,
        parameters={
            name: Estimate(float(value), float(se))
            for name, value, se in zip(fitted.names, fitted.values, fitted.standard_errors, strict=True)
        },
        correlation=tuple(tuple(row) for row in to_plain(fitted.correlation)),
        residual_noise=ResidualNoise(fitted.noise.sigma, fitted.noise.correlation_time),
    )
