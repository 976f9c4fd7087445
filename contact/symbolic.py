"""The arithmetic of force terms in Exudyn's symbols, for user functions that Exudyn evaluates without Python.

An exception inside ``CreateSymbolicUserFunction`` corrupts the heap, so whatever may go wrong in a term must have gone
wrong before: the conformance tests trace every term first.  Exudyn shares no common subexpressions: a number that a
term uses twice is computed twice.
"""

from __future__ import annotations

import exudyn

from sssi_exudyn.contact.maths import Number

_symbols = exudyn.symbolic  # set while the package is imported


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
