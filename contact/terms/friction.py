"""Friction along the ski and the snow's resistance across it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import FootState, FootTerm
from sssi_exudyn.core.quantity import quantity

_BOUNDS = "paper, 2.3: bounds and first guess of the optimisation"


@dataclass(frozen=True)
class AnisotropicFriction(FootTerm):
    """Coulomb friction with one coefficient along the ski and another across it.

    Formula: f_t = −mu_t·ΣF_N·v_t/√(v_t² + ε²),   f_n = −mu_n·ΣF_N·v_n/(|v_n|^p + w^p)^(1/p),   w² = ε² + (τ·v_t)²

    Each direction has its own smoothed sign.  ε is the slip speed over which the sign turns over.  τ is the tangent of
    the slip angle over which the resistance across the ski builds up: with τ alone this resistance depends on the
    angle between ski and path, with ε alone on the speed across.  p says how sharply it then becomes constant.  The
    paper smooths by speed (τ = 0).
    """

    name: ClassVar[str] = "friction"
    sources: ClassVar[tuple[str, ...]] = ("paper, 2.2.3",)

    mu_t: float = quantity(0.1, "1", low=0.01, high=0.99, source=_BOUNDS, meaning="friction along the ski")
    mu_n: float = quantity(0.5, "1", low=0.01, high=0.99, source=_BOUNDS, meaning="resistance across the ski")
    eps: float = quantity(
        0.10,
        "m/s",
        low=0.001,
        high=1.0,
        source="chosen: the paper gives no number",
        meaning="slip speed over which the sign turns over",
    )
    slip: float = quantity(
        0.0,
        "1",
        low=0.0,
        high=0.5,
        source="paper: the sign is smoothed by speed alone; tyres and sledges build side force up over an angle",
        meaning="tangent of the slip angle over which the resistance across the ski builds up",
    )
    sharpness: float = quantity(
        2.0,
        "1",
        low=1.0,
        high=8.0,
        source="chosen: the paper gives no number",
        meaning="exponent of the passage from building up to full resistance across the ski",
    )

    def force(self, math: Math, state: FootState) -> tuple[Number, Number]:
        along = -self.mu_t * state.load * math.saturate(state.v_t, self.eps)
        skewed = self.slip * state.v_t
        slip = state.v_n / math.sqrt(self.eps * self.eps + skewed * skewed)
        rounded = math.power(1.0 + math.power(math.absolute(slip), self.sharpness), 1.0 / self.sharpness)
        return along, -self.mu_n * state.load * slip / rounded
