"""A force that depends on speed."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import direction, log_uniform


class PowerOfSpeed(Unlisted):
    """A force in one direction that goes as a power of speed."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        course = (geometry.speed / np.mean(geometry.speed)) ** rng.uniform(-1.0, 3.0)
        return geometry.on_body(log_uniform(rng, 8.0, 90.0) * direction(rng)[:, None] * course)
