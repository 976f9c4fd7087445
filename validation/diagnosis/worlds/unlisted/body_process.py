"""A force on the skier that wanders."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import direction, gaussian_process, log_uniform, pulse, stretch


class WanderingForce(Unlisted):
    """A force on the skier that is a random process of any memory, all along or for a while."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        memory, middles = log_uniform(rng, 0.3, 8.0), geometry.middles
        if rng.uniform() < 0.5:
            force = direction(rng)[:, None] * gaussian_process(rng, middles, memory)
        else:
            force = np.stack([gaussian_process(rng, middles, memory) for _ in range(3)]) / np.sqrt(3.0)
        if rng.uniform() < 0.5:
            force = force * pulse(rng, geometry.edges, stretch(rng, geometry.edges, 0.5, 4.0))
        return geometry.on_body(log_uniform(rng, 20.0, 200.0) * force)
