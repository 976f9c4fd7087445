"""The state of a search, frozen, and fits under it; a function that changes the state gives the next one.

The state holds what a fit depends on beside model and parameters: noise levels, what instruments, skier, posture and
snow surface may do, and what the full model predicts beyond the reduced one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.runtime.cache import Shapes, fingerprint
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import simulate_reduced
from sssi_exudyn.validation.diagnosis.evidence import (
    Freedom,
    LinearModel,
    NoiseLevels,
    Whitener,
    best_levels,
    usual_levels,
    whiten_columns,
    whitener,
)
from sssi_exudyn.validation.diagnosis.hypothesis import Candidate, FittedRun
from sssi_exudyn.validation.diagnosis.problem import DiagnosisProblem, Nuisances, no_nuisances, nuisances_of
from sssi_exudyn.validation.diagnosis.refit import Parameter, Refit, arrays_of, kept_shapes, refit, refit_of

Arrays = Mapping[str, NDArray[np.generic]]
"""What a cache keeps."""
_SETTLED: Final = 0.2
"""Standard deviations of the noise by which the full model's surplus may still change."""


@dataclass(frozen=True)
class State:
    """What a fit depends on beside its model and parameters.

    levels : of the noise;  nuisances : what else may vary
    beyond : (N,) what the full model predicts beyond the reduced one
    first_evidence : log evidence of the model without anything added, once it is known
    """

    levels: NoiseLevels
    nuisances: Nuisances
    beyond: Array
    first_evidence: float | None = None

    def offset(self, amounts: Array) -> Array:
        """(N,) what is added to the reduced model's prediction on a surface whose modes have these amounts (s,): a
        prediction counts from the surface before any height was known.
        """
        waves = self.nuisances.surface
        return np.asarray(self.nuisances.mean + self.beyond - (waves @ amounts if waves.shape[1] else 0.0))


def first_fit(problem: DiagnosisProblem) -> tuple[DiagnosisProblem, State, Refit]:
    """The fit of the model without anything added, about which is found what else may vary; and the problem with fixes
    that count by how far off they are.
    """
    size = len(problem.measurements.measured)
    state = State(usual_levels(problem.measurements), no_nuisances(size), np.zeros(size))
    base = fit_model(problem, state, problem.model, problem.parameters, state.levels)
    problem = problem.with_residual(problem.measurements.measured - base.predicted)
    state = replace(state, nuisances=_nuisances(problem, base))
    return problem, *settle(problem, state, base)


def fit_model(
    problem: DiagnosisProblem, state: State, model: Model, parameters: tuple[Parameter, ...], levels: NoiseLevels
) -> Refit:
    """Refit ``parameters`` from the model's values on, under that noise."""

    def run() -> Refit:
        whiten = noise_whitener(problem, state, levels)
        return refit(model, parameters, problem.prepared, problem.measurements, whiten, place)

    def place(model: Model) -> tuple[Model, Array]:
        placed, amounts = problem.place(model)
        return placed, state.offset(amounts)

    if problem.cache is None:
        return run()
    # NumPy's arrays and numbers alone are kept; the model follows from them
    key = fingerprint("refit", problem.key, model_to_dict(model), parameters, levels, state.beyond, state.nuisances)
    shapes = kept_shapes(len(state.beyond), len(parameters))
    found = refit_of(problem.cache.get_or_make(key, lambda: arrays_of(run()), shapes), model, parameters)
    return replace(found, model=problem.place(found.model)[0])


def settle(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[State, Refit]:
    """The same model refitted under the noise that suits it best."""
    levels, _ = best_levels(linear_model(problem, state, fit), state.levels)
    return replace(state, levels=levels), fit_model(problem, state, fit.model, fit.parameters, levels)


def confirm(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[State, Refit]:
    """The fit on the full model.

    What the full model predicts beyond the reduced one changes little with the parameters: it is added to the reduced
    prediction, which is then fitted again.
    """
    for _ in range(2):
        beyond = _full_prediction(problem, fit.model) - _reduced_prediction(problem, state, fit)
        change = (beyond - state.beyond)[:, None]
        moved = float(np.max(np.abs(whiten_columns(linear_model(problem, state, fit), state.levels, change))))
        state = replace(state, beyond=beyond)
        fit = fit_model(problem, state, fit.model, fit.parameters, state.levels)
        if moved < _SETTLED:
            break
    return state, fit


def remove(problem: DiagnosisProblem, state: State, fit: Refit, candidate: Candidate) -> tuple[State, Refit]:
    """The fit refitted without what the candidate brought."""
    names = {name for group in candidate.amplitudes for name in group} | set(candidate.places)
    owners = {name.partition(".")[0] for name in names}
    model = fit.model
    if owners == {"start"}:
        model = model.with_values({name: problem.model.value(name) for name in names})
    else:
        model = model.without(owners)
    kept = tuple(p for p in fit.parameters if not names & set(p.names))
    known = tuple(p for p in problem.parameters if names & set(p.names))
    return settle(problem, state, fit_model(problem, state, model, (*kept, *known), state.levels))


def noise_whitener(problem: DiagnosisProblem, state: State, levels: NoiseLevels) -> Whitener:
    """Of all that is noise to the fit's parameters."""
    size, beside = len(state.beyond), state.nuisances
    nothing = Freedom(np.zeros((size, 0)), np.zeros(0))
    empty = LinearModel(problem.measurements, np.zeros(size), nothing, beside.posture, beside.surface)
    return whitener(empty, levels, beside.free.columns * beside.free.scales)


def linear_model(problem: DiagnosisProblem, state: State, fit: Refit) -> LinearModel:
    """Measurements less prediction about a fit, as if every parameter still stood at its prior mean."""
    residual = problem.measurements.measured - fit.predicted + fit.sensitivity @ fit.pulls
    beside = state.nuisances
    free = beside.free.with_more(fit.sensitivity, fit.scales)
    return LinearModel(problem.measurements, residual, free, beside.posture, beside.surface)


def fitted_run(problem: DiagnosisProblem, state: State, fit: Refit) -> FittedRun:
    """The fitted model and its run, as hypotheses see it."""
    run = simulate_reduced(fit.model, problem.prepared)
    prediction = _reduced_prediction(problem, state, fit)
    return FittedRun(fit.model, problem.prepared, run, problem.measurements, prediction)


def _reduced_prediction(problem: DiagnosisProblem, state: State, fit: Refit) -> Array:
    """(N,) what the instruments would measure of a fit, by the reduced model alone."""
    return fit.predicted - state.offset(problem.place(fit.model)[1])


def get_or_make(problem: DiagnosisProblem, key: str, make: Callable[[], Arrays], shapes: Shapes) -> Arrays:
    """What the cache has under ``key``, or else what ``make`` gives."""
    return problem.cache.get_or_make(key, make, shapes) if problem.cache else make()


def _full_prediction(problem: DiagnosisProblem, model: Model) -> Array:
    """(N,) what the instruments would measure, by the full model."""

    def run() -> Arrays:
        return {"predicted": problem.measurements.predict(model, simulate(model, problem.motion))}

    key = fingerprint("full model", problem.key, model_to_dict(model))
    shapes = {"predicted": problem.measurements.measured.shape}
    return np.asarray(get_or_make(problem, key, run, shapes)["predicted"], dtype=np.float64)


def _nuisances(problem: DiagnosisProblem, base: Refit) -> Nuisances:
    """What may vary about the run of a fit."""

    def run() -> Arrays:
        found = nuisances_of(problem, base.model)
        return {
            "columns": found.free.columns,
            "scales": found.free.scales,
            "mean": found.mean,
            "posture": found.posture,
            "surface": found.surface,
        }

    size = len(base.predicted)
    key = fingerprint("nuisances", problem.key, base.values)
    shapes = {
        "columns": (size, None),
        "scales": (None,),
        "mean": (size,),
        "posture": (size, None),
        "surface": (size, None),
    }
    kept = get_or_make(problem, key, run, shapes)
    columns, scales, mean, posture, surface = (np.asarray(kept[name], dtype=np.float64) for name in shapes)
    return Nuisances(Freedom(columns, scales), mean, posture, surface)
