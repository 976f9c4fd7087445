"""Friction that changes from place to place."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import gaussian_process, log_uniform


class CourseOfFriction(Unlisted):
    """Friction along both skis that is a course of place, and no stretch: a process, a trend, a wave or a hollow."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        place = geometry.place
        x = (place - place[0]) / max(float(place[-1] - place[0]), 1.0)
        at, wide = rng.uniform(0.0, 1.0), log_uniform(rng, 0.1, 0.6)
        kind = int(rng.integers(4))
        if kind == 0:
            course = gaussian_process(rng, x, log_uniform(rng, 0.1, 1.0))
        elif kind == 1:
            course = np.abs(x - (0.7 * at if rng.uniform() < 0.5 else 1.0 - 0.7 * at)) ** log_uniform(rng, 0.5, 2.0)
        elif kind == 2:
            course = np.sin(2.0 * np.pi * (x / wide + at))
        else:
            course = 1.0 / (1.0 + ((x - at) / wide) ** 2)
        brake = -float(rng.choice([-1.0, 1.0])) * log_uniform(rng, 0.015, 0.15) * course * geometry.load
        along = np.zeros((2, *geometry.shape))
        along[:, 0] = brake
        return geometry.on_foot(along[0], 0) + geometry.on_foot(along[1], 1)
