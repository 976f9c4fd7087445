"""Draws of the instruments' noise, whose levels are known from the recording alone."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import uneven_covariance
from sssi_exudyn.fitting.evidence import LinearModel, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels, level_priors

_NOISES: Final = 15
"""Noises with which runs are drawn."""
_NOISIER: Final = 1.3
"""By how many times noise is larger than the levels at most: these fit the recording, and come out too small."""


def draw_instrument_noise(linear: LinearModel, levels: NoiseLevels, count: int, rng: np.random.Generator) -> Array:
    """Draw (N, ``count``) noise of all instruments in units of that of ``levels``, which is another from run to run."""
    drawn = np.zeros((len(linear.residual), count))
    noises = np.arange(count) % _NOISES
    rng.shuffle(noises)
    for k in range(_NOISES):
        mine = np.flatnonzero(noises == k)
        own = _other_levels(linear, levels, rng)
        drawn[:, mine] = whiten_columns(linear, levels, _noise(linear, own, len(mine), rng))
    return drawn


def _other_levels(linear: LinearModel, levels: NoiseLevels, rng: np.random.Generator) -> NoiseLevels:
    """Draw levels: the fixes' T from its prior with σ²/T kept, then all noise as much larger."""
    prior = level_priors(linear.measurements.usual)["gps.correlation_time"]
    memory = float(np.clip(prior.usual * np.exp(prior.spread * rng.standard_normal()), prior.low, prior.high))
    larger = float(np.exp(rng.uniform(0.0, np.log(_NOISIER))))
    levels = levels.remembering("gps", memory)
    sizes = {name: larger * value for name, value in levels.numbers.items() if name.endswith(".sigma")}
    return levels.with_numbers(sizes)


def _noise(linear: LinearModel, levels: NoiseLevels, count: int, rng: np.random.Generator) -> Array:
    """Draw (N, ``count``) noise of all instruments."""
    drawn = np.zeros((len(linear.residual), count))
    for name, place in linear.measurements.blocks.items():
        if place.stop > place.start:
            times, scale = linear.measurements.time_of(name), linear.measurements.scale[place]
            cov = uneven_covariance(times, levels.of(name), scale)
            drawn[place] = np.linalg.cholesky(cov) @ rng.standard_normal((len(cov), count))
    return drawn
