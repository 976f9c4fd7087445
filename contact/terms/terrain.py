"""Snow surfaces that are not plane: height fields in which the contact itself works."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import TerrainTerm
from sssi_exudyn.contact.terms.shapes import bell
from sssi_exudyn.core.quantity import quantity


@dataclass(frozen=True)
class SlopeChange(TerrainTerm):
    """A piste that steepens or flattens along a line across the fall line.

    Formula: h = −tan(delta)·½(x + √(x² + width²)),   x = f − f0
    """

    name: ClassVar[str] = "slope_change"
    sources: ClassVar[tuple[str, ...]] = ("geometry of two planes joined by a hyperbola",)

    delta: float = quantity(0.0, "rad", low=-0.3, high=0.3, source="chosen", meaning="how much steeper it is below f0")
    f0: float = quantity(0.0, "m", low=-1e4, high=1e4, source="chosen", meaning="where it changes, down the fall line")
    width: float = quantity(5.0, "m", low=1.0, high=40.0, source="chosen", meaning="length over which it changes")

    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        fall = math.sin(self.delta) / math.cos(self.delta)
        x = f - self.f0
        root = math.sqrt(x * x + self.width * self.width)
        # x + root, written so that nothing cancels far above the change
        lift = math.where(x, x + root, self.width * self.width / (root - x))
        return -0.5 * fall * lift, -0.5 * fall * lift / root, 0.0


@dataclass(frozen=True)
class TerrainBump(TerrainTerm):
    """A roll or a dip across the slope.

    Formula: h = rise·exp(−½((f − f0)/width)²)
    """

    name: ClassVar[str] = "terrain_bump"
    sources: ClassVar[tuple[str, ...]] = ("a bell, the smoothest shape with a height, a place and a length",)

    rise: float = quantity(0.0, "m", low=-2.0, high=2.0, source="chosen", meaning="height of the roll; below 0 a dip")
    f0: float = quantity(0.0, "m", low=-1e4, high=1e4, source="chosen", meaning="its middle, down the fall line")
    width: float = quantity(4.0, "m", low=1.0, high=30.0, source="chosen", meaning="standard width along the fall line")

    def height(self, math: Math, f: Number, l: Number) -> tuple[Number, Number, Number]:  # noqa: E741
        h = self.rise * bell(math, f, self.f0, self.width)
        return h, -h * (f - self.f0) / (self.width * self.width), 0.0
