"""Air that moves over the ground, and a skier whom it brakes or lifts otherwise than assumed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

from sssi_exudyn.contact.maths import Math, Number, Vector
from sssi_exudyn.contact.term import PlaceState, SegmentState, SegmentTerm, WindTerm
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.shapes import swell
from sssi_exudyn.core.quantity import quantity

_STRONGEST: Final = 25.0
"""m/s; above, lifts stand still."""
_BEAUFORT: Final = "Beaufort scale to 9 to 10, where lifts no longer run"
SWELLS: Final = ("f_1", "f_2", "f_3", "f_4", "f_5", "f_6")
"""Numbers by which a wind is stronger at its times."""


def _turbulence(which: str) -> Any:  # Any: as ``quantity``
    """Declare by how much a wind is stronger about one of its times."""
    meaning = f"more down the fall line about the {which} time"
    return quantity(0.0, "m/s", low=-_STRONGEST, high=_STRONGEST, source=_BEAUFORT, meaning=meaning)


@dataclass(frozen=True)
class Wind(WindTerm):
    """A wind along the ground, which swells and falls by ``f_1`` to ``f_6`` about times that are ``every`` s apart.

    Formula: w = (w_f + Σ f_i·½(1 + cos(π·x_i)), w_l, 0)   x_i = min(1, |t − begin − (i − 1)·every|/every)
    """

    name: ClassVar[str] = "wind"
    sources: ClassVar[tuple[str, ...]] = (
        "the air's velocity relative to the body, as in the paper's 2.2.4",
        "turbulence of some m/s next to the mean wind: IEC 61400-1, normal turbulence model",
    )

    w_f: float = quantity(
        0.0, "m/s", low=-_STRONGEST, high=_STRONGEST, source=_BEAUFORT, meaning="wind down the fall line"
    )
    w_l: float = quantity(0.0, "m/s", low=-_STRONGEST, high=_STRONGEST, source=_BEAUFORT, meaning="wind to the left")
    begin: float = quantity(0.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="first of these times")
    every: float = quantity(2.5, "s", low=0.1, high=7200.0, source="chosen", meaning="from one of them to the next")
    f_1: float = _turbulence("first")
    f_2: float = _turbulence("second")
    f_3: float = _turbulence("third")
    f_4: float = _turbulence("fourth")
    f_5: float = _turbulence("fifth")
    f_6: float = _turbulence("sixth")

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        more: Number = 0.0
        for i, name in enumerate(SWELLS):
            about = self.begin + i * self.every
            more = more + getattr(self, name) * swell(math, state.t, about - self.every, about + self.every, 1.0)
        return self.w_f + more, self.w_l, 0.0


@dataclass(frozen=True)
class Gust(WindTerm):
    """A wind that rises from t0 and ends at t1; w_f and w_l are its peak.

    Formula: w = (w_f, w_l, 0)·½(1 − cos(π·min(1, 2x/rise)))   x = min(t − t0, t1 − t)/(t1 − t0), where that is positive
    """

    name: ClassVar[str] = "gust"
    sources: ClassVar[tuple[str, ...]] = ("the one-minus-cosine gust of 14 CFR 25.341", "Tukey's cosine taper")

    w_f: float = quantity(
        0.0, "m/s", low=-_STRONGEST, high=_STRONGEST, source=_BEAUFORT, meaning="gust down the fall line"
    )
    w_l: float = quantity(0.0, "m/s", low=-_STRONGEST, high=_STRONGEST, source=_BEAUFORT, meaning="gust to the left")
    t0: float = quantity(1.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it comes")
    t1: float = quantity(2.0, "s", low=-10.0, high=7200.0, source="chosen", meaning="when it goes")
    rise: float = quantity(
        1.0, "1", low=0.05, high=1.0, source="chosen", meaning="share of its time in which it swells and falls"
    )

    def velocity(self, math: Math, state: PlaceState) -> Vector:
        share = swell(math, state.t, self.t0, self.t1, self.rise)
        return self.w_f * share, self.w_l * share, 0.0


@dataclass(frozen=True)
class DragArea(SegmentTerm):
    """Clothing or posture that takes more or less air than the assumed drag area C_D·A.

    Formula: F = share·½·C_D·rho·A·|u|·u   in addition to the air's, with its default C_D and rho
    """

    name: ClassVar[str] = "drag_area"
    corrects: ClassVar[str] = AirDrag.name
    sources: ClassVar[tuple[str, ...]] = (
        "drag areas of skiers from 0.15 m² (tuck) to 0.6 m² (upright): Barelle et al., Sports Eng. 7 (2004) 107",
    )

    share: float = quantity(
        0.0, "1", low=-0.7, high=3.0, source="range of drag areas of skiers", meaning="more of the drag area, relative"
    )

    def force(self, math: Math, state: SegmentState) -> Vector:
        f, l, n = AirDrag().force(math, state)  # noqa: E741  the slope frame's name of the axis
        return self.share * f, self.share * l, self.share * n


@dataclass(frozen=True)
class Lift(SegmentTerm):
    """Clothing or posture by which the air lifts the skier more than assumed.

    Formula: F = ½·c_l·rho·A·(|u|²·n − u_n·u)   in addition to the air's, with its default rho
    """

    name: ClassVar[str] = "lift"
    knows_up: ClassVar[bool] = True
    corrects: ClassVar[str] = AirDrag.name
    sources: ClassVar[tuple[str, ...]] = (
        "lift areas of 0.08 to 0.21 m² of two skiers: K. Watanabe, T. Ohtsuki, Ergonomics 20 (1977)",
    )

    c_l: float = quantity(
        0.0, "1", low=-0.5, high=3.0, source="a plate at its best incidence has 1.2", meaning="more lift coefficient"
    )

    def force(self, math: Math, state: SegmentState) -> Vector:
        drag, both = AirDrag(), AirDrag(c_l=1.0)
        without, lifted = drag.force(math, state), both.force(math, state)
        f, l, n = (self.c_l * (more - less) for more, less in zip(lifted, without, strict=True))  # noqa: E741
        return f, l, n
