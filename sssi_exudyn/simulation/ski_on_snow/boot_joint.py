"""How a ski gives against the captured foot on snow that edges cut."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.bodies.skier.boot import Cuff
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantity
from sssi_exudyn.recording.recording import Equipment

_ESTIMATE: Final = "estimate"
_ANKLE_FLEXION: Final = 300.0
"""N m/rad of an ankle with its muscles: two hold up a standing skier of 75 kg, whose weight topples him by 660 N m/rad
(Winter et al., J. Neurophysiol. 80 (1998) 1211)."""


@dataclass(frozen=True)
class BootJoint:
    """How a ski gives against the captured foot: a spring with a damper in yaw, roll, heave and pitch.

    Yaw is about the foot's up axis, heave along it; roll is about the ski's long axis, pitch across it.  At no force
    the ski is where the capture has the foot: what loads both feet alike lowers the pelvis by load/stiffness.
    """

    yaw_stiffness: float = quantity(
        1e3,
        "N m/rad",
        low=20.0,
        high=1e4,
        source=f"{_ESTIMATE}: with a tenth, a ski that skids spins under the boot",
        meaning="of the leg in yaw",
    )
    roll_stiffness: float = quantity(
        600.0, "N m/rad", low=200.0, high=3e3, source=_ESTIMATE, meaning="of boot and ankle in roll"
    )
    heave_stiffness: float = quantity(
        4e4, "N/m", low=1e4, high=3e5,
        source=f"{_ESTIMATE}: of legs that hop stiffly (Farley and Morgenroth, J. Biomech. 32 (1999) 267)",
        meaning="of the leg along the foot's up axis",
    )  # fmt: skip
    pitch_stiffness: float = quantity(
        _ANKLE_FLEXION + Cuff().cuff_flexion, "N m/rad", low=100.0, high=1e4,
        source=f"{_ESTIMATE}: ankle in standing (Winter 1998) and cuff", meaning="of boot and ankle in pitch",
    )  # fmt: skip
    yaw_inertia: float = quantity(0.5, "kg m^2", low=0.1, high=2.0, source=_ESTIMATE, meaning="of ski, boot and leg")
    roll_inertia: float = quantity(0.05, "kg m^2", low=0.01, high=0.5, source=_ESTIMATE, meaning="of ski and boot")
    heave_mass: float = quantity(
        40.0, "kg", low=1.0, high=100.0, source="half a skier, who moves over skis that firm snow holds",
        meaning="that heave's damper is measured by",
    )  # fmt: skip
    pitch_inertia: float = quantity(
        0.5,
        "kg m^2",
        low=0.1,
        high=2.0,
        source=f"{_ESTIMATE}: ski and boot",
        meaning="that pitch's damper is measured by",
    )
    damping_ratio: float = quantity(0.7, "1", low=0.0, high=2.0, source=_ESTIMATE, meaning="of critical, in all four")

    @property
    def stiffness(self) -> Array:
        """(4,) N m/rad in yaw and roll, N/m in heave, N m/rad in pitch."""
        return np.array([self.yaw_stiffness, self.roll_stiffness, self.heave_stiffness, self.pitch_stiffness])

    @property
    def inertia(self) -> Array:
        """(4,) kg m² and kg.  A ski takes those of yaw and roll along; in heave and pitch it has but its own."""
        return np.array([self.yaw_inertia, self.roll_inertia, self.heave_mass, self.pitch_inertia])

    @property
    def damping(self) -> Array:
        """(4,) N m s/rad and N s/m"""
        return 2.0 * self.damping_ratio * np.sqrt(self.stiffness * self.inertia)


def boot_joint(equipment: Equipment) -> BootJoint:
    """Return the joint of these boots: the cuffs' stiffness in edging is that in roll, in flexion with the ankle's that
    in pitch.
    """
    usual = BootJoint(roll_stiffness=equipment.cuff_edging)
    if equipment.cuff_flexion is None:
        return usual
    return replace(usual, pitch_stiffness=_ANKLE_FLEXION + equipment.cuff_flexion)
