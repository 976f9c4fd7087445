"""Snow that is pressed in: the normal force of one contact point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import PointState, PointTerm
from sssi_exudyn.core.quantity import quantity

POINT_LENGTH: Final = 0.033
"""m; length of edge that the stiffness and the damping are given for: a ski of 1.65 m with 50 points an edge."""

_PAPER = "paper, 2.2.3"
_CHOICE = "chosen: the paper gives no number"


@dataclass(frozen=True)
class HuntCrossley(PointTerm):
    """Spring and damper that stiffen with depth, and never pull.

    Formula: F_N = max(0, k·δ^m1 + c·sign(δ̇)·|δ̇|^m2·δ^m3)·length/33 mm  for δ > 0, else 0

    The force is in proportion to the length of edge that the point stands for, so that refining the ski converges.
    The exponents are at least one: below, the force's slope at the snow's surface (or at rest) would be infinite.
    """

    name: ClassVar[str] = "penetration"
    sources: ClassVar[tuple[str, ...]] = (
        _PAPER,
        "K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440: damping that vanishes with the depth",
    )

    k: float = quantity(5e3, "N/m^m1", low=1e2, high=1e6, source=_CHOICE, meaning="stiffness of 33 mm of edge")
    c: float = quantity(5e3, "N s^m2/m^(m2+m3)", low=0.0, high=1e6, source=_CHOICE, meaning="damping of 33 mm of edge")
    m1: float = quantity(1.5, "1", low=1.0, high=3.0, source=_CHOICE, meaning="exponent of the depth, spring")
    m2: float = quantity(1.0, "1", low=1.0, high=3.0, source=_CHOICE, meaning="exponent of the depth's rate")
    m3: float = quantity(1.5, "1", low=1.0, high=3.0, source=_CHOICE, meaning="exponent of the depth, damper")

    def force(self, math: Math, state: PointState) -> Number:
        depth = math.maximum(state.depth, 0.0)
        spring = self.k * math.power(depth, self.m1)
        damper = self.c * math.signed_power(state.rate, self.m2)
        return math.maximum(spring + damper * math.power(depth, self.m3), 0.0) * (state.length / POINT_LENGTH)
