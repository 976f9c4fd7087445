"""Faults of instruments in the benchmark's world, with other laws than those of the diagnosis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import GpsSensor, InsoleSensor

_HERE: Final = "the benchmark's world"
_USUAL_LOAD: Final = 500.0
"""N on a sole."""


@dataclass(frozen=True)
class WorldJump(GpsSensor):
    """Formula: fixes that move away by (x, y) within the first quarter of the time from t0 to t1, and back within the
    last, as reflected signals come and go.
    """

    name: ClassVar[str] = "world_jump"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    x: float
    y: float
    t0: float
    t1: float

    def offset(self, time: Array) -> Array:
        quarter = 0.25 * (self.t1 - self.t0)
        share = np.clip(np.minimum(time - self.t0, self.t1 - time) / quarter, 0.0, 1.0)
        return np.asarray(share[:, None] * [self.x, self.y, 0.0])


@dataclass(frozen=True)
class WorldGain(InsoleSensor):
    """Formula: the left insole's error of gain grows with the root of the load."""

    name: ClassVar[str] = "world_gain"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    left: float

    def reading(self, sole: Array) -> Array:
        grown = np.sqrt(np.maximum(sole, 0.0) / _USUAL_LOAD)
        return np.asarray(sole * (1.0 + grown * [self.left, 0.0]))


@dataclass(frozen=True)
class WorldCuff(InsoleSensor):
    """Formula: the cuffs' share of the load falls with the load, by its power of −0.3."""

    name: ClassVar[str] = "world_cuff"
    sources: ClassVar[tuple[str, ...]] = (_HERE,)
    share: float

    def reading(self, sole: Array) -> Array:
        return np.asarray(sole - self.share * sole * (np.maximum(sole, 1.0) / _USUAL_LOAD) ** -0.3)
