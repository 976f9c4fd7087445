"""Formulas over ``Math`` as compiled functions with their derivatives: geometry and kinematics are written as laws are.

A formula is a function whose first argument is a ``Math``.  Its others are annotated as a ``Number``, a ``Pair``, a
``Vector`` or a ``Rotation``, and it gives a number, a vector or a tuple of both:

    @formula(by=("gap", "normal"))
    def depth(_math: Math, gap: Number, normal: Vector) -> Number:
        return gap * normal[2]

Python calls it as it stands, over floats, arrays or the nodes of a tape; so formulas may call each other.  For a module
of formulas among its templates ``compile_kernel`` writes

    depth(gap, normal) → what the formula gives
    depth_derivatives(gap, normal) → that, and a tuple of its derivatives by each of ``by``: each has the structure of
        what the formula gives, and for a number of that a number, or by the others a tuple of 2, 3 or 9
    depth_linearisation(gap, normal, to): fills ``to`` with the same derivatives, one row for each number that the
        formula gives and one column for each number of ``by``

The compiled functions do not take an argument with a default: they are evaluated and differentiated at the default.  A
small turn is such an argument, zero, and costs nothing where it vanishes.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from inspect import Parameter, signature
from types import ModuleType
from typing import Any, Final

import numpy as np

from sssi_exudyn.contact.codegen.tape import Node, Operand, Tape, TapeMath, needed, source_lines
from sssi_exudyn.contact.maths import Math

_SHAPES: Final[dict[str, tuple[int, ...]]] = {"Number": (), "Pair": (2,), "Vector": (3,), "Rotation": (3, 3)}
"""Of an argument with that annotation."""


@dataclass(frozen=True)
class Formula:
    """A formula, and the arguments by which it is differentiated.

    Raises TypeError for an argument without one of the annotations, ValueError for one of ``by`` that it does not have.
    """

    function: Callable[..., Any]
    by: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, argument in self._arguments.items():
            if argument.annotation not in _SHAPES:
                raise TypeError(f"{self.name}: {name} must be annotated as one of {', '.join(_SHAPES)}")
        for name in self.by:
            if name not in self._arguments:
                raise ValueError(f"{self.name} has no argument {name} to be differentiated by")

    def __call__(self, math: Math, *given: Any) -> Any:
        """Return what the formula gives over ``math``."""
        return self.function(math, *given)

    @property
    def name(self) -> str:
        """The formula's name, which the compiled functions begin with."""
        return self.function.__name__

    @property
    def _arguments(self) -> dict[str, Parameter]:
        return dict(list(signature(self.function).parameters.items())[1:])

    def source(self) -> str:
        """Return the compiled functions as text."""
        tape, arguments = Tape(), self._arguments
        nodes = {name: _nodes(tape, name, argument.annotation) for name, argument in arguments.items()}
        result = self.function(TapeMath(tape), *(x if x.ndim == 2 else _plain(x) for x in nodes.values()))
        outputs = list(_numbers(result))
        columns = _columns(tape, outputs, [x for name in self.by for x in nodes[name].flat])
        fixed = {name: np.asarray(a.default) for name, a in arguments.items() if a.default is not a.empty}
        values = {x: float(c) for name, c in fixed.items() for x, c in zip(nodes[name].flat, c.flat, strict=True)}
        outputs, *columns = (tape.substituted(nodes_of_column, values) for nodes_of_column in (outputs, *columns))
        given = ", ".join(name for name in arguments if name not in fixed)

        lines, names = source_lines(tape, outputs, prefix="x")
        functions = [_function(f"{self.name}({given})", [*lines, f"return {_like(result, iter(names))}"])]
        if not self.by:
            return functions[0]
        lines, names = source_lines(tape, [*outputs, *itertools.chain(*columns)], prefix="x")
        slopes = np.array(names[len(outputs) :], dtype=object).reshape(-1, len(outputs)).T
        at = np.cumsum([0, *(nodes[name].size for name in self.by)])
        by = [
            _like(result, (_tuple(row) if nodes[name].ndim else row[0] for row in slopes[:, first:last]))
            for name, first, last in zip(self.by, at[:-1], at[1:], strict=True)
        ]
        given_back = f"return {_like(result, iter(names))}, {_tuple(by)}"
        functions.append(_function(f"{self.name}_derivatives({given})", [*lines, given_back]))
        lines, names = source_lines(tape, list(itertools.chain(*columns)), prefix="x")
        # what vanishes is filled by a loop: a line for each number of a table takes 0.1 s to compile
        fill = [f"for row in range({len(outputs)}):", f"    for column in range({len(columns)}):"]
        fill += ["        to[row, column] = 0.0"]
        places = [(i % len(outputs), i // len(outputs), name) for i, name in enumerate(names)]
        fill += [f"to[{row}, {column}] = {name}" for row, column, name in places if name != "0.0"]
        functions.append(_function(f"{self.name}_linearisation({given}, to)", [*lines, *fill]))
        return "\n\n".join(functions)


def formula(*, by: tuple[str, ...] = ()) -> Callable[[Callable[..., Any]], Formula]:
    """Make a function over ``Math`` a ``Formula``, differentiated by the arguments of those names."""
    return lambda function: Formula(function, by)


def formulas_of(module: ModuleType) -> list[Formula]:
    """Return the formulas that a module defines."""
    values = [value for value in vars(module).values() if isinstance(value, Formula)]
    return [value for value in values if value.function.__module__ == module.__name__]


def _nodes(tape: Tape, name: str, annotation: str) -> Any:
    """Return an argument's numbers as named nodes, an array of its shape."""
    nodes = np.empty(_SHAPES[annotation], dtype=object)
    for place in np.ndindex(nodes.shape):
        nodes[place] = tape.name(f"{name}[{', '.join(map(str, place))}]" if place else name)
    return nodes


def _columns(tape: Tape, outputs: Sequence[Operand], variables: Sequence[Node]) -> list[list[Operand]]:
    """∂outputs/∂variable for each variable: swept forwards or backwards, whichever takes fewer operations."""
    forwards = [tape.derivatives(outputs, x) for x in variables]
    rows = [tape.gradient(x, variables) for x in outputs]
    backwards = [[row[column] for row in rows] for column in range(len(variables))]
    return min(forwards, backwards, key=lambda columns: len(needed(tape, list(itertools.chain(*columns)))))


def _plain(nodes: Any) -> Any:
    return tuple(nodes) if nodes.ndim else nodes[()]


def _numbers(result: Any) -> Iterator[Operand]:
    """Return all numbers of nested tuples."""
    if isinstance(result, tuple):
        for part in result:
            yield from _numbers(part)
    else:
        yield result


def _like(result: Any, texts: Iterator[str]) -> str:
    """Return nested tuples of the structure of ``result`` with these texts where it has numbers."""
    return _tuple(_like(part, texts) for part in result) if isinstance(result, tuple) else next(texts)


def _tuple(texts: Iterable[str]) -> str:
    return f"({', '.join(texts)},)"


def _function(head: str, lines: Sequence[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"@_inner\ndef {head}:\n{body}\n"
