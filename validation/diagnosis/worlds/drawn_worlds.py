"""Draws of measurements in worlds with known causes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, uneven_covariance
from sssi_exudyn.fitting.evidence import Uncertain, uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels, level_priors
from sssi_exudyn.validation.diagnosis.worlds.catalogue import Answer
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry

_NOISES: Final = 15
"""Noises that worlds are drawn with."""
_NOISIER: Final = 1.3
"""By how many times noise is larger than the levels at most: these fit the recording, and come out too small."""


@dataclass(frozen=True)
class Worlds:
    """D worlds of a run.

    labels : (D,) index of the answer that each is an example of
    rest : (N, D) their measurements, in units of noise, without what is uncertain
    strength : (D,) standard errors of what is hidden, by all that the measurements say of it
    """

    labels: NDArray[np.int_]
    rest: Array
    strength: Array


def draw_worlds(
    geometry: Geometry, known: Uncertain, answers: Sequence[Answer], count: int, rng: np.random.Generator
) -> Worlds:
    """Draw ``count`` worlds, of each answer its share; the uncertain is ``known`` at the geometry's levels."""
    ends = np.round(np.cumsum([0.0, *(answer.share for answer in answers)]) * count).astype(int)
    labels = np.repeat(np.arange(len(answers)), np.diff(ends))
    moved = np.empty((len(geometry.linear.residual), len(labels)))
    for k, label in enumerate(labels.tolist()):
        families = answers[label].families
        moved[:, k] = families[k % len(families)].draw(rng, geometry)
    return observe(geometry, known, labels, moved, rng)


def observe(
    geometry: Geometry, known: Uncertain, labels: NDArray[np.int_], moved: Array, rng: np.random.Generator
) -> Worlds:
    """Return worlds in which measurements are ``moved`` (N, D), with noise and all that is uncertain drawn."""
    linear, levels = geometry.linear, geometry.levels
    white = whiten_columns(linear, levels, moved)
    strength = np.sqrt(np.maximum(np.sum(white * known.remove_from(white), axis=0), 0.0))
    seen = white + known.columns @ rng.standard_normal((known.columns.shape[1], len(labels)))
    noises = np.arange(len(labels)) % _NOISES
    rng.shuffle(noises)
    for k in range(_NOISES):
        mine = np.flatnonzero(noises == k)
        seen[:, mine] += whiten_columns(linear, levels, _noise(geometry, _other_levels(geometry, rng), len(mine), rng))
    return Worlds(labels, known.remove_from(seen), strength)


def known_of(geometry: Geometry) -> Uncertain:
    """Return all that is uncertain of a run, at the levels of its worlds."""
    return uncertain(geometry.linear, geometry.levels)


def _other_levels(geometry: Geometry, rng: np.random.Generator) -> NoiseLevels:
    """Draw levels: the fixes' T from its prior with σ²/T kept, then all noise as much larger."""
    levels, usual = geometry.levels, geometry.linear.measurements.usual
    prior = level_priors(usual)["gps.correlation_time"]
    memory = float(np.clip(prior.usual * np.exp(prior.spread * rng.standard_normal()), prior.low, prior.high))
    larger = float(np.exp(rng.uniform(0.0, np.log(_NOISIER))))
    levels = levels.remembering("gps", memory)
    sizes = {name: larger * value for name, value in levels.numbers.items() if name.endswith(".sigma")}
    return levels.with_numbers(sizes)


def _noise(geometry: Geometry, levels: NoiseLevels, count: int, rng: np.random.Generator) -> Array:
    """Draw (N, count) noise of all instruments."""
    measurements = geometry.linear.measurements
    drawn = np.zeros((len(geometry.linear.residual), count))
    for name, place in measurements.blocks.items():
        if place.stop > place.start:
            noise: ExponentialNoise = levels.of(name)
            cov = uneven_covariance(measurements.time_of(name), noise, measurements.scale[place])
            drawn[place] = np.linalg.cholesky(cov) @ rng.standard_normal((len(cov), count))
    return drawn
