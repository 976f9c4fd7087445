"""Noise of which single samples have more (``core.noise.uneven_covariance``), made white sample by sample.

e = σ₀ (a + d b + √r c): the state (a, b) is Markov and c independent, so a Kalman filter makes independent numbers of
the samples, with their derivatives by the correlation time.

Source: Särkkä, Bayesian Filtering and Smoothing (2013), ch. 4 and 12.
"""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, Scale, draw_noise
from sssi_exudyn.core.noise import log_divisors as even_log_divisors
from sssi_exudyn.core.noise import whiten as whiten_even
from sssi_exudyn.core.noise import whiten_with_slope as whiten_even_with_slope
from sssi_exudyn.runtime.jit import njit


def whiten(time: Array, columns: Array, noise: ExponentialNoise, scale: Scale) -> Array:
    """Return columns as independent numbers of variance one, if they are such noise.

    Parameters
    ----------
    time : (n,) s, increasing
    columns : (n, c), independent of each other
    noise : of a sample of scale one
    scale : of the n samples

    Returns (n, c).
    """
    base = _least(noise, scale)
    if scale.even:
        return whiten_even(time, columns, base)
    white, _, _, _ = _filter(*_steps(time, noise), scale.excess, scale.alone, columns, slope=False)
    return np.asarray(white / base.sigma)


def whiten_with_slope(time: Array, columns: Array, noise: ExponentialNoise, scale: Scale) -> tuple[Array, Array, float]:
    """Return what ``whiten`` does, its derivative by the correlation time's logarithm, and that of ``log_divisors``.
    Arguments are as there, the correlation time above 0.
    """
    base = _least(noise, scale)
    if scale.even:
        return whiten_even_with_slope(time, columns, base)
    white, slope, _, by_volume = _filter(*_steps(time, noise), scale.excess, scale.alone, columns, slope=True)
    return white / base.sigma, slope / base.sigma, float(by_volume)


def log_divisors(time: Array, noise: ExponentialNoise, scale: Scale) -> float:
    """Return Σ log of what ``whiten`` divides by, which turns a density of whitened numbers into one of the measured
    ones.  The correlation time is above 0.
    """
    base = _least(noise, scale)
    if scale.even:
        return even_log_divisors(time, base)
    none = np.zeros((len(time), 0))
    _, _, volume, _ = _filter(*_steps(time, noise), scale.excess, scale.alone, none, slope=False)
    return len(time) * float(np.log(base.sigma)) + float(volume)


def noise_information(time: Array, noise: ExponentialNoise) -> Array:
    """Return what readings that are such noise alone know of log σ and log T, (2, 2): the expected curvature of minus
    their log density.  The correlation time T is above 0.
    """
    kept, slope, fresh = _steps(time, noise)
    both = -2.0 * float(np.sum(kept * slope / fresh))
    return np.array([[2.0 * len(time), both], [both, float(np.sum(slope**2 * (1.0 + kept**2) / fresh**2))]])


def draw_uneven_noise(rng: np.random.Generator, time: Array, noise: ExponentialNoise, scale: Scale) -> Array:
    """Draw such noise, (n,); arguments as for ``log_divisors``."""
    drawn = draw_noise(rng, time, noise)
    if not scale.even:
        drawn = drawn + scale.excess * draw_noise(rng, time, noise)
        drawn = drawn + noise.sigma * np.sqrt(scale.alone) * rng.normal(size=len(time))
    return np.asarray(scale.least * drawn)


def _least(noise: ExponentialNoise, scale: Scale) -> ExponentialNoise:
    """Return the noise of the least noisy samples."""
    return ExponentialNoise(scale.least * noise.sigma, noise.correlation_time)


def _steps(time: Array, noise: ExponentialNoise) -> tuple[Array, Array, Array]:
    """Return the correlation φ (n,) of each sample with the one before, its derivative by the correlation time's
    logarithm, and 1 − φ².  The first sample counts as if it came after an eternity.
    """
    decay = np.full(len(time), np.inf)
    if noise.correlation_time > 0.0:
        decay[1:] = np.diff(time) / noise.correlation_time
    kept = np.exp(-decay)
    slope = np.zeros(len(time))
    slope[1:] = kept[1:] * decay[1:] if noise.correlation_time > 0.0 else 0.0
    return kept, slope, -np.expm1(-2.0 * decay)  # expm1 keeps 1 − φ² right where a step is a tiny share of the time


@njit(cache=True, error_model="numpy")
def _filter(kept, kept_slope, fresh, more, alone, columns, slope):
    """Return innovations in standard deviations (n, c), Σ log of these, and, with ``slope``, derivatives of both by the
    correlation time's logarithm.

    kept, kept_slope, fresh : (n,) φ, its derivative, 1 − φ²;  more, alone : (n,) d, r
    """
    n, c = columns.shape
    white, by_time = np.zeros((n, c)), np.zeros((n if slope else 0, c))
    a, b = np.zeros(c), np.zeros(c)  # the state's mean, a column each, and its derivative
    a1, b1 = np.zeros(c), np.zeros(c)
    aa, ab, bb = 1.0, 0.0, 1.0  # its covariance, and the derivative of that
    aa1, ab1, bb1 = 0.0, 0.0, 0.0
    volume, volume1 = 0.0, 0.0
    for k in range(n):
        f, f1, d = kept[k], kept_slope[k], more[k]
        ff, ff1 = f * f, 2.0 * f * f1
        aa1, ab1, bb1 = ff1 * (aa - 1.0) + ff * aa1, ff1 * ab + ff * ab1, ff1 * (bb - 1.0) + ff * bb1
        aa, ab, bb = ff * aa + fresh[k], ff * ab, ff * bb + fresh[k]
        at_a, at_b = aa + d * ab, ab + d * bb
        spread = at_a + d * at_b + alone[k]
        root = np.sqrt(spread)
        gain_a, gain_b = at_a / spread, at_b / spread
        volume += np.log(root)
        at_a1, at_b1, by_spread, gain_a1, gain_b1 = 0.0, 0.0, 0.0, 0.0, 0.0
        if slope:
            at_a1, at_b1 = aa1 + d * ab1, ab1 + d * bb1
            by_spread = (at_a1 + d * at_b1) / spread
            gain_a1, gain_b1 = at_a1 / spread - gain_a * by_spread, at_b1 / spread - gain_b * by_spread
            volume1 += 0.5 * by_spread
        for j in range(c):
            if slope:
                a1[j] = f1 * a[j] + f * a1[j]
                b1[j] = f1 * b[j] + f * b1[j]
            a[j] *= f
            b[j] *= f
            rest = columns[k, j] - a[j] - d * b[j]
            white[k, j] = rest / root
            if slope:
                rest1 = -a1[j] - d * b1[j]
                by_time[k, j] = (rest1 - 0.5 * by_spread * rest) / root
                a1[j] += gain_a1 * rest + gain_a * rest1
                b1[j] += gain_b1 * rest + gain_b * rest1
            a[j] += gain_a * rest
            b[j] += gain_b * rest
        aa1, ab1, bb1 = (
            aa1 - gain_a1 * at_a - gain_a * at_a1,
            ab1 - gain_a1 * at_b - gain_a * at_b1,
            bb1 - gain_b1 * at_b - gain_b * at_b1,
        )
        aa, ab, bb = aa - gain_a * at_a, ab - gain_a * at_b, bb - gain_b * at_b
    return white, by_time, volume, volume1
