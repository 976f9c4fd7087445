"""The steps of ``simulate`` and ``fit``: a model is chosen, fitted and run.

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

from sssi_exudyn.commands.expected import expected_seconds
from sssi_exudyn.commands.outcome import Made, Outcome, fit_figures, write_outcome
from sssi_exudyn.commands.recordings import SHORTEST_FIT, read_folder
from sssi_exudyn.contact.registry import check_together, combine_terms, is_carved, read_term
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.choices import Backend, HeadingMode, Method, Snow
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.new_files import check_no_link
from sssi_exudyn.core.text import one_line
from sssi_exudyn.fitting.estimate import estimate, is_estimated
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import fit_few_sensors
from sssi_exudyn.fitting.first_fit import fit as fit_problem
from sssi_exudyn.fitting.first_fit import problem_of
from sssi_exudyn.fitting.misfit import why_missed
from sssi_exudyn.fitting.parameters import seek_too
from sssi_exudyn.fitting.snow_prior import glide_prior
from sssi_exudyn.fitting.snow_surface import on_snow_surface
from sssi_exudyn.io.writing import clear_errors, folder_lock
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.heading import check_heading
from sssi_exudyn.model.legs import check_legs
from sssi_exudyn.model.model import PRESETS, Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.plugins import use_plugin
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.results.draws import draws_table
from sssi_exudyn.results.folder import check_own
from sssi_exudyn.results.posture import posture_figures, second_half_table
from sssi_exudyn.results.uncertainty import uncertainty_figures
from sssi_exudyn.runtime.cache import Cache
from sssi_exudyn.runtime.plugins import origin_of
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.simulation.full.open_model import OpenModel, open_model
from sssi_exudyn.simulation.full.run import simulate as simulate_model
from sssi_exudyn.simulation.reduced.balanced_lean import balance
from sssi_exudyn.simulation.result import SimulationResult

CACHE: Final = "cache"
"""Folder within a result that keeps what an interrupted command has computed."""
_QUICK: Final = (
    "quick: friction has no standard errors, as the reduced model alone was fitted, posture and instruments as they"
    " are; leave --quick out to estimate their errors too"
)


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
