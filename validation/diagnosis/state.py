"""The state of a search, frozen, and fits under it; a function that changes the state gives the next one.

The state holds what a fit depends on beside model and parameters: noise levels, the instruments' mounting, what errors
of the capture do, and what the full model predicts beyond the reduced one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.measurements import averages
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.runtime.cache import Shapes, fingerprint
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import simulate_reduced
from sssi_exudyn.simulation.sensitivities import sensitivities
from sssi_exudyn.validation.capture_error import antenna_responses, capture_errors, responses
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
from sssi_exudyn.validation.diagnosis.problem import DiagnosisProblem, mounting_freedom
from sssi_exudyn.validation.diagnosis.refit import Parameter, Refit, arrays_of, kept_shapes, refit, refit_of

Arrays = Mapping[str, NDArray[np.generic]]
"""What a cache keeps."""
_SETTLED: Final = 0.2
"""Standard deviations of the noise by which the full model's surplus may still change."""


@dataclass(frozen=True)
class State:
    """What a fit depends on beside its model and parameters.

    levels : of the noise;  mounting : what varies with the instruments' mounting
    cuff : (N,) mean effect of the boots' cuffs;  beyond : (N,) what the full model predicts beyond the reduced one
    capture : (N, c) responses to errors of the capture, for one radian
    first_evidence : log evidence of the model without anything added, once it is known
    """

    levels: NoiseLevels
    mounting: Freedom
    cuff: Array
    beyond: Array
    capture: Array
    first_evidence: float | None = None

    @property
    def offset(self) -> Array:
        """(N,) what is added to the reduced model's prediction."""
        return np.asarray(self.cuff + self.beyond)

    @property
    def without_capture(self) -> State:
        """The same with a capture that has no error."""
        return replace(self, capture=np.zeros((len(self.cuff), 0)))


def initial_state(problem: DiagnosisProblem) -> State:
    """Usual noise, and mountings from a run of the model as it is given."""
    mounting, cuff = _mounting(problem, problem.model)
    nothing = np.zeros_like(cuff)
    return State(usual_levels(problem.measurements), mounting, cuff, nothing, np.zeros((len(cuff), 0)))


def first_fit(problem: DiagnosisProblem) -> tuple[State, Refit]:
    """The fit of the model without anything added; what the capture's errors do is found about it."""
    state = initial_state(problem)
    base = fit_model(problem, state, problem.model, problem.parameters, state.levels)
    mounting, cuff = _mounting(problem, base.model)
    state = replace(state, mounting=mounting, cuff=cuff)
    base = fit_model(problem, state, base.model, base.parameters, state.levels)
    return settle(problem, replace(state, capture=_capture_responses(problem, base)), base)


def fit_model(
    problem: DiagnosisProblem, state: State, model: Model, parameters: tuple[Parameter, ...], levels: NoiseLevels
) -> Refit:
    """Refit ``parameters`` from the model's values on, under that noise."""

    def run() -> Refit:
        whiten = noise_whitener(problem, state, levels)
        return refit(model, parameters, problem.prepared, problem.measurements, whiten, state.offset)

    if problem.cache is None:
        return run()
    # NumPy's arrays and numbers alone are kept; the model follows from them
    key = fingerprint(
        "refit", problem.key, model_to_dict(model), parameters, levels, state.offset, state.capture, state.mounting
    )
    shapes = kept_shapes(len(state.offset), len(parameters))
    return refit_of(problem.cache.get_or_make(key, lambda: arrays_of(run()), shapes), model, parameters)


def settle(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[State, Refit]:
    """The same model refitted under the noise that suits it best."""
    levels, _ = best_levels(linear_model(problem, state, fit), state.levels)
    return replace(state, levels=levels), fit_model(problem, state, fit.model, fit.parameters, levels)


def fit_track(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[Refit, Whitener]:
    """The fit that meets the measurements best, as an ordinary fit does: the capture is taken as it is, and what it
    gets wrong counts as noise.  The noise's covariance is that of what such a fit leaves.
    """
    exact = state.without_capture
    found = fit_model(problem, exact, fit.model, fit.parameters, usual_levels(problem.measurements))
    levels, _ = best_levels(linear_model(problem, exact, found), state.levels)
    return found, noise_whitener(problem, exact, levels)


def confirm(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[State, Refit]:
    """The fit on the full model.

    What the full model predicts beyond the reduced one changes little with the parameters: it is added to the reduced
    prediction, which is then fitted again.
    """
    for _ in range(2):
        beyond = _full_prediction(problem, fit.model) - (fit.predicted - state.offset)
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
    size = len(state.cuff)
    empty = LinearModel(problem.measurements, np.zeros(size), Freedom(np.zeros((size, 0)), np.zeros(0)), state.capture)
    return whitener(empty, levels, state.mounting.columns * state.mounting.scales)


def linear_model(problem: DiagnosisProblem, state: State, fit: Refit) -> LinearModel:
    """Measurements less prediction about a fit, as if every parameter still stood at its prior mean."""
    residual = problem.measurements.measured - fit.predicted + fit.sensitivity @ fit.pulls
    free = state.mounting.with_more(fit.sensitivity, fit.scales)
    return LinearModel(problem.measurements, residual, free, state.capture)


def fitted_run(problem: DiagnosisProblem, state: State, fit: Refit) -> FittedRun:
    """The fitted model and its run, as hypotheses see it."""
    run = simulate_reduced(fit.model, problem.prepared)
    return FittedRun(fit.model, problem.prepared, run, problem.measurements, fit.predicted - state.offset)


def get_or_make(problem: DiagnosisProblem, key: str, make: Callable[[], Arrays], shapes: Shapes) -> Arrays:
    """What the cache has under ``key``, or else what ``make`` gives."""
    return problem.cache.get_or_make(key, make, shapes) if problem.cache else make()


def _mounting(problem: DiagnosisProblem, model: Model) -> tuple[Freedom, Array]:
    """What the instruments' mounting does, from the soles' forces in a run of that model."""
    measurements = problem.measurements
    run = simulate_reduced(model, problem.prepared)
    sole = averages(run.time, run.sole_force, measurements.windows)
    later = sensitivities(model, problem.prepared, ["start.clock_offset"], measurements.predict)[1]
    return mounting_freedom(measurements, sole, later[:, 0])


def _full_prediction(problem: DiagnosisProblem, model: Model) -> Array:
    """(N,) what the instruments would measure, by the full model."""

    def run() -> Arrays:
        return {"predicted": problem.measurements.predict(model, simulate(model, problem.motion))}

    key = fingerprint("full model", problem.key, model_to_dict(model))
    shapes = {"predicted": problem.measurements.measured.shape}
    return np.asarray(get_or_make(problem, key, run, shapes)["predicted"], dtype=np.float64)


def _capture_responses(problem: DiagnosisProblem, base: Refit) -> Array:
    """(N, c) what errors of the capture do to the run of a fit, for one radian."""

    def run() -> Arrays:
        errors = capture_errors(problem.motion, problem.prepared)
        columns = responses(base.model, problem.prepared, problem.measurements, errors)
        torso = antenna_responses(problem.motion, base.model, problem.measurements)
        return {"columns": np.column_stack([columns, torso])}

    key = fingerprint("capture", problem.key, base.values)
    shapes = {"columns": (len(base.predicted), None)}
    columns = np.asarray(get_or_make(problem, key, run, shapes)["columns"], dtype=np.float64)
    problem.progress(None, f"{columns.shape[1]} possible errors of the capture")
    return columns
