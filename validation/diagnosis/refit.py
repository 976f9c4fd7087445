"""Refit a model, extended or not, to all measurements at once, under the noise as it is.

    J = ½ ‖W (measured − predicted)‖² + ½ Σ ((p − p₀)/s)²

W whitens the instruments' noise together with what errors of the posture and waves of the snow do to the run.  The
search is NLopt's SLSQP on the reduced model, with the Gauss-Newton curvature of every point it comes to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import LinearModel, NoiseLevels, Whitener, uncertain
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.fitting.optimise import minimise_squares
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.reduced.prepared import Prepared
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities

_ENOUGH = 0.02
"""Change of J, in units of χ²/2, that ends the search."""
_MOST = 30
"""Runs of a search at most."""


@dataclass(frozen=True)
class Parameter:
    """A number that is fitted: its names in the model (several move together), and what is known of it beforehand."""

    names: tuple[NumberRef, ...]
    prior: Prior


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
        """The number of that name, and ``spread`` standard deviations below and above it."""
        for i, parameter in enumerate(self.parameters):
            if name in parameter.names:
                half = spread * float(np.sqrt(self.covariance[i, i]))
                return float(self.values[i]), float(self.values[i]) - half, float(self.values[i]) + half
        raise KeyError(name)


_KEPT = ("values", "predicted", "sensitivity", "objective", "covariance")


def arrays_of(fit: Refit) -> dict[str, Array]:
    """What of a refit is numbers; ``refit_of`` makes it whole again."""
    return {name: np.asarray(getattr(fit, name), dtype=np.float64) for name in _KEPT}


def kept_shapes(size: int, count: int) -> dict[str, tuple[int, ...]]:
    """Shapes of what ``arrays_of`` gives, for ``size`` measurements and ``count`` parameters."""
    shapes = ((count,), (size,), (size, count), (), (count, count))
    return dict(zip(_KEPT, shapes, strict=True))


def refit_of(arrays: Mapping[str, np.ndarray], model: Model, parameters: tuple[Parameter, ...]) -> Refit:
    """The refit of ``model`` by ``parameters`` whose numbers ``arrays_of`` gave."""
    values, predicted, sensitivity, objective, covariance = (np.asarray(arrays[name], float) for name in _KEPT)
    fitted = with_parameters(model, parameters, values)
    return Refit(fitted, parameters, values, predicted, sensitivity, float(objective), covariance)


def with_parameters(model: Model, parameters: tuple[Parameter, ...], values: Array) -> Model:
    """The model with those values."""
    by_name = {name: float(value) for p, value in zip(parameters, values, strict=True) for name in p.names}
    return model.with_values(by_name)


def linear_values(
    linear: LinearModel, levels: NoiseLevels, parameters: Sequence[Parameter], first: int
) -> dict[NumberRef, tuple[float, float]]:
    """Values of ``parameters`` and their standard deviations by a linear model, all else integrated out; ``first`` is
    where they begin among what is free.
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
) -> Refit:
    """Fit ``parameters`` from the model's values on; ``place`` gives the model on its snow surface, and what is added
    (N,) to what the reduced model predicts of it.

    Raises SimulationDiverged when the model cannot be simulated at all.
    """
    measured = measurements.measured
    means = np.array([p.prior.mean for p in parameters])
    sigmas = np.array([p.prior.sigma for p in parameters])
    bounds = np.array([model.bounds(p.names[0]) for p in parameters])
    values = np.array([model.value(p.names[0]) for p in parameters])
    seen: dict[bytes, tuple[Array, Array, Array]] = {}

    def evaluate(at: Array) -> tuple[float, Array, Array]:
        """J, its gradient, and its Gauss-Newton curvature."""
        placed, offset = place(with_parameters(model, parameters, at))
        predicted, sensitivity = _responses(placed, prepared, measurements, parameters)
        predicted = predicted + offset
        table = whiten(np.column_stack([measured - predicted, sensitivity]))
        residual, slopes = table[:, 0], table[:, 1:]
        pull = (at - means) / sigmas
        curvature = np.asarray(slopes.T @ slopes + np.diag(sigmas**-2.0))
        seen[at.tobytes()] = predicted, sensitivity, curvature
        return 0.5 * float(residual @ residual + pull @ pull), -slopes.T @ residual + pull / sigmas, curvature

    minimum = minimise_squares(evaluate, values, bounds, objective_tolerance=_ENOUGH, most=_MOST)
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
    """Prediction (N,) and sensitivity (N, k)."""
    names = [name for p in parameters for name in p.names]
    base, slopes = sensitivities(model, prepared, names, measurements.predict)
    first = np.cumsum([0, *(len(p.names) for p in parameters[:-1])])
    return base, np.asarray(np.add.reduceat(slopes, first, axis=1))
