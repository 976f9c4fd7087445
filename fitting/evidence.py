"""How probable measurements are under an explanation: a linear Gaussian model with autocorrelated noise.

    y = X a + e,   a ~ N(0, diag(scale²)),   e: each block an exponentially correlated noise

The amplitudes a (of a hypothesis, of what a fit leaves free, of the posture's errors, of the snow surface) are
integrated out, so that a freedom costs what it could have explained and did not (Occam's factor).  Noise levels are
not known beforehand: they maximise the evidence times a prior of what instruments usually show.

Source: Rasmussen and Williams 2006, ch. 2 and 5; MacKay 2003, ch. 28.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np
from numpy.linalg import LinAlgError
from numpy.polynomial.hermite import hermgauss
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.linalg.lapack import dpotri

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import Scale, uneven_covariance
from sssi_exudyn.fitting.autocorrelated_noise import log_divisors, noise_information, whiten, whiten_with_slope
from sssi_exudyn.fitting.noise import BLOCKS_OF, LevelPrior, NoiseLevels, UsualLevels, level_priors, log_prior
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.fitting.optimise import minimise

_UNSEEN: Final = 0.02
"""Standard deviations of all noise together below which a direction of the posture's errors is left out."""
_TOLERANCE: Final = 1e-3
"""Change of the log evidence that ends a search of noise levels."""
_NODES: Final = (5, 3)
"""Of the integral over the noise of fixes, along the direction that a run shows least and across it."""
_STENCIL: Final = np.array([0.1, 0.4])
"""Changes of log σ²/T and log T by which the integrand's curvature is measured: a standard deviation, nearly, of each
in a run of some seconds."""


class Measured(Protocol):
    """Measurements in blocks of one vector, each block with the noise of its instrument."""

    @property
    def blocks(self) -> Mapping[str, slice]: ...
    @property
    def scale(self) -> Scale: ...
    @property
    def usual(self) -> UsualLevels: ...
    def time_of(self, block: str) -> Array: ...


@dataclass(frozen=True)
class Freedom:
    """What may vary next to a hypothesis: columns (N, k) and the standard deviations (k,) of their amplitudes."""

    columns: Array
    scales: Array

    def with_more(self, columns: Array, scales: Array) -> Freedom:
        """Return these and other amplitudes."""
        return Freedom(np.hstack([self.columns, columns]), np.concatenate([self.scales, scales]))


@dataclass(frozen=True)
class LinearProblem:
    """Measurements less prediction, and the linear responses to all that may vary.

    residual : (N,) as if every amplitude stood at its mean;  free : parameters of the fit, instruments and skier
    sized : columns (N, c) each for a usual amount, by the level that says how much larger amounts are: "posture" its
        errors, "surface" waves of the snow, "force" the force that every explanation has
    """

    measurements: Measured
    residual: Array
    free: Freedom
    sized: Mapping[str, Array] = field(default_factory=dict)

    def all_free(self, levels: NoiseLevels) -> Freedom:
        """Return everything that may vary."""
        sizes, numbers = [self.free.scales], levels.numbers
        sizes += [np.full(columns.shape[1], numbers[name]) for name, columns in self.sized.items()]
        return Freedom(np.hstack([self.free.columns, *self.sized.values()]), np.concatenate(sizes))


@dataclass(frozen=True)
class LinearModel(LinearProblem):
    """The linear problem of what hypotheses are compared by."""

    measurements: Measurements


def whiten_columns(
    linear: LinearProblem, levels: NoiseLevels, columns: Array, rows: Mapping[str, NDArray[np.bool_]] | None = None
) -> Array:
    """Return columns (N, c) in units of independent noise; of some ``rows`` by block alone where these are given."""
    measurements = linear.measurements
    parts = []
    for name, place in measurements.blocks.items():
        time, block, scale = measurements.time_of(name), columns[place], measurements.scale[place]
        if rows is not None:
            time, block, scale = time[rows[name]], block[rows[name]], scale[rows[name]]
        parts.append(whiten(time, block, levels.of(name), scale) if len(time) else block)
    return np.concatenate(parts)


def log_volume(linear: LinearProblem, levels: NoiseLevels) -> float:
    """Return Σ log of the whitening's divisors and N/2 log 2π: what turns the exponent of a density of whitened numbers
    into the log density of the measured ones.
    """
    total = 0.5 * len(linear.residual) * float(np.log(2.0 * np.pi))
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            time, scale = linear.measurements.time_of(name), linear.measurements.scale[place]
            total += log_divisors(time, levels.of(name), scale)
    return total


def log_evidence(linear: LinearProblem, levels: NoiseLevels, extra: Freedom | None = None) -> float:
    """Return the log probability density of the measurements (SI units), all amplitudes integrated out."""
    return evidence_and_slopes(linear, levels, extra)[0]


def evidence_and_slopes(
    linear: LinearProblem, levels: NoiseLevels, extra: Freedom | None = None
) -> tuple[float, dict[str, float]]:
    """Return ``log_evidence`` and its derivatives by the logarithms of the levels' ``numbers``."""
    return _Evidence(linear, extra).at(levels)


class _Evidence:
    """Log evidence at many noise levels."""

    def __init__(self, linear: LinearProblem, extra: Freedom | None) -> None:
        free = linear.free if extra is None else linear.free.with_more(extra.columns, extra.scales)
        self.linear = linear
        self.columns = np.column_stack([linear.residual, free.columns * free.scales, *linear.sized.values()])
        ends = np.cumsum([1 + len(free.scales), *(columns.shape[1] for columns in linear.sized.values())])
        self.sized = dict(zip(linear.sized, map(slice, ends, ends[1:]), strict=True))
        self.blocks = {name: at for name, at in linear.measurements.blocks.items() if at.stop > at.start}

    def _scales(self, levels: NoiseLevels) -> Array:
        """Return by how many times each column counts more at these levels."""
        scales, numbers = np.ones(self.columns.shape[1]), levels.numbers
        for name, at in self.sized.items():
            scales[at] = numbers[name]
        return scales

    def sought(self) -> dict[str, LevelPrior]:
        """Return the numbers of the levels of which the measurements say something, and of which not all is given."""
        instruments = [name for name, blocks in BLOCKS_OF.items() if any(block in self.blocks for block in blocks)]
        sized = [name for name, at in self.sized.items() if self.columns[:, at].shape[1]]
        return {
            name: prior
            for name, prior in level_priors(self.linear.measurements.usual).items()
            if prior.spread > 0.0 and name.partition(".")[0] in (*instruments, *sized)
        }

    def information(self, levels: NoiseLevels, names: Sequence[str]) -> Array:
        """Return roughly what measurements with that noise know of the logarithms of its numbers, (k, k) in the order
        of ``names``: were it seen alone, and each amplitude alone in it.
        """
        numbers = list(levels.numbers)  # each noise has its σ and then its T
        known = np.zeros((len(numbers), len(numbers)))
        for instrument, blocks in BLOCKS_OF.items():
            first = numbers.index(f"{instrument}.sigma")
            for name in blocks:
                if name in self.blocks:
                    time = self.linear.measurements.time_of(name)
                    known[first : first + 2, first : first + 2] += noise_information(time, levels.of(name))
        for name, at in self.sized.items():
            seen = np.sum(whiten_columns(self.linear, levels, self.columns[:, at] * levels.numbers[name]) ** 2, axis=0)
            known[numbers.index(name), numbers.index(name)] = 2.0 * float(np.sum((seen / (1.0 + seen)) ** 2))
        chosen = [numbers.index(name) for name in names]
        return known[np.ix_(chosen, chosen)]

    def by_fixes(self, levels: NoiseLevels) -> Callable[[NoiseLevels], float]:
        """Return a function of levels that differ from these by the noise of the fixes' places alone: the log evidence
        there.
        """
        measurements, columns = self.linear.measurements, self.columns * self._scales(levels)

        def whitened(name: str, levels: NoiseLevels) -> Array:
            place = self.blocks[name]
            return whiten(measurements.time_of(name), columns[place], levels.of(name), measurements.scale[place])

        held = [whitened(name, levels) for name in self.blocks if name not in BLOCKS_OF["gps"]]
        squares = np.sum([white.T @ white for white in held], axis=0)

        def at_other(levels: NoiseLevels) -> float:
            fixes = [whitened(name, levels) for name in BLOCKS_OF["gps"] if name in self.blocks]
            total = squares + np.sum([white.T @ white for white in fixes], axis=0)
            factor = precision_of(total[1:, 1:], lambda: np.vstack([*held, *fixes])[:, 1:])
            left = total[0, 0] - total[0, 1:] @ cho_solve(factor, total[1:, 0])
            volume = log_volume(self.linear, levels)
            return -0.5 * float(left) - float(np.sum(np.log(np.diag(factor[0])))) - volume

        return at_other

    def at(self, levels: NoiseLevels) -> tuple[float, dict[str, float]]:
        """Return the log evidence at these levels, and its derivatives by the logarithms of their ``numbers``.

        With T the whitened columns' inner products, A their part without the residual plus one on the diagonal and
        w = A⁻¹ T₁₀, a change of T changes the log evidence by −½ tr(M dT), where M = (1, −w)(1, −w)ᵀ + A⁻¹.
        """
        measurements, scales = self.linear.measurements, self._scales(levels)
        columns = self.columns * scales
        white, slope, by_volume = np.empty_like(columns), np.empty_like(columns), {}
        for name, at in self.blocks.items():
            time, scale = measurements.time_of(name), measurements.scale[at]
            white[at], slope[at], by_volume[name] = whiten_with_slope(time, columns[at], levels.of(name), scale)
        total = white.T @ white
        factor = precision_of(total[1:, 1:], lambda: white[:, 1:])
        weights = np.concatenate([[1.0], -cho_solve(factor, total[1:, 0])])
        value = -0.5 * float(total[0] @ weights) - float(np.sum(np.log(np.diag(factor[0]))))
        by_product = np.outer(weights, weights)
        by_product[1:, 1:] += _inverse(factor[0])
        slopes = {name: -float(np.sum((by_product * total)[at])) for name, at in self.sized.items()}
        for instrument, blocks in BLOCKS_OF.items():
            slopes[f"{instrument}.sigma"] = slopes[f"{instrument}.correlation_time"] = 0.0
            for name in blocks:
                if name in self.blocks:
                    at = self.blocks[name]
                    pulled = white[at] @ by_product
                    slopes[f"{instrument}.sigma"] += float(np.vdot(pulled, white[at])) - len(pulled)
                    slopes[f"{instrument}.correlation_time"] -= float(np.vdot(pulled, slope[at])) + by_volume[name]
        return value - log_volume(self.linear, levels), slopes


def log_posterior(linear: LinearProblem, levels: NoiseLevels) -> float:
    """Return log evidence plus the log prior density of the noise, but for the latter's constant."""
    return log_evidence(linear, levels) + log_prior(linear.measurements.usual, levels)


def best_levels(linear: LinearProblem, start: NoiseLevels, extra: Freedom | None = None) -> tuple[NoiseLevels, float]:
    """Return the noise that makes the measurements most probable, and log evidence plus the noise's log prior there.

    The search begins at ``start``.  Numbers of which the measurements say nothing stay as ``start`` has them.
    """
    evidence = _Evidence(linear, extra)
    sought, usual = evidence.sought(), linear.measurements.usual
    names = list(sought)
    if not names:
        return start, evidence.at(start)[0] + log_prior(usual, start)
    priors = list(sought.values())
    middle, spread = np.log([prior.usual for prior in priors]), np.array([prior.spread for prior in priors])

    def levels_at(logs: Array) -> NoiseLevels:
        return start.with_numbers(dict(zip(names, np.exp(logs).tolist(), strict=True)))

    def minus(logs: Array) -> tuple[float, Array]:
        levels = levels_at(logs)
        value, slopes = evidence.at(levels)
        by_name = np.array([slopes[name] for name in names])
        return -value - log_prior(usual, levels), (logs - middle) / spread**2 - by_name

    bounds = np.log([[prior.low, prior.high] for prior in priors])
    begin = np.clip(np.log([start.numbers[name] for name in names]), *bounds.T)
    curvature = evidence.information(levels_at(begin), names) + np.diag(spread**-2.0)
    best = minimise(minus, begin, bounds, curvature, objective_tolerance=_TOLERANCE)
    return levels_at(best.values), -best.objective


def evidence_over_noise(linear: LinearProblem, levels: NoiseLevels, extra: Freedom | None = None) -> float:
    """Return log evidence plus the noise's log prior with the noise of the fixes' places integrated out; all other
    levels stay, which a run shows better.

    levels : the best ones, about whose σ²/T and T the integral is a Gauss-Hermite sum of 3 × 5 nodes

    Source: Liu and Pierce, Biometrika 81 (1994) 624 (adaptive quadrature).
    """
    usual, by_fixes = linear.measurements.usual, _Evidence(linear, extra).by_fixes(levels)

    def at(change: Array) -> float:
        """Return the log integrand where log σ²/T and log T are larger by ``change``."""
        rate, memory = change
        gps = levels.gps
        other = levels.with_numbers(
            {
                "gps.sigma": gps.sigma * float(np.exp(0.5 * (rate + memory))),
                "gps.correlation_time": gps.correlation_time * float(np.exp(memory)),
            }
        )
        return by_fixes(other) + log_prior(usual, other)

    middle = at(np.zeros(2))
    curvature = _curvature(at, middle)
    sizes, axes = np.linalg.eigh(curvature)
    priors = level_priors(usual)
    widest = max(1.0, *(priors[f"gps.{name}"].spread for name in ("sigma", "correlation_time")))
    lengths = np.sqrt(2.0 / np.maximum(sizes, widest**-2))  # the slow direction comes first
    nodes = [hermgauss(count) for count in _NODES]
    logs = [
        at(axes @ (lengths * [x, y])) + x**2 + y**2 + np.log(weight * other)
        for x, weight in zip(*nodes[0], strict=True)
        for y, other in zip(*nodes[1], strict=True)
    ]
    beforehand = [priors[f"gps.{name}"].spread for name in ("sigma", "correlation_time")]
    # dlog σ dlog T is half of dlog σ²/T dlog T
    volume = np.sum(np.log(lengths)) - np.log(2.0) - np.log(2.0 * np.pi * np.prod(beforehand))
    return float(np.logaddexp.reduce(logs) + volume)


def best_evidence(linear: LinearProblem, start: NoiseLevels, extra: Freedom | None = None) -> tuple[NoiseLevels, float]:
    """Return ``best_levels``' noise, and the log evidence over the noise about it (``evidence_over_noise``)."""
    levels, _ = best_levels(linear, start, extra)
    return levels, evidence_over_noise(linear, levels, extra)


def _curvature(at: Callable[[Array], float], middle: float) -> Array:
    """Return (2, 2) the curvature of −``at`` about zero, where its value is ``middle``, by differences."""
    a, b = np.diag(_STENCIL)
    both = at(a + b) + at(-a - b) - at(a - b) - at(b - a)
    own = [2.0 * middle - at(step) - at(-step) for step in (a, b)]
    scaled = np.array([[own[0], -0.25 * both], [-0.25 * both, own[1]]])
    return np.asarray(scaled / np.outer(_STENCIL, _STENCIL))


def precision(columns: Array) -> tuple[Array, bool]:
    """Return the Cholesky factor, as ``cho_solve`` takes it, of the posterior precision of amplitudes of variance one,
    from whitened columns (N, k).
    """
    return precision_of(columns.T @ columns, lambda: columns)


def precision_of(squares: Array, columns: Callable[[], Array]) -> tuple[Array, bool]:
    """Return the same from the columns' inner products ``squares`` (k, k); ``columns`` gives them where rounding has
    left these indefinite.
    """
    one = np.eye(len(squares))
    try:
        return cho_factor(squares + one, lower=True)
    except LinAlgError:  # the squares of columns whose sizes are far apart have no digits left for the one
        factor = np.linalg.qr(np.vstack([columns(), one]), mode="r")
        return np.asarray(factor * np.sign(np.diag(factor))[:, None]).T, True


def _inverse(lower: Array) -> Array:
    """Return A⁻¹ (k, k), where A = L Lᵀ and ``lower`` (k, k) holds L."""
    inverse, _ = dpotri(lower, lower=1)
    below = np.tril(inverse)
    return np.asarray(below + np.tril(below, -1).T)


@dataclass(frozen=True)
class Whitener:
    """Noise, errors of the posture and waves of the snow as one: whitened numbers are independent, with variance one.

    lower : (N, N) Cholesky factor of the covariance
    """

    lower: Array

    def __call__(self, columns: Array) -> Array:
        return np.asarray(solve_triangular(self.lower, columns, lower=True))


def whitener(linear: LinearProblem, levels: NoiseLevels, kept: Array | None = None) -> Whitener:
    """Return a whitener of the measurements that counts everything except the fit's and hypotheses' parameters as
    noise.  Further columns with scale are ``kept`` (k, 2), such as the height's origin.
    """
    size = len(linear.residual)
    covariance = np.zeros((size, size))
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            time, scale = linear.measurements.time_of(name), linear.measurements.scale[place]
            covariance[place, place] = uneven_covariance(time, levels.of(name), scale)
    for name, columns in linear.sized.items():
        errors = levels.numbers[name] * columns
        covariance += errors @ errors.T
    if kept is not None:
        covariance += kept @ kept.T
    return Whitener(np.asarray(np.linalg.cholesky(covariance + 1e-12 * np.diag(np.diag(covariance)))))


def fewer_columns(measurements: Measurements, columns: Array) -> Array:
    """Return fewer columns (N, d) with the covariance of ``columns`` (N, c), each of them of variance one.  They are
    principal directions without those that all measurements together see by less than ``_UNSEEN`` of their noise.
    """
    usual = measurements.usual
    noise = np.ones(len(columns))
    for name, place in measurements.blocks.items():
        noise[place] = usual.of(name).sigma
    noise *= measurements.scale.total
    directions, sizes, _ = np.linalg.svd(columns / noise[:, None], full_matrices=False)
    kept = sizes > _UNSEEN
    return np.asarray(noise[:, None] * directions[:, kept] * sizes[kept])


@dataclass(frozen=True)
class Uncertain:
    """All that may vary next to a hypothesis, in units of noise, to be taken out of what is measured.

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
        """Return the standard deviations (k, …) of it that ``columns`` (n, …) are taken for."""
        return np.asarray(cho_solve(self.factor, self.columns.T @ columns))

    def remove_from(self, columns: Array) -> Array:
        """Return what is left (n, …) of ``columns`` once it has taken its part."""
        return np.asarray(columns - self.columns @ self.share(columns))


def uncertain(
    linear: LinearProblem, levels: NoiseLevels, rows: Mapping[str, NDArray[np.bool_]] | None = None
) -> Uncertain:
    """Return all that is uncertain by all measurements, or by some ``rows`` by block (``whiten_columns``)."""
    free = linear.all_free(levels)
    table = whiten_columns(linear, levels, np.column_stack([linear.residual, free.columns * free.scales]), rows)
    x = table[:, 1:]
    return Uncertain(table[:, 0], x, precision(x))


def overlaps(
    linear: LinearProblem,
    levels: NoiseLevels,
    known: Uncertain,
    candidates: Sequence[Freedom],
    drawn: Array | None = None,
) -> tuple[Array, Array]:
    """Return what the measurements know of each of c candidates, with at most w amplitudes of usual size.

    These are the amplitudes' information (c, w, w) and the pull (c, w, 1) of what is left.  All that is uncertain has
    taken its part before, as is ``known`` of ``linear``.  With ``drawn`` (n, d), measurements of d runs in units of
    noise, the pull is theirs in place of the recorded ones, (c, w, d).
    """
    rest = known.remove_from(known.residual[:, None] if drawn is None else drawn)
    columns = usual_columns(candidates)
    together = whiten_columns(linear, levels, columns.reshape(len(columns), -1))
    cleared = known.remove_from(together)
    gram = products_by_candidate(together.reshape(columns.shape), cleared.reshape(columns.shape))
    return gram, (together.T @ rest).reshape(*columns.shape[1:], -1)


def products_by_candidate(left: Array, right: Array) -> Array:
    """Return the inner products (c, w, w) of the columns (n, c, w) of each of c candidates."""
    return np.asarray(np.matmul(np.transpose(left, (1, 2, 0)), np.transpose(right, (1, 0, 2))))


def usual_columns(candidates: Sequence[Freedom]) -> Array:
    """Return (n, c, w) what a usual size of each amplitude of c candidates does; amplitudes that a candidate has less
    than another do nothing.
    """
    width = max(len(candidate.scales) for candidate in candidates)
    columns = np.zeros((len(candidates[0].columns), len(candidates), width))
    for k, candidate in enumerate(candidates):
        columns[:, k, : len(candidate.scales)] = candidate.columns * candidate.scales
    return columns


class Information:
    """What measurements know of the amplitudes of candidates, in axes in which they know them independently.

    known : (c, w) along each axis;  axes : (c, w, w) columns
    """

    def __init__(self, gram: Array) -> None:
        """Decompose ``gram`` (c, w, w), as ``overlaps`` gives it."""
        known, self.axes = np.linalg.eigh(0.5 * (gram + np.swapaxes(gram, 1, 2)))
        self.known = np.maximum(known, 0.0)

    def along(self, pull: Array) -> Array:
        """Return the pull (c, w, d) of amplitudes along the axes."""
        return np.asarray(np.swapaxes(self.axes, 1, 2) @ pull)

    def log_factors(self, along: Array, sizes: Sequence[float] = (1.0,)) -> Array:
        """Return log Bayes factors (sizes, c, d) of each candidate against none, from ``along``.

        sizes : by how many times amplitudes are usually larger
        """
        squares = along**2
        log_factor = np.empty((len(sizes), len(squares), squares.shape[2]))
        for i, size in enumerate(sizes):
            inner = 1.0 + size**2 * self.known
            gain = 0.5 * (size**2 / inner)[:, None] @ squares
            log_factor[i] = gain[:, 0] - 0.5 * np.sum(np.log(inner), axis=1)[:, None]
        return log_factor


def log_factors(gram: Array, pull: Array, sizes: Sequence[float] = (1.0,)) -> Array:
    """Return log Bayes factors (sizes, c, d) of each candidate against none.

    gram, pull : of ``overlaps`` with each of d runs' measurements
    sizes : by how many times amplitudes are usually larger
    """
    information = Information(gram)
    return information.log_factors(information.along(pull), sizes)
