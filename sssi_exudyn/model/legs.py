"""How legs give under the captured feet, on snow that edges do not cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantity

_CARRIED: Final = 40.0
"""kg that a leg's damper is measured by: half a skier."""
USUAL_COMPLIANCE: Final = 2.5e-5
"""m/N of a leg that hops stiffly: 40 kN/m (Farley and Morgenroth, J. Biomech. 32 (1999) 267)."""


@dataclass(frozen=True)
class Legs:
    """What a leg gives under load beyond what the capture shows: a spring with a damper along the foot's up axis.

    The boot and its ski rise by h against the captured foot, and the force N of the ski along the foot's up axis is

        N = K h + c dh/dt,   K = 1/compliance,   c = 2 damping_ratio √(K · 40 kg)

    less the ski's own inertia.  A compliance of 0 holds the ski at the captured foot, as the paper does.
    """

    compliance: float = quantity(
        0.0, "m/N", low=0.0, high=2e-4,
        source="Farley and Morgenroth, J. Biomech. 32 (1999) 267: legs that hop have 20 to 40 kN/m and more",
        meaning="rise of a boot against its captured foot per force; 0 holds it",
    )  # fmt: skip
    damping_ratio: float = quantity(
        0.7, "1", low=0.0, high=2.0, source="estimate, as that of the boot's joint on snow that edges cut",
        meaning="share of critical damping, of the damper with that spring",
    )  # fmt: skip

    @property
    def give(self) -> bool:
        """Return whether they give at all."""
        return bool(np.real(self.compliance) > 0.0)

    @property
    def stiffness(self) -> Any:
        """N/m of a leg that gives; complex where the compliance is."""
        return 1.0 / self.compliance

    @property
    def damping(self) -> Any:
        """N s/m of a leg that gives; complex where a number is."""
        return 2.0 * self.damping_ratio * np.sqrt(self.stiffness * _CARRIED)


RIGID: Final = Legs()


def check_legs(legs: Legs, terms: Sequence[Term], file: str | Path = "legs", place: str = "compliance") -> None:
    """Raise InputError for legs that give on snow that edges cut, where the boots' joints have a give of their own."""
    if legs.give and is_carved(terms):
        problem = "on snow that edges cut the joint at the boot gives already"
        raise InputError(file, place, problem, "leave the compliance at 0")
