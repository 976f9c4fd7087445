"""Autocorrelated noise: correlated neighbours carry less information than their number.

The error of a GPS fix keeps nearly the same direction for seconds.  The model here is the stationary process with an
exponential correlation, cov(t, t') = σ² exp(−|t − t'|/T) (Ornstein-Uhlenbeck; sampled evenly it is AR(1)).  It is
Markov, so each sample needs only the one before, at any spacing:

    e₀ = r₀/σ,   e_k = (r_k − φ_k r_{k−1}) / (σ √(1 − φ_k²)),   φ_k = exp(−Δt_k/T)

are independent with variance one.  Source: Rasmussen and Williams 2006, appendix B.2; Sokal 1997 for the window.

Single samples that are far off count less (``tail_weight``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import chdtri, ndtri  # chi2.isf, norm.ppf; all of scipy.stats takes half a second to load

from sssi_exudyn.core.frames import Array

NORMAL_90: Final = float(ndtri(0.95))
"""Standard deviations on either side of the mean that hold 90 % of a normal distribution."""
_SOKAL_WINDOW = 5.0
"""The sum of correlations stops at five autocorrelation times: later lags add noise only (Sokal 1997)."""

_RARE: Final = 0.0124
"""Share of ordinary samples that lie beyond the distance of full weight: in one dimension 2.5 standard deviations."""


@dataclass(frozen=True)
class ExponentialNoise:
    """Noise of standard deviation ``sigma`` (the residual's unit) and ``correlation_time`` (s; 0 is white)."""

    sigma: float
    correlation_time: float


@dataclass(frozen=True)
class Scale:
    """Factors by which samples are noisier than usual ones.

    lasting : (n,) above 0, the factor that neighbours share: a receiver has lost its solution for seconds
    total : (n,) the factor with each sample's own error, such as one fix that is far off; nowhere below ``lasting``
    """

    lasting: Array
    total: Array

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> Scale:
        return Scale(self.lasting[rows], self.total[rows])

    @property
    def least(self) -> float:
        """Scale s₀ of the least noisy samples."""
        return float(np.min(self.lasting))

    @property
    def excess(self) -> Array:
        """Excess (n,) d = √((s/s₀)² − 1) of the lasting scale s."""
        return np.asarray(np.sqrt(np.maximum((self.lasting / self.least) ** 2 - 1.0, 0.0)))

    @property
    def alone(self) -> Array:
        """Variance (n,) r of each sample's own error, in units of the variance of the least noisy samples."""
        return np.asarray(np.maximum(self.total**2 - self.lasting**2, 0.0) / self.least**2)

    @property
    def even(self) -> bool:
        """Return whether all samples have the same scale."""
        return bool(np.all(self.total == self.least))


def tail_weight(square: Array, dimensions: int) -> Array:
    """Weigh samples by the square of their distance r in standard deviations.

    The weight is 1 up to a distance c that few ordinary samples exceed, and (c/r)² beyond it.  The density is
    exp(−r²/2), with tails that fall as |r| to the power −c².

    The weights of a Student distribution, 5/(4 + r²), also raise near samples and lower ordinary ones.  With Gaussian
    noise they gave standard errors that were a tenth too small.

    Source: Huber and Ronchetti, Robust Statistics (2009), 4.8, redescending estimates.
    """
    return np.minimum(1.0, float(chdtri(dimensions, _RARE)) / np.maximum(square, 1e-12))


def whiten(time: Array, residual: Array, noise: ExponentialNoise) -> Array:
    """Whiten a residual: if it is such noise, the result is independent numbers of variance one.

    Parameters
    ----------
    time : (n,) s, increasing
    residual : (n,) or (n, d); the d columns are independent of each other

    Returns an array of the residual's shape.
    """
    steps, spread = _steps(time, residual, noise.correlation_time)
    return steps / (noise.sigma * spread)


def whiten_with_slope(time: Array, residual: Array, noise: ExponentialNoise) -> tuple[Array, Array, float]:
    """Whiten a residual and differentiate by the logarithm of the correlation time.

    Returns the whitened residual, its derivative, and the derivative of ``log_divisors``.  Arguments are those of
    ``whiten``, the correlation time above 0.
    """
    steps, spread = _steps(time, residual, noise.correlation_time)
    white = steps / (noise.sigma * spread)
    column = (slice(None),) + (None,) * (residual.ndim - 1)
    decay = np.diff(time)[column] / noise.correlation_time
    kept = np.exp(-decay)
    share = kept * decay / spread[1:]  # of φ's own derivative
    slope = np.zeros_like(white)
    slope[1:] = share * (kept * white[1:] / spread[1:] - residual[:-1] / noise.sigma)
    return white, slope, -float(np.sum(kept * share / spread[1:]))


def log_divisors(time: Array, noise: ExponentialNoise) -> float:
    """Return Σ log(σ √(1 − φ²)), the logarithm of what ``whiten`` divides by, for samples at ``time`` (n,).

    It turns a density of whitened numbers into one of the measured numbers.  The correlation time is above 0.
    """
    decay = np.diff(time) / noise.correlation_time
    return len(time) * float(np.log(noise.sigma)) + 0.5 * float(np.sum(np.log(-np.expm1(-2.0 * decay))))


def parts_in_cells(edges: Array, noise: ExponentialNoise, held: float) -> Array:
    """Return (c, c) independent parts of ``covariance_in_cells``: a column each."""
    return np.asarray(np.linalg.cholesky(covariance_in_cells(edges, noise, held)))


def covariance_in_cells(edges: Array, noise: ExponentialNoise, held: float) -> Array:
    """Return the covariance (c, c) of a process' means over the cells between ``edges`` (c + 1,) s.

    The process stays the same for ``held`` (s) at a time.  So a cell of that length has its variance, and a longer one
    less: its mean is that of n independent steps of h s, with ρ = exp(−h/T) from one to the next.

        σ² (n + 2 Σ (n − k) ρᵏ) / n²   within a cell, k from 1 to n − 1
        σ² g gᵀ exp(−Δ/T)   between middles that are Δ apart,   g = sinh(n h / 2T) / (n sinh(h / 2T))
    """
    lengths, middles = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    steps = np.maximum(1.0, np.round(lengths / held))
    decay = lengths / (steps * noise.correlation_time)
    ratio = np.exp(-decay)
    longer = (ratio * (steps - 1.0) - steps * ratio**2 + ratio ** (steps + 1.0)) / (1.0 - ratio) ** 2
    gain = np.sinh(0.5 * steps * decay) / (steps * np.sinh(0.5 * decay))
    apart = np.abs(middles[:, None] - middles) / noise.correlation_time
    covariance = np.outer(gain, gain) * np.exp(-apart)
    np.fill_diagonal(covariance, (steps + 2.0 * longer) / steps**2)
    return np.asarray(noise.sigma**2 * covariance)


def uneven_covariance(time: Array, noise: ExponentialNoise, scale: Scale) -> Array:
    """Return the covariance (n, n) of noise that is ``scale`` times larger at some samples at ``time`` (n,) s.

        e = σ₀ (a + d b + √r c),   σ₀ = s₀ σ

    a and b are independent processes of variance one with the same correlation, and d is the ``excess``.  c is
    independent from sample to sample, and r is the variance that a sample has ``alone``.  So a sample that is far off
    carries no information on its neighbours.  If the noise were s σ a instead, a fix off by half a metre would fix its
    neighbours' error, a twentieth of its own, to a few millimetres.  If single outliers were part of b, an outlier to
    the other side within a noisy spell would be next to impossible.  The correlation time is above 0.
    """
    more = scale.excess
    decay = np.exp(-np.abs(time[:, None] - time) / noise.correlation_time)
    return np.asarray((scale.least * noise.sigma) ** 2 * (decay * (1.0 + np.outer(more, more)) + np.diag(scale.alone)))


def draw_noise(rng: np.random.Generator, time: Array, noise: ExponentialNoise) -> Array:
    """Draw noise (n,) of this kind at increasing ``time`` (n,); the correlation time is above 0."""
    out = np.empty(len(time))
    for k in range(len(time)):
        kept = np.exp(-(time[k] - time[k - 1]) / noise.correlation_time) if k else 0.0
        out[k] = noise.sigma * np.sqrt(1.0 - kept**2) * rng.normal() + (kept * out[k - 1] if k else 0.0)
    return out


def fit_noise(time: Array, residual: Array, longest: float = np.inf) -> ExponentialNoise:
    """Estimate the most likely σ and correlation time of a residual of zero mean; arguments as for ``whiten``.

    For each T the best σ² is the mean square of the samples whitened with σ = 1; T is searched between a tenth of the
    mean step (no longer distinguishable from white) and the record's length or ``longest`` (s).
    """
    step = float(np.mean(np.diff(time)))

    def minus_log_likelihood(log_time: float) -> float:
        steps, spread = _steps(time, residual, float(np.exp(log_time)))
        variance = float(np.mean((steps / spread) ** 2))
        return 0.5 * float(np.log(variance)) + float(np.mean(np.log(spread)))

    bounds = (np.log(0.1 * step), np.log(min(float(time[-1] - time[0]), longest)))
    correlation_time = float(np.exp(minimize_scalar(minus_log_likelihood, bounds=bounds, method="bounded").x))
    steps, spread = _steps(time, residual, correlation_time)
    return ExponentialNoise(float(np.sqrt(np.mean((steps / spread) ** 2))), correlation_time)


def chi_square_per_dof(time: Array, residual: Array, noise: ExponentialNoise, parameters: int = 0) -> float:
    """Return χ² of the whitened residual per degree of freedom: about 1 where the noise explains the whole residual.

    ``parameters`` were fitted to the same data.  Raises ValueError when they leave no degree of freedom.
    """
    dof = residual.size - parameters
    if dof <= 0:
        raise ValueError(f"{parameters} parameters leave no degree of freedom in {residual.size} values")
    return float(np.sum(whiten(time, residual, noise) ** 2)) / dof


def autocorrelation_time(residual: Array) -> float:
    """Estimate the integrated autocorrelation time τ = 1 + 2 Σ ρ_k of evenly spaced samples (n,), in samples (≥ 1).

    White noise has 1, AR(1) has (1 + φ)/(1 − φ).  A constant residual has n.
    """
    n = len(residual)
    centred = residual - np.mean(residual)
    variance = float(np.dot(centred, centred))
    if variance <= np.finfo(float).eps * float(np.dot(residual, residual)) or n < 2:
        return float(n)
    spectrum = np.fft.rfft(centred, 2 * n)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2)[:n] / variance
    times = 2.0 * np.cumsum(correlation) - 1.0
    enough = np.flatnonzero(np.arange(n) >= _SOKAL_WINDOW * times)
    chosen = times[enough[0]] if len(enough) else times[-1]
    return float(np.clip(chosen, 1.0, n))


def effective_samples(residual: Array) -> float:
    """Return the number n/τ of independent samples that an evenly spaced residual (n,) is worth."""
    return len(residual) / autocorrelation_time(residual)


def _steps(time: Array, residual: Array, correlation_time: float) -> tuple[Array, Array]:
    """Return the residual's innovations and their standard deviation for σ = 1 (broadcast against the residual)."""
    decay = np.diff(time) / correlation_time if correlation_time > 0.0 else np.full(len(time) - 1, np.inf)
    # expm1 keeps the spread right where a step is a tiny share of the correlation time
    spread = np.concatenate([[1.0], np.sqrt(-np.expm1(-2.0 * decay))])
    column = (slice(None),) + (None,) * (residual.ndim - 1)
    steps = np.array(residual, dtype=float)
    steps[1:] -= np.exp(-decay)[column] * residual[:-1]
    return steps, spread[column]
