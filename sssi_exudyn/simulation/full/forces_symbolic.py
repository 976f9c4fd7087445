"""The arithmetic of force terms in Exudyn's symbols, for user functions that Exudyn evaluates without Python.

An exception inside ``CreateSymbolicUserFunction`` corrupts the heap, so whatever may go wrong in a term must have gone
wrong before: every law is noted on a tape first, and Exudyn's symbols get the tape's operations.  Exudyn shares no
common subexpressions: a number that a term uses twice is computed twice.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import Final

import exudyn
import numpy as np

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen.tape import Node, Operand, Tape, TapeMath, needed
from sssi_exudyn.contact.maths import Math, Number
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.full.forces_numpy import six_of

_symbols = exudyn.symbolic  # set while the package is imported
_POINTS: Final = 32
_SEGMENTS: Final = 8
"""Rows of a block: a call costs some 2 µs, a row that is not needed 0.1 µs."""


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

    def atan2(self, y: Number, x: Number) -> Number:
        return _symbols.atan2(y, x)

    def exp(self, x: Number) -> Number:
        return _symbols.exp(x)

    def log(self, x: Number) -> Number:
        return _symbols.log(x)

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
    """The terms recorded as Exudyn's expressions and evaluated by Exudyn, a block of points at a time."""

    def __init__(self, terms: Sequence[Term]) -> None:
        def segment(math: Math, t: Number, f: Number, l: Number, *rest: Number) -> Sequence[Number]:  # noqa: E741
            wind_f, wind_l, wind_n = places.air_velocity(math, terms, places.PlaceState(t, f, l))
            v_f, v_l, v_n, area, ff, fl, fn, ll, ln, nn = rest
            state = places.SegmentState((v_f, v_l, v_n), (wind_f, wind_l, wind_n), area, (ff, fl, fn, ll, ln, nn))
            return places.segment_force(math, terms, state)

        def body(math: Math, t: Number, f: Number, l: Number, *velocity: Number) -> Sequence[Number]:  # noqa: E741
            v_f, v_l, v_n = velocity
            return places.body_force(math, terms, places.BodyState(t, f, l, (v_f, v_l, v_n)))

        self._point = RecordedLaw(
            3, _POINTS, lambda math, *a: (places.point_force(math, terms, places.PointState(*a)),)
        )
        self._foot = RecordedLaw(9, 2, lambda math, *a: places.foot_force(math, terms, places.FootState(*a)))
        self._segment = RecordedLaw(13, _SEGMENTS, segment)
        self._body = RecordedLaw(6, 1, body)
        self._terrain = RecordedLaw(2, _POINTS, lambda math, *a: places.terrain_height(math, terms, *a))
        self._flat = not any(isinstance(term, places.TerrainTerm) for term in terms)

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        return self._point(depth, rate, length)[:, 0]

    def foot(self, *state: Array) -> tuple[Array, Array]:
        along, across = self._foot(*state).T
        return along, across

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array, facing: Array) -> Array:  # noqa: E741
        return self._segment(t, f, l, *velocity.T, area, *six_of(facing))

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        (force,) = self._body(t, f, l, *velocity)
        return np.asarray(force)

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        if self._flat:
            flat = np.zeros(f.shape)
            return flat, flat, flat
        height, by_f, by_l = self._terrain(f.ravel(), l.ravel()).T.reshape(3, *f.shape)
        return height, by_f, by_l


def _in_symbols(tape: Tape, outputs: Sequence[Operand], symbols: dict[Node, Number]) -> list[Number]:
    """Return the tape's outputs, its operations done on Exudyn's symbols."""
    math = SymbolicMath()
    known = dict(symbols)

    def value(x: Operand) -> Number:
        return known[x] if isinstance(x, Node) else x

    for node in needed(tape, outputs):
        if node not in known:
            operands = [value(x) for x in node.operands]
            operation = _OPERATORS.get(node.operation) or getattr(math, node.operation)
            known[node] = operation(*operands)
    return [value(x) for x in outputs]


_OPERATORS: Final[dict[str, Callable[[Number, Number], Number]]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}


class RecordedLaw:
    """A law written down once for each row of a block, which Exudyn then evaluates in one call.

    The arguments are a matrix's columns: setting one matrix and reading one vector takes 0.1 µs a row for the
    paper's law, where setting and reading symbols one by one takes 1.5 µs.  Recording is switched on while the law is
    written down and off again: other user functions shall stay numbers.
    """

    def __init__(self, arguments: int, rows: int, law: Callable[..., Sequence[Number]]) -> None:
        tape = Tape()
        names = [tape.name(f"a{k}") for k in range(arguments)]
        outputs = tuple(law(TapeMath(tape), *names))
        self._block = np.zeros((rows, arguments))
        self._inputs = _symbols.Matrix("inputs", self._block)
        before = _symbols.GetRecording()
        _symbols.SetRecording(True)
        try:
            symbols = [
                _in_symbols(tape, outputs, {name: self._inputs[row, k] for k, name in enumerate(names)})
                for row in range(rows)
            ]
            self._outputs = _symbols.Vector([x for row in symbols for x in row])
        finally:
            _symbols.SetRecording(before)
        self._size = len(symbols[0])

    def __call__(self, *columns: Array | float) -> Array:
        """Return (k, outputs) for arguments of which the last is an array (k,) or all are numbers."""
        count, rows = np.size(columns[-1]), len(self._block)
        outputs: Array = np.empty((count, self._size))
        given = np.empty((-(-count // rows) * rows, len(columns)))
        for k, column in enumerate(columns):
            given[:count, k] = column
        given[count:] = given[:1]  # of no use, but values that the law is made for
        for start in range(0, count, rows):
            self._inputs.SetMatrix(given[start : start + rows])
            stop = min(start + rows, count)
            block = self._outputs.Evaluate().reshape(rows, self._size)
            outputs[start:stop] = block[: stop - start]
        return outputs
