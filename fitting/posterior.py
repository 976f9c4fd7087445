"""One estimate of all that is uncertain about a run: friction, start, snow surface, capture, skier, instruments.

Every number has a prior from its instrument.  A round linearises the reduced model about the best estimate, by all
numbers θ that the laws and instruments know and by the errors η of posture and mass, in standard deviations.  η is
eliminated, as its priors are narrow and the measurements linear within them, and NLopt's SLSQP finds θ within its
bounds:

    J(θ) = ½ rᵀ C⁻¹ r + ½ Σ ((θ − θ₀)/s)²,   C = noise + N Nᵀ + D Dᵀ,   η = Nᵀ C⁻¹ r

r measured less predicted, N the responses to η, D those to a drag area that changes within turns.  The posture is
corrected by η, the model runs again, and a step that does not lessen the misfit is halved.  Rounds end where nothing
moves any more.

What is then not known of θ is a sum, θ̂ − θ = K (N η + e) + P Λ (θ₀ − θ) with K = P Xᵀ C⁻¹, so that every group has its
part of the variance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.linalg import cho_solve

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom, LinearProblem, best_levels, log_evidence, precision
from sssi_exudyn.fitting.linear_fit import averaged_covariance, draw_amounts, widening
from sssi_exudyn.fitting.linearised_run import (
    Point,
    Responses,
    Setting,
    linearise,
    linearise_at,
    linearise_numbers,
    moved_point,
    point_at,
    responses_to_numbers,
)
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.optimise import Optimum, minimise
from sssi_exudyn.fitting.parameters import DRAG
from sssi_exudyn.model.model import Model
from sssi_exudyn.runtime.threads import both
from sssi_exudyn.simulation.reduced.run import simulate_reduced

MEASUREMENTS: Final = "measurements"
"""Where the uncertainty by the instruments' noise is counted."""
ROUNDS: Final = 12
_SETTLED: Final = 0.15
"""Standard deviations by which nothing moves any more."""
_ROUGHLY: Final = 0.6
"""The same of an estimate that others go on from."""
_CLOSE: Final = 1.0
"""Of the misfit that the linear form still promises, within which an estimate for comparing hypotheses ends: less than
what two names differ by.  Damped steps are short where much is left: on a hill estimates ended 4 to 20 above.
"""
_WORTH: Final = 0.1
"""Of the misfit that a round takes away, with which such an estimate goes on where more than ``_CLOSE`` is promised.  A
step that is damped moves hardly anything: the estimate with a patch ended 5 above where it ends from its true place.
"""
_STRAIGHT: Final = 1.0
"""Standard deviations of a last move within which a search has converged."""
_BENT: Final = 2.0
"""Standard deviations by which the posture moves until the responses to its errors are computed again: angles of few
degrees, which change them by some per cent, so that each round still takes away most of what is left.
"""
_BENT_AT_THE_END: Final = 0.5
"""The same for a search that has nearly settled: where no step lessens the misfit by old responses, new ones may."""
_TOLERANCE: Final = 1e-6
"""Of J where its linear form is searched."""
_DAMPINGS: Final = (0.0, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5)
"""Of steps that are tried."""
_KEPT: Final = 0.5
"""Share of the promised decrease of the misfit with which a step is taken."""
_ROUGH: Final = 0.1
"""Share of the misfit that may be promised at the end of a search that has converged."""
_CALMER: Final = 2.5
"""Ratio of the moves of two rounds, one after the other, that is usual: the time left is predicted by it."""
_JUDGED: Final = 2.0
"""Rounds that are as long as a run of the full model and the round after it."""


@dataclass(frozen=True)
class Posterior:
    """What is known after an estimate.

    model : with numbers, mass and posture as estimated;  setting : what was sought
    values, covariance : θ (k,) and (k, k), all else integrated out
    sizes : (m,) η, in standard deviations, the skier's mass last
    shares : standard deviation of each of θ (k,) by the group that it comes from; their squares add up
    levels : of the noise;  predicted : (N,) what would be measured of the model
    beyond : (N,) what of that the full model adds to the reduced one;  responses : of the last round
    optimum : how the last search ended, its objective that of the last point;  rounds : linearisations
    moved : standard deviations by which the last round moved
    """

    model: Model
    setting: Setting
    values: Array
    covariance: Array
    sizes: Array
    shares: Mapping[str, Array]
    levels: NoiseLevels
    predicted: Array
    beyond: Array
    responses: Responses
    optimum: Optimum
    rounds: int
    moved: float

    def share(self, name: str) -> dict[str, float]:
        """Return the parts of one number's variance by group, the largest first."""
        i = self.setting.names.index(name)
        parts = {group: float(sigma[i] ** 2 / self.covariance[i, i]) for group, sigma in self.shares.items()}
        return dict(sorted(parts.items(), key=lambda part: -part[1]))

    def interval(self, name: str, spread: float) -> tuple[float, float, float]:
        """The number of that name, and ``spread`` standard deviations below and above it."""
        i = self.setting.names.index(name)
        ends = self.values[:, None] + np.sqrt(np.diag(self.covariance))[:, None] * np.array([0.0, -spread, spread])
        value, low, high = self.setting.in_units(ends.T)[:, i].tolist()
        return value, low, high

    @property
    def numbers(self) -> Array:
        """(k,) the model's numbers that were sought, each in its unit."""
        return self.setting.in_units(self.values)

    @property
    def covariance_of_numbers(self) -> Array:
        """(k, k) covariance of ``numbers``."""
        slopes = self.setting.slopes(self.model)
        return np.asarray(self.covariance * np.outer(slopes, slopes))

    def model_where(self, known: Mapping[NumberRef, float]) -> Model:
        """Return the model where some numbers of θ are ``known``: the others are where they most probably are then, by
        their covariance with these.
        """
        model = self.model.with_values(dict(known))
        held = np.array([bool(set(unknown.names) & known.keys()) for unknown in self.setting.unknowns])
        values = self.setting.values(model)
        across = self.covariance[np.ix_(~held, held)]
        values[~held] += across @ np.linalg.solve(self.covariance[np.ix_(held, held)], (values - self.values)[held])
        return self.setting.at(model, np.clip(values, *self.setting.bounds(model).T))

    @property
    def track_error(self) -> float:
        """Mean horizontal distance (m) of the antenna from the fixes."""
        blocks = self.setting.seen.blocks
        return float(np.mean(np.hypot(self.residual[blocks["x"]], self.residual[blocks["y"]])))

    @property
    def widened(self) -> float:
        """Return by how much standard errors were widened for what the model lacks."""
        return widening(self.setting.seen.usual, self.levels)

    @property
    def linear(self) -> LinearProblem:
        """The run linearised about the estimate: θ first, then η, the changing drag, and where heights count from."""
        return _linear(self.setting, self, self.responses)

    @property
    def log_evidence(self) -> float:
        """Log probability density of all measurements (SI units), all that is uncertain integrated out about the
        estimate: what two laws leave of one recording may be compared by it.
        """
        return log_evidence(self.linear, self.levels)

    @property
    def residual(self) -> Array:
        """(N,) measured less predicted."""
        return np.asarray(self.setting.seen.measured - self.predicted)


def find_posterior(
    model: Model,
    setting: Setting,
    full: Callable[[Model], Array] | None = None,
    say: Advance = silent,
    known: Posterior | None = None,
    *,
    comparing: bool = False,
) -> Posterior:
    """Estimate all that is uncertain, from the numbers that the model has; it is of posture and mass as captured, or as
    an estimate of a similar model already ``known`` has them.  Single readings count less by how far off they are, and
    it ends where nothing moves any more: a place for ``comparing`` hypotheses takes every reading at its word, as their
    evidence does, and ends roughly there.

    ``full`` predicts the measurements (N,) by the full model, the moments left at zero; where the rounds have settled,
    what it predicts beyond the reduced model is added, and they go on.

    Raises SimulationDiverged when a simulation does.
    """
    point, responses = linearise_at(model, setting) if known is None else _linearise_known(model, setting, known)
    seen = setting.seen
    if seen.times["moment_f"].size > 0 and not is_carved(point.model.terms):  # no onset of friction where edges cut
        seen = seen.with_slip_noise(point.model, simulate_reduced(point.model, point.prepared))
    levels: NoiseLevels = seen.usual
    setting = replace(setting, seen=seen)
    linearised, moved, share = point.sizes, np.inf, 0.0
    for rounds in range(1, ROUNDS + 1):
        if rounds > 1 and not comparing:
            setting = replace(setting, seen=seen.weighed(seen.measured - point.predicted, levels))
        levels, _ = best_levels(_linear_by_waves(setting, point, responses), levels)
        setting = setting.with_waves(levels.surface)
        solution = solve(setting, point, responses, levels)
        before = point
        point, misfit, gained = _step(setting, point, responses, levels, solution)
        left = misfit - solution.optimum.objective
        kept = gained > _KEPT * (gained + left)
        spread = np.sqrt(np.diag(solution.covariance))
        changes = (setting.values(point.model) - setting.values(before.model)) / spread
        moved = float(np.max(np.abs(np.concatenate([changes, point.sizes - before.sizes]))))
        estimated = _share_done(rounds, moved, _ROUGHLY if comparing else _SETTLED, judged=full is not None)
        share = max(share, estimated)  # a round may move more than the one before
        say(share, f"round {rounds}: moved by {moved:.2f} standard deviations, {_description(point.model)}")
        bend, roughly = _bend(point, linearised), comparing and left < _CLOSE
        judge = full if moved < _STRAIGHT or rounds == ROUNDS - 1 else None
        goes_on = comparing and left > _CLOSE and gained > _WORTH
        if rounds == ROUNDS or (judge is None and not goes_on and _ends(moved, bend, roughly=roughly)):
            break
        bent = _BENT if moved > _STRAIGHT else _BENT_AT_THE_END
        again = not kept or bend > bent or (comparing and moved < _ROUGHLY)
        following = partial(linearise, setting) if again else partial(linearise_numbers, setting, known=responses)
        linearised = point.sizes if again else linearised
        if judge is None:
            responses = following(point)
        else:  # on a core each
            say(None, "full model")
            responses, point = both(partial(following, point), partial(_judged, setting, point, judge))
            full = None
    covariance, shares = _in_the_end(setting, point, responses, levels, solution)
    return Posterior(
        model=point.model,
        setting=setting,
        values=setting.values(point.model),
        covariance=covariance,
        sizes=point.sizes,
        shares=shares,
        levels=levels,
        predicted=point.predicted,
        beyond=point.beyond,
        responses=responses,
        optimum=ending_of(solution.optimum, misfit, moved),
        rounds=rounds,
        moved=moved,
    )


def _judged(setting: Setting, point: Point, full: Callable[[Model], Array]) -> Point:
    """Return the point with what the full model predicts of it beyond the reduced one.

    Raises SimulationDiverged when its simulation does.
    """
    surplus = full(point.model) - (point.predicted - point.beyond)
    surplus[setting.seen.moments] = 0.0
    return replace(point, predicted=point.predicted - point.beyond + surplus, beyond=surplus)


def _in_the_end(
    setting: Setting, point: Point, responses: Responses, levels: NoiseLevels, solution: Solution
) -> tuple[Array, dict[str, Array]]:
    """Return θ's covariance (k, k) and standard deviations (k,) by group.  They are averaged over how long the fixes'
    noise remembers, and widened by what the model lacks.
    """
    k = len(setting.unknowns)
    averaged = averaged_covariance(_linear(setting, point, responses), levels)[:k, :k]
    covariance = averaged * np.outer(setting.sigmas, setting.sigmas)
    of_noise = solution.shares[MEASUREMENTS] ** 2 + np.diag(covariance - solution.covariance)
    shares = {**solution.shares, MEASUREMENTS: np.sqrt(np.maximum(of_noise, 0.0))}
    wide = widening(setting.seen.usual, levels)
    return covariance * wide**2, {group: wide * share for group, share in shares.items()}


def _share_done(rounds: int, moved: float, settled: float, *, judged: bool) -> float:
    """Return roughly which share of a search is done after so many ``rounds``, the last of which ``moved`` so much;
    ``judged`` says whether the full model has still to judge it.
    """
    more = np.clip(np.log(moved / settled) / np.log(_CALMER), 0.0, ROUNDS - rounds) if moved > 0.0 else 0.0
    return float(rounds / (rounds + more + (_JUDGED if judged else 0.0)))


def _ends(moved: float, bend: float, *, roughly: bool) -> bool:
    """Return whether a search ends that ``moved`` so much by responses so far away."""
    most, away = (_ROUGHLY, _BENT) if roughly else (_SETTLED, _BENT_AT_THE_END)
    return moved < most and bend < away


def _bend(point: Point, linearised: Array) -> float:
    """Return by how many standard deviations the posture's errors are from where the responses to them are known."""
    return float(np.max(np.abs(point.sizes - linearised)[:-1], initial=0.0))


def _linearise_known(model: Model, setting: Setting, known: Posterior) -> tuple[Point, Responses]:
    """Linearise as ``linearise_at`` does, with the errors of posture and mass of an estimate already ``known``.  Its
    responses to them are taken where it has the same measurements, errors and heading.
    """
    before = known.setting
    sizes = setting.sizes_of(before.errors, known.sizes)
    point = point_at(setting, model, sizes, np.zeros(len(setting.seen.measured)))
    same = before.seen.blocks == setting.seen.blocks and before.errors == setting.errors
    if not same or known.model.heading.is_found != model.heading.is_found:
        return point, linearise(setting, point)
    by_number = responses_to_numbers(setting, point, setting.unknowns, ())
    return point, replace(known.responses, by_number=by_number)


def ending_of(optimum: Optimum, misfit: float, moved: float) -> Optimum:
    """Return how the search ended.  It has not converged while it still moves by what matters, nor where no step takes
    away what the linear form of the misfit promises; the ``optimum``'s objective is what that would leave.
    """
    if moved >= _STRAIGHT:
        reason = f"stopped: the last of {ROUNDS} rounds moved by {moved:.1f} standard deviations"
        return replace(optimum, objective=misfit, converged=False, reason=reason)
    promised = 1.0 - optimum.objective / misfit if misfit > 0.0 else 0.0
    if promised > _ROUGH:
        reason = f"stopped: no step lessens the misfit, though its linear form promises {promised:.0%}"
        return replace(optimum, objective=misfit, converged=False, reason=reason)
    return replace(optimum, objective=misfit)


def _description(model: Model) -> str:
    if is_carved(model.terms):
        numbers = (model.value(f"carving.{name}") for name in ("mu", "hardness", "strength"))
        return "mu {:.4f}, hardness {:.3g} N/m³, strength {:.3g} Pa".format(*numbers)
    return f"mu_t {model.friction.mu_t:.4f}, mu_n {model.friction.mu_n:.4f}"


@dataclass(frozen=True)
class _Whitened:
    """A linearised point in units of noise.

    residual : (N,) were η zero;  numbers, errors, drag : (N, k), (N, m), (N, c)
    """

    residual: Array
    numbers: Array
    errors: Array
    drag: Array

    def held(self, by_number: Array, by_error: float, sizes: Array) -> _Whitened:
        """Return the rows and further ones that hold θ, weighed (k,), and η where they are."""
        k, m = self.numbers.shape[1], self.errors.shape[1]
        return _Whitened(
            np.concatenate([self.residual, np.zeros(k), by_error * sizes]),
            np.vstack([self.numbers, np.diag(by_number), np.zeros((m, k))]),
            np.vstack([self.errors, np.zeros((k, m)), by_error * np.eye(m)]),
            np.vstack([self.drag, np.zeros((k + m, self.drag.shape[1]))]),
        )


def _whiten(setting: Setting, point: Point | Posterior, responses: Responses, levels: NoiseLevels) -> _Whitened:
    residual = setting.seen.measured - point.predicted + responses.by_error @ point.sizes
    parts = [responses.by_number, responses.by_error, responses.by_drag]
    table = setting.seen.whiten(levels, np.column_stack([residual, *parts]))
    return _Whitened(table[:, 0], *np.split(table[:, 1:], np.cumsum([part.shape[1] for part in parts[:-1]]), axis=1))


def draw_numbers(found: Posterior, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """θ (count, k), within their bounds, and η (count, m), drawn together from what is known about the estimate."""
    setting = found.setting
    off = draw_amounts(found.linear, found.levels, count, rng)
    k = len(setting.unknowns)
    bounds = setting.bounds(found.model)
    values = np.clip(found.values + found.widened * off[:, :k] * setting.sigmas, bounds[:, 0], bounds[:, 1])
    return setting.in_units(values), found.sizes + off[:, k : k + len(found.sizes)]


def _linear(setting: Setting, point: Point | Posterior, responses: Responses) -> LinearProblem:
    """Return a run linearised about a point in θ, η, the changing drag and where heights count from."""
    seen = setting.seen
    ahead = responses.by_error @ point.sizes + responses.by_number @ (setting.values(point.model) - setting.means)
    columns = np.column_stack([responses.by_number, responses.by_error, responses.by_drag, seen.height_origin])
    scales = np.ones(columns.shape[1])
    scales[: len(setting.sigmas)] = setting.sigmas
    return LinearProblem(seen, seen.measured - point.predicted + ahead, Freedom(columns, scales))


def _linear_by_waves(setting: Setting, point: Point, responses: Responses) -> LinearProblem:
    """Return the same with the waves of the snow apart, whose size beforehand is a level of the noise."""
    whole, waves = _linear(setting.with_waves(1.0), point, responses), np.flatnonzero(setting.waves)
    free = Freedom(np.delete(whole.free.columns, waves, axis=1), np.delete(whole.free.scales, waves))
    return replace(whole, free=free, sized={"surface": whole.free.columns[:, waves]})


@dataclass(frozen=True)
class Solution:
    """The linear problem's solution: the step of θ (k,), η (m,), θ's covariance and whose it is.

    drag : (N, c) responses to the changing drag, in units of noise
    """

    optimum: Optimum
    step: Array
    sizes: Array
    covariance: Array
    shares: Mapping[str, Array]
    drag: Array


def solve(setting: Setting, point: Point, responses: Responses, levels: NoiseLevels, damping: float = 0.0) -> Solution:
    """Solve the linear problem about a point; ``damping`` holds θ and η there, as if they were known to 1/√damping of
    their priors' spread.
    """
    white = _whiten(setting, point, responses, levels)
    drag = white.drag
    if damping > 0.0:
        white = white.held(np.sqrt(damping) / setting.sigmas, np.sqrt(damping), point.sizes)
    integrated = np.column_stack([white.errors, white.drag])
    factor = precision(integrated)

    def without_errors(columns: Array) -> Array:
        """Return C⁻¹ times the columns."""
        return np.asarray(columns - integrated @ cho_solve(factor, integrated.T @ columns))

    weighted = without_errors(white.numbers)
    by_measurements = white.numbers.T @ weighted
    curvature = by_measurements + np.diag(setting.sigmas**-2.0)
    before = setting.values(point.model)
    pull, rest = weighted.T @ white.residual, float(white.residual @ without_errors(white.residual))

    def evaluate(at: Array) -> tuple[float, Array]:
        step, prior = at - before, (at - setting.means) / setting.sigmas
        value = 0.5 * (rest + float(step @ by_measurements @ step - 2.0 * pull @ step + prior @ prior))
        return value, np.asarray(by_measurements @ step - pull + prior / setting.sigmas)

    bounds = setting.bounds(point.model)
    start = np.clip(before, bounds[:, 0], bounds[:, 1])
    optimum = minimise(evaluate, start, bounds, curvature, objective_tolerance=_TOLERANCE)
    step = optimum.values - before
    covariance = np.asarray(np.linalg.inv(curvature), dtype=np.float64)
    return Solution(
        optimum,
        step,
        np.asarray(cho_solve(factor, integrated.T @ (white.residual - white.numbers @ step))[: white.errors.shape[1]]),
        covariance,
        _shares(setting, covariance, weighted, integrated),
        drag,
    )


def _shares(setting: Setting, covariance: Array, weighted: Array, integrated: Array) -> dict[str, Array]:
    """Return standard deviations of θ (k,) by the group that they come from."""
    gain = covariance @ weighted.T  # K
    variances: dict[str, Array] = {MEASUREMENTS: np.sum(gain**2, axis=1)}
    of_integrated = (gain @ integrated) ** 2
    of_errors = setting.groups()
    of_errors += [DRAG] * (integrated.shape[1] - len(of_errors))
    of_priors = covariance**2 / setting.sigmas**2
    own = [unknown.group for unknown in setting.unknowns]
    for groups, parts in ((of_errors, of_integrated), (own, of_priors)):
        for i, group in enumerate(groups):
            variances[group] = variances.get(group, np.zeros(len(gain))) + parts[:, i]
    return {group: np.sqrt(variance) for group, variance in variances.items()}


def _step(
    setting: Setting, point: Point, responses: Responses, levels: NoiseLevels, solution: Solution
) -> tuple[Point, float, float]:
    """Return the next point, its misfit, and by how much that is less than before.

    The point is that of the whole step, or the best of steps that are damped more and more (Levenberg and Marquardt).
    """
    before = setting.values(point.model)
    drag = solution.drag
    first = _misfit(setting, levels, before, point.sizes, point.predicted, drag)
    promised = first - solution.optimum.objective
    best, least = point, first
    for damping in _DAMPINGS:
        if damping > 0.0:
            solution = solve(setting, point, responses, levels, damping)
        values = before + solution.step
        try:
            trial = moved_point(setting, point, responses, values, solution.sizes)
        except SimulationDiverged:
            continue
        misfit = _misfit(setting, levels, values, solution.sizes, trial.predicted, drag)
        if misfit < least:
            best, least = trial, misfit
        elif best is not point:
            break
        if first - least > _KEPT * promised:
            break
    return best, least, first - least


def _misfit(setting: Setting, levels: NoiseLevels, values: Array, sizes: Array, predicted: Array, drag: Array) -> float:
    """Return half of χ², of the measurements and of what was known beforehand; the changing ``drag``, whose responses
    (N, c) are in units of noise, is as it fits best.
    """
    residual = setting.seen.whiten(levels, (setting.seen.measured - predicted)[:, None])[:, 0]
    by_drag = drag.T @ residual
    explained = float(by_drag @ cho_solve(precision(drag), by_drag))
    prior = (values - setting.means) / setting.sigmas
    return 0.5 * float(residual @ residual - explained + prior @ prior + sizes @ sizes)
