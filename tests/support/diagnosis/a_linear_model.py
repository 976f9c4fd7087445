"""A small linear model with the noise of all instruments, drawn, and its covariance by definition."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.evidence import Freedom, LinearModel
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.observations import Measurements

LEVELS = NoiseLevels(
    gps=ExponentialNoise(0.02, 2.0),
    height=ExponentialNoise(0.03, 1.0),
    speed=ExponentialNoise(0.1, 1.0),
    load=ExponentialNoise(20.0, 0.05),
    difference=ExponentialNoise(40.0, 0.4),
    moment=ExponentialNoise(45.0, 0.2),
    posture=0.7,
    surface=1.6,
    force=1.3,
)


def instruments(fixes: int = 12, windows: int = 7) -> Measurements:
    rng = np.random.default_rng(1)
    stated = rng.uniform(0.2, 1.0, size=fixes)
    return Measurements(
        0.1 * np.arange(fixes),
        rng.normal(size=(fixes, 3)),
        0.02,
        0.1 * np.arange(windows),
        400.0 + rng.normal(size=(windows, 2)),
        stated,
        np.where(np.arange(fixes) == 4, 0.1, stated),
    )


def linear_model(seed: int = 2) -> LinearModel:
    measurements = instruments()
    size = len(measurements.measured)
    rng = np.random.default_rng(seed)
    scale = np.ones(size)
    scale[measurements.blocks["load"].start :] = 500.0
    return LinearModel(
        measurements,
        0.03 * scale * rng.normal(size=size),
        Freedom(scale[:, None] * rng.normal(size=(size, 3)), np.array([0.1, 0.02, 0.5])),
        {
            "posture": 0.01 * scale[:, None] * rng.normal(size=(size, 4)),
            "surface": 0.02 * scale[:, None] * rng.normal(size=(size, 5)),
            "force": 0.015 * scale[:, None] * rng.normal(size=(size, 3)),
        },
    )


def covariance(given: LinearModel) -> Array:
    """By its definition."""
    size = len(given.residual)
    noise_covariance = np.zeros((size, size))
    for name, place in given.measurements.blocks.items():
        time, noise, scale = given.measurements.time_of(name), LEVELS.of(name), given.measurements.scale[place]
        least = scale.lasting.min()
        more = np.sqrt((scale.lasting / least) ** 2 - 1.0)
        alone = np.diag(scale.total**2 - scale.lasting**2)
        alike = np.exp(-np.abs(time[:, None] - time) / noise.correlation_time)
        noise_covariance[place, place] = noise.sigma**2 * (least**2 * alike * (1.0 + np.outer(more, more)) + alone)
    sized = np.hstack([getattr(LEVELS, name) * columns for name, columns in given.sized.items()])
    return noise_covariance + sized @ sized.T
