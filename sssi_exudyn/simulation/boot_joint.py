"""How a ski turns against the captured foot on snow that edges cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantity
from sssi_exudyn.recording.recording import Equipment

_ESTIMATE: Final = "estimate"


@dataclass(frozen=True)
class BootJoint:
    """How a ski turns against the captured foot: a spring with a damper in yaw and in roll."""

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
    yaw_inertia: float = quantity(0.5, "kg m^2", low=0.1, high=2.0, source=_ESTIMATE, meaning="of ski, boot and leg")
    roll_inertia: float = quantity(0.05, "kg m^2", low=0.01, high=0.5, source=_ESTIMATE, meaning="of ski and boot")
    damping_ratio: float = quantity(0.7, "1", low=0.0, high=2.0, source=_ESTIMATE, meaning="of critical, in both")

    @property
    def stiffness(self) -> Array:
        """(2,) N m/rad in yaw and roll."""
        return np.array([self.yaw_stiffness, self.roll_stiffness])

    @property
    def inertia(self) -> Array:
        """(2,) kg m²"""
        return np.array([self.yaw_inertia, self.roll_inertia])

    @property
    def damping(self) -> Array:
        """(2,) N m s/rad"""
        return 2.0 * self.damping_ratio * np.sqrt(self.stiffness * self.inertia)


def boot_joint(equipment: Equipment) -> BootJoint:
    """The joint of these boots: their cuffs' stiffness in edging is that in roll."""
    return BootJoint(roll_stiffness=equipment.cuff_edging)
