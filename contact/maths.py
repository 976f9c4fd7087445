"""The arithmetic of force terms: one formula over floats, arrays or symbols.

A term calls nothing but ``Math``, NumPy's usual functions and the operators + − · / ** on its numbers, and never
branches on one of them.  Both branches of ``where`` are computed, so each of them must be defined on both sides of the
switch.
"""

from __future__ import annotations

import math
from typing import Any, Protocol, TypeAlias

import numpy as np

Number: TypeAlias = Any
"""A float, an array, an Exudyn symbol or a node of a tape, depending on the ``Math`` in use."""

Pair: TypeAlias = tuple[Number, Number]
"""The same of two places."""

Vector: TypeAlias = tuple[Number, Number, Number]
"""Components along f, l and n of the slope frame."""

Rotation: TypeAlias = Any
"""A rotation's nine numbers, ``rotation[i, j]``; its columns are the turned frame's axes."""


def dot(a: Vector, b: Vector) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(s: Number, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


class Math(Protocol):
    """The functions a term may use."""

    def sqrt(self, x: Number) -> Number:
        """Return the square root of x ≥ 0."""

    def sin(self, x: Number) -> Number:
        """Return the sine of an angle in radians."""

    def cos(self, x: Number) -> Number:
        """Return the cosine of an angle in radians."""

    def atan(self, x: Number) -> Number:
        """Return the inverse tangent, radians."""

    def atan2(self, y: Number, x: Number) -> Number:
        """Return the angle of the direction (x, y) from the first axis, radians, −π to π."""

    def exp(self, x: Number) -> Number:
        """Return the exponential."""

    def log(self, x: Number) -> Number:
        """Return the natural logarithm of x > 0."""

    def tanh(self, x: Number) -> Number:
        """Return the hyperbolic tangent."""

    def absolute(self, x: Number) -> Number:
        """Return |x|."""

    def sign(self, x: Number) -> Number:
        """Return −1, 0 or 1."""

    def power(self, x: Number, p: Number) -> Number:
        """Return x to the power p, for x ≥ 0 and p > 0."""

    def signed_power(self, x: Number, p: Number) -> Number:
        """Return sign(x)·|x| to the power p, for p ≥ 1: smooth through 0, where sign and power alone are not."""

    def where(self, x: Number, a: Number, b: Number) -> Number:
        """Return a if x > 0, else b."""

    def maximum(self, a: Number, b: Number) -> Number:
        """Return the greater of the two."""

    def minimum(self, a: Number, b: Number) -> Number:
        """Return the lesser of the two."""

    def saturate(self, v: Number, eps: Number) -> Number:
        """Return v/√(v² + eps²): the sign of v, smoothed over the width eps > 0."""


class FloatMath:
    """Plain Python floats: the reference for the other kinds."""

    sqrt = staticmethod(math.sqrt)
    sin = staticmethod(math.sin)
    cos = staticmethod(math.cos)
    atan = staticmethod(math.atan)
    atan2 = staticmethod(math.atan2)
    exp = staticmethod(math.exp)
    log = staticmethod(math.log)
    tanh = staticmethod(math.tanh)
    absolute = staticmethod(abs)

    def sign(self, x: Number) -> Number:
        return float(x > 0.0) - float(x < 0.0)

    def power(self, x: Number, p: Number) -> Number:
        return math.pow(x, p)

    def signed_power(self, x: Number, p: Number) -> Number:
        return math.copysign(math.pow(abs(x), p), x)

    def where(self, x: Number, a: Number, b: Number) -> Number:
        return a if x > 0.0 else b

    def maximum(self, a: Number, b: Number) -> Number:
        return a if a > b else b

    def minimum(self, a: Number, b: Number) -> Number:
        return a if a < b else b

    def saturate(self, v: Number, eps: Number) -> Number:
        return v / math.sqrt(v * v + eps * eps)


class ArrayMath:
    """NumPy arrays that broadcast against each other."""

    sqrt = staticmethod(np.sqrt)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    atan = staticmethod(np.arctan)
    atan2 = staticmethod(np.arctan2)
    exp = staticmethod(np.exp)
    log = staticmethod(np.log)
    tanh = staticmethod(np.tanh)
    absolute = staticmethod(np.abs)
    sign = staticmethod(np.sign)
    power = staticmethod(np.power)
    maximum = staticmethod(np.maximum)
    minimum = staticmethod(np.minimum)

    def signed_power(self, x: Number, p: Number) -> Number:
        return np.copysign(np.power(np.abs(x), p), x)

    def where(self, x: Number, a: Number, b: Number) -> Number:
        return np.where(np.asarray(x) > 0.0, a, b)

    def saturate(self, v: Number, eps: Number) -> Number:
        return v / np.sqrt(v * v + eps * eps)
