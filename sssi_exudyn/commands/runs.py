"""The steps of ``simulate``, ``fit``, ``validate`` and ``report``: a model is chosen, run, fitted, judged and written.

All raise InputError for bad input and SimulationDiverged when the solver gives up.  A command that was interrupted
continues when it is given again: every simulation of a fit is kept in the result's ``cache`` folder until the fit ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from sssi_exudyn.analysis.biomechanics import biomechanics, label_turns, residual_moment, turn_figures
from sssi_exudyn.analysis.boots import add_cuffs
from sssi_exudyn.analysis.losses import loss_figures
from sssi_exudyn.analysis.skiing import recorded_turns
from sssi_exudyn.analysis.turn_style import add_styles, style_of
from sssi_exudyn.commands.expected import expected_seconds
from sssi_exudyn.commands.recordings import SHORTEST_FIT, SILENT, read_folder
from sssi_exudyn.contact.registry import check_together, combine_terms, is_carved, read_term
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.choices import Backend, HeadingMode, Method, Snow
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.new_files import check_no_link
from sssi_exudyn.core.text import one_line
from sssi_exudyn.fitting.estimate import estimate, is_estimated
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import fit_few_sensors
from sssi_exudyn.fitting.few_sensors.path_balance import PathEstimate
from sssi_exudyn.fitting.first_fit import Fitted, problem_of
from sssi_exudyn.fitting.first_fit import fit as fit_problem
from sssi_exudyn.fitting.misfit import why_missed
from sssi_exudyn.fitting.observations import correct_fixes
from sssi_exudyn.fitting.parameters import seek_too
from sssi_exudyn.fitting.snow_prior import glide_prior
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.io.writing import check_file_name, clear_errors, folder_lock, to_plain, write_atomically
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.heading import check_heading
from sssi_exudyn.model.legs import check_legs
from sssi_exudyn.model.model import PRESETS, Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.from_recording import round_trip_table
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.plugins import use_plugin
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.reports.report import render, render_folder, render_pdf, write_run
from sssi_exudyn.results.carving import carving_figures
from sssi_exudyn.results.draws import draws_table
from sssi_exudyn.results.folder import MEASURED, amend_result, check_own, read_series, read_summary
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
from sssi_exudyn.simulation.full.open_model import OpenModel, open_model
from sssi_exudyn.simulation.full.run import simulate as simulate_model
from sssi_exudyn.simulation.reduced.balanced_lean import balance
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.sweeps.sweep import is_sweep
from sssi_exudyn.sweeps.sweep import render_folder as render_sweep_folder
from sssi_exudyn.terrain.profile import surface_figures
from sssi_exudyn.validation.agreement import judge_loads, judge_track
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis

CACHE: Final = "cache"
"""Folder within a result that keeps what an interrupted command has computed."""
_QUICK: Final = (
    "quick: friction has no standard errors, as the reduced model alone was fitted, posture and instruments as they"
    " are; leave --quick out to estimate their errors too"
)


@dataclass(frozen=True)
class Made:
    """A run as a result's folder holds it.

    opensim : the texts of its files for OpenSim, by name
    """

    run: StoredRun
    opensim: Mapping[str, str]


@dataclass(frozen=True)
class Work:
    """A recording that a command works on.

    out : folder of the result; None where nothing is written
    settings : which stretch of the recording was chosen, for the result's origin
    """

    recording: Recording
    motion: Motion
    out: Path | None
    progress: Progress
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class ChosenModel:
    """The model that a command begins with.

    given : whether the user gave it; otherwise it is the paper's
    settings : what the user chose for it, for the result's origin
    """

    model: Model
    given: bool
    settings: Mapping[str, str]


@contextmanager
def open_recording(
    source: Path | Recording,
    out: Path | None,
    progress: Progress,
    seconds: tuple[float, float] | None = None,
    shortest: float = SHORTEST_FIT,
) -> Iterator[Work]:
    """Lock the result's folder, and read the recording and its motion, or a stretch of it of ``shortest`` (s) or more.

    Raises InputError where something in the recording is wrong, another process writes the folder, or it holds the
    results of another recording.
    """
    with lock_of(out):
        recording, motion = read_folder(source, progress, seconds, shortest)
        check_own(out, recording.name)
        yield Work(recording, motion, out, progress, chosen_seconds(seconds))


def choose_model(
    work: Work, model: Path | Model | None, terms: Sequence[Term], snow: Snow, heading: HeadingMode | None
) -> ChosenModel:
    """Return the given model, or the paper's, with further force terms, the snow and the heading.

    Raises InputError for terms that do not act together, for numbers outside their bounds, for a heading that the snow
    does not decide, and for a given model on a stretch that begins later than the recording: its start is that of its
    own run.
    """
    if model is not None and work.settings.get("seconds", [None])[0] is not None:
        problem = "a given model starts with the place and speed of its own run's begin"
        raise InputError("--seconds", "", problem, "give the end alone, such as :12.5, or leave the model out")
    given = read_model(model) if isinstance(model, Path) else model
    on_edges = (Carving(),) if snow == "carving" else ()
    chosen = add_terms(given or model_of(work.recording, work.motion), (*on_edges, *terms)).with_heading(heading)
    chosen.check_numbers()
    check_heading(chosen.heading, chosen.terms, "--heading")
    check_legs(chosen.legs, chosen.terms)
    settings: dict[str, str] = {}
    if snow != "paper":
        settings["snow"] = snow
    if heading is not None:
        settings["heading"] = heading
    return ChosenModel(chosen, given is not None, settings)


def build_model(work: Work, chosen: ChosenModel) -> OpenModel:
    """Build the model in Exudyn.  Raises InputError for a heading that is to be found."""
    with work.progress.stage("build"):
        return open_model(chosen.model, work.motion)


def chosen_seconds(seconds: tuple[float, float] | None) -> dict[str, Any]:
    """Return the chosen stretch of a recording as a setting of a result; nothing for the whole."""
    if seconds is None:
        return {}
    return {"seconds": [second if np.isfinite(second) else None for second in seconds]}


def simulate_recording(work: Work, chosen: ChosenModel, *, balanced: bool, backend: Backend) -> Made:
    """Simulate the model once; ``balanced`` first leans the posture so that the skier is in balance.

    Raises InputError for a balance on snow that edges do not cut, and SimulationDiverged when the solver gives up.
    """
    model = chosen.model
    settings: dict[str, Any] = {"command": "simulate", "backend": backend, **work.settings, **chosen.settings}
    if balanced:
        if not is_carved(model.terms):
            problem = "the lean that balances a skier is sought on snow that edges cut"
            raise InputError("--balanced", "", problem, "add --snow carving, or leave it out")
        settings["balanced"] = True
        with work.progress.stage("balance") as stage:
            model = balance(model, work.motion, progress=stage.advance).model
    return _simulate_into(work, model, Outcome(settings), backend)


def fit_recording(
    work: Work, chosen: ChosenModel, *, method: Method, parameters: Sequence[str], quick: bool = False
) -> Made:
    """Fit the model's friction to the GPS track, with the ``parameters`` of its terms, and simulate with it.

    A free heading is held by a spring while fitting.  A ``quick`` fit takes posture and instruments as they are, by the
    reduced model alone.  Raises InputError without a GPS, and for snow that the method or the recording does not allow.
    """
    recording, motion = work.recording, work.motion
    if recording.gps is None:
        raise InputError(recording.folder / FILE, "[gps]", "there is no GPS to fit to", "add it, or use simulate")
    model, carved = chosen.model, is_carved(chosen.model.terms)
    if carved:
        _check_cutting(recording, method)
    if quick:
        _check_quick(recording, carved=carved)
    if recording.completed is not None:
        return _fit_few_sensors(work, chosen, method, parameters)
    if method == "joint" and not chosen.given:
        model = on_snow_surface(model, recording, motion)
    problem = seek_too(problem_of(recording, motion, model, method), parameters)
    uncertainty, draws, missed = None, None, ""
    cache = cache_in(work.out)
    task = "quick fit" if quick else "fit carving" if carved else "fit"
    with work.progress.stage("fit", expected_seconds(task, motion)) as stage:
        if quick:
            fitted = fit_problem(problem, motion, method, full=False, coarse=True, cache=cache, progress=stage.advance)
            fitted = replace(fitted, model=replace(fitted.model, solver=PRESETS["fast"]))
            missed = why_missed(fitted, recording) or _QUICK
        elif is_estimated(recording, method):
            estimated = estimate(problem, recording, motion, cache=cache, progress=stage.advance)
            fitted, uncertainty = estimated.fitted, uncertainty_figures(estimated.posterior)
            draws = None if uncertainty.withheld else draws_table(estimated.posterior)
        else:
            fitted = fit_problem(problem, motion, method, cache=cache, progress=stage.advance)
            missed = why_missed(fitted, recording)
    settings: dict[str, Any] = {"command": "fit", "method": method, **work.settings}
    if parameters:
        settings["parameters"] = list(parameters)
    if quick:
        settings["quick"] = True
    glides = None if carved or method != "joint" else glide_prior(recording.snow)
    outcome = Outcome(
        {**settings, **chosen.settings},
        fit_figures(fitted),
        uncertainty=uncertainty,
        draws=draws,
        missed=missed,
        notes=() if glides is None else (glides.sentence,),
    )
    made = _simulate_into(work, replace(fitted.model, heading=chosen.model.heading), outcome)
    if cache is not None:
        cache.remove()
    return made


def _fit_few_sensors(work: Work, chosen: ChosenModel, method: Method, parameters: Sequence[str]) -> Made:
    """Fit a recording of few sensors, and simulate with what they show.

    Heights of a receiver alone show no more of the slope than its plane.  Raises InputError for what few sensors do not
    show.
    """
    recording, motion = work.recording, work.motion
    assert recording.completed is not None
    assert recording.gps is not None
    if method != "joint":
        raise InputError("--method", method, "it searches for what few sensors do not show", "leave it out")
    if parameters:
        problem = "few sensors show effective friction alone"
        raise InputError("--parameters", ", ".join(parameters), problem, "leave it out")
    model = chosen.model
    if not chosen.given:
        model = replace(model, solver=PRESETS["fast"])
        if recording.gps.barometric or recording.elevations is not None or recording.runs:
            model = on_snow_surface(model, recording, motion)
    with work.progress.stage("fit", expected_seconds("fit few sensors", motion)) as stage:
        fit = fit_few_sensors(recording, motion, model, method, stage.advance)
    missed = why_missed(fit.unled_fit, recording)
    posture = posture_figures(recording.completed, fit)
    posture = posture.without_errors() if missed else posture
    settings = {"command": "fit", "method": method, **work.settings, **chosen.settings}
    outcome = Outcome(
        settings,
        fit_figures(fit.fitted),
        posture,
        second_half_table(fit),
        missed=missed,
        path=fit.path,
        unconfirmed=fit.unconfirmed,
    )
    return _simulate_into(work, replace(fit.fitted.model, heading=chosen.model.heading), outcome)


def _check_quick(recording: Recording, *, carved: bool) -> None:
    """Raise InputError for a quick fit of what posture and instruments as they are do not show."""
    problem = ""
    if carved:
        problem = "where edges cut, errors of the posture hide what the snow does"
    elif recording.completed is not None:
        problem = "few sensors have no shorter fit"
    if problem:
        raise InputError("--quick", "", problem, "leave it out, or take less of the recording with --seconds")


def _check_cutting(recording: Recording, method: Method) -> None:
    """Raise InputError for a fit that snow cut by edges does not allow."""
    if method != "joint":
        raise InputError("--method", method, "the paper's method fits the paper's snow", "leave it out")
    if recording.completed is not None:
        problem = "edges that cut want a captured posture: what few sensors leave open is larger"
        raise InputError(recording.folder / FILE, "[motion]", problem, "leave --snow carving out")


def terms_named(terms: Sequence[Term | str]) -> tuple[Term, ...]:
    """Return force terms, names replaced by the terms with default numbers.

    Raises InputError for an unknown name, and for what is neither a name nor a term, such as the class of a term.
    """
    known = [read_term(term, {}, "--term", "") if isinstance(term, str) else term for term in terms]
    for term in known:
        if not isinstance(term, Term):
            name = getattr(term, "__name__", term)
            raise InputError("terms", one_line(name), "it is no force term", "give an object of its class, or a name")
    return tuple(known)


def add_terms(model: Model, terms: Sequence[Term]) -> Model:
    """Return the model with further force terms, without those that they replace.

    Classes of the caller's own are known by their names from here on, because their results are read back.

    Raises InputError where such a name is another term's, and for terms that do not act together.
    """
    for term in (*model.terms, *terms):
        if origin_of(type(term)) is not None:
            use_plugin(type(term))
    together = combine_terms(model.terms, terms)
    check_together(together, "--term")
    return model.with_terms(together)


def lock_of(out: Path | None) -> AbstractContextManager[None]:
    """Return the lock of a result's folder; where nothing is written it locks nothing."""
    return nullcontext() if out is None else folder_lock(out)


def cache_in(out: Path | None) -> Cache | None:
    """Return the cache of a result's folder, which keeps what an interrupted command has computed; None without one.

    Raises InputError where a link stands in its place.
    """
    if out is None:
        return None
    with clear_errors(out / CACHE):
        check_no_link(out / CACHE)
    return Cache(out / CACHE)


def validate(folder: Path, result: Path, out: Path, *, progress: Progress = SILENT) -> Summary:
    """Compare the run in the folder ``result`` with the recording's GPS and insoles, into ``out``.

    Returns the new summary.
    """
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
    """Write the report of one result folder, of several side by side, or of a sweep's folder.

    ``out`` is a page (.html) or a document to print (.pdf).  Returns that file's path; raises InputError for another
    ending.
    """
    _check_ending(out)
    if is_sweep(results[0]):
        if len(results) > 1 or out.suffix != ".html":
            raise InputError(results[0], "", "this is a sweep", "give it alone, and a name that ends in .html")
        write_atomically(out, render_sweep_folder(results[0]))
        return out
    return write_report([(read_run(result), result.resolve().name) for result in results], out)


def write_report(results: Sequence[tuple[StoredRun, str]], out: Path) -> Path:
    """Write the report of results, each with a name that distinguishes it from others of the same recording."""
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
    """Raise InputError where a report's file is neither a page nor a document, or cannot be."""
    if out.suffix not in (".html", ".pdf"):
        raise InputError(out, "", "neither a page nor a document", "end its name in .html or .pdf")
    check_file_name(out)


@dataclass(frozen=True)
class Outcome:
    """What a result holds in addition to its run.

    settings : what the user chose
    fit : how the fit ended, with the fitted parameters
    posture, second_half : of a recording of few sensors (``results.posture``)
    uncertainty, draws : what the fit leaves uncertain, and draws from it (``results.draws``)
    diagnosis : what a diagnosis found
    diverged : why the simulation stopped before the end
    missed : why a fit of friction alone has no standard errors; "" where it has
    path : the balance along the path of few sensors
    unconfirmed : why the simulated run does not confirm that balance; "" where it does
    notes : what a reader should know of the fit
    """

    settings: Mapping[str, Any]
    fit: Fit = field(default_factory=Fit)
    posture: Posture | None = None
    second_half: pd.DataFrame | None = None
    uncertainty: UncertaintyFigures | None = None
    draws: pd.DataFrame | None = None
    diagnosis: Diagnosis | None = None
    diverged: str | None = None
    missed: str = ""
    path: PathEstimate | None = None
    unconfirmed: str = ""
    notes: tuple[str, ...] = ()

    @property
    def believable_fit(self) -> Fit:
        """Return how the fit ended, without standard errors where its residuals contradict them."""
        withheld = self.missed if self.uncertainty is None else self.uncertainty.withheld
        if not withheld:
            return self.fit
        parameters = {name: replace(estimate, se=None) for name, estimate in (self.fit.parameters or {}).items()}
        return replace(self.fit, parameters=parameters)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return what the fit says against its own results, in sentences."""
        ended = () if self.fit.converged is not False else (f"the fit did not converge: {self.fit.reason}",)
        said = tuple(doubt for doubt in (self.missed, self.unconfirmed) if doubt)
        return (*ended, *said, *(() if self.uncertainty is None else self.uncertainty.doubts))


def _simulate_into(work: Work, model: Model, outcome: Outcome, backend: Backend = "fastest") -> Made:
    """Run the model and write all that a result folder holds; a run that diverges leaves what it has, and raises."""
    task = "simulate carving" if is_carved(model.terms) else "simulate"
    with work.progress.stage("simulate", expected_seconds(task, work.motion)) as stage:
        try:
            result = simulate_model(model, work.motion, backend=backend, progress=stage.advance)
        except SimulationDiverged as error:
            if isinstance(error.partial, SimulationResult):
                stopped = replace(outcome, diverged=str(error))
                write_outcome(work.out, work.recording, work.motion, model, error.partial, stopped)
            raise
    return write_outcome(work.out, work.recording, work.motion, model, result, outcome)


def write_outcome(
    out: Path | None, recording: Recording, motion: Motion, model: Model, result: SimulationResult, outcome: Outcome
) -> Made:
    """Put together all that a result's folder holds of a run, and write it into ``out`` if given."""
    result = result.shift(_height_of_track(recording, result))
    series = result.to_frame(slope_to_enu(model.inclination, model.fall_line_azimuth))
    turns = recorded_turns(recording, float(result.time[0]), float(result.time[-1]))
    technique = biomechanics(result, model.skier.mass, model.inclination, turns)
    if outcome.path is not None and not technique.table.empty:
        technique = replace(technique, table=add_styles(technique.table, outcome.path))
    series, boots = label_turns(series, technique.turns), None
    if recording.completed is None:  # ankles that are assumed tell nothing of boots
        series, boots = add_cuffs(series, result, model)
    gps = recording.gps and correct_fixes(recording.gps, model)
    diagnosis, ended = outcome.diagnosis, outcome.believable_fit
    summary = summary_from_dict(
        {
            "recording": recording.name,
            "friction": _friction(model, ended),
            "carving": carving_figures(model, result, ended.parameters or {}),
            "trajectory": judge_track(series, gps),
            "pressure_ratio": judge_loads(series, recording.insoles),
            "fit": ended,
            "solver": {"simulated_s": float(np.ptp(result.time)), **result.statistics},
            "energy": Energy(
                result.closure_percent, {name: float(work[-1] - work[0]) for name, work in result.energy.items()}
            ),
            "turns": turn_figures(technique),
            "losses": loss_figures(
                result,
                technique.table,
                model.inclination,
                None if is_carved(model.terms) else model.value("friction.mu_n"),
            ),
            "residual_moment": residual_moment(result),
            "provenance": provenance(recording.hashes, {**outcome.settings, **_plugins_of(model)}, seed=0),
            "capture": {"round_trip": round_trip_table(motion)},
            "diverged": outcome.diverged,
            "posture": outcome.posture,
            "uncertainty": outcome.uncertainty,
            "diagnosis": diagnosis and DiagnosisResult(diagnosis.verdict, diagnosis.sentence),
            "notices": (*outcome.doubts, *outcome.notes, *recording.notices),
            "boots": boots,
            "technique": outcome.path and style_of(outcome.path),
            "surface": model.surface
            and surface_figures(
                model.surface, result.foot_position.mean(axis=1), model.inclination, 1 + len(recording.runs)
            ),
        }
    )
    measured = measured_table(gps, recording.insoles)
    table = None if technique.table.empty else technique.table  # a run too short for a turn has a table without columns
    run = StoredRun(
        summary, series, model, measured, motion.geometry, table, outcome.second_half, diagnosis, outcome.draws
    )
    made = Made(run, opensim_texts(result, Parts(model, motion)))
    if out is not None:
        write_run(out, run, made.opensim)
    return made


def _plugins_of(model: Model) -> dict[str, Any]:
    """Return the plug-ins that a model's laws come from, for the result's origin; nothing where there are none."""
    plugins = [plugin.as_table() for plugin in origins_of(type(term) for term in model.terms)]
    return {"plugins": plugins} if plugins else {}


def _height_of_track(recording: Recording, result: SimulationResult) -> Array:
    """Return (3,) m along the slope's normal: heights count from the antenna's at the start, as in the fit.

    See ``predict_fixes``.
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
    """Return the ``fit`` group of a summary."""
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
