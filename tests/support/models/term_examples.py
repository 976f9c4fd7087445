"""Terms that only the tests know: for the places that no term of the registry acts in, and for all functions of Math.

They go through the same conformance tests as the registry's terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.term import BodyState, BodyTerm, PlaceState, TerrainTerm, WindTerm
from sssi_exudyn.core.quantity import quantity

_MADE_UP = "made up for the tests"


@dataclass(frozen=True)
class UniformWind(WindTerm):
    """The same wind everywhere.

    Formula: w = (w_f, w_l, w_n)
    """

    name: ClassVar[str] = "uniform_wind"
    sources: ClassVar[tuple[str, ...]] = (_MADE_UP,)

    w_f: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind down the fall line")
    w_l: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind to the left")
    w_n: float = quantity(0.0, "m/s", low=-20.0, high=20.0, source=_MADE_UP, meaning="wind away from the snow")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        return self.w_f, self.w_l, self.w_n


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
    """Every function that a term may use, once.

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
        return self.a * first, self.a * (switches - state.f), -(self.a * powers) + rest * state.l


@dataclass(frozen=True)
class WithNumpy(BodyTerm):
    """Operators and NumPy's functions in place of those of Math.

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
