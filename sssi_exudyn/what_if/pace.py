"""The pace at which a movement is played: own time t of every instant s of the recorded clock.

    t(s) = start + ∫ exp(g) ds

g is a sum of B-splines, so that time never runs backwards and a pace of one is g = 0.  A slower skier comes to each
place of the path later, and moves there as he did when he was recorded, only slower.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.body_forces import PlantedPole, PolePlant
from sssi_exudyn.core.frames import Array


@dataclass(frozen=True)
class Pace:
    """Own time of the recorded clock's instants.

    recorded : (n,) s, increasing;  slowness : (n,) exp(g), s of own time a second of the recorded clock
    """

    recorded: Array
    slowness: Array

    @cached_property
    def _own(self) -> CubicSpline:
        return CubicSpline(self.recorded, self.slowness).antiderivative()

    @cached_property
    def _back(self) -> CubicSpline:
        return CubicSpline(self.own(self.recorded), self.recorded)

    def own(self, recorded: Array) -> Array:
        """Return own times (n,) s of instants (n,) s of the recorded clock; the start is the same."""
        inside = np.clip(recorded, self.recorded[0], self.recorded[-1])
        return np.asarray(self.recorded[0] + self._own(inside) + (recorded - inside) * self.slowness[-1])

    def back(self, own: Array) -> Array:
        """Return instants (n,) s of the recorded clock at own times (n,) s."""
        first, last = self.own(self.recorded[[0, -1]])
        return np.asarray(self._back(np.clip(own, first, last)))

    def later(self, change: Array) -> CubicSpline:
        """Return, as a function of the recorded clock, the growth of own times (s) where g grows by ``change`` (n, …)
        at the pace's instants.
        """
        slower = self.slowness.reshape((-1, *(1,) * (change.ndim - 1))) * change
        return CubicSpline(self.recorded, slower).antiderivative()

    def retimed(self, terms: tuple[Term, ...]) -> tuple[Term, ...]:
        """Return the terms with the skier's pole plants at their own times; wind and snow keep theirs."""
        return tuple(self._retimed(term) for term in terms)

    def _retimed(self, term: Term) -> Term:
        if isinstance(term, PolePlant):
            return replace(term, t=float(self.own(np.array(term.t))))
        if isinstance(term, PlantedPole):
            first, last = self.own(np.array([term.t0, term.t1])).tolist()
            return replace(term, t0=first, t1=last)
        return term
