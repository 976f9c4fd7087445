"""The skier's heading on snow that edges cut: prescribed, held by a spring, or free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from sssi_exudyn.contact.registry import is_carved
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.choices import HeadingMode
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantity


@dataclass(frozen=True)
class Heading:
    """The heading of the whole skier about gravity.

    mode : ``replay``, the captured heading; ``track``, held to the captured one by a spring and a damper; ``free``, the
        result of the forces of snow and air
    """

    mode: HeadingMode = "replay"
    stiffness: float = quantity(
        500.0, "N m/rad", low=1.0, high=1e6,
        source="estimate: a capture's heading is off by some 3 degrees, and posture and snow disagree by some 30 N m",
        meaning="stiffness of the spring to the captured heading, in track",
    )  # fmt: skip
    damping_ratio: float = quantity(
        0.7,
        "1",
        low=0.0,
        high=2.0,
        source="estimate",
        meaning="share of critical damping, of the damper with that spring",
    )

    @property
    def is_found(self) -> bool:
        """Return whether the heading may differ from the captured one."""
        return self.mode != "replay"

    def held(self) -> Heading:
        """Return the heading for fits: a free one is held by the spring, or it could explain any misfit."""
        return replace(self, mode="track") if self.mode == "free" else self


REPLAY: Final = Heading()


def check_heading(heading: Heading, terms: Sequence[Term], file: str | Path = "heading", place: str = "") -> None:
    """Raise InputError where the heading is free or held by a spring on snow that does not turn a ski."""
    if heading.is_found and not is_carved(terms):
        problem = f"{heading.mode}: friction at the foot has no yaw moment that could decide the heading"
        raise InputError(file, place, problem, "use snow that edges cut, or replay")
