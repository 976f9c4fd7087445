"""What a world of one kind has hidden."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.diagnosis_data import Kind
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry


class WorldFamily(ABC):
    """Worlds in which one cause is hidden.

    name : of the cause;  kind : of it; those that are "unexplained" are one answer, "not in the list"
    """

    @property
    @abstractmethod
    def name(self) -> str: ...

    @property
    @abstractmethod
    def kind(self) -> Kind: ...

    @abstractmethod
    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        """Return (N,) what a cause of random place, time and size does to the measurements."""


class Unlisted(WorldFamily):
    """Worlds with a cause that no hypothesis describes."""

    @property
    def name(self) -> str:
        return type(self).__name__

    @property
    def kind(self) -> Kind:
        return "unexplained"
