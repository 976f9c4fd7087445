"""Uncertainty of what a recording states: standard deviations usual for inertial suits, insoles and stated masses.

``[uncertainty]`` of ``recording.toml`` replaces them where better ones are known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from sssi_exudyn.core.quantity import quantity

_SUIT: Final = "inertial suits: 1 to 2 degrees and 0.3 to 0.5 degrees that wander (Robert-Lachaine et al. 2017)"
_SEGMENTS: Final = "thigh and shank wrong by their own degree"
_DEGREE: Final = math.radians(1.0)
_MOST: Final = 45.0 * _DEGREE


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations of stated and measured quantities before a fit."""

    foot: float = quantity(
        1.5 * _DEGREE, "rad", low=0.0, high=_MOST, source=_SUIT, meaning="constant turn of each foot about each axis"
    )
    foot_wander: float = quantity(
        0.4 * _DEGREE, "rad", low=0.0, high=_MOST, source=_SUIT, meaning="turn of a foot that changes over seconds"
    )
    foot_yaw_fast: float = quantity(
        0.15 * _DEGREE, "rad", low=0.0, high=_MOST,
        source="measured: docs/notebook/uncertainty.md, noise of single segments that forgets within half a second",
        meaning="yaw of a foot that changes within a second",
    )  # fmt: skip
    foot_place: float = quantity(
        0.01, "m", low=0.0, high=0.3, source=_SEGMENTS, meaning="each foot's place along and across the slope"
    )
    foot_place_wander: float = quantity(
        0.004, "m", low=0.0, high=0.3, source=_SEGMENTS, meaning="the same, changing over seconds"
    )
    foot_height: float = quantity(
        0.005, "m", low=0.0, high=0.3, source=_SEGMENTS, meaning="height of one foot against the other"
    )
    foot_height_wander: float = quantity(
        0.008, "m", low=0.0, high=0.3,
        source="computed: constant errors of 0.4 to 1 degree in every joint make 5 to 13 mm, as the legs bend",
        meaning="the same, changing over seconds",
    )  # fmt: skip
    trunk: float = quantity(
        1.5 * _DEGREE, "rad", low=0.0, high=_MOST, source=_SUIT, meaning="constant lean of the trunk"
    )
    trunk_wander: float = quantity(
        0.4 * _DEGREE, "rad", low=0.0, high=_MOST, source=_SUIT, meaning="the same, changing over seconds"
    )
    mass: float = quantity(
        2.0, "kg", low=0.0, high=50.0, source="clothes, helmet, what he carries", meaning="the skier's stated mass"
    )
    drag: float = quantity(
        0.15,
        "1",
        low=0.0,
        high=1.0,
        meaning="share of the drag coefficient",
        source="ten skiers differ by 14 % upright and by 13 % in a tuck: Appl. Sci. 12 (2022) 902",
    )
    lift_area: float = quantity(
        0.15, "m^2", low=0.0, high=1.0,
        source="root mean square of 0.08 to 0.21 m², of two skiers: Watanabe and Ohtsuki, Ergonomics 20 (1977)",
        meaning="lift area of the skier",
    )  # fmt: skip
    drag_area_wander: float = quantity(
        0.02, "m^2", low=0.0, high=0.3,
        source="chosen: a twentieth of what lies between a tuck and upright, 0.15 to 0.6 m² (Barelle et al. 2004)",
        meaning="drag area that changes within a turn, as a skier rises and crouches",
    )  # fmt: skip
    snow_stiffness: float = quantity(
        0.3, "1", low=0.0, high=2.0, source="snow differs by more", meaning="share of the penetration's stiffness"
    )
    snow_damping: float = quantity(
        1.0, "log", low=0.0, high=2.0, source="chosen: the paper states none",
        meaning="logarithm of the factor to which the penetration's damping is known; 0 holds it",
    )  # fmt: skip
    snow_exponents: float = quantity(
        0.13, "1", low=0.0, high=0.5, source="chosen: from a linear spring to one that stiffens with depth squared",
        meaning="share of the exponents of the depth, of spring and damper; 0 holds them",
    )  # fmt: skip
    friction_onset: float = quantity(
        1.0, "log", low=0.0, high=2.0, source="chosen: the paper states none; 0.03 to 0.3 m/s is likely",
        meaning="logarithm of the factor to which the slip is known over which friction builds up; 0 holds it",
    )  # fmt: skip
    leg_compliance: float = quantity(
        1.0, "1", low=0.0, high=10.0,
        source="chosen: from legs whose give the capture shows to those that hop (Farley and Morgenroth 1999)",
        meaning="the legs' compliance, as a share of the usual one; 0 holds them",
    )  # fmt: skip
    boot_cuff: float = quantity(
        0.03, "1", low=0.0, high=0.5, source="Nakazato et al. 2011", meaning="share of the load in the boots' cuffs"
    )
    insole_gain: float = quantity(
        0.05, "1", low=0.0, high=0.5, source="calibration of one insole", meaning="relative error of each insole"
    )
    insole_zero: float = quantity(
        15.0, "N", low=0.0, high=300.0, source="chosen: a zero set before the run drifts by 1 to 2 % of a weight",
        meaning="what each insole reads unloaded",
    )  # fmt: skip
    insole_clock: float = quantity(
        0.01, "s", low=0.0, high=0.25, source="chosen: a stamp of the foot, seen to a frame of the capture",
        meaning="clock of the insoles against the capture",
    )  # fmt: skip
    antenna: float = quantity(
        0.015, "m", low=0.0, high=0.5, source="tape measure", meaning="antenna's place on the body, each axis"
    )
    clock: float = quantity(
        0.005, "s", low=0.0, high=1.0, source="synchronised clocks", meaning="clock of the receiver against the capture"
    )
    residual_moment: float = quantity(
        20.0, "N m", low=1.0, high=1e4, source="residual reduction, OpenSim",
        meaning="residual moment about the pelvis",
    )  # fmt: skip
