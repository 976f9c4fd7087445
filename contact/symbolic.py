"""The arithmetic of force terms in Exudyn's symbols, for user functions that Exudyn evaluates without Python.

An exception inside ``CreateSymbolicUserFunction`` corrupts the heap, so whatever may go wrong in a term must have gone
wrong before: the conformance tests trace every term first.  Exudyn shares no common subexpressions: a number that a
term uses twice is computed twice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import exudyn
import numpy as np

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.maths import Number
from sssi_exudyn.contact.term import Term
from sssi_exudyn.frames import Array

_symbols = exudyn.symbolic  # set while the package is imported
_FOOT: Final = ("load", "v_t", "v_n", "edge", "groove", "t", "f", "l", "side")
_VELOCITY: Final = ("v_f", "v_l", "v_n")


class SymbolicMath:
    """``Math`` over ``exudyn.symbolic.Real``; constants may stand among the arguments."""

    def sqrt(self, x: Number) -> Number:
        return _symbols.sqrt(x)

    def sin(self, x: Number) -> Number:
        return _symbols.sin(x)

    def cos(self, x: Number) -> Number:
        return _symbols.cos(x)

    def atan(self, x: Number) -> Number:
        return _symbols.atan(x)

    def exp(self, x: Number) -> Number:
        return _symbols.exp(x)

    def tanh(self, x: Number) -> Number:
        return _symbols.tanh(x)

    def absolute(self, x: Number) -> Number:
        return _symbols.abs(x)

    def sign(self, x: Number) -> Number:
        return _symbols.sign(x)

    def power(self, x: Number, p: Number) -> Number:
        return _symbols.pow(x, p)

    def signed_power(self, x: Number, p: Number) -> Number:
        return _symbols.sign(x) * _symbols.pow(_symbols.abs(x), p)

    def where(self, x: Number, a: Number, b: Number) -> Number:
        # IfThenElse takes nothing but symbols, and any number but zero for true
        return _symbols.IfThenElse(_symbols.Real(0.0) < x, *(self._symbol(branch) for branch in (a, b)))

    def maximum(self, a: Number, b: Number) -> Number:
        return _symbols.max(a, b)

    def minimum(self, a: Number, b: Number) -> Number:
        return _symbols.min(a, b)

    def saturate(self, v: Number, eps: Number) -> Number:
        # sin(atan(v/eps)) is v/sqrt(v*v + eps*eps) with v evaluated once
        return _symbols.sin(_symbols.atan(v / eps))

    def _symbol(self, x: Number) -> Number:
        return _symbols.Real(x) if isinstance(x, float | int) else x


class SymbolicLaws:
    """The terms recorded once as Exudyn's expressions and evaluated by Exudyn, without the interpreter.

    Recording is switched on while the terms are written down and off again: other user functions shall stay numbers.
    """

    def __init__(self, terms: Sequence[Term]) -> None:
        self._math = SymbolicMath()
        before = _symbols.GetRecording()
        _symbols.SetRecording(True)
        try:
            self._point = self._recorded(("depth", "rate", "length"), lambda *a: (self._of_point(terms, *a),))
            self._foot = self._recorded(_FOOT, lambda *a: places.foot_force(self._math, terms, places.FootState(*a)))
            self._segment = self._recorded(("t", "f", "l", *_VELOCITY, "area"), lambda *a: self._of_segment(terms, *a))
            self._body = self._recorded(("t", "f", "l", *_VELOCITY), lambda *a: self._of_body(terms, *a))
            self._terrain = self._recorded(("f", "l"), lambda *a: places.terrain_height(self._math, terms, *a))
        finally:
            _symbols.SetRecording(before)
        self._flat = not any(isinstance(term, places.TerrainTerm) for term in terms)

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        evaluate = self._point
        return np.array([evaluate(*each)[0] for each in zip(depth, rate, length, strict=True)])

    def foot(self, *state: float) -> tuple[float, float]:
        along, across = self._foot(*state)
        return along, across

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array) -> Array:  # noqa: E741
        rows = [self._segment(t, f, l, *v, a) for v, a in zip(velocity, area, strict=True)]
        return np.array(rows, dtype=np.float64).reshape(len(area), 3)

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        return np.array(self._body(t, f, l, *velocity))

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        if self._flat:
            flat = np.zeros(np.shape(f))
            return flat, flat, flat
        rows = [self._terrain(*each) for each in zip(np.ravel(f), np.ravel(l), strict=True)]
        height, by_f, by_l = np.array(rows).T.reshape(3, *np.shape(f))
        return height, by_f, by_l

    def _recorded(self, names: Sequence[str], law: Callable[..., Sequence[Number]]) -> Callable[..., tuple[float, ...]]:
        """A function of floats that evaluates what ``law`` makes of symbols of those names."""
        symbols = [_symbols.Real(name, 0.0) for name in names]
        put = [symbol.SetValue for symbol in symbols]
        results = [x if isinstance(x, float) else x.Evaluate for x in law(*symbols)]

        def evaluate(*values: float) -> tuple[float, ...]:
            for place, value in zip(put, values, strict=True):
                place(value)
            return tuple(x if isinstance(x, float) else x() for x in results)

        return evaluate

    def _of_point(self, terms: Sequence[Term], *state: Number) -> Number:
        return places.point_force(self._math, terms, places.PointState(*state))

    def _of_segment(self, terms: Sequence[Term], t: Number, f: Number, l: Number, *rest: Number) -> Sequence[Number]:  # noqa: E741
        wind_f, wind_l, wind_n = places.air_velocity(self._math, terms, places.PlaceState(t, f, l))
        v_f, v_l, v_n, area = rest
        state = places.SegmentState((v_f, v_l, v_n), (wind_f, wind_l, wind_n), area)
        return places.segment_force(self._math, terms, state)

    def _of_body(self, terms: Sequence[Term], t: Number, f: Number, l: Number, *velocity: Number) -> Sequence[Number]:  # noqa: E741
        v_f, v_l, v_n = velocity
        return places.body_force(self._math, terms, places.BodyState(t, f, l, (v_f, v_l, v_n)))
