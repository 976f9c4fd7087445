"""How probable measurements are under an explanation: a linear Gaussian model with autocorrelated noise.

    y = X a + e,   a ~ N(0, diag(scale²)),   e: each block an exponentially correlated noise

The amplitudes a (of a hypothesis, of what a fit leaves free, of the capture's errors) are integrated out, so that a
freedom costs what it could have explained and did not (Occam's factor).  Noise levels are not known
beforehand: they maximise the evidence times a prior of what instruments usually show.

Source: Rasmussen and Williams 2006, ch. 2 and 5; MacKay 2003, ch. 28.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import Bounds, minimize

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, whiten
from sssi_exudyn.validation.capture_error import USUAL
from sssi_exudyn.validation.measurements import Measurements

_LOAD_SHARE: Final = 0.03
_DIFFERENCE_SHARE: Final = 0.05
"""Noise of the insoles' total and difference, as shares of the mean total, before the data speak."""


@dataclass(frozen=True)
class NoiseLevels:
    """Noise of every instrument: standard deviations, correlation times (s), and the capture's error (rad)."""

    gps: ExponentialNoise
    height: ExponentialNoise
    load: ExponentialNoise
    difference: ExponentialNoise
    capture: float

    def of(self, block: str) -> ExponentialNoise:
        """Of a block of the measurements."""
        by_block = {"x": self.gps, "y": self.gps, "height": self.height, "load": self.load}
        return by_block.get(block, self.difference)

    @property
    def vector(self) -> Array:
        """Logarithms of all numbers that are sought."""
        noises = (self.gps, self.height, self.load, self.difference)
        return np.log([*(x for n in noises for x in (n.sigma, n.correlation_time)), self.capture])

    @staticmethod
    def from_vector(logs: Array) -> NoiseLevels:
        """The levels of such a vector."""
        values = [float(x) for x in np.exp(logs)]
        pairs = [ExponentialNoise(*values[i : i + 2]) for i in range(0, 8, 2)]
        return NoiseLevels(pairs[0], pairs[1], pairs[2], pairs[3], values[8])


_SPREAD: Final = np.array([0.35, 0.35, 0.45, 0.5, 0.5, 0.5, 0.5, 0.5, 0.45])
"""Standard deviations of the logarithms: within a factor of 2 for GPS in two of three recordings."""


_FARTHEST: Final = 3.0
"""Standard deviations from the usual within which a noise level is sought."""


def usual_levels(measurements: Measurements) -> NoiseLevels:
    """What instruments of the stated quality usually show."""
    sigma = measurements.gps_sigma
    load = max(float(measurements.loads.sum(axis=1).mean()) if len(measurements.loads) else 0.0, 1.0)
    return NoiseLevels(
        gps=ExponentialNoise(1.1 * sigma, 2.5),
        height=ExponentialNoise(1.4 * sigma, 1.5),
        load=ExponentialNoise(_LOAD_SHARE * load, 0.05),
        difference=ExponentialNoise(_DIFFERENCE_SHARE * load, 0.3),
        capture=USUAL,
    )


@dataclass(frozen=True)
class Freedom:
    """What may vary beside a hypothesis: columns (N, k) and the standard deviations (k,) of their amplitudes."""

    columns: Array
    scales: Array

    def with_more(self, columns: Array, scales: Array) -> Freedom:
        """These and others."""
        return Freedom(np.hstack([self.columns, columns]), np.concatenate([self.scales, scales]))


@dataclass(frozen=True)
class LinearModel:
    """Measurements less prediction, and the linear responses to all that may vary.

    residual : (N,);  free : parameters of the fit;  capture : errors of the capture, for one radian
    """

    measurements: Measurements
    residual: Array
    free: Freedom
    capture: Array


def whiten_columns(linear: LinearModel, levels: NoiseLevels, columns: Array) -> Array:
    """Columns (N, c) as they are in units of independent noise."""
    out = np.empty_like(columns)
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            out[place] = whiten(linear.measurements.time_of(name), columns[place], levels.of(name))
    return out


def log_volume(linear: LinearModel, levels: NoiseLevels) -> float:
    """Σ log of the whitening's divisors: what turns a density of whitened numbers into one of the measured ones."""
    total = 0.0
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            time = linear.measurements.time_of(name)
            noise = levels.of(name)
            decay = np.diff(time) / noise.correlation_time
            total += len(time) * np.log(noise.sigma) + 0.5 * float(np.sum(np.log(-np.expm1(-2.0 * decay))))
    return total


def log_prior(measurements: Measurements, levels: NoiseLevels) -> float:
    """Log prior of the noise levels, but for a constant."""
    apart = (levels.vector - usual_levels(measurements).vector) / _SPREAD
    return float(-0.5 * apart @ apart)


def log_evidence(linear: LinearModel, levels: NoiseLevels, extra: Freedom | None = None) -> float:
    """log p(measurements), amplitudes integrated out, but for a constant that all explanations share."""
    return _Evidence(linear, extra).at(levels)


class _Evidence:
    """Log evidence at many noise levels.

    Whitened columns enter only by their inner products.  Those of a block depend on its correlation time alone but for
    a factor, so the last few are kept: a search by differences changes one number at a time.
    """

    def __init__(self, linear: LinearModel, extra: Freedom | None) -> None:
        free = linear.free if extra is None else linear.free.with_more(extra.columns, extra.scales)
        self.linear = linear
        self.columns = np.column_stack([linear.residual, free.columns * free.scales, linear.capture])
        self.scales = np.ones(self.columns.shape[1])
        self.capture = slice(self.columns.shape[1] - linear.capture.shape[1], None)
        self.blocks = {name: at for name, at in linear.measurements.blocks.items() if at.stop > at.start}
        self.kept: dict[str, dict[float, Array]] = {name: {} for name in self.blocks}

    def at(self, levels: NoiseLevels) -> float:
        """Log evidence at these levels."""
        total = sum(self._products(name, levels.of(name)) for name in self.blocks)
        self.scales[self.capture] = levels.capture
        total = total * self.scales * self.scales[:, None]
        factor = cho_factor(total[1:, 1:] + np.eye(len(total) - 1), lower=True)
        misfit = float(total[0, 0] - total[0, 1:] @ cho_solve(factor, total[1:, 0]))
        return -0.5 * misfit - float(np.sum(np.log(np.diag(factor[0])))) - log_volume(self.linear, levels)

    def _products(self, name: str, noise: ExponentialNoise) -> Array:
        """Inner products (1 + c, 1 + c) of a block's whitened columns."""
        kept = self.kept[name]
        if noise.correlation_time not in kept:
            if len(kept) == _KEPT:
                del kept[next(iter(kept))]
            unit = ExponentialNoise(1.0, noise.correlation_time)
            columns = whiten(self.linear.measurements.time_of(name), self.columns[self.blocks[name]], unit)
            kept[noise.correlation_time] = columns.T @ columns
        return kept[noise.correlation_time] / noise.sigma**2


_KEPT: Final = 2
"""Correlation times of a block whose products are kept: that of a point of the search, and of the step beside it."""


def best_levels(linear: LinearModel, start: NoiseLevels, extra: Freedom | None = None) -> tuple[NoiseLevels, float]:
    """The noise that makes the measurements most probable, and log evidence plus the noise's own prior there."""
    evidence = _Evidence(linear, extra)

    def minus(logs: Array) -> float:
        levels = NoiseLevels.from_vector(logs)
        return -evidence.at(levels) - log_prior(linear.measurements, levels)

    usual = usual_levels(linear.measurements).vector
    farthest = Bounds(usual - _FARTHEST * _SPREAD, usual + _FARTHEST * _SPREAD)
    searches = [
        minimize(minus, begin, method="L-BFGS-B", bounds=farthest, options={"maxiter": 40, "ftol": 1e-7, "eps": 1e-3})
        for begin in (start.vector, usual)
    ]
    found = min(searches, key=lambda search: float(search.fun))
    return NoiseLevels.from_vector(found.x), -float(found.fun)


@dataclass(frozen=True)
class Whitener:
    """The noise and the capture's errors as one: whitened numbers are independent, with variance one.

    lower : (N, N) Cholesky factor of the covariance
    """

    lower: Array

    def __call__(self, columns: Array) -> Array:
        return np.asarray(solve_triangular(self.lower, columns, lower=True))


def whitener(linear: LinearModel, levels: NoiseLevels, kept: Array | None = None) -> Whitener:
    """Of the measurements, everything but the fit's parameters (and hypotheses') counted as noise; ``kept`` (k, 2)
    are further columns with scale, such as the height's origin.
    """
    size = len(linear.residual)
    covariance = np.zeros((size, size))
    for name, place in linear.measurements.blocks.items():
        time, noise = linear.measurements.time_of(name), levels.of(name)
        apart = np.abs(time[:, None] - time[None, :])
        covariance[place, place] = noise.sigma**2 * np.exp(-apart / noise.correlation_time)
    errors = levels.capture * linear.capture
    covariance += errors @ errors.T
    if kept is not None:
        covariance += kept @ kept.T
    return Whitener(np.asarray(np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))))


def log_factors(linear: LinearModel, levels: NoiseLevels, candidates: list[Freedom]) -> Array:
    """(c,) log Bayes factor of each candidate against none, at given noise levels."""
    free = linear.free.with_more(linear.capture, np.full(linear.capture.shape[1], levels.capture))
    table = whiten_columns(linear, levels, np.column_stack([linear.residual, free.columns * free.scales]))
    y, x = table[:, 0], table[:, 1:]
    factor = cho_factor(x.T @ x + np.eye(x.shape[1]), lower=True)
    rest = y - x @ cho_solve(factor, x.T @ y)
    widths = [c.columns.shape[1] for c in candidates]
    together = whiten_columns(linear, levels, np.hstack([c.columns * c.scales for c in candidates]))
    cleared = together - x @ cho_solve(factor, x.T @ together)
    found, begin = np.empty(len(candidates)), 0
    for i, width in enumerate(widths):
        part = slice(begin, begin + width)
        begin += width
        gram = together[:, part].T @ cleared[:, part] + np.eye(width)
        pull = together[:, part].T @ rest
        lower = np.linalg.cholesky(gram)
        half = solve_triangular(lower, pull, lower=True)
        found[i] = 0.5 * float(half @ half) - float(np.sum(np.log(np.diag(lower))))
    return found
