"""Terms that only the tests know: for places without a term in the registry, and for all functions of Math.

They go through the same conformance tests as the registry's terms.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from sssi_exudyn.contact.conformance_states import GRIDS, UniformWind, ask, grid, instances
from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.registry import TERMS
from sssi_exudyn.contact.term import BodyState, BodyTerm, TerrainTerm
from sssi_exudyn.core.quantity import quantity

_MADE_UP = "made up for the tests"


@dataclass(frozen=True)
class Ridge(TerrainTerm):
    """A ridge across the slope.

    Formula: h = height·exp(−((f − at)/width)²)
    """

    name: ClassVar[str] = "ridge"
    sources: ClassVar[tuple[str, ...]] = (_MADE_UP,)

    height_m: float = quantity(0.1, "m", low=0.0, high=1.0, source=_MADE_UP, meaning="height of the ridge")
    at: float = quantity(5.0, "m", low=0.0, high=100.0, source=_MADE_UP, meaning="place down the fall line")
    width: float = quantity(2.0, "m", low=0.5, high=10.0, source=_MADE_UP, meaning="width of the ridge")

    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        x = (f - self.at) / self.width
        h = self.height_m * math.exp(-x * x)
        return h, -2.0 * x * h / self.width, 0.0


@dataclass(frozen=True)
class Everything(BodyTerm):
    """A term that uses every allowed function once.

    Formula: F = a·(sums of all functions of Math)
    """

    name: ClassVar[str] = "everything"
    sources: ClassVar[tuple[str, ...]] = (_MADE_UP,)

    a: float = quantity(2.0, "N", low=0.5, high=20.0, source=_MADE_UP, meaning="strength")
    p: float = quantity(1.7, "1", low=1.0, high=3.0, source=_MADE_UP, meaning="exponent")
    eps: float = quantity(0.3, "m/s", low=0.01, high=1.0, source=_MADE_UP, meaning="width of the smoothed sign")

    def force(self, math: Math, state: BodyState) -> Vector:
        x, y, z = state.velocity
        first = math.sqrt(1.0 + x * x) + math.sin(y) * math.cos(z) + math.atan(x * y) - math.exp(0.1 * z)
        switches = math.where(x, x * y, x * z) + math.maximum(y, z) * math.minimum(x, y) + math.sign(z) * z
        powers = math.power(math.absolute(x), self.p) + math.signed_power(y, self.p)
        rest = math.saturate(z - x, self.eps + math.absolute(y)) / (2.0 + math.tanh(state.t)) - 3.0 / (1.0 + y * y)
        turned = math.atan2(y - 0.3 * z, 0.2 + x)
        return self.a * (first + turned), self.a * (switches - state.f), -(self.a * powers) + rest * state.l


@dataclass(frozen=True)
class WithNumpy(BodyTerm):
    """A term with operators and NumPy's functions in place of those of Math.

    Formula: F = a·(sums of NumPy's functions)
    """

    name: ClassVar[str] = "with_numpy"
    sources: ClassVar[tuple[str, ...]] = (_MADE_UP,)

    a: float = quantity(2.0, "N", low=0.5, high=20.0, source=_MADE_UP, meaning="strength")
    p: float = quantity(1.7, "1", low=1.0, high=3.0, source=_MADE_UP, meaning="exponent")

    def force(self, math: Math, state: BodyState) -> Vector:
        x, y, z = state.velocity
        first = np.sqrt(1.0 + x**2) + np.sin(y) * np.cos(z) + np.arctan(x * y) - np.exp(0.1 * z) + np.log(2.0 + y**2)
        switches = np.where(x > 0.0, x * y, x * z) + np.maximum(y, z) * np.minimum(x, y) + np.where(z <= y, z - y, 0.0)
        powers = np.float64(2.0) * (0.1 + np.abs(x)) ** self.p + np.square(y) / (1.0 + y**4) + np.hypot(x, 1.0 + z**2)
        rest = (1.0 + x**2) ** -0.5 + np.clip(z, -0.3, 0.3) / (2.0 + np.tanh(state.t)) + abs(y) ** 3 * np.power(1.5, 2)
        return self.a * first, self.a * switches, -(self.a * powers) + rest * state.l


EXAMPLES = (UniformWind, Ridge, Everything, WithNumpy)
CLASSES: tuple[type[Any], ...] = (*TERMS, *EXAMPLES)


def printed_by_exudyn() -> str:
    """Return JSON of the grid in Exudyn's symbols, for every class and every instance.

    It has to run in a process of its own.
    """
    from sssi_exudyn.simulation.full.forces_symbolic import RecordedLaw

    def values(term: Any) -> list[list[float]]:
        names = list(GRIDS[term.kind])
        law = RecordedLaw(len(names), 1, lambda math, *a: ask(math, term, dict(zip(names, a, strict=True))))
        return [law(*(np.array([x]) for x in state.values()))[0].tolist() for state in grid(term.kind)]

    return json.dumps({cls.name: [values(term) for term in instances(cls)] for cls in CLASSES})
