"""What a linear model's amplitudes are, and refits of a model about which all is linearised.

``estimate`` gives all that is uncertain of a run under its noise.  Slow noise moves an estimate most, and how slow it
is a run of seconds hardly shows: covariances are averaged over how long the fixes' noise remembers.

``refit`` fits a model, extended or not, to all measurements at once, under the noise as it is:

    J = ½ ‖W (measured − predicted)‖² + ½ Σ ((p − p₀)/s)²

W whitens the instruments' noise together with what errors of the posture and waves of the snow do to the run.  The
search is NLopt's SLSQP on the reduced model, with the Gauss-Newton curvature of every point it comes to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import LinearModel, LinearProblem, Uncertain, Whitener, log_posterior, uncertain
from sssi_exudyn.fitting.noise import NoiseLevels, UsualLevels
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.fitting.optimise import minimise_squares, step_back
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced.prepared import Prepared
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities

_ENOUGH: Final = 0.02
"""Change of J, in units of χ²/2, that ends the search."""
_MOST: Final = 30
"""Runs of a search at most."""
_MEMORIES: Final = tuple(2.0 ** (0.5 * k) for k in range(-6, 7))
"""Correlation times of the fixes' noise that are weighed against each other, in units of the declared one."""
_NEGLIGIBLE: Final = 1e-3
"""Probability, of the most probable one's, below which a correlation time is left out."""
_BY_MODEL: Final = ("speed", "load", "difference")
"""Instruments whose noise is larger than usual where the model lacks something; a receiver's fixes often are noisier
than stated.
"""


def estimate_amounts(linear: LinearProblem, levels: NoiseLevels) -> tuple[Array, Array]:
    """Return mean (k,) and covariance (k, k) of all that is uncertain, in standard deviations of what is known of it
    beforehand.
    """
    known = uncertain(linear, levels)
    return known.share(known.residual), np.asarray(cho_solve(known.factor, np.eye(known.columns.shape[1])))


def other_memories(linear: LinearProblem, levels: NoiseLevels) -> list[tuple[float, NoiseLevels]]:
    """Return levels by how long the receiver's fixes remember their error, the slowest noise, with their probabilities;
    σ²/T is kept, which a run shows best.
    """
    usual = linear.measurements.usual.gps.correlation_time
    tried = [levels.remembering("gps", share * usual) for share in _MEMORIES]
    logs = np.array([log_posterior(linear, other) for other in tried])
    weights = np.exp(logs - np.max(logs))
    weights[weights < _NEGLIGIBLE] = 0.0
    weights /= np.sum(weights)
    return [(float(weight), other) for weight, other in zip(weights, tried, strict=True) if weight > 0.0]


def averaged_covariance(linear: LinearProblem, levels: NoiseLevels) -> Array:
    """Return the covariance (k, k) of all that is uncertain, in standard deviations, about its estimate under
    ``levels``, averaged over ``other_memories``.
    """
    mean, _ = estimate_amounts(linear, levels)
    total = np.zeros((len(mean), len(mean)))
    for weight, other in other_memories(linear, levels):
        moved, covariance = estimate_amounts(linear, other)
        total += weight * (covariance + np.outer(moved - mean, moved - mean))
    return total


def draw_amounts(linear: LinearProblem, levels: NoiseLevels, count: int, rng: np.random.Generator) -> Array:
    """Draw amounts (count, k) of all that is uncertain, in standard deviations, less their estimate by ``levels``."""
    mean, _ = estimate_amounts(linear, levels)
    tried = other_memories(linear, levels)
    chosen = rng.choice(len(tried), size=count, p=[weight for weight, _ in tried])
    drawn = np.empty((count, len(mean)))
    for i, (_, other) in enumerate(tried):
        rows = np.flatnonzero(chosen == i)
        known: Uncertain = uncertain(linear, other)
        normal = rng.standard_normal((len(mean), len(rows)))
        off = solve_triangular(known.factor[0], normal, trans="T", lower=True).T
        drawn[rows] = known.share(known.residual) - mean + off
    return drawn


def widening(usual: UsualLevels, levels: NoiseLevels) -> float:
    """Return by how much standard errors grow where noise is larger than its instruments' ``usual`` one: what is left
    over is then no noise alone but what the model lacks, and that does not average out as noise does.

    Source: Birge, Phys. Rev. 40 (1932) 207; the scale factor of the Particle Data Group, Phys. Rev. D 110 (2024)
    030001, section 5.2.
    """
    known, shown = usual.numbers, levels.numbers
    return max([1.0, *(shown[f"{name}.sigma"] / known[f"{name}.sigma"] for name in _BY_MODEL)])


@dataclass(frozen=True)
class Refit:
    """What a refit found.

    model : with the fitted numbers;  parameters, values : (k,) what was fitted
    predicted : (N,) by the reduced model, with what ``place`` adds;  sensitivity : (N, k);  objective : J
    covariance : (k, k) of the values, from the curvature at the end
    """

    model: Model
    parameters: tuple[Parameter, ...]
    values: Array
    predicted: Array
    sensitivity: Array
    objective: float
    covariance: Array

    @property
    def pulls(self) -> Array:
        """(k,) values less what was known beforehand."""
        return np.asarray(self.values - np.array([p.prior.mean for p in self.parameters]))

    @property
    def scales(self) -> Array:
        """(k,) standard deviations of what was known beforehand."""
        return np.array([p.prior.sigma for p in self.parameters])

    def interval(self, name: str, spread: float) -> tuple[float, float, float]:
        """Return the number of that name, and ``spread`` standard deviations below and above it."""
        for i, parameter in enumerate(self.parameters):
            if name in parameter.names:
                half = spread * float(np.sqrt(self.covariance[i, i]))
                return float(self.values[i]), float(self.values[i]) - half, float(self.values[i]) + half
        raise KeyError(name)


_KEPT = ("values", "predicted", "sensitivity", "objective", "covariance")


def arrays_of(fit: Refit) -> dict[str, Array]:
    """Return the numbers of a refit; ``refit_of`` makes it whole again."""
    return {name: np.asarray(getattr(fit, name), dtype=np.float64) for name in _KEPT}


def kept_shapes(size: int, count: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of what ``arrays_of`` gives, for ``size`` measurements and ``count`` parameters."""
    shapes = ((count,), (size,), (size, count), (), (count, count))
    return dict(zip(_KEPT, shapes, strict=True))


def refit_of(arrays: Mapping[str, np.ndarray], model: Model, parameters: tuple[Parameter, ...]) -> Refit:
    """Return the refit of ``model`` by ``parameters`` whose numbers ``arrays_of`` gave."""
    values, predicted, sensitivity, objective, covariance = (np.asarray(arrays[name], float) for name in _KEPT)
    fitted = with_parameters(model, parameters, values)
    return Refit(fitted, parameters, values, predicted, sensitivity, float(objective), covariance)


def with_parameters(model: Model, parameters: tuple[Parameter, ...], values: Array) -> Model:
    """Return the model with those values."""
    by_name = {name: float(value) for p, value in zip(parameters, values, strict=True) for name in p.names}
    return model.with_values(by_name)


def linear_values(
    linear: LinearModel, levels: NoiseLevels, parameters: Sequence[Parameter], first: int
) -> dict[NumberRef, tuple[float, float]]:
    """Return values of ``parameters`` and their standard deviations by a linear model, all else integrated out;
    ``first`` is where they begin among what is free.
    """
    known = uncertain(linear, levels)
    amounts = known.share(known.residual)
    sigmas = np.sqrt(np.diag(cho_solve(known.factor, np.eye(len(amounts)))))
    by_name: dict[NumberRef, tuple[float, float]] = {}
    for i, parameter in enumerate(parameters, first):
        scale = float(linear.free.scales[i])
        value = parameter.prior.mean + scale * float(amounts[i]), scale * float(sigmas[i])
        by_name |= dict.fromkeys(parameter.names, value)
    return by_name


def refit(
    model: Model,
    parameters: tuple[Parameter, ...],
    prepared: Prepared,
    measurements: Measurements,
    whiten: Whitener,
    place: Callable[[Model], tuple[Model, Array]],
    worth: float = np.inf,
) -> Refit:
    """Fit ``parameters`` from the model's values on; ``place`` gives the model on its snow surface, and what is added
    (N,) to what the reduced model predicts of it.  The search gives up where it promises no J below ``worth``.

    Raises SimulationDiverged when the model cannot be simulated at all.
    """
    measured = measurements.measured
    means = np.array([p.prior.mean for p in parameters])
    sigmas = np.array([p.prior.sigma for p in parameters])
    bounds = np.array([model.bounds(p.names[0]) for p in parameters])
    values = np.array([model.value(p.names[0]) for p in parameters])
    seen: dict[bytes, tuple[Array, Array, Array]] = {}

    def evaluate(at: Array) -> tuple[float, Array, Array]:
        """Return J, its gradient, and its Gauss-Newton curvature."""
        placed, offset = place(with_parameters(model, parameters, at))
        predicted, sensitivity = _responses(placed, prepared, measurements, parameters)
        predicted = predicted + offset
        table = whiten(np.column_stack([measured - predicted, sensitivity]))
        residual, slopes = table[:, 0], table[:, 1:]
        pull = (at - means) / sigmas
        curvature = np.asarray(slopes.T @ slopes + np.diag(sigmas**-2.0))
        seen[at.tobytes()] = predicted, sensitivity, curvature
        return 0.5 * float(residual @ residual + pull @ pull), -slopes.T @ residual + pull / sigmas, curvature

    search = step_back(evaluate)
    minimum = minimise_squares(search, values, bounds, objective_tolerance=_ENOUGH, most=_MOST, worth=worth)
    predicted, sensitivity, curvature = seen[minimum.values.tobytes()]
    return Refit(
        place(with_parameters(model, parameters, minimum.values))[0],
        parameters,
        minimum.values,
        predicted,
        sensitivity,
        minimum.objective,
        np.asarray(np.linalg.inv(curvature)),
    )


def _responses(
    model: Model, prepared: Prepared, measurements: Measurements, parameters: tuple[Parameter, ...]
) -> tuple[Array, Array]:
    """Return prediction (N,) and sensitivity (N, k)."""
    names = [name for p in parameters for name in p.names]
    base, slopes = sensitivities(model, prepared, names, measurements.predict)
    first = np.cumsum([0, *(len(p.names) for p in parameters[:-1])])
    return base, np.asarray(np.add.reduceat(slopes, first, axis=1))
