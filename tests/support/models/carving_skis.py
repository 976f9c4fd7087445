"""Skis and snow for which a turn's radius is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sssi_exudyn.bodies.ski.ski import Profile, Ski
from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import EdgeState
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import Array

SIDECUT = 12.0
"""Radius of the parabolic sidecut, m."""
LENGTH = 1.6
FIRM = Carving(strength=1e7)
"""Snow whose wall holds an edge by a small part of its strength."""


def bent_ski(edge: float, deeper: float = 0.0, *, stiffness: float = 1e14) -> Ski:
    """Return a rigid ski with a parabolic sidecut, bent so that its edge lies in the snow's plane.

    It does so at the edge angle ``edge`` (rad), except for its middle, which is ``deeper`` (m) along the snow's normal.
    """
    half, waist = 0.5 * LENGTH, 0.066
    rise = 0.5 * half**2 / SIDECUT * np.tan(edge).item() + deeper / np.cos(edge).item()
    parabola = ("flat_at_end", "flat_at_start")
    return Ski(
        name="bent",
        source="made up",
        width=Profile((0.0, 0.5, 1.0), (waist + half**2 / SIDECUT, waist, waist + half**2 / SIDECUT), parabola),
        thickness=Profile((0.0, 1.0), (0.012, 0.012), ("linear",)),
        height=Profile((0.0, 0.5, 1.0), (rise, 0.0, rise), parabola),
        length=LENGTH,
        boot_centre=half,
        mass=1.5,
        young_modulus=stiffness,
        shear_modulus=stiffness,
    )


@dataclass(frozen=True)
class WithoutGroove(Carving):
    """Snow that springs back completely behind every point, with a wall that remembers.

    Formula: as carving, with G = 0
    """

    name: ClassVar[str] = "without_groove"

    def remember(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        return 0.0, super().remember(math, state)[1]


@dataclass(frozen=True)
class WithoutPlay(Carving):
    """Snow whose walls hold an edge that has risen from the groove's floor as if it had not.

    Formula: as carving, with no play
    """

    name: ClassVar[str] = "without_play"

    def _play(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        return 0.0, 0.0


@dataclass(frozen=True)
class StiffSideways(Ski):
    """A ski that does not bend in its own plane."""

    def lateral_stiffness(self, s: ArrayLike) -> Array:
        return 100.0 * super().lateral_stiffness(s)

    @classmethod
    def of(cls, ski: Ski) -> StiffSideways:
        return cls(**{field.name: getattr(ski, field.name) for field in fields(ski)})
