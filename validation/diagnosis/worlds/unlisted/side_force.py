"""A rough stretch."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import log_uniform, pulse, stretch


class AlternatingForce(Unlisted):
    """A stretch that throws the skier to and fro, across or normal, and may brake him as well."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        within = pulse(rng, geometry.edges, stretch(rng, geometry.edges, 0.8, 4.0))
        thrown = log_uniform(rng, 10.0, 120.0) * rng.standard_normal(geometry.shape)
        thrown *= np.array([0.0, 1.0, float(rng.choice([0.0, 1.0]))])[:, None]
        thrown[0] = -float(rng.uniform(0.0, 0.12)) * geometry.load.sum(axis=0)
        return geometry.on_body(within * thrown)
