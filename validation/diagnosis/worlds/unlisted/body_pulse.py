"""A push."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import direction, log_uniform, pulse, stretch


class Pulse(Unlisted):
    """A pulse of any profile, length and direction on the skier; the shorter, the stronger."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        window = stretch(rng, geometry.edges, 0.25, 4.0)
        size = log_uniform(rng, 40.0, 200.0) * float(np.clip(1.0 / (window[1] - window[0]), 0.4, 2.0)) ** 0.5
        return geometry.on_body(size * direction(rng)[:, None] * pulse(rng, geometry.edges, window))
