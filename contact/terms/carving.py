"""Edges that cut: the snow's forces on a ski's edge, with the groove that the shovel leaves for the rest of the ski."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import EdgeState, EdgeTerm
from sssi_exudyn.core.quantity import quantity

_MOSSNER = "M. Mössner et al., J. Glaciol. 59 (2013) 1170"
_ESTIMATE = "estimate"
_LEVEL: Final = 1e-9
"""m; a section less tilted than this is flat."""
_TURNED: Final = 0.035
"""rad; over this edge angle the firm wall of the groove goes from one side of the edge to the other."""
_OPEN: Final = 5e-3
"""m of sideslip beyond the groove's own width after which a point has left the groove."""
_YIELD_DEPTH: Final = 2e-3
"""m; depth at which ``yield_offset`` is met: the stiffness of the wall is that of this depth at every depth."""
_SMALL: Final = 1e-3
"""N/m; below, friction is smoothed."""


@dataclass(frozen=True)
class Carving(EdgeTerm):
    """Plastic snow that an edge cuts into, and a groove that guides the edge's later points.

    Formula: p = H·w·cosθ·I0·(1 − r/δ)₊·(1 + χ·ȧ)₊,  q = −q_e − ρ_s·a·v_n·|v_n|,  q_e = k_s·(u − play) within ±S_f·a,
    u = U + h·v_n,  f = −μ·√(p² + q²)·V/√(V² + ε²) − p·(τ·N)₊

    p is along the snow's normal, q across the edge in the snow's plane, f along the edge, each a metre of edge.  The
    snow's pressure is in proportion to depth, H; I0 is the mean depth over the section of the groove, of depth
    g = max(a, G) under the lower edge; an edge that has risen by r from the groove's floor presses less, and no more
    where r reaches δ or the snow's surface.  The wall carries S_f·a on the side of the base, ``inside`` times that on
    the other; beyond, the edge skids and the wall moves with it.  The groove has the ski's own shape, one wall as steep
    as the base and one square to it: an edge that has risen by r has the play (r − δ)₊·cotθ on the base's side, whose
    snow springs back, and r·tanθ on the other.  Friction is on the resultant of p and q.  Where the edge climbs along
    its own tangent τ it compacts snow.

    A groove of depth G is left behind by sideslip over its own width a·cotθ, the ski's width at most, and 5 mm.
    """

    name: ClassVar[str] = "carving"
    replaces: ClassVar[tuple[str, ...]] = ("penetration", "friction")
    sources: ClassVar[tuple[str, ...]] = (
        f"{_MOSSNER}: penetration in proportion to the volume displaced, shear strength to the area cut",
        "P. Federolf et al., Sports Eng. 12 (2010) 123, doi 10.1007/s12283-010-0038-z: the rear runs in the groove",
        "Y. Hirano, N. Tada, Med. Sci. Sports Exerc. 28 (1996) 1209: snow thrown aside resists by its density",
    )

    hardness: float = quantity(
        1e8, "N/m^3", low=4e7, high=9e10, source=f"{_MOSSNER}: bounds; default: {_ESTIMATE}",
        meaning="H, pressure of the snow a metre of depth",
    )  # fmt: skip
    strength: float = quantity(
        4e5, "Pa", low=4e4, high=2e6, source=f"{_MOSSNER}: the firmest snow measured; upper bound: {_ESTIMATE}",
        meaning="S_f, shear strength of the groove's wall",
    )  # fmt: skip
    recovery: float = quantity(
        5e-4, "m", low=1e-4, high=2e-3, source=_ESTIMATE, meaning="δ, how far pressed snow springs back"
    )
    yield_offset: float = quantity(
        5e-4, "m", low=1e-4, high=2e-3, source=_ESTIMATE, meaning="u_y, offset at which a wall of 2 mm yields"
    )
    damping: float = quantity(
        1.0, "s/m", low=0.0, high=5.0, source="the ratio c/k of penetration", meaning="χ, rise of the pressure by rate"
    )
    inside: float = quantity(
        0.3, "1", low=0.0, high=1.0, source=_ESTIMATE, meaning="ρ_i, strength away from the base's side, a share"
    )
    density: float = quantity(
        450.0, "kg/m^3", low=0.0, high=700.0, source=_ESTIMATE, meaning="ρ_s, snow thrown aside by sideslip"
    )
    mu: float = quantity(
        0.05, "1", low=0.01, high=0.3, source="as friction.mu_t; of the resultant", meaning="friction along the edge"
    )
    eps: float = quantity(
        0.10, "m/s", low=0.001, high=1.0, source="as friction.eps", meaning="speed the sign turns over"
    )

    def force(self, math: Math, state: EdgeState) -> tuple[Number, Number, Number, Number]:
        a = math.maximum(state.lower, 0.0)
        floor = math.maximum(a, state.groove)
        risen = floor - a
        mean, moment = _depths(math, floor, state.lower - state.upper)
        spring_back = math.minimum(self.recovery, math.maximum(floor, 1e-9))
        loose = math.maximum(1.0 - risen / spring_back, 0.0) * math.maximum(1.0 + self.damping * state.rate, 0.0)
        scale = self.hardness * state.width * math.cos(state.edge) * loose
        push = scale * mean
        across = -self._wall(math, state) - self.density * a * state.v_n * math.absolute(state.v_n)
        forward = math.saturate(state.v_t, self.eps)
        square = push * push + across * across
        resultant = square / (math.sqrt(square + _SMALL * _SMALL) + _SMALL)
        climbing = math.maximum(state.rise * forward, 0.0)
        along = -(self.mu * resultant + push * climbing) * forward
        return push * state.length, along * state.length, across * state.length, scale * moment * state.length

    def remember(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        a = math.maximum(state.lower, 0.0)
        sine = math.maximum(math.absolute(math.sin(state.edge)), 1e-6)
        opening = math.minimum(a * math.cos(state.edge) / sine, state.width) + _OPEN
        kept = math.exp(-state.step * math.absolute(state.v_n) / opening)
        groove = a + math.maximum(state.groove - a, 0.0) * kept
        (right, left), (most_right, most_left) = self._play(math, state), self._most(math, state)
        offset = state.offset + state.step * state.v_n
        offset = math.minimum(offset, left + most_left / self._stiffness())
        offset = math.maximum(offset, -right - most_right / self._stiffness())
        return math.where(state.lower, groove, 0.0), math.where(state.lower, offset, 0.0)

    def capacity(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        most = self.strength * math.maximum(state.lower, 0.0)
        return most * state.length, math.absolute(self._wall(math, state)) * state.length

    def _stiffness(self) -> Number:
        """Return the stiffness of the groove's wall (N/m²)."""
        return self.strength * _YIELD_DEPTH / self.yield_offset

    def _wall(self, math: Math, state: EdgeState) -> Number:
        """Return the force on the groove's wall a metre of edge, to the left (N/m)."""
        (right, left), (most_right, most_left) = self._play(math, state), self._most(math, state)
        offset = state.offset + state.step * state.v_n
        beyond = math.maximum(offset - left, 0.0) - math.maximum(-offset - right, 0.0)
        return math.maximum(math.minimum(self._stiffness() * beyond, most_left), -most_right)

    def _most(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        """Return the greatest forces of the walls to the right and to the left (N/m)."""
        most, turned = self.strength * math.maximum(state.lower, 0.0), _turned(math, state)
        middle, half = 0.5 * (1.0 + self.inside), 0.5 * (1.0 - self.inside)
        return most * (middle - half * turned), most * (middle + half * turned)

    def _play(self, math: Math, state: EdgeState) -> tuple[Number, Number]:
        """Return the distances (m) of a risen edge in its groove from the walls to the right and to the left."""
        risen = math.maximum(state.groove - math.maximum(state.lower, 0.0), 0.0)
        turned = _turned(math, state)
        sine, cosine = math.maximum(math.absolute(math.sin(state.edge)), 1e-6), math.cos(state.edge)
        cosine = math.maximum(cosine, 1e-6)
        base = math.minimum(math.maximum(risen - self.recovery, 0.0) * cosine / sine, state.width)
        side = math.minimum(risen * sine / cosine, state.width)
        middle, half = 0.5 * (base + side), 0.5 * (base - side)
        return middle - half * turned, middle + half * turned


def _turned(math: Math, state: EdgeState) -> Number:
    """Return the side of the edge on which the base is, from -1 to 1; 1 is left."""
    return math.maximum(math.minimum(state.edge / _TURNED, 1.0), -1.0)


def _depths(math: Math, lower: Number, apart: Number) -> tuple[Number, Number]:
    """Integrate ∫ (depth)₊ over the section's width, as a share of it from the lower edge on; also times that share.

    The lower edge is at the depth ``lower`` and the other edge ``apart`` less deep (m).
    """
    d = math.maximum(apart, _LEVEL)
    covered = math.minimum(lower / d, 1.0)
    return covered * (lower - 0.5 * d * covered), covered * covered * (0.5 * lower - d * covered / 3.0)
