"""What a fit minimises: the squared distance between simulated and measured antenna, and how far instruments may be
off.

    J = ½ w ∫ c ‖x_exp − x_sim‖² dt + ½ Σ ((p − p₀)/s)²

The paper's objective is the integral alone, every fix counting the same (c = 1).  Its weight w = 1/(2 σ² T) counts the
noise as it is: correlated over a time T, it has as many independent samples as there are stretches of 2 T, and only so
is it weighed rightly against the priors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import median_filter

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, tail_weight
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.observations import Track, predict_fixes
from sssi_exudyn.model.model import Model

_NEIGHBOURS: Final = 9
"""Fixes whose median a fix is held against: up to four of them in a row are noticed."""
_LEAST_SPREAD: Final = 0.3
"""Of a fix's standard deviation: fixes that are closer together than they say are not held to it."""
_FAR_OFF: Final = 0.5
"""What a fix that is far off counts at most."""
_FEW: Final = 1.0 / 3.0
"""Share of fixes that may be far off.  Where more are, the residual is the model's: two fifths of the fixes next to a
first fit on carving snow, which misses them by 2 m; with these set aside no step of its search lessened the misfit."""


@dataclass(frozen=True)
class Prior:
    """What an instrument or an earlier measurement says of a parameter: mean and standard deviation in its unit."""

    mean: float
    sigma: float


@dataclass(frozen=True)
class Problem:
    """One recording's fit: the parameters sought, in order, and what they are judged by.

    model : everything that is not fitted
    names : the fitted numbers, as ``Model.value`` knows them
    priors : of some of them; an empty mapping leaves the paper's bare objective
    weight : w in 1/(m² s)
    counts : (n,) what each fix counts, 0 to 1 (``counts_of``)
    """

    model: Model
    track: Track
    names: tuple[NumberRef, ...]
    priors: Mapping[NumberRef, Prior]
    weight: float
    counts: Array

    @property
    def start(self) -> Array:
        """The parameters as the model has them."""
        return np.array([self.model.value(name) for name in self.names])

    @property
    def bounds(self) -> Array:
        """(k, 2) least and greatest value of each parameter."""
        return np.array([self.model.bounds(name) for name in self.names])

    def with_noise(self, noise: ExponentialNoise) -> Problem:
        """Return the same with the weight that the noise gives."""
        return replace(self, weight=weight_of(noise, self.track))

    def with_counts(self, counts: Array) -> Problem:
        """Return the same with fixes that count so much (n,)."""
        return replace(self, counts=counts)

    def model_at(self, values: Array) -> Model:
        """Return the model with the parameters at ``values`` (k,)."""
        return self.model.with_values(dict(zip(self.names, values, strict=True)))

    def residual(self, model: Model, time: Array, antenna: Array) -> Array:
        """Return measured minus simulated at the fixes, (n, 2) m."""
        return self.track.place - predict_fixes(model, time, antenna, self.track.time)[:, :2]

    def value(self, residual: Array, values: Array) -> float:
        """Return the objective."""
        squares = np.sum(residual**2, axis=1)
        return float(0.5 * self.weight * (squares @ self.seconds) + 0.5 * np.sum(self._pulls(values) ** 2))

    def gradient(self, residual: Array, sensitivity: Array, values: Array) -> Array:
        """Return the gradient (k,) of the objective; sensitivity (n, 2, k) is the derivative of the simulated place."""
        by_path = -self.weight * np.einsum("n,nc,nck->k", self.seconds, residual, sensitivity)
        return np.asarray(by_path + self._pulls(values) / self._sigmas)

    def curvature(self, sensitivity: Array) -> Array:
        """Return the Gauss-Newton approximation (k, k) of the objective's second derivatives."""
        by_path = self.weight * np.einsum("n,nck,ncl->kl", self.seconds, sensitivity, sensitivity)
        return np.asarray(by_path + np.diag(self._sigmas**-2.0))

    def score_covariance(self, sensitivity: Array, noise: ExponentialNoise) -> Array:
        """Return the covariance (k, k) of the gradient when the residual is ``noise``, as it is: correlated in time."""
        apart = np.abs(self.track.time[:, None] - self.track.time[None, :])
        correlation = np.exp(-apart / max(noise.correlation_time, 1e-9)) * noise.sigma**2
        weighted = self.weight * self.seconds[:, None, None] * sensitivity
        by_path = np.einsum("nck,nm,mcl->kl", weighted, correlation, weighted)
        return np.asarray(by_path + np.diag(self._sigmas**-2.0))

    @property
    def seconds(self) -> Array:
        """(n,) s that each fix stands for in the integral (trapezoids), as far as it counts."""
        return np.asarray(self.counts * np.gradient(self.track.time))

    @property
    def _sigmas(self) -> Array:
        return np.array([self.priors[name].sigma if name in self.priors else np.inf for name in self.names])

    def _pulls(self, values: Array) -> Array:
        means = np.array([self.priors[name].mean if name in self.priors else 0.0 for name in self.names])
        return np.asarray((values - means) / self._sigmas)


def weight_of(noise: ExponentialNoise, track: Track) -> float:
    """Return w = 1/(2 σ² T); never more than white noise of the same σ would give at the fixes' own rate."""
    interval = float(np.median(np.diff(track.time)))
    return 1.0 / (noise.sigma**2 * max(2.0 * noise.correlation_time, interval))


def counts_of(track: Track, residual: Array | None = None) -> Array:
    """Return what each fix counts, (n,), 1 for an ordinary one.  It counts less where it says so itself by its standard
    deviation, and, with a residual (n, 2) m, where it is far off its neighbours, as few fixes are.
    """
    counts = np.minimum(1.0, (np.median(track.sigma) / track.sigma) ** 2)
    if residual is None:
        return np.asarray(counts)
    apart = residual - median_filter(residual, size=(_NEIGHBOURS, 1), mode="mirror")
    spread = max(1.4826 * float(np.median(np.abs(apart))), _LEAST_SPREAD * float(np.median(track.sigma)))
    far = np.sum((apart / spread) ** 2, axis=1)
    weight = tail_weight(far, 2)
    return np.asarray(counts if np.mean(weight < _FAR_OFF) > _FEW else np.minimum(counts, weight))


def uncertainty(problem: Problem, sensitivity: Array, noise: ExponentialNoise) -> Array:
    """Return the covariance (k, k) of the fitted parameters: H⁻¹ S H⁻¹, S the score's covariance under the noise as it
    is.
    """
    inverse = np.linalg.pinv(problem.curvature(sensitivity), hermitian=True)
    return np.asarray(inverse @ problem.score_covariance(sensitivity, noise) @ inverse)


def correlations(covariance: Array) -> Array:
    """Return the correlation matrix (k, k)."""
    sigma = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(sigma, sigma))
