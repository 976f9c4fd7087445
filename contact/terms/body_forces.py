"""Forces on the skier that come neither from the snow under his skis nor from the air."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from sssi_exudyn.contact.maths import Math, Vector
from sssi_exudyn.contact.term import BodyState, BodyTerm
from sssi_exudyn.contact.terms.air import STILL, AirDrag
from sssi_exudyn.contact.terms.shapes import bell, swell, window
from sssi_exudyn.core.quantity import quantity

_ROOT_TWO_PI: Final = 2.5066282746310002
_SLOW: Final = 0.1
"""m/s; below, a skier has no direction of travel."""


_SIDE: Final = "hand that holds the pole: 1 the left, -1 the right, 0 both alike"
_LEAST_HEIGHT: Final = 0.3
"""Least height of the hand over the tip, as a share of a pole's length."""


@dataclass(frozen=True)
class PolePlant(BodyTerm):
    """A pole set at time t: a short push along the path, braking or driving, and up from the snow.

    Formula: F = (forward·v/|v| + up·n)·exp(−½((t' − t)/width)²)/(width·√(2π)),   t' the time
    """

    name: ClassVar[str] = "pole_plant"
    sources: ClassVar[tuple[str, ...]] = (
        "pole forces of some 10 to 100 N s at transitions: Müller, Schwameder, J. Sports Sci. 21 (2003) 679",
    )

    forward: float = quantity(
        0.0, "N*s", low=-200.0, high=200.0, source="chosen", meaning="impulse along the path; below 0 it brakes"
    )
    up: float = quantity(
        0.0, "N*s", low=0.0, high=200.0, source="a pole pushes and cannot pull", meaning="impulse away from the snow"
    )
    t: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when")
    width: float = quantity(0.08, "s", low=0.02, high=1.0, source="chosen", meaning="standard width in time")
    side: float = quantity(0.0, "1", low=-1.0, high=1.0, source="chosen", meaning=_SIDE)

    def at_hands(self) -> tuple[float, float]:
        return 0.5 * (1.0 + self.side), 0.5 * (1.0 - self.side)

    def force(self, math: Math, state: BodyState) -> Vector:
        v_f, v_l, _ = state.velocity
        pulse = bell(math, state.t, self.t, self.width) / (self.width * _ROOT_TWO_PI)
        along = self.forward * pulse / math.sqrt(v_f * v_f + v_l * v_l + _SLOW * _SLOW)
        return along * v_f, along * v_l, self.up * pulse


@dataclass(frozen=True)
class PlantedPole(BodyTerm):
    """A pole whose tip stands in the snow from t0 to t1 and is pressed along its shaft.

    It is set ahead of the hand, which passes over it at the skier's speed: at first it brakes, behind the skier it
    drives.

    Formula: F = ½(1 − cos 2πs)·press·(d·v/|v| + √(L² − d²)·n)/L,   s = (t' − t0)/(t1 − t0),   d = |v|·(t' − t0) − ahead
    """

    name: ClassVar[str] = "planted_pole"
    sources: ClassVar[tuple[str, ...]] = ("geometry of a rigid pole; pole forces as for pole_plant",)

    press: float = quantity(0.0, "N", low=0.0, high=2e3, source="chosen", meaning="largest force along the shaft")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when the tip is set")
    t1: float = quantity(1.3, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it is drawn out")
    ahead: float = quantity(
        0.5, "m", low=-1.0, high=1.0, source="chosen", meaning="of the tip before the hand when it is set"
    )
    length: float = quantity(1.15, "m", low=0.5, high=1.6, source="typical pole", meaning="from grip to tip")
    side: float = quantity(0.0, "1", low=-1.0, high=1.0, source="chosen", meaning=_SIDE)

    def at_hands(self) -> tuple[float, float]:
        return 0.5 * (1.0 + self.side), 0.5 * (1.0 - self.side)

    def force(self, math: Math, state: BodyState) -> Vector:
        v_f, v_l, _ = state.velocity
        speed = math.sqrt(v_f * v_f + v_l * v_l + _SLOW * _SLOW)
        passed = speed * (state.t - self.t0) - self.ahead
        reach = math.sqrt(1.0 - _LEAST_HEIGHT * _LEAST_HEIGHT) * self.length
        passed = math.maximum(math.minimum(passed, reach), -reach)
        height = math.sqrt(self.length * self.length - passed * passed)
        along = self.press * swell(math, state.t, self.t0, self.t1, 1.0) / self.length
        return along * passed * v_f / speed, along * passed * v_l / speed, along * height


@dataclass(frozen=True)
class UnexplainedForce(BodyTerm):
    """A force of unknown cause; several in a row follow any course in time.

    Formula: F = (force_f, force_l, force_n)·½(tanh((t − t0)/rise) − tanh((t − t1)/rise))
    """

    name: ClassVar[str] = "unexplained_force"
    sources: ClassVar[tuple[str, ...]] = ("none: it is what the known laws leave",)

    force_f: float = quantity(0.0, "N", low=-3e3, high=3e3, source="chosen", meaning="force down the fall line")
    force_l: float = quantity(0.0, "N", low=-3e3, high=3e3, source="chosen", meaning="force to the left")
    force_n: float = quantity(0.0, "N", low=-3e3, high=3e3, source="chosen", meaning="force away from the snow")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it comes")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it goes")
    rise: float = quantity(0.05, "s", low=0.01, high=2.0, source="chosen", meaning="time it takes to come and to go")

    def force(self, math: Math, state: BodyState) -> Vector:
        share = window(math, state.t, self.t0, self.t1, self.rise)
        return self.force_f * share, self.force_l * share, self.force_n * share


@dataclass(frozen=True)
class PassingDrag(BodyTerm):
    """More drag area for a while in still air, as of a skier who rises.

    Formula: F = −½·rho·area·|v|·v·½(tanh((t − t0)/rise) − tanh((t − t1)/rise))   with the air's default rho
    """

    name: ClassVar[str] = "passing_drag"
    sources: ClassVar[tuple[str, ...]] = (
        "drag areas of skiers from 0.15 m² (tuck) to 0.6 m² (upright): Barelle et al., Sports Eng. 7 (2004) 107",
    )

    area: float = quantity(0.0, "m^2", low=-0.5, high=1.0, source="range of drag areas", meaning="more drag area")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it comes")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it goes")
    rise: float = quantity(0.05, "s", low=0.01, high=2.0, source="chosen", meaning="time it takes to come and to go")

    def force(self, math: Math, state: BodyState) -> Vector:
        v_f, v_l, v_n = state.velocity
        speed = math.sqrt(v_f * v_f + v_l * v_l + v_n * v_n + STILL * STILL)
        drag = -0.5 * AirDrag().rho * self.area * speed * window(math, state.t, self.t0, self.t1, self.rise)
        return drag * v_f, drag * v_l, drag * v_n
