"""Drag of the air on the skier's segments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Final

from sssi_exudyn.contact.maths import Math, Vector
from sssi_exudyn.contact.term import SegmentState, SegmentTerm
from sssi_exudyn.core.quantity import quantity

_CHOICE = "chosen: the paper gives no number"
_LIFT: Final = "lift: K. Watanabe, T. Ohtsuki, Ergonomics 20 (1977)"

STILL: Final = 1e-6
"""m/s; keeps the slope of the speed's root finite in still air; it changes the drag by 10⁻¹² of it at 1 m/s."""


def _density() -> Any:
    return quantity(
        1.05,
        "kg/m^3",
        low=0.6,
        high=1.4,
        source="standard atmosphere near 1900 m, winter",
        meaning="density of the air",
    )


def _lift(meaning: str) -> Any:
    return quantity(0.0, "1", low=-1.0, high=2.0, source="the paper has no lift", meaning=meaning)


@dataclass(frozen=True)
class AirDrag(SegmentTerm):
    """Quadratic drag, along the velocity of the air relative to the segment, and lift across it, away from the snow.

    Formula: F = ½·rho·A·(C_D·|u|·u + C_L·(|u|²·n − u_n·u)),   u = wind − velocity
    """

    name: ClassVar[str] = "air"
    knows_up: ClassVar[bool] = True
    sources: ClassVar[tuple[str, ...]] = ("paper, 2.2.4", _LIFT)

    c_d: float = quantity(0.9, "1", low=0.1, high=2.0, source=_CHOICE, meaning="drag coefficient")
    rho: float = _density()
    c_l: float = _lift("lift coefficient, of the area of drag")

    def force(self, math: Math, state: SegmentState) -> Vector:
        u_f, u_l, u_n = (air - own for air, own in zip(state.wind, state.velocity, strict=True))
        speed = math.sqrt(u_f * u_f + u_l * u_l + u_n * u_n + STILL * STILL)
        half = 0.5 * self.rho * state.area
        along, across = half * (self.c_d * speed - self.c_l * u_n), half * self.c_l
        return along * u_f, along * u_l, along * u_n + across * (u_f * u_f + u_l * u_l + u_n * u_n)


TINY: Final = 1e-18
"""m⁴ m²/s²; keeps the slope of a root finite where a segment has no area or the air stands still."""


@dataclass(frozen=True)
class PostureAir(SegmentTerm):
    """Quadratic drag and lift of a segment's area in its posture.

    The force is along M û: across a long segment that is inclined to the wind, which gives drag and lift.  C_L is for
    the lift that this does not contain, of clothing and a cambered trunk.

    Formula: F = ½·rho·|u|²·(C_D·M û/√(û·M û) + C_L·√(û·M û)·(n − û_n·û)),   u = wind − velocity, û = u/|u|
    """

    name: ClassVar[str] = "posture_air"
    knows_up: ClassVar[bool] = True
    replaces: ClassVar[tuple[str, ...]] = (AirDrag.name,)
    sources: ClassVar[tuple[str, ...]] = (
        "paper, 2.2.4",
        "drag areas of skiers from 0.23 m² (tuck) to 0.66 m² (upright): Appl. Sci. 12 (2022) 902",
        _LIFT,
    )

    c_d: float = quantity(
        1.17,
        "1",
        low=0.1,
        high=2.0,
        source="1.17 ± 0.09, ten upright skiers with boots, skis, poles in a wind tunnel: Appl. Sci. 12 (2022) 902",
        meaning="drag coefficient of a segment",
    )
    rho: float = _density()
    c_l: float = _lift("coefficient of further lift, of the area shown")

    def force(self, math: Math, state: SegmentState) -> Vector:
        u_f, u_l, u_n = (air - own for air, own in zip(state.wind, state.velocity, strict=True))
        ff, fl, fn, ll, ln, nn = state.facing
        m_f, m_l, m_n = (
            ff * u_f + fl * u_l + fn * u_n,
            fl * u_f + ll * u_l + ln * u_n,
            fn * u_f + ln * u_l + nn * u_n,
        )
        root = math.sqrt(u_f * m_f + u_l * m_l + u_n * m_n + TINY)
        squared = u_f * u_f + u_l * u_l + u_n * u_n
        push = 0.5 * self.c_d * self.rho * squared / root
        across = 0.5 * self.c_l * self.rho * root / math.sqrt(squared + STILL * STILL)
        along = across * u_n
        return push * m_f - along * u_f, push * m_l - along * u_l, push * m_n - along * u_n + across * squared


@dataclass(frozen=True)
class ShownAreas:
    """Area of each segment from the side and from above, for a skier of ``FrontalAreas``' height (m²).

    ``FrontalAreas`` gives the area from the front.
    """

    SIDE: ClassVar[str] = "boxes and cylinders of a clothed adult of 1.75 m: chosen"

    pelvis_side: float = quantity(0.042, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of the pelvis from the side")
    pelvis_above: float = quantity(0.050, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of the pelvis from above")
    torso_side: float = quantity(
        0.150, "m^2", low=0.0, high=0.6, source=SIDE, meaning="of torso and head from the side"
    )
    torso_above: float = quantity(0.080, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of torso and head from above")
    thigh_side: float = quantity(0.060, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of one thigh from the side")
    thigh_above: float = quantity(0.023, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of one thigh along it")
    leg_side: float = quantity(0.048, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of one lower leg from the side")
    leg_above: float = quantity(0.014, "m^2", low=0.0, high=0.3, source=SIDE, meaning="of one lower leg along it")
    foot_side: float = quantity(0.030, "m^2", low=0.0, high=0.1, source=SIDE, meaning="of one foot from the side")
    foot_above: float = quantity(0.028, "m^2", low=0.0, high=0.1, source=SIDE, meaning="of one foot from above")
    arm_side: float = quantity(0.030, "m^2", low=0.0, high=0.2, source=SIDE, meaning="of one upper arm from the side")
    arm_above: float = quantity(0.010, "m^2", low=0.0, high=0.2, source=SIDE, meaning="of one upper arm along it")
    forearm_side: float = quantity(0.020, "m^2", low=0.0, high=0.2, source=SIDE, meaning="of one forearm from the side")
    forearm_above: float = quantity(0.006, "m^2", low=0.0, high=0.2, source=SIDE, meaning="of one forearm along it")
    hand_side: float = quantity(0.010, "m^2", low=0.0, high=0.1, source=SIDE, meaning="of one hand from the side")
    hand_above: float = quantity(0.005, "m^2", low=0.0, high=0.1, source=SIDE, meaning="of one hand along it")

    def of_height(self, height: float) -> dict[str, tuple[float, float, float]]:
        """Return areas (m²) along a segment's own axes by segment of the chain, for a skier of ``height`` (m)."""
        front = FrontalAreas().of_height(height)
        scale = (height / FrontalAreas.REFERENCE_HEIGHT) ** 2
        return {
            segment: (
                front[segment],
                scale * float(getattr(self, f"{part}_side")),
                scale * float(getattr(self, f"{part}_above")),
            )
            for part, group in FrontalAreas.SEGMENTS.items()
            for segment in group
        }


@dataclass(frozen=True)
class FrontalAreas:
    """Frontal area of each of the 14 segments that the air acts on, for a skier of ``REFERENCE_HEIGHT`` (m²)."""

    REFERENCE_HEIGHT: ClassVar[float] = 1.75
    """m"""
    SEGMENTS: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType(
        {
            "pelvis": ("pelvis",),
            "torso": ("torso",),
            "thigh": ("femur_l", "femur_r"),
            "leg": ("tibia_l", "tibia_r"),
            "foot": ("calcn_l", "calcn_r"),
            "arm": ("humerus_l", "humerus_r"),
            "forearm": ("ulna_l", "ulna_r"),
            "hand": ("hand_l", "hand_r"),
        }
    )
    """The kinematic chain's segments that each area belongs to."""

    pelvis: float = quantity(0.060, "m^2", low=0.0, high=0.3, source=_CHOICE, meaning="frontal area of the pelvis")
    torso: float = quantity(0.170, "m^2", low=0.0, high=0.6, source=_CHOICE, meaning="of the torso with the head")
    thigh: float = quantity(0.055, "m^2", low=0.0, high=0.3, source=_CHOICE, meaning="of one thigh")
    leg: float = quantity(0.045, "m^2", low=0.0, high=0.3, source=_CHOICE, meaning="of one lower leg")
    foot: float = quantity(0.012, "m^2", low=0.0, high=0.1, source=_CHOICE, meaning="of one foot")
    arm: float = quantity(0.030, "m^2", low=0.0, high=0.2, source=_CHOICE, meaning="of one upper arm")
    forearm: float = quantity(0.020, "m^2", low=0.0, high=0.2, source=_CHOICE, meaning="of one forearm")
    hand: float = quantity(0.008, "m^2", low=0.0, high=0.1, source=_CHOICE, meaning="of one hand")

    def of_height(self, height: float) -> dict[str, float]:
        """Return the area (m²) by segment of the chain for a skier of ``height`` (m): it grows with height squared."""
        scale = (height / self.REFERENCE_HEIGHT) ** 2
        return {segment: scale * getattr(self, part) for part, group in self.SEGMENTS.items() for segment in group}
