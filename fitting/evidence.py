"""How probable measurements are under an explanation: a linear Gaussian model with autocorrelated noise.

    y = X a + e,   a ~ N(0, diag(scale²)),   e: each block an exponentially correlated noise

The amplitudes a (of a hypothesis, of what a fit leaves free, of the posture's errors, of the snow surface) are
integrated out, so that a freedom costs what it could have explained and did not (Occam's factor).  Noise levels are
not known beforehand: they maximise the evidence times a prior of what instruments usually show.

Source: Rasmussen and Williams 2006, ch. 2 and 5; MacKay 2003, ch. 28.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import Bounds, minimize

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, uneven_covariance
from sssi_exudyn.fitting.autocorrelated_noise import log_divisors, whiten, whiten_with_slope
from sssi_exudyn.fitting.noise import precision
from sssi_exudyn.fitting.observations import Measurements, height_noise
from sssi_exudyn.terrain.from_heights import AMPLITUDE

_LOAD_SHARE: Final = 0.03
_DIFFERENCE_SHARE: Final = 0.05
"""Noise of the insoles' total and difference, as shares of the mean total, before the data speak."""


_NOISE_OF: Final = {"x": 0, "y": 0, "height": 1, "load": 2, "difference": 3}
"""Which of the noises each block of the measurements has, in the order of ``NoiseLevels``."""


@dataclass(frozen=True)
class NoiseLevels:
    """Noise of every instrument: standard deviations and correlation times (s); and by how many times the errors of the
    posture and the waves of the snow surface are larger than usual ones.
    """

    gps: ExponentialNoise
    height: ExponentialNoise
    load: ExponentialNoise
    difference: ExponentialNoise
    posture: float
    surface: float

    def of(self, block: str) -> ExponentialNoise:
        """Of a block of the measurements."""
        return (self.gps, self.height, self.load, self.difference)[_NOISE_OF[block]]

    @property
    def vector(self) -> Array:
        """Logarithms of all numbers that are sought."""
        noises = (self.gps, self.height, self.load, self.difference)
        return np.log([*(x for n in noises for x in (n.sigma, n.correlation_time)), self.posture, self.surface])

    @staticmethod
    def from_vector(logs: Array) -> NoiseLevels:
        """The levels of such a vector."""
        values = [float(x) for x in np.exp(logs)]
        pairs = [ExponentialNoise(*values[i : i + 2]) for i in range(0, 8, 2)]
        return NoiseLevels(pairs[0], pairs[1], pairs[2], pairs[3], values[8], values[9])


_SPREAD: Final = np.array([0.35, 0.35, 0.45, 0.5, 0.5, 0.5, 0.5, 0.5, 0.35, AMPLITUDE[1]])
"""Standard deviations of the logarithms: within a factor of 2 for GPS in two of three recordings."""


_UNSEEN: Final = 0.02
"""Standard deviations of all noise together below which a direction of the posture's errors is left out."""
_FARTHEST: Final = 3.0
"""Standard deviations from the usual within which a noise level is sought."""


def usual_levels(measurements: Measurements) -> NoiseLevels:
    """What instruments of the stated quality usually show."""
    sigma = measurements.gps_sigma
    load = max(float(measurements.loads.sum(axis=1).mean()) if len(measurements.loads) else 0.0, 1.0)
    return NoiseLevels(
        gps=ExponentialNoise(1.1 * sigma, 2.5),
        height=height_noise(measurements),
        load=ExponentialNoise(_LOAD_SHARE * load, 0.05),
        difference=ExponentialNoise(_DIFFERENCE_SHARE * load, 0.3),
        posture=1.0,
        surface=1.0,
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

    residual : (N,) as if every amplitude stood at its mean;  free : parameters of the fit, instruments and skier
    posture : (N, c) errors of the posture, each for a usual one;  surface : (N, s) waves of the snow, likewise
    """

    measurements: Measurements
    residual: Array
    free: Freedom
    posture: Array
    surface: Array

    def all_free(self, levels: NoiseLevels) -> Freedom:
        """Everything that may vary."""
        sizes = [np.full(self.posture.shape[1], levels.posture), np.full(self.surface.shape[1], levels.surface)]
        return self.free.with_more(np.hstack([self.posture, self.surface]), np.concatenate(sizes))


def whiten_columns(
    linear: LinearModel, levels: NoiseLevels, columns: Array, rows: Mapping[str, NDArray[np.bool_]] | None = None
) -> Array:
    """Columns (N, c) as they are in units of independent noise; of some ``rows`` by block alone where these are
    given.
    """
    measurements = linear.measurements
    found = []
    for name, place in measurements.blocks.items():
        time, block, scale = measurements.time_of(name), columns[place], measurements.scale[place]
        if rows is not None:
            time, block, scale = time[rows[name]], block[rows[name]], scale[rows[name]]
        found.append(whiten(time, block, levels.of(name), scale) if len(time) else block)
    return np.concatenate(found)


def log_volume(linear: LinearModel, levels: NoiseLevels) -> float:
    """Σ log of the whitening's divisors: what turns a density of whitened numbers into one of the measured ones."""
    total = 0.0
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            time, scale = linear.measurements.time_of(name), linear.measurements.scale[place]
            total += log_divisors(time, levels.of(name), scale)
    return total


def log_prior(measurements: Measurements, levels: NoiseLevels) -> float:
    """Log prior of the noise levels, but for a constant."""
    apart = (levels.vector - usual_levels(measurements).vector) / _SPREAD
    return float(-0.5 * apart @ apart)


def log_evidence(linear: LinearModel, levels: NoiseLevels, extra: Freedom | None = None) -> float:
    """Log probability density of the measurements (SI units), all amplitudes integrated out."""
    return _Evidence(linear, extra).at(levels)[0]


class _Evidence:
    """Log evidence at many noise levels."""

    def __init__(self, linear: LinearModel, extra: Freedom | None) -> None:
        free = linear.free if extra is None else linear.free.with_more(extra.columns, extra.scales)
        self.linear = linear
        self.columns = np.column_stack([linear.residual, free.columns * free.scales, linear.posture, linear.surface])
        fixed, waves = 1 + len(free.scales), self.columns.shape[1] - linear.surface.shape[1]
        self.sized = {"posture": slice(fixed, waves), "surface": slice(waves, None)}
        self.blocks = {name: at for name, at in linear.measurements.blocks.items() if at.stop > at.start}

    def at(self, levels: NoiseLevels) -> tuple[float, Array]:
        """Log evidence at these levels, and its derivatives (10,) by the numbers of their ``vector``.

        With T the whitened columns' inner products, A their part without the residual plus one on the diagonal and
        w = A⁻¹ T₁₀, a change of T changes the log evidence by −½ tr(M dT), where M = (1, −w)(1, −w)ᵀ + A⁻¹.
        """
        scales = np.ones(self.columns.shape[1])
        for name, at in self.sized.items():
            scales[at] = getattr(levels, name)
        parts, measurements = {}, self.linear.measurements
        for name, at in self.blocks.items():
            columns = self.columns[at] * scales
            time, scale = measurements.time_of(name), measurements.scale[at]
            parts[name] = whiten_with_slope(time, columns, levels.of(name), scale)
        total = np.sum([white.T @ white for white, _, _ in parts.values()], axis=0)
        factor = cho_factor(total[1:, 1:] + np.eye(len(total) - 1), lower=True)
        weights = np.concatenate([[1.0], -cho_solve(factor, total[1:, 0])])
        value = -0.5 * float(total[0] @ weights) - float(np.sum(np.log(np.diag(factor[0]))))
        by_product = np.outer(weights, weights)
        by_product[1:, 1:] += cho_solve(factor, np.eye(len(total) - 1))
        slopes = np.array([0.0] * 8 + [-float(np.sum((by_product * total)[at])) for at in self.sized.values()])
        for name, (white, slope, by_volume) in parts.items():
            which = 2 * _NOISE_OF[name]
            pulled = white @ by_product
            slopes[which] += float(np.sum(pulled * white)) - len(white)
            slopes[which + 1] -= float(np.sum(pulled * slope)) + by_volume
        value -= 0.5 * len(self.linear.residual) * float(np.log(2.0 * np.pi))
        return value - log_volume(self.linear, levels), slopes


def best_levels(linear: LinearModel, start: NoiseLevels, extra: Freedom | None = None) -> tuple[NoiseLevels, float]:
    """The noise that makes the measurements most probable, and log evidence plus the noise's own prior there."""
    evidence = _Evidence(linear, extra)
    usual = usual_levels(linear.measurements).vector

    def minus(logs: Array) -> tuple[float, Array]:
        levels = NoiseLevels.from_vector(logs)
        value, slopes = evidence.at(levels)
        return -value - log_prior(linear.measurements, levels), (logs - usual) / _SPREAD**2 - slopes

    farthest = Bounds(usual - _FARTHEST * _SPREAD, usual + _FARTHEST * _SPREAD)
    searches = [
        minimize(minus, begin, jac=True, method="L-BFGS-B", bounds=farthest, options={"maxiter": 40, "ftol": 1e-7})
        for begin in (start.vector, usual)
    ]
    found = min(searches, key=lambda search: float(search.fun))
    return NoiseLevels.from_vector(found.x), -float(found.fun)


@dataclass(frozen=True)
class Whitener:
    """Noise, errors of the posture and waves of the snow as one: whitened numbers are independent, with variance one.

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
        if place.stop > place.start:
            time, scale = linear.measurements.time_of(name), linear.measurements.scale[place]
            covariance[place, place] = uneven_covariance(time, levels.of(name), scale)
    for errors in (levels.posture * linear.posture, levels.surface * linear.surface):
        covariance += errors @ errors.T
    if kept is not None:
        covariance += kept @ kept.T
    return Whitener(np.asarray(np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))))


def fewer_columns(measurements: Measurements, columns: Array) -> Array:
    """Fewer columns (N, d) with the covariance of ``columns`` (N, c), each of them of variance one: principal
    directions without those that all measurements together see by less than ``_UNSEEN`` of their noise.
    """
    usual = usual_levels(measurements)
    noise = np.ones(len(columns))
    for name, place in measurements.blocks.items():
        noise[place] = usual.of(name).sigma
    noise *= measurements.scale.total
    directions, sizes, _ = np.linalg.svd(columns / noise[:, None], full_matrices=False)
    kept = sizes > _UNSEEN
    return np.asarray(noise[:, None] * directions[:, kept] * sizes[kept])


@dataclass(frozen=True)
class Uncertain:
    """All that may vary beside a hypothesis, in units of noise, to be taken out of what is measured.

    residual : (n,) were all of it at its mean;  columns : (n, k) for a standard deviation of each
    factor : Cholesky factor, as ``cho_solve`` takes it, of what is known of it afterwards
    """

    residual: Array
    columns: Array
    factor: tuple[Array, bool]

    @property
    def chi_squared(self) -> float:
        """χ² of what is measured, all of it where that is least."""
        return float(self.residual @ self.remove_from(self.residual))

    def share(self, columns: Array) -> Array:
        """(k, …) standard deviations of it that ``columns`` (n, …) are taken for."""
        return np.asarray(cho_solve(self.factor, self.columns.T @ columns))

    def remove_from(self, columns: Array) -> Array:
        """(n, …) what is left of ``columns`` once it has taken its part."""
        return np.asarray(columns - self.columns @ self.share(columns))


def uncertain(
    linear: LinearModel, levels: NoiseLevels, rows: Mapping[str, NDArray[np.bool_]] | None = None
) -> Uncertain:
    """Of all measurements, or of some ``rows`` by block (``whiten_columns``)."""
    free = linear.all_free(levels)
    table = whiten_columns(linear, levels, np.column_stack([linear.residual, free.columns * free.scales]), rows)
    x = table[:, 1:]
    return Uncertain(table[:, 0], x, precision(x))


def overlaps(
    linear: LinearModel,
    levels: NoiseLevels,
    known: Uncertain,
    candidates: Sequence[Freedom],
    drawn: Array | None = None,
) -> tuple[Array, Array]:
    """What the measurements know of each of c candidates, all with w amplitudes of usual size, once all that is
    uncertain has taken its part, as is ``known`` of ``linear``: the amplitudes' information (c, w, w), and the pull (c,
    w, 1) of what is left; (c, w, d) of d runs' measurements that are ``drawn`` (n, d) in units of noise, in place of
    the recorded ones.
    """
    rest = known.remove_from(known.residual[:, None] if drawn is None else drawn)
    width = candidates[0].columns.shape[1]
    together = whiten_columns(linear, levels, np.hstack([c.columns * c.scales for c in candidates]))
    cleared = known.remove_from(together)
    shape = len(together), len(candidates), width
    gram = np.einsum("nci,ncj->cij", together.reshape(shape), cleared.reshape(shape))
    return gram, (together.T @ rest).reshape(len(candidates), width, -1)


def log_factors(gram: Array, pull: Array, sizes: Sequence[float] = (1.0,)) -> Array:
    """(sizes, c, d) log Bayes factor of each candidate against none, were its amplitudes usually so many times as
    large, from its ``overlaps`` with each of d runs' measurements.
    """
    found = np.empty((len(sizes), len(gram), pull.shape[2]))
    for i, size in enumerate(sizes):
        inner = size**2 * gram + np.eye(gram.shape[1])
        gain = 0.5 * size**2 * np.sum(pull * np.linalg.solve(inner, pull), axis=1)
        found[i] = gain - 0.5 * np.linalg.slogdet(inner)[1][:, None]
    return found
