"""What holds one ski back for a while, and no known law explains."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.friction_corrections import UnexplainedDrag
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    InTime,
    Numbers,
    Probe,
    as_weight,
)

_LONGEST: Final = 1.0
"""s; what brakes a ski for longer is a stretch of snow under it."""


@dataclass(frozen=True)
class DragOfOneSki(InTime):
    """One ski that is held back for a while, for a reason that is not known; the formula is that of
    ``UnexplainedDrag``.  Insoles and the skis' edge angles say which.

    side : 1 the left ski, -1 the right one; both are tried
    """

    side: float = 1.0

    name = UnexplainedDrag.name
    kind = "unexplained"
    comes_again = False
    caption = "one ski that is held back"
    keys = ("brake_t", "brake_n")
    scale, longest, least = 80.0, 0.15, 1
    distinctions = (Distinction(("snow_patch", "unexplained_force"), "a second run over the same place"),)

    def possible(self, model: Model) -> bool:
        return all(term.t1 - term.t0 <= _LONGEST for term in model.terms if isinstance(term, UnexplainedDrag))

    def part(self, t0: float, t1: float, rise: float) -> UnexplainedDrag:
        return UnexplainedDrag(t0=t0, t1=t1, side=self.side)

    def cell(self, t0: float, t1: float) -> UnexplainedDrag:
        return self.part(t0, t1, 1.0)

    def profile(self, share: Array, rise: float) -> Array:
        return np.ones(len(share))

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return [probe for one in self._each() for probe in super(DragOfOneSki, one).probes(fitted)]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        of_each = zip(self._each(), np.split(responses, 2, axis=1), strict=True)
        every = [candidate for one, its in of_each for candidate in super(DragOfOneSki, one).candidates(fitted, its)]
        return [candidate for candidate in every if self.possible(candidate.model)]

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return (
            f"{_which(model)} is held back, which no known law explains: {abs(numbers['brake_t'].value):.0f} N along "
            f"it and {abs(numbers['brake_n'].value):.0f} N across"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        held = np.hypot(numbers["brake_t"].value, numbers["brake_n"].value).item()
        return f"something holds {_which(model)} back that none of the known causes explains, {as_weight(held)}"

    def _each(self) -> tuple[DragOfOneSki, DragOfOneSki]:
        return replace(self, side=1.0), replace(self, side=-1.0)


def _which(model: Model) -> str:
    """Return the ski that the model's terms hold back, in words."""
    sides = {term.side for term in model.terms if isinstance(term, UnexplainedDrag)}
    return {frozenset({1.0}): "the left ski", frozenset({-1.0}): "the right ski"}.get(frozenset(sides), "one ski")
