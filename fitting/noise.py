"""How large the noise of each instrument is, and how long it remembers, from a run that is linearised.

    y = u a + e,   a ~ N(0, 1),   e: each block an exponentially correlated noise

a is all that is uncertain, each in standard deviations of what is known beforehand.  A noise's size σ is found by
expectation and maximisation, its correlation time T by the evidence, a integrated out.  What a run shows best is σ²/T,
how its noise changes from one reading to the next: so T is sought with σ²/T held.  Slow noise moves an estimate most,
and how slow it is a run of seconds hardly shows: estimates are averaged over T.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.observation import Observation

Levels = Mapping[str, ExponentialNoise]
"""Noise by block."""
BEFOREHAND: Final = 20.0
"""Independent measurements that the usual size of a noise counts for, beside those of the run."""
_MEMORIES: Final = tuple(2.0 ** (0.5 * k) for k in range(-6, 7))
"""Correlation times that are weighed against each other, in units of the usual one."""
_MEMORY_SPREAD: Final = 0.35
"""Standard deviation of a correlation time's logarithm about the usual one's, as in a diagnosis.  Were it known
less well, slow errors of the fixes would be taken for errors of the posture: their noise came out as 0.7 of what it is,
remembered for a third of the time.
"""
_GIVEN: Final = "moment"
"""The group of measurements whose noise is not estimated less than it is given: how well a skier balances is no matter
of the run."""
_SLOWEST: Final = "fixes"
"""The group of measurements over whose noise's correlation time estimates are averaged."""
_BY_MODEL: Final = ("speed", "load", "load difference")
"""Groups of measurements whose noise is larger than usual where the model lacks something; a receiver's fixes often are
noisier than stated.
"""
_NEGLIGIBLE: Final = 1e-3
"""Of the most probable one: correlation times that are left out."""
WEIGHINGS: Final = 4
"""Rounds of expectation and maximisation."""


@dataclass(frozen=True)
class LinearRun:
    """All that is measured of a run, linearised in all that is uncertain.

    residual : (N,) measured less predicted, were all that is uncertain as beforehand
    columns : (N, k) what a standard deviation of each changes
    """

    seen: Observation
    residual: Array
    columns: Array

    def whitened(self, levels: Levels) -> tuple[Array, Array]:
        """y (N,) and u (N, k)."""
        table = self.seen.whiten(levels, np.column_stack([self.residual, self.columns]))
        return table[:, 0], table[:, 1:]

    def log_evidence(self, levels: Levels) -> float:
        """Log probability density of the measurements (SI units), all that is uncertain integrated out."""
        y, u = self.whitened(levels)
        factor = precision(u)
        pull = u.T @ y
        evidence = -0.5 * float(y @ y - pull @ cho_solve(factor, pull)) - float(np.sum(np.log(np.diag(factor[0]))))
        return evidence - self.seen.log_volume(levels) - 0.5 * len(y) * float(np.log(2.0 * np.pi))

    def estimate(self, levels: Levels) -> tuple[Array, Array]:
        """Mean (k,) and covariance (k, k) of all that is uncertain, in standard deviations."""
        y, u = self.whitened(levels)
        factor = precision(u)
        return np.asarray(cho_solve(factor, u.T @ y)), np.asarray(cho_solve(factor, np.eye(u.shape[1])))


def precision(columns: Array) -> tuple[Array, bool]:
    """The Cholesky factor, as ``cho_solve`` takes it, of what is known afterwards of amplitudes of variance one."""
    one = np.eye(columns.shape[1])
    try:
        return cho_factor(columns.T @ columns + one, lower=True)
    except LinAlgError:  # the squares of columns whose sizes are far apart have no digits left for the one
        factor = np.linalg.qr(np.vstack([columns, one]), mode="r")
        return np.asarray(factor * np.sign(np.diag(factor))[:, None]).T, True


def weigh_noise(linear: LinearRun, levels: Levels) -> Levels:
    """The noise's levels, from what remains when all that is uncertain is taken out."""
    seen = linear.seen
    for _ in range(WEIGHINGS):
        y, u = linear.whitened(levels)
        factor = precision(u)
        left = y - u @ cho_solve(factor, u.T @ y)
        found = dict(levels)
        for group, names in seen.groups.items():
            rows = np.concatenate([np.arange(len(y))[seen.blocks[name]] for name in names])
            square = float(left[rows] @ left[rows] + np.sum(u[rows] * cho_solve(factor, u[rows].T).T))
            noise, usual = levels[names[0]], seen.usual[names[0]]
            more = BEFOREHAND * (usual.sigma / noise.sigma) ** 2
            sigma = noise.sigma * float(np.sqrt((square + more) / (len(rows) + BEFOREHAND)))
            if group == _GIVEN:
                sigma = max(sigma, usual.sigma)
            found |= dict.fromkeys(names, ExponentialNoise(sigma, noise.correlation_time))
        levels = found
    for names in _remembering(seen):
        levels = max(_memories(linear, levels, names), key=lambda pair: pair[0])[1]
    return levels


def other_memories(linear: LinearRun, levels: Levels) -> list[tuple[float, Levels]]:
    """Levels by how long the receiver's fixes remember their error, the slowest noise, with their probabilities."""
    tried = list(_memories(linear, levels, linear.seen.groups[_SLOWEST]))
    weights = np.exp(np.array([density for density, _ in tried]) - max(density for density, _ in tried))
    weights[weights < _NEGLIGIBLE] = 0.0
    weights /= np.sum(weights)
    return [(float(weight), each) for weight, (_, each) in zip(weights, tried, strict=True) if weight > 0.0]


def averaged_covariance(linear: LinearRun, levels: Levels) -> Array:
    """(k, k) of all that is uncertain, in standard deviations, about its estimate under ``levels``, averaged over
    ``other_memories``.
    """
    mean, _ = linear.estimate(levels)
    total = np.zeros((len(mean), len(mean)))
    for weight, each in other_memories(linear, levels):
        other, covariance = linear.estimate(each)
        total += weight * (covariance + np.outer(other - mean, other - mean))
    return total


def widening(seen: Observation, levels: Levels) -> float:
    """By how much standard errors grow where noise is larger than its instruments': what is left over is then no noise
    alone but what the model lacks, and that does not average out as noise does.

    Source: Birge, Phys. Rev. 40 (1932) 207; the scale factor of the Particle Data Group, Phys. Rev. D 110 (2024)
    030001, section 5.2.
    """
    first = [seen.groups[group][0] for group in _BY_MODEL if group in seen.groups]
    return max([1.0, *(levels[name].sigma / seen.usual[name].sigma for name in first)])


def draw(linear: LinearRun, levels: Levels, count: int, rng: np.random.Generator) -> Array:
    """(count, k) amounts of all that is uncertain, in standard deviations, less their estimate under ``levels``."""
    mean, _ = linear.estimate(levels)
    tried = other_memories(linear, levels)
    chosen = rng.choice(len(tried), size=count, p=[weight for weight, _ in tried])
    drawn = np.empty((count, len(mean)))
    for i, (_, each) in enumerate(tried):
        rows = np.flatnonzero(chosen == i)
        y, u = linear.whitened(each)
        factor = precision(u)
        other = cho_solve(factor, u.T @ y)
        off = solve_triangular(factor[0], rng.standard_normal((len(mean), len(rows))), trans="T", lower=True).T
        drawn[rows] = other - mean + off
    return drawn


def _remembering(seen: Observation) -> list[tuple[str, ...]]:
    """Blocks of each group whose noise's correlation time is sought."""
    return [names for group, names in seen.groups.items() if group != _GIVEN]


def _memories(linear: LinearRun, levels: Levels, names: tuple[str, ...]) -> Iterator[tuple[float, Levels]]:
    """Log probability density, but for a constant, and levels with other correlation times of some blocks' noise."""
    noise, usual = levels[names[0]], linear.seen.usual[names[0]]
    for share in _MEMORIES:
        memory = share * usual.correlation_time
        sigma = noise.sigma * float(np.sqrt(memory / noise.correlation_time))
        each = {**levels, **dict.fromkeys(names, ExponentialNoise(sigma, memory))}
        size = usual.sigma / sigma
        beforehand = BEFOREHAND * (np.log(size) - 0.5 * size**2) - 0.5 * (np.log(share) / _MEMORY_SPREAD) ** 2
        yield linear.log_evidence(each) + float(beforehand), each
