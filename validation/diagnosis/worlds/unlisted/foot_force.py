"""A force on one ski."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry
from sssi_exudyn.validation.diagnosis.worlds.profiles import gaussian_process, log_uniform, pulse, stretch


class OneSki(Unlisted):
    """One ski that is held, along it and across: in one pulse, again and again, or as a share of its load."""

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        foot, edges = int(rng.integers(2)), geometry.edges
        across = float(rng.choice([0.0, 1.0]) * rng.normal())
        course = np.array([-1.0, across, 0.0])[:, None]
        kind = int(rng.integers(3))
        if kind == 0:
            window = stretch(rng, edges, 0.25, 3.0)
            size = log_uniform(rng, 30.0, 250.0) * float(np.clip(1.0 / (window[1] - window[0]), 0.4, 2.0)) ** 0.5
            return geometry.on_foot(size * course * pulse(rng, edges, window), foot)
        if kind == 1:
            process = gaussian_process(rng, geometry.middles, log_uniform(rng, 0.3, 6.0))
            return geometry.on_foot(log_uniform(rng, 20.0, 150.0) * course * process, foot)
        usual = geometry.load[foot] * (1.0 + 0.3 * gaussian_process(rng, geometry.middles, 2.0))
        return geometry.on_foot(log_uniform(rng, 0.02, 0.15) * np.array([[-1.0], [0.0], [0.0]]) * usual, foot)
