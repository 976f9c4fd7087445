"""Worlds that a hypothesis brings by itself, from its own law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING, Kind
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.search.form_error import MEMORIES, MOST_WRONG
from sssi_exudyn.validation.diagnosis.worlds.family import WorldFamily
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry, is_possible
from sssi_exudyn.validation.diagnosis.worlds.profiles import gaussian_process, log_uniform

_SIZES: Final = (0.4, 4.0)
"""Usual sizes of an effect in worlds; the hypotheses' evidence has 0.5 to 2, each times a normal number."""
_TRIALS: Final = 50
"""Draws of a physically possible effect at most: of the rarest one in three is."""


@dataclass(frozen=True)
class LawWorlds(WorldFamily):
    """Worlds with the law or fault of a hypothesis: at a random one of its places, of any size, and of nearly its form.

    A fault of an instrument has exactly its form.
    """

    hypothesis: Hypothesis

    @property
    def name(self) -> str:
        return self.hypothesis.name

    @property
    def kind(self) -> Kind:
        return self.hypothesis.kind

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        candidates = geometry.candidates[self.name]
        for _ in range(_TRIALS):
            candidate = candidates[int(rng.integers(len(candidates)))]
            scales = candidate.free.scales
            amplitudes = scales * self.hypothesis.draw_amplitudes(rng, len(scales)) * log_uniform(rng, *_SIZES)
            if is_possible(self.hypothesis, candidate, amplitudes):
                break
        moved = np.asarray(candidate.free.columns @ amplitudes)
        if self.kind == "sensor":
            return moved
        share = rng.uniform(0.0, MOST_WRONG) * gaussian_process(rng, geometry.middles, log_uniform(rng, *MEMORIES))
        return geometry.bent(moved, share)


@dataclass(frozen=True)
class NothingHidden(WorldFamily):
    """Worlds without anything hidden; the slope of some has a roll of its own, as natural slopes have.

    shapes : hypotheses whose law shapes the snow;  natural : share of slopes that have such a roll
    """

    shapes: Sequence[Hypothesis]
    natural: float

    @property
    def name(self) -> str:
        return NOTHING_MISSING

    @property
    def kind(self) -> Kind:
        return "physics"

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        shapes = [shape for shape in self.shapes if shape.name in geometry.candidates]
        if not shapes or rng.uniform() > self.natural:
            return np.zeros(len(geometry.linear.residual))
        shape = shapes[int(rng.integers(len(shapes)))]
        candidates = geometry.candidates[shape.name]
        column = candidates[int(rng.integers(len(candidates)))].free.columns[:, 0]
        return np.asarray(column * rng.normal(0.0, shape.natural * geometry.waves))


@dataclass(frozen=True)
class TwoAtOnce(WorldFamily):
    """Worlds with two of some families at once."""

    families: Sequence[WorldFamily]
    called: str

    @property
    def name(self) -> str:
        return self.called

    @property
    def kind(self) -> Kind:
        return "physics"

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        one, other = rng.choice(len(self.families), 2, replace=False)
        return np.asarray(self.families[one].draw(rng, geometry) + self.families[other].draw(rng, geometry))
