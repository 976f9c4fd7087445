"""Fit friction, start and heading of one recording to its GPS track.

The search runs on the reduced model until it stands still, then on the full model from there, without the skeleton's
tree, which changes no path: its objective is the full model's, its gradient combines the full residual with the
reduced model's sensitivities, which differ from the full ones by a few percent.  Such a gradient vanishes where the
full residual is orthogonal to the sensitivities, as far as they are known.

The paper's bare objective is searched as published, by SLSQP with the curvature at the start alone; the other with
the curvature wherever the search is.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.choices import Method
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, fit_noise
from sssi_exudyn.core.number_ref import (
    FRICTION,
    HEADING_OFFSET,
    MU_N,
    MU_T,
    START_F,
    START_L,
    VELOCITY_F,
    VELOCITY_L,
    NumberRef,
)
from sssi_exudyn.fitting.noise import NOISE
from sssi_exudyn.fitting.objective import Prior, Problem, correlations, counts_of, uncertainty, weight_of
from sssi_exudyn.fitting.observations import correct_fixes, track_of
from sssi_exudyn.fitting.optimise import Optimum, Squares, minimise, minimise_squares, step_back
from sssi_exudyn.fitting.snow_prior import glide_prior
from sssi_exudyn.model.from_recording import guess_with_error
from sssi_exudyn.model.heading import REPLAY
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.runtime.cache import Cache, Shapes, fingerprint
from sssi_exudyn.simulation.full.run import antenna_path
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, STEP, Prepared, prepare
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities

Responses = Callable[[Array], tuple[Array, Array]]
"""From the parameters (k,) to residual (n, 2) m and the derivative (n, 2, k) of the simulated places."""
NUISANCES: Final = (VELOCITY_F, VELOCITY_L, START_F, START_L, HEADING_OFFSET)
START_VALUES: Final = {MU_T: 0.1, MU_N: 0.5}
"""Where the search starts (paper 2.4)."""
CUTTING: Final = (NumberRef("carving.mu"),)
"""Friction where edges cut; what else the track says of such snow is estimated with all that is uncertain."""
_FIRST_NOISE: Final = ExponentialNoise(0.05, NOISE.gps.memory)
"""Of the residual, before there is one: what posture errors of 0.3° and a receiver of 2 cm leave."""
_COARSE_NOISE = 1.0
"""m; what fixes of any receiver are wrong by against their neighbours, before the residual tells."""
_COARSE_TOLERANCE = 0.1
"""Of the objective, there, before everything else that is uncertain is sought along."""
_CARVED_TOLERANCE = 20.0
"""The same where edges cut: errors of the posture, which are sought afterwards, take up far more."""
_ROUNDS = 5
"""Searches by turns with weighing the fixes, at most."""
_MEMORY = 1.0 / 6.0
"""Of the run's length, the longest correlation of what is left of a track to which start, heading and friction were
fitted.  A smooth misfit is most likely under noise without an end, of any size, under which a track says nothing."""
_COUNTING = 0.5
"""A fix that counts less says nothing of the noise of the others."""
UNSTEERED = Prior(0.7, 0.15)
"""Friction across skis of unknown heading, so that no slip shows it: between the published 0.55 and 0.9."""


@dataclass(frozen=True)
class Fitted:
    """What a fit found.

    model : the model with the fitted numbers
    names, values : (k,) the fitted parameters;  covariance : (k, k) from the residual as it is, correlated in time
    residual : (n, 2) m measured minus simulated at ``time`` (n,) s, level frame, by the model that was fitted
    noise : of that residual
    optimum, reduced : how the searches on the full and on the reduced model ended
    """

    method: Method
    model: Model
    names: tuple[NumberRef, ...]
    values: Array
    covariance: Array
    time: Array
    residual: Array
    noise: ExponentialNoise
    optimum: Optimum
    reduced: Optimum
    wall: float

    @property
    def standard_errors(self) -> Array:
        """(k,) in the parameters' units."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """(k, k)"""
        return correlations(self.covariance)

    def standard_error(self, name: str) -> float:
        """Return the standard error of one parameter; NaN where it was not fitted."""
        return float(self.standard_errors[self.names.index(name)]) if name in self.names else float("nan")

    def value(self, name: str) -> float:
        """Return the model's value of a number, fitted or not."""
        return self.model.value(name)


def problem_of(recording: Recording, motion: Motion, model: Model, method: Method) -> Problem:
    """Return what is fitted to the recording's GPS, from the paper's starting values; whatever else the model has
    stays.

    A heading that is free is held by a spring: any misfit could be a heading otherwise.

    Raises ValueError when the recording has no GPS.
    """
    if recording.gps is None:
        raise ValueError("the recording has no GPS")
    track = track_of(recording.gps, model.fall_line_azimuth, motion.start, motion.stop)
    gps = correct_fixes(recording.gps, model)
    guess, error = guess_with_error(gps, motion, model.inclination, model.fall_line_azimuth)
    known = model.start
    start = replace(guess, heading_offset=known.heading_offset, clock_offset=known.clock_offset)
    cut = is_carved(model.terms)
    model = replace(model, start=start, heading=model.heading.held())
    model = model if cut else model.with_values(START_VALUES)
    friction = CUTTING if cut else FRICTION
    if method == "paper":
        return Problem(model, track, FRICTION, {}, 1.0, np.ones(len(track.time)))
    sigma = float(np.median(track.sigma))
    priors: dict[NumberRef, Prior] = {
        VELOCITY_F: Prior(start.velocity_f, error),
        VELOCITY_L: Prior(start.velocity_l, error),
        START_F: Prior(start.f, 3.0 * sigma),
        START_L: Prior(start.l, 3.0 * sigma),
        HEADING_OFFSET: Prior(known.heading_offset, recording.heading.sigma),
    }
    if recording.completed is not None and not recording.completed.steered:
        priors[MU_N] = UNSTEERED
    glides = None if cut or recording.completed is not None else glide_prior(recording.snow)
    if glides is not None:  # what few sensors show is effective friction, which skids too
        priors[MU_T] = Prior(glides.mean, glides.sigma)
    modes = surface_priors(model)
    priors |= modes
    noise = replace(_FIRST_NOISE, sigma=float(np.clip(sigma, _FIRST_NOISE.sigma, _COARSE_NOISE)))
    return Problem(model, track, friction + NUISANCES + tuple(modes), priors, weight_of(noise, track), counts_of(track))


def with_surface(problem: Problem, model: Model) -> Problem:
    """Return the problem with the priors of another snow surface, that of ``model``."""
    others = {name: prior for name, prior in problem.priors.items() if name.part != "surface"}
    return replace(problem, priors=others | surface_priors(model))


def surface_priors(model: Model) -> dict[NumberRef, Prior]:
    """Return the priors of the numbers of a model's snow surface: each counts in standard deviations."""
    return dict.fromkeys(() if model.surface is None else model.surface.names, Prior(0.0, 1.0))


def fit(
    problem: Problem,
    motion: Motion,
    method: Method = "joint",
    *,
    full: bool = True,
    coarse: bool = False,
    cache: Cache | None = None,
    progress: Advance = silent,
) -> Fitted:
    """Solve the problem with the full model, or without ``full`` with the reduced one alone; ``coarse`` with long steps
    and a large tolerance, as always where most of the posture is assumed.  What the full model simulated and the
    reduced one's searches found is kept in ``cache``, so that the same call goes on from there.

    The heading is the captured one, whatever the model's: snow that is not found yet would turn the skier away.

    Raises SimulationDiverged when a simulation does.
    """
    begin = clock.perf_counter()
    problem = replace(problem, model=replace(problem.model, heading=REPLAY))
    coarse = coarse or motion.foot_sigma is not None
    prepared = prepare(problem.model, motion, step=COARSE_STEP if coarse else STEP)
    enough = _COARSE_TOLERANCE if coarse else _tolerance(problem)
    if is_carved(problem.model.terms):
        enough = _CARVED_TOLERANCE
    at = _reduced_responses(problem, prepared)
    reduced = _cached_search(cache, motion, problem, at, progress, enough if coarse else 10.0 * enough)
    if method == "joint":  # the residual now tells what the noise is
        residual, _ = at(reduced.values)
        for _ in range(_ROUNDS):
            counts = counts_of(problem.track, residual)
            if np.all(np.abs(counts - problem.counts) < _COUNTING):
                break  # otherwise fixes that are far off have bent the track by which they were found
            problem = problem.with_counts(counts)
            again = replace(problem, model=problem.model_at(reduced.values))
            reduced = _cached_search(cache, motion, again, at, progress, 10.0 * enough)
            residual, _ = at(reduced.values)
        problem = problem.with_noise(noise_of(problem, residual))
        again = replace(problem, model=problem.model_at(reduced.values))
        reduced = _cached_search(cache, motion, again, at, progress, enough)
    _, sensitivity = at(reduced.values)
    curvature = problem.curvature(sensitivity)
    seen: dict[bytes, Array] = {}

    def run(values: Array) -> Array:
        key = values.tobytes()
        if key not in seen:
            seen[key] = full_residual(problem, motion, values, cache)
            progress(None, f"full model, evaluation {len(seen)}: {_description(problem, seen[key], values)}")
        return seen[key]

    def evaluate(values: Array) -> tuple[float, Array, Array]:
        residual = run(values)
        return problem.value(residual, values), problem.gradient(residual, sensitivity, values), curvature

    optimum = reduced
    if full:
        optimum = _search(problem, evaluate, reduced.values, _tolerance(problem))
        residual = run(optimum.values)
    else:
        residual, _ = at(optimum.values)
    noise = noise_of(problem, residual)
    return Fitted(
        method=method,
        model=problem.model_at(optimum.values),
        names=problem.names,
        values=optimum.values,
        covariance=uncertainty(problem, sensitivity, noise),
        time=problem.track.time,
        residual=residual,
        noise=noise,
        optimum=optimum,
        reduced=reduced,
        wall=clock.perf_counter() - begin,
    )


def noise_of(problem: Problem, residual: Array) -> ExponentialNoise:
    """Return the noise of a residual (n, 2) m, from the fixes that count."""
    kept, time = problem.counts > _COUNTING, problem.track.time
    longest = _MEMORY * float(time[-1] - time[0]) if problem.priors else np.inf
    return fit_noise(time[kept], residual[kept], longest)


def _cached_search(
    cache: Cache | None, motion: Motion, problem: Problem, at: Responses, progress: Advance, tolerance: float
) -> Optimum:
    """Return what the search on the reduced model gives, or what it returned before an interrupt."""

    def search() -> dict[str, np.ndarray]:
        reduced_fit = _search_reduced(problem, at, progress, tolerance)
        return {name: np.asarray(value) for name, value in asdict(reduced_fit).items()}

    if cache is None:
        return _search_reduced(problem, at, progress, tolerance)
    about = (problem.names, problem.priors, problem.weight, problem.counts, problem.track, problem.model)
    shapes: Shapes = {
        "values": (len(problem.names),),
        "objective": (),
        "evaluations": (),
        "converged": (),
        "reason": (),
    }
    kept = cache.get_or_make(fingerprint("reduced search", tolerance, *about, motion), search, shapes)
    return Optimum(
        values=np.asarray(kept["values"], dtype=np.float64),
        objective=float(kept["objective"]),
        evaluations=int(kept["evaluations"]),
        converged=bool(kept["converged"]),
        reason=str(kept["reason"]),
    )


def fit_reduced(
    problem: Problem,
    prepared: Prepared,
    progress: Advance = silent,
    *,
    tolerance: float | None = None,
) -> Optimum:
    """Solve the problem with the reduced model, until the objective changes by less than ``tolerance``."""
    enough = _tolerance(problem) if tolerance is None else tolerance
    return _search_reduced(problem, _reduced_responses(problem, prepared), progress, enough)


def _search_reduced(problem: Problem, at: Responses, progress: Advance, tolerance: float) -> Optimum:
    """Solve the problem with the reduced model, of which ``at`` gives what fixes see."""

    def evaluate(values: Array) -> tuple[float, Array, Array]:
        residual, sensitivity = at(values)
        progress(None, f"reduced model: {_description(problem, residual, values)}")
        slope = problem.gradient(residual, sensitivity, values)
        return problem.value(residual, values), slope, problem.curvature(sensitivity)

    return _search(problem, evaluate, problem.start, tolerance)


def _search(problem: Problem, evaluate: Squares, start: Array, tolerance: float) -> Optimum:
    """Minimise the objective; ``evaluate`` gives it with its gradient and its Gauss-Newton curvature.  A step to where
    the simulation diverges is too long: it is taken back.  Raises SimulationDiverged when it does at the start.
    """
    evaluate = step_back(evaluate)
    if problem.priors:
        return minimise_squares(evaluate, start, problem.bounds, objective_tolerance=tolerance)
    first = evaluate(start)[2]
    return minimise(lambda x: evaluate(x)[:2], start, problem.bounds, first, objective_tolerance=tolerance)


def full_residual(problem: Problem, motion: Motion, values: Array, cache: Cache | None = None) -> Array:
    """Return measured minus simulated by the full model, (n, 2) m."""
    model = problem.model_at(values)
    key = fingerprint("antenna", model, motion)

    def run() -> dict[str, Array]:
        time, antenna = antenna_path(model, motion)
        return {"time": time, "antenna": antenna}

    kept = cache.get_or_make(key, run, {"time": (None,), "antenna": (None, 3)}) if cache else run()
    return problem.residual(model, np.asarray(kept["time"]), np.asarray(kept["antenna"]))


def _reduced_responses(problem: Problem, prepared: Prepared) -> Responses:
    """Return what gives residual (n, 2) and the derivative (n, 2, k) of the simulated places by the reduced model.

    It keeps what it gave: searches by turns with weighing the fixes begin where the last one ended, and weights change
    neither of both.
    """
    known: dict[bytes, tuple[Array, Array]] = {}

    def at(values: Array) -> tuple[Array, Array]:
        key = values.tobytes()
        if key not in known:
            residual, derivative = sensitivities(
                problem.model_at(values),
                prepared,
                problem.names,
                lambda model, run: problem.residual(model, run.time, run.antenna),
            )
            known[key] = residual, -derivative
        return known[key]

    return at


def _tolerance(problem: Problem) -> float:
    """Return change of the objective that no longer matters: a thousandth of χ², or in the paper's bare integral 1 mm²
    over the run.
    """
    return 1e-3 if problem.priors else 1e-6 * float(problem.track.time[-1] - problem.track.time[0])


def _description(problem: Problem, residual: Array, values: Array) -> str:
    numbers: Mapping[NumberRef, float] = dict(zip(problem.names, values, strict=True))
    error = float(np.mean(np.linalg.norm(residual, axis=1)))
    friction = ", ".join(
        f"{name.partition('.')[2]} {value:.4f}" for name, value in numbers.items() if name in FRICTION + CUTTING
    )
    return f"mean error {error:.3f} m, {friction}"
