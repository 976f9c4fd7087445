"""The state of a search, frozen, and fits under it; a function that changes the state gives the next one.

The state holds what a fit depends on apart from model and parameters: noise levels, what instruments, skier, posture
and snow surface may do, and what the full model predicts beyond the reduced one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import CLOCK_OFFSET, NumberRef
from sssi_exudyn.fitting.estimate import estimate, estimate_from, judging_run
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, Whitener, best_levels, whitener
from sssi_exudyn.fitting.first_fit import with_surface
from sssi_exudyn.fitting.linear_fit import Refit, arrays_of, kept_shapes, refit, refit_of
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.fitting.snow_surface import surface_process
from sssi_exudyn.model.faults import InsoleSensor, LeverArm
from sssi_exudyn.model.model import Model
from sssi_exudyn.runtime.cache import Shapes, fingerprint
from sssi_exudyn.simulation.reduced.prepared import COARSE_STEP, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem, Nuisances, no_nuisances, nuisances_of
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, FittedRun

Arrays = Mapping[str, NDArray[np.generic]]
"""What a cache keeps."""
_STATED: Final = (LeverArm, InsoleSensor)
"""Instruments' parts whose numbers an estimate seeks along."""


@dataclass(frozen=True)
class State:
    """What a fit depends on apart from its model and parameters.

    levels : of the noise;  nuisances : what else may vary
    beyond : (N,) what the full model predicts beyond the reduced one
    estimate : what all is linearised about; None where most of the posture is assumed
    """

    levels: NoiseLevels
    nuisances: Nuisances
    beyond: Array
    estimate: Posterior | None = None

    def offset(self, amounts: Array) -> Array:
        """Return (N,) what is added to the reduced model's prediction on a surface whose modes have these amounts (s,):
        a prediction counts from what was most probable before anything was measured.
        """
        modes = self.nuisances.surface
        return np.asarray(self.nuisances.mean + self.beyond - (modes @ amounts if modes.shape[1] else 0.0))


@dataclass(frozen=True)
class Reestimate:
    """A fit about an estimate of its own: the problem and the state about that."""

    problem: DiagnosisProblem
    state: State
    fit: Refit


def first_fit(problem: DiagnosisProblem, *, full: bool = False) -> tuple[DiagnosisProblem, State, Refit]:
    """Fit the model without anything added, about the estimate of all that is uncertain; and the problem
    prepared for it, with fixes that count by how far off they are.  With ``full`` the full model judges the estimate.
    """
    size = len(problem.measurements.measured)
    recording, motion = problem.recording, problem.motion
    problem = replace(problem, ground=surface_process(problem.model, recording, motion))
    state = State(problem.measurements.usual, no_nuisances(size), np.zeros(size))
    if recording.completed is None:
        made = estimate(
            problem.fitting,
            recording,
            motion,
            full=full,
            comparing=True,
            process=problem.ground,
            cache=problem.cache,
            progress=problem.progress,
        )
        problem = problem.with_residual(made.fitted.residual)
        return linearise_about(*_beneath(problem, made.posterior), problem.parameters)
    base = fit_model(problem, state, problem.model, problem.parameters, state.levels)
    residual = problem.measurements.measured - base.predicted
    blocks = problem.measurements.blocks
    problem = problem.with_residual(np.stack([residual[blocks["x"]], residual[blocks["y"]]], axis=1))
    none = np.zeros(len(problem.errors) + 1)
    beyond = _full_surplus(problem, base.model) if full else state.beyond
    state = replace(state, nuisances=_nuisances(problem, base.model, none, ()), beyond=beyond)
    base = fit_model(problem, state, base.model, base.parameters, state.levels)
    return problem, *settle(problem, state, base)


def _beneath(problem: DiagnosisProblem, posterior: Posterior) -> tuple[DiagnosisProblem, Posterior]:
    """Return the surface as a process beneath the posture of an estimate, whose heights leave waves too short for its
    modes.

    It stays that for all that is compared after.  Taken again from the heights with each explanation, these waves make
    up for what it does to the snow, and a bump that is not there gained 12 in log evidence.
    """
    process = surface_process(posterior.model, problem.recording, problem.motion)
    if process is None or posterior.model.surface is None:
        return problem, posterior
    process = process.at(posterior.model.surface)
    return replace(problem, ground=process), replace(posterior, model=replace(posterior.model, surface=process.surface))


def estimate_again(
    problem: DiagnosisProblem, state: State, fit: Refit, *, full: bool
) -> tuple[DiagnosisProblem, State, Refit]:
    """Fit other terms or faults, about a new estimate of all that is uncertain."""
    if state.estimate is None:
        if full:
            state = replace(state, beyond=_full_surplus(problem, fit.model))
            fit = fit_model(problem, state, fit.model, fit.parameters, state.levels)
        return problem, state, fit
    fit = replace(fit, parameters=tuple(_counted_from_stated(problem, parameter) for parameter in fit.parameters))
    posterior = _estimate_with(problem, fit, state.estimate, full=full, comparing=True)
    return linearise_about(problem, posterior, fit.parameters)


def _counted_from_stated(problem: DiagnosisProblem, parameter: Parameter) -> Parameter:
    """Return a parameter with the prior that its number has about an estimate of its own.

    A clock is uncertain in every estimate.  About an earlier one it counts from what that found, and what was found
    counts as its error.  Were it to count from there later, part of a late clock would be no fault.
    """
    if parameter in problem.parameters:
        return parameter
    try:
        stated = parameter.of(problem.model)
    except InputError:  # of what was found
        return parameter
    return replace(parameter, prior=replace(parameter.prior, mean=stated))


def last_estimate(problem: DiagnosisProblem, state: State, fit: Refit, *, full: bool) -> Posterior | None:
    """Estimate all that is uncertain of a fit's model as a fit of the recording estimates it: that nothing is left over
    of the moment about the pelvis counts too.  None where most of the posture is assumed.
    """
    if state.estimate is None:
        return None
    problem.progress(None, "posture, snow surface and balance at the end")
    return _estimate_with(problem, fit, state.estimate, full=full, comparing=False)


def _estimate_with(
    problem: DiagnosisProblem, fit: Refit, known: Posterior, *, full: bool, comparing: bool
) -> Posterior:
    heights = problem.ground is not None and fit.model.surface is not None
    counted = problem.fitting.with_counts(problem.stamped_by(fit.model).counts)
    return estimate_from(
        fit.model, with_surface(counted, fit.model), problem.recording, problem.motion,
        more={p.names: p.prior for p in found_by(problem, fit)}, known=known,
        full=full, comparing=comparing, heights=heights, cache=problem.cache, progress=problem.progress,
    )  # fmt: skip


def found_by(problem: DiagnosisProblem, fit: Refit) -> list[Parameter]:
    """Return parameters of a fit that the model without anything added does not have, or not as free."""
    return [parameter for parameter in fit.parameters if parameter not in problem.parameters]


def linearise_about(
    problem: DiagnosisProblem, posterior: Posterior, parameters: tuple[Parameter, ...]
) -> tuple[DiagnosisProblem, State, Refit]:
    """Prepare the problem on the posture and the snow surface of an estimate, and fit there.

    Instruments are as they are stated: what is uncertain of them acts linearly.
    """
    sought = [name for parameter in parameters for name in parameter.names]
    owners = {name.owner for name in sought}
    others = (s for s in posterior.model.sensors if s.name in owners or not isinstance(s, _STATED))
    stated = (s for s in problem.model.sensors if s.name not in owners and isinstance(s, _STATED))
    model = replace(posterior.model, sensors=(*others, *stated))
    problem = replace(
        problem,
        ground=None if problem.ground is None or model.surface is None else problem.ground.estimated(model),
        prepared=prepare(model, problem.motion, step=COARSE_STEP),
        key=fingerprint(problem.key, model, posterior.sizes),
    )
    model, _ = problem.place(model)
    seen, beyond = posterior.setting.seen, np.zeros(len(problem.measurements.measured))
    for name, block in problem.measurements.blocks.items():
        if name in seen.blocks:
            beyond[block] = posterior.beyond[seen.blocks[name]]
    nuisances = _nuisances(problem, model, posterior.sizes, sought)
    state = State(problem.measurements.usual, nuisances, beyond, posterior)
    base = fit_model(problem, state, model, parameters, state.levels)
    return problem, *settle(problem, state, base)


def fit_model(
    problem: DiagnosisProblem,
    state: State,
    model: Model,
    parameters: tuple[Parameter, ...],
    levels: NoiseLevels,
    worth: float = np.inf,
) -> Refit:
    """Refit ``parameters`` from the model's values on, under that noise; give up where no J below ``worth`` is in
    sight.
    """

    def run() -> Refit:
        whiten = noise_whitener(problem, state, levels, model)
        return refit(model, parameters, problem.prepared, problem.measurements, whiten, place, worth)

    def place(model: Model) -> tuple[Model, Array]:
        placed, amounts = problem.place(model)
        return placed, state.offset(amounts)

    if problem.cache is None:
        return run()
    # NumPy's arrays and numbers alone are kept; the model follows from them
    key = fingerprint("refit", problem.key, model, parameters, levels, state.beyond, state.nuisances, worth)
    shapes = kept_shapes(len(state.beyond), len(parameters))
    fit = refit_of(problem.cache.get_or_make(key, lambda: arrays_of(run()), shapes), model, parameters)
    return replace(fit, model=problem.place(fit.model)[0])


def settle(problem: DiagnosisProblem, state: State, fit: Refit) -> tuple[State, Refit]:
    """Refit the same model under the noise that suits it best."""
    levels, _ = best_levels(linear_model(problem, state, fit), state.levels)
    return replace(state, levels=levels), fit_model(problem, state, fit.model, fit.parameters, levels)


def remove(problem: DiagnosisProblem, state: State, fit: Refit, candidate: Candidate) -> tuple[State, Refit]:
    """Refit without what the candidate brought."""
    names = candidate.strengths | set(candidate.places)
    model = model_without(problem, fit.model, candidate)
    kept = tuple(p for p in fit.parameters if not names & set(p.names))
    known = tuple(p for p in problem.parameters if names & set(p.names))
    return settle(problem, state, fit_model(problem, state, model, (*kept, *known), state.levels))


def model_without(problem: DiagnosisProblem, model: Model, candidate: Candidate) -> Model:
    """Return the model without what the candidate brought."""
    names = candidate.strengths | set(candidate.places)
    owners = {name.owner for name in names}
    if owners == {CLOCK_OFFSET.owner}:
        return model.with_values({name: problem.model.value(name) for name in names})
    return model.without(owners)


def noise_whitener(problem: DiagnosisProblem, state: State, levels: NoiseLevels, model: Model) -> Whitener:
    """Return a whitener of all that is noise to the parameters of a fit that begins at a model."""
    size, nuisances = len(state.beyond), state.nuisances
    nothing = Freedom(np.zeros((size, 0)), np.zeros(0))
    empty = LinearModel(problem.stamped_by(model), np.zeros(size), nothing, nuisances.sized)
    return whitener(empty, levels, nuisances.fixed.columns * nuisances.fixed.scales)


def linear_model(problem: DiagnosisProblem, state: State, fit: Refit) -> LinearModel:
    """Return measurements less prediction about a fit, as if every parameter still stood at its prior mean."""
    residual = problem.measurements.measured - fit.predicted + fit.sensitivity @ fit.pulls
    nuisances = state.nuisances
    free = nuisances.fixed.with_more(fit.sensitivity, fit.scales)
    return LinearModel(problem.stamped_by(fit.model), residual, free, nuisances.sized)


def linear_without(problem: DiagnosisProblem, state: State, fit: Refit, candidate: Candidate) -> LinearModel:
    """Return measurements less prediction about ``fit``, as if its candidate did nothing where it was placed.

    A number that is uncertain without the candidate, too, as a clock's, stays so.
    """
    kept = np.array([not set(candidate.places) & set(parameter.names) for parameter in fit.parameters])
    parameters = tuple(parameter for parameter, keep in zip(fit.parameters, kept, strict=True) if keep)
    placed = replace(fit, parameters=parameters, values=fit.values[kept], sensitivity=fit.sensitivity[:, kept])
    linear = linear_model(problem, state, placed)
    before = {name: parameter.prior.sigma for parameter in problem.parameters for name in parameter.names}
    scales = [
        before.get(parameter.names[0], 0.0) if candidate.strengths & set(parameter.names) else parameter.prior.sigma
        for parameter in parameters
    ]
    fixed = state.nuisances.fixed
    stays = np.array(scales) > 0.0
    return replace(linear, free=fixed.with_more(placed.sensitivity[:, stays], np.array(scales)[stays]))


def fitted_run(problem: DiagnosisProblem, state: State, fit: Refit) -> FittedRun:
    """Return the fitted model and its run, as hypotheses see it."""
    run = simulate_reduced(fit.model, problem.prepared)
    prediction = _reduced_prediction(problem, state, fit)
    stated = {name: parameter.prior.sigma for parameter in problem.parameters for name in parameter.names}
    stated[CLOCK_OFFSET] = problem.about.clock
    return FittedRun(fit.model, problem.prepared, run, problem.measurements, prediction, stated, problem.thresholds)


def _reduced_prediction(problem: DiagnosisProblem, state: State, fit: Refit) -> Array:
    """Return what the instruments would measure of a fit, (N,), by the reduced model alone."""
    return fit.predicted - state.offset(problem.place(fit.model)[1])


def get_or_make(problem: DiagnosisProblem, key: str, make: Callable[[], Arrays], shapes: Shapes) -> Arrays:
    """Return what the cache has under ``key``, or else what ``make`` gives."""
    return problem.cache.get_or_make(key, make, shapes) if problem.cache else make()


def _full_surplus(problem: DiagnosisProblem, model: Model) -> Array:
    """Return what the full model predicts beyond the reduced one, (N,)."""
    full = problem.measurements.predict(model, judging_run(model, problem.motion, problem.cache))
    return full - problem.measurements.predict(model, simulate_reduced(model, problem.prepared))


def _nuisances(problem: DiagnosisProblem, model: Model, sizes: Array, fitted: Collection[NumberRef]) -> Nuisances:
    """Return ``nuisances_of``, kept in the cache."""

    def run() -> Arrays:
        made = nuisances_of(problem, model, sizes, fitted)
        return {
            "columns": made.free.columns,
            "scales": made.free.scales,
            "posture": made.posture,
            "surface": made.surface,
            "force": made.force,
            "mean": made.mean,
        }

    size = len(problem.measurements.measured)
    key = fingerprint("nuisances", problem.key, model, sizes, sorted(fitted))
    rows = (size, None)
    shapes: Shapes = dict.fromkeys(("columns", "posture", "surface", "force"), rows)
    shapes = {**shapes, "scales": (None,), "mean": (size,)}
    kept = get_or_make(problem, key, run, shapes)
    columns, posture, surface, force, scales, mean = (np.asarray(kept[name], dtype=np.float64) for name in shapes)
    return Nuisances(Freedom(columns, scales), posture, surface, force, mean)
