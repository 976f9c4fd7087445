"""A tape of the operations that a force term carries out, from which code and derivatives are written.

``TapeMath`` is the fourth kind of ``Math``: its numbers are nodes of a ``Tape``.  Equal operations share a node, the
order of operations is the term's own, so that what is written from the tape rounds as the plain formula does.  Nodes
know ``**`` and NumPy's usual functions too, so that a law may be written with those.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn, TypeAlias

import numpy as np

from sssi_exudyn.contact.maths import Number

Operand: TypeAlias = "Node | float"
"""What an operation works on: another node's result, or a constant."""


@dataclass(frozen=True, eq=False)
class Node:
    """The result of one operation on a tape.  It has no truth value: a term must not branch on it."""

    tape: Tape = field(repr=False)
    index: int
    operation: str
    operands: tuple[Operand, ...]

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options or ufunc.__name__ not in _NUMPY:
            raise TypeError(f"a force term cannot use numpy.{ufunc.__name__} here; {_USABLE}")
        return _NUMPY[ufunc.__name__](self.tape, *map(_operand, inputs))

    def __array_function__(self, func: Any, _types: Any, args: Any, kwargs: Any) -> Any:
        return _by_name(func, args, kwargs)

    def __bool__(self) -> NoReturn:
        raise TypeError("a force term must not branch on a number; use math.where, math.maximum or math.minimum")

    def __float__(self) -> NoReturn:
        raise TypeError("a force term must not turn a number into a float; use the functions of math")

    def __lt__(self, other: Operand) -> Condition:
        return Condition(self.tape, self.tape.subtract(other, self), strict=True)

    def __gt__(self, other: Operand) -> Condition:
        return Condition(self.tape, self.tape.subtract(self, other), strict=True)

    def __le__(self, other: Operand) -> Condition:
        return Condition(self.tape, self.tape.subtract(self, other), strict=False)

    def __ge__(self, other: Operand) -> Condition:
        return Condition(self.tape, self.tape.subtract(other, self), strict=False)

    def __pow__(self, exponent: Operand) -> Operand:
        return _power(self.tape, self, exponent)

    def __rpow__(self, base: Operand) -> Operand:
        return _power(self.tape, base, self)

    def __abs__(self) -> Operand:
        return self.tape.node("absolute", self)

    def __pos__(self) -> Operand:
        return self

    def __add__(self, other: Operand) -> Operand:
        return self.tape.add(self, other)

    def __radd__(self, other: Operand) -> Operand:
        return self.tape.add(other, self)

    def __sub__(self, other: Operand) -> Operand:
        return self.tape.subtract(self, other)

    def __rsub__(self, other: Operand) -> Operand:
        return self.tape.subtract(other, self)

    def __mul__(self, other: Operand) -> Operand:
        return self.tape.multiply(self, other)

    def __rmul__(self, other: Operand) -> Operand:
        return self.tape.multiply(other, self)

    def __truediv__(self, other: Operand) -> Operand:
        return self.tape.divide(self, other)

    def __rtruediv__(self, other: Operand) -> Operand:
        return self.tape.divide(other, self)

    def __neg__(self) -> Operand:
        return self.tape.multiply(-1.0, self)


@dataclass(frozen=True, eq=False)
class Condition:
    """A comparison of nodes, for ``numpy.where``: that ``difference`` is > 0, or, not ``strict``, that it is not."""

    tape: Tape = field(repr=False)
    difference: Operand
    strict: bool

    def __bool__(self) -> NoReturn:
        raise TypeError("a force term must not branch on a number; use numpy.where, math.where, maximum or minimum")

    def __array_function__(self, func: Any, _types: Any, args: Any, kwargs: Any) -> Any:
        return _by_name(func, args, kwargs)

    def choose(self, a: Operand, b: Operand) -> Operand:
        """Return a where it holds, else b."""
        first, second = (a, b) if self.strict else (b, a)
        return self.tape.where(self.difference, first, second)


def _power(tape: Tape, base: Operand, exponent: Operand) -> Operand:
    """Return whole powers up to the fourth as products, so that the base may be negative; others are for bases ≥ 0."""
    if isinstance(exponent, Node):
        return tape.node("power", base, exponent)
    if exponent == 0.5:
        return tape.node("sqrt", base)
    if exponent not in (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0):
        return tape.node("power", base, float(exponent))
    product: Operand = 1.0
    for _ in range(abs(int(exponent))):
        product = tape.multiply(product, base)
    return product if exponent >= 0.0 else tape.divide(1.0, product)


def _operand(x: Any) -> Operand:
    """Return a node, or NumPy's number as a float.  Raises TypeError for an array, which a law on one state does not
    have.
    """
    if isinstance(x, Node):
        return x
    if np.ndim(x):
        raise TypeError("a force term works on single numbers, not on arrays")
    return float(x)


def _by_name(func: Any, args: Any, kwargs: Any) -> Any:
    """Note ``numpy.where`` and ``numpy.clip``, which are no ufuncs."""
    if func is np.where and len(args) == 3 and not kwargs and isinstance(args[0], Condition):
        return args[0].choose(_operand(args[1]), _operand(args[2]))
    if func is np.clip and len(args) == 3 and not kwargs:
        x, low, high = map(_operand, args)
        tape = next(operand.tape for operand in (x, low, high) if isinstance(operand, Node))
        return tape.node("minimum", tape.node("maximum", x, low), high)
    raise TypeError(f"a force term cannot use numpy.{func.__name__} here; {_USABLE}")


def _is(operand: Operand, value: float) -> bool:
    return not isinstance(operand, Node) and operand == value


@dataclass
class Tape:
    """The operations so far, each only once.  Sums and products with constant 0 or 1 are taken off at once."""

    nodes: list[Node] = field(default_factory=list)
    known: dict[tuple[object, ...], Node] = field(default_factory=dict)

    def node(self, operation: str, *operands: Operand) -> Node:
        """Return the node of that operation, a new one unless it has been carried out before."""
        constants_as_floats = tuple(x if isinstance(x, Node) else float(x) for x in operands)
        key = (operation, *(("node", x.index) if isinstance(x, Node) else x for x in constants_as_floats))
        if key not in self.known:
            self.known[key] = Node(self, len(self.nodes), operation, constants_as_floats)
            self.nodes.append(self.known[key])
        return self.known[key]

    def name(self, name: str) -> Node:
        """Note an argument of the function to be written: a name, or an expression such as ``parameters[3]``."""
        key = ("name", name)
        if key not in self.known:
            self.known[key] = Node(self, len(self.nodes), name, ())
            self.nodes.append(self.known[key])
        return self.known[key]

    def add(self, a: Operand, b: Operand) -> Operand:
        if _is(a, 0.0) or _is(b, 0.0):
            return b if _is(a, 0.0) else a
        return self.node("+", a, b)

    def subtract(self, a: Operand, b: Operand) -> Operand:
        if _is(b, 0.0):
            return a
        return self.multiply(-1.0, b) if _is(a, 0.0) else self.node("-", a, b)

    def multiply(self, a: Operand, b: Operand) -> Operand:
        if _is(a, 0.0) or _is(b, 0.0):
            return 0.0
        if _is(a, 1.0) or _is(b, 1.0):
            return b if _is(a, 1.0) else a
        return self.node("*", a, b)

    def divide(self, a: Operand, b: Operand) -> Operand:
        if _is(a, 0.0) or _is(b, 1.0):
            return a
        return self.node("/", a, b)

    def where(self, x: Operand, a: Operand, b: Operand) -> Operand:
        if a is b or (not isinstance(a, Node) and not isinstance(b, Node) and a == b):
            return a
        return self.node("where", x, a, b)

    def derivatives(self, outputs: Sequence[Operand], variable: Node) -> list[Operand]:
        """Return ∂output/∂variable of each output, as further operations on this tape.

        At a switch (``where``, ``maximum``, ``minimum``, ``absolute``) it is that of the branch taken there.
        """
        slopes: dict[int, Operand] = {}

        def slope(x: Operand) -> Operand:
            return slopes[x.index] if isinstance(x, Node) else 0.0

        for node in needed(self, outputs):
            if node is variable:
                slopes[node.index] = 1.0
            else:
                inner = tuple(slope(x) for x in node.operands)
                still = all(_is(d, 0.0) for d in inner)
                slopes[node.index] = 0.0 if still else _RULES[node.operation](self, node, *inner)
        return [slope(x) for x in outputs]

    def gradient(self, output: Operand, variables: Sequence[Node]) -> list[Operand]:
        """Return ∂output/∂variable by each of many variables, in one sweep backwards over the operations."""
        slopes: dict[int, Operand] = {output.index: 1.0} if isinstance(output, Node) else {}
        for node in reversed(needed(self, [output])):
            for place, x in enumerate(node.operands):
                if isinstance(x, Node) and node.index in slopes:
                    alone = [float(other == place) for other in range(len(node.operands))]
                    more = self.multiply(slopes[node.index], _RULES[node.operation](self, node, *alone))
                    slopes[x.index] = self.add(slopes.get(x.index, 0.0), more)
        return [slopes.get(x.index, 0.0) for x in variables]

    def substituted(self, outputs: Sequence[Operand], values: Mapping[Node, float]) -> list[Operand]:
        """Return the outputs where some nodes are constants, as operations that leave out what then vanishes."""
        simplified: dict[str, Callable[..., Operand]] = {
            "+": self.add, "-": self.subtract, "*": self.multiply, "/": self.divide, "where": self.where
        }  # fmt: skip
        known: dict[int, Operand] = {}
        for node in needed(self, outputs):
            operands = [known[x.index] if isinstance(x, Node) else x for x in node.operands]
            if not operands:
                known[node.index] = values.get(node, node)
            elif node.operation in simplified:
                known[node.index] = simplified[node.operation](*operands)
            else:
                known[node.index] = self.node(node.operation, *operands)
        return [known[x.index] if isinstance(x, Node) else x for x in outputs]


def _slope_of_power(tape: Tape, node: Node, dx: Operand, dp: Operand) -> Operand:
    x, p = node.operands
    signed = node.operation == "signed_power"
    base = tape.node("absolute", x) if signed else x
    by_base: Operand = 0.0
    by_exponent: Operand = 0.0
    if not _is(dx, 0.0):
        by_base = tape.multiply(tape.multiply(p, tape.node("power", base, tape.subtract(p, 1.0))), dx)
    if not _is(dp, 0.0):
        by_exponent = tape.multiply(tape.node("log_power", base, p), dp)
        by_exponent = tape.multiply(tape.node("sign", x), by_exponent) if signed else by_exponent
    return tape.add(by_base, by_exponent)


def _slope_of_saturate(tape: Tape, node: Node, dv: Operand, de: Operand) -> Operand:
    v, e = node.operands
    square = tape.add(tape.multiply(v, v), tape.multiply(e, e))
    cube = tape.multiply(square, tape.node("sqrt", square))
    slope = tape.subtract(tape.multiply(e, dv), tape.multiply(v, de))
    return tape.divide(tape.multiply(e, slope), cube)


def _slope_of_angle(tape: Tape, node: Node, dy: Operand, dx: Operand) -> Operand:
    y, x = node.operands
    turned = tape.subtract(tape.multiply(x, dy), tape.multiply(y, dx))
    return tape.divide(turned, tape.add(tape.multiply(x, x), tape.multiply(y, y)))


_RULES: dict[str, Callable[..., Operand]] = {
    "+": lambda tape, node, da, db: tape.add(da, db),
    "-": lambda tape, node, da, db: tape.subtract(da, db),
    "*": lambda tape, node, da, db: tape.add(tape.multiply(da, node.operands[1]), tape.multiply(node.operands[0], db)),
    "/": lambda tape, node, da, db: tape.divide(tape.subtract(da, tape.multiply(node, db)), node.operands[1]),
    "sqrt": lambda tape, node, dx: tape.divide(tape.multiply(0.5, dx), node),
    "sin": lambda tape, node, dx: tape.multiply(tape.node("cos", *node.operands), dx),
    "cos": lambda tape, node, dx: tape.multiply(tape.multiply(-1.0, tape.node("sin", *node.operands)), dx),
    "atan": lambda tape, node, dx: tape.divide(dx, tape.add(1.0, tape.multiply(*node.operands * 2))),
    "atan2": _slope_of_angle,
    "exp": lambda tape, node, dx: tape.multiply(node, dx),
    "log": lambda tape, node, dx: tape.divide(dx, *node.operands),
    "tanh": lambda tape, node, dx: tape.multiply(tape.subtract(1.0, tape.multiply(node, node)), dx),
    "absolute": lambda tape, node, dx: tape.multiply(tape.node("sign", *node.operands), dx),
    "sign": lambda tape, node, dx: 0.0,
    "power": _slope_of_power,
    "signed_power": _slope_of_power,
    "where": lambda tape, node, dx, da, db: tape.where(node.operands[0], da, db),
    "maximum": lambda tape, node, da, db: tape.where(tape.subtract(*node.operands), da, db),
    "minimum": lambda tape, node, da, db: tape.where(tape.subtract(*reversed(node.operands)), da, db),
    "saturate": _slope_of_saturate,
}
"""Of each operation, its derivative from its operands' derivatives; where all of those vanish it is not asked."""


def _node(name: str) -> Callable[..., Operand]:
    return lambda tape, *operands: tape.node(name, *operands)


_NUMPY: dict[str, Callable[..., Any]] = {
    "add": Tape.add,
    "subtract": Tape.subtract,
    "multiply": Tape.multiply,
    "divide": Tape.divide,
    "power": _power,
    "float_power": _power,
    "negative": lambda tape, x: tape.multiply(-1.0, x),
    "positive": lambda tape, x: x,
    "square": lambda tape, x: tape.multiply(x, x),
    "reciprocal": lambda tape, x: tape.divide(1.0, x),
    "hypot": lambda tape, x, y: tape.node("sqrt", tape.add(tape.multiply(x, x), tape.multiply(y, y))),
    "tan": lambda tape, x: tape.divide(tape.node("sin", x), tape.node("cos", x)),
    "arctan": _node("atan"),
    "fabs": _node("absolute"),
    **{name: _node(name) for name in ("sqrt", "sin", "cos", "exp", "log", "tanh", "absolute", "sign")},
    "maximum": _node("maximum"),
    "minimum": _node("minimum"),
    "clip": lambda tape, x, low, high: tape.node("minimum", tape.node("maximum", x, low), high),
    "greater": lambda tape, a, b: Condition(tape, tape.subtract(a, b), strict=True),
    "less": lambda tape, a, b: Condition(tape, tape.subtract(b, a), strict=True),
    "less_equal": lambda tape, a, b: Condition(tape, tape.subtract(a, b), strict=False),
    "greater_equal": lambda tape, a, b: Condition(tape, tape.subtract(b, a), strict=False),
}
"""NumPy's functions of numbers, by their names, on a tape."""
_USABLE = f"use one of: {', '.join(sorted(_NUMPY))}, where, or the functions of math"


class TapeMath:
    """``Math`` whose numbers are nodes of one tape."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape

    def sqrt(self, x: Number) -> Number:
        return self.tape.node("sqrt", x)

    def sin(self, x: Number) -> Number:
        return self.tape.node("sin", x)

    def cos(self, x: Number) -> Number:
        return self.tape.node("cos", x)

    def atan(self, x: Number) -> Number:
        return self.tape.node("atan", x)

    def atan2(self, y: Number, x: Number) -> Number:
        return self.tape.node("atan2", y, x)

    def exp(self, x: Number) -> Number:
        return self.tape.node("exp", x)

    def log(self, x: Number) -> Number:
        return self.tape.node("log", x)

    def tanh(self, x: Number) -> Number:
        return self.tape.node("tanh", x)

    def absolute(self, x: Number) -> Number:
        return self.tape.node("absolute", x)

    def sign(self, x: Number) -> Number:
        return self.tape.node("sign", x)

    def power(self, x: Number, p: Number) -> Number:
        return self.tape.node("power", x, p)

    def signed_power(self, x: Number, p: Number) -> Number:
        return self.tape.node("signed_power", x, p)

    def where(self, x: Number, a: Number, b: Number) -> Number:
        return self.tape.node("where", x, a, b)

    def maximum(self, a: Number, b: Number) -> Number:
        return self.tape.node("maximum", a, b)

    def minimum(self, a: Number, b: Number) -> Number:
        return self.tape.node("minimum", a, b)

    def saturate(self, v: Number, eps: Number) -> Number:
        return self.tape.node("saturate", v, eps)


_SPELLING = {name: f"_math.{name}" for name in ("sqrt", "sin", "cos", "atan", "atan2", "exp", "log", "tanh")}


def needed(tape: Tape, outputs: Sequence[Operand]) -> list[Node]:
    """Return the nodes that the outputs depend on, in the order in which they were noted."""
    indices: set[int] = set()
    waiting = [x for x in outputs if isinstance(x, Node)]
    while waiting:
        node = waiting.pop()
        if node.index not in indices:
            indices.add(node.index)
            waiting.extend(x for x in node.operands if isinstance(x, Node))
    return [tape.nodes[index] for index in sorted(indices)]


def source_lines(tape: Tape, outputs: Sequence[Operand], *, prefix: str) -> tuple[list[str], list[str]]:
    """Return the tape as lines of Python, only what the outputs need, one operation a line, and each output's name or
    number.

    Results are named by ``prefix`` and a number.  The library's functions are spelt ``_math.sqrt``, the others of
    ``Math`` with an underscore (``_where``).
    """

    def text(x: Operand) -> str:
        if isinstance(x, Node):
            return f"{prefix}{x.index}" if x.operands else x.operation
        return repr(float(x))

    lines = []
    for node in needed(tape, outputs):
        if node.operands:
            names = [text(x) for x in node.operands]
            if node.operation in "+-*/":
                right = f" {node.operation} ".join(names)
            else:
                right = f"{_SPELLING.get(node.operation, '_' + node.operation)}({', '.join(names)})"
            lines.append(f"{text(node)} = {right}")
    return lines, [text(x) for x in outputs]
