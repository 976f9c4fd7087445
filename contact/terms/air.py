"""Drag of the air on the skier's segments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Final

from sssi_exudyn.contact.maths import Math, Vector
from sssi_exudyn.contact.term import SegmentState, SegmentTerm
from sssi_exudyn.core.quantity import quantity

_CHOICE = "chosen: the paper gives no number"

STILL: Final = 1e-6
"""m/s; keeps the slope of the speed's root finite in still air; it changes the drag by 10⁻¹² of it at 1 m/s."""


@dataclass(frozen=True)
class AirDrag(SegmentTerm):
    """Quadratic drag, along the velocity of the air relative to the segment.

    Formula: F = ½·C_D·rho·A·|u|·u,   u = wind − velocity
    """

    name: ClassVar[str] = "air"
    sources: ClassVar[tuple[str, ...]] = ("paper, 2.2.4",)

    c_d: float = quantity(0.9, "1", low=0.1, high=2.0, source=_CHOICE, meaning="drag coefficient")
    rho: float = quantity(
        1.05,
        "kg/m^3",
        low=0.6,
        high=1.4,
        source="standard atmosphere near 1900 m, winter",
        meaning="density of the air",
    )

    def force(self, math: Math, state: SegmentState) -> Vector:
        u_f, u_l, u_n = (air - own for air, own in zip(state.wind, state.velocity, strict=True))
        speed = math.sqrt(u_f * u_f + u_l * u_l + u_n * u_n + STILL * STILL)
        drag = 0.5 * self.c_d * self.rho * state.area * speed
        return drag * u_f, drag * u_l, drag * u_n


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
        """Area by segment of the kinematic chain (m²) for a skier of ``height`` (m): it grows with height squared."""
        scale = (height / self.REFERENCE_HEIGHT) ** 2
        return {segment: scale * getattr(self, part) for part, group in self.SEGMENTS.items() for segment in group}
