"""Force laws as text of Python that Numba compiles: every class of terms is traced once and written down, with its
derivatives.  ``compiled`` has what the functions are called and take.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from sssi_exudyn.contact import maths
from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen import law_parameters, plugin_addresses, vectors
from sssi_exudyn.contact.codegen.tape import Node, Operand, Tape, TapeMath, needed, source_lines
from sssi_exudyn.contact.registry import TERMS
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.terrain import surface

_HELPERS: Final = """
import math as _math

from sssi_exudyn.contact.codegen.plugin_addresses import callable_at as _callable_at
from sssi_exudyn.contact.codegen.plugin_addresses import carray as _carray
from sssi_exudyn.contact.codegen.plugin_addresses import expected_false as _expected_false
from sssi_exudyn.contact.codegen.plugin_addresses import law_address as _law_address
from sssi_exudyn.contact.codegen.law_parameters import LawParameters as _LawParameters
from sssi_exudyn.runtime.jit import njit as _njit

# a division by zero is infinite, as in NumPy, and raises nothing
_compiled = _njit(cache=True, error_model="numpy")
_inner = _njit(error_model="numpy")  # kept on disk within their callers
_rarely = _expected_false()


@_inner
def _absolute(x):
    return abs(x)


@_inner
def _sign(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@_inner
def _maximum(a, b):
    return a if a > b else b


@_inner
def _minimum(a, b):
    return a if a < b else b


@_inner
def _where(x, a, b):
    return a if x > 0.0 else b


@_inner
def _saturate(v, eps):
    return v / _math.sqrt(v * v + eps * eps)


@_inner
def _power(x, p):  # the exponents that laws mostly have cost a root at most
    if p == 1.5:
        return x * _math.sqrt(x)
    if p == 1.0:
        return x
    if p == 0.5:
        return _math.sqrt(x)
    if p == 0.0:
        return 1.0
    return _math.pow(x, p)


@_inner
def _log_power(x, p):  # the derivative of the power by its exponent
    return _power(x, p) * _math.log(x) if x > 0.0 else 0.0


@_inner
def _signed_power(x, p):
    return _math.copysign(_power(abs(x), p), x)


@_inner
def _by_air(found, begin, end, by_air):  # columns of the air's derivatives become those of a force by way of the air
    for column in range(begin, end):
        w_f, w_l, w_n = found[0, column], found[1, column], found[2, column]
        for row in range(3):
            found[row, column] = by_air[3 * row] * w_f + by_air[3 * row + 1] * w_l + by_air[3 * row + 2] * w_n
"""

_Trace = Callable[[TapeMath, Any, dict[str, Operand]], Sequence[Operand]]


@dataclass(frozen=True)
class Law:
    """How one place's functions are traced: their names and arguments, those by which ``derivatives`` are taken, and
    those by which the linearisation is; the number of outputs, and what one term of the place gives.  Where there is no
    name there is no such function.
    """

    value: str
    derivatives: str
    linearisation: str
    arguments: tuple[str, ...]
    variables: tuple[str, ...]
    state: tuple[str, ...]
    outputs: int
    trace: _Trace


def _velocity(a: dict[str, Operand]) -> tuple[Operand, Operand, Operand]:
    return a["v_f"], a["v_l"], a["v_n"]


def _facing(a: dict[str, Operand]) -> tuple[Operand, Operand, Operand, Operand, Operand, Operand]:
    return a["m_ff"], a["m_fl"], a["m_fn"], a["m_ll"], a["m_ln"], a["m_nn"]


_EDGE: Final = (
    "lower", "upper", "rate", "width", "groove", "offset", "step", "v_t", "v_n", "rise", "edge", "length",
)  # fmt: skip
_EDGE_STATE: Final = ("lower", "upper", "rate", "groove", "offset", "v_t", "v_n", "rise", "edge")
_VELOCITY: Final = ("v_f", "v_l", "v_n")
_FACING: Final = ("m_ff", "m_fl", "m_fn", "m_ll", "m_ln", "m_nn")
_AIR: Final = ("w_f", "w_l", "w_n")
"""The air's velocity where a segment is."""
LAWS: Final = {
    "point": Law(
        "point_force",
        "point_derivatives",
        "point_linearisation",
        ("depth", "rate", "length"),
        ("depth", "rate"),
        ("depth", "rate"),
        1,
        lambda math, term, a: (term.force(math, places.PointState(**a)),),
    ),
    "foot": Law(
        "foot_force",
        "foot_derivatives",
        "foot_linearisation",
        ("load", "v_t", "v_n", "edge", "groove", "t", "f", "l", "side"),
        ("load", "v_t", "v_n"),
        ("load", "v_t", "v_n", "edge", "groove", "f", "l"),
        2,
        lambda math, term, a: term.force(math, places.FootState(**a)),
    ),
    "segment": Law(
        "segment_force",
        "segment_derivatives",
        "segment_linearisation",
        ("t", "f", "l", *_VELOCITY, "area", *_FACING),
        _VELOCITY,
        ("f", "l", *_VELOCITY),
        3,
        lambda math, term, a: term.force(
            math, places.SegmentState(_velocity(a), (a["w_f"], a["w_l"], a["w_n"]), a["area"], _facing(a))
        ),
    ),
    "body": Law(
        "body_force",
        "body_derivatives",
        "body_linearisation",
        ("t", "f", "l", *_VELOCITY),
        _VELOCITY,
        ("f", "l", *_VELOCITY),
        3,
        lambda math, term, a: term.force(math, places.BodyState(a["t"], a["f"], a["l"], _velocity(a))),
    ),
    "wind": Law(
        "air_velocity",
        "",
        "wind_linearisation",
        ("t", "f", "l"),
        (),
        ("f", "l"),
        3,
        lambda math, term, a: term.velocity(math, places.PlaceState(**a)),
    ),
    "terrain": Law(
        "terrain_height",
        "",
        "terrain_linearisation",
        ("f", "l"),
        (),
        ("f", "l"),
        3,
        lambda math, term, a: term.height(math, a["f"], a["l"]),
    ),
}
EDGE_LAWS: Final = (
    Law(
        "edge_force",
        "edge_derivatives",
        "edge_linearisation",
        _EDGE,
        ("lower", "upper", "rate", "v_t", "v_n", "edge"),
        _EDGE_STATE,
        4,
        lambda math, term, a: term.force(math, places.EdgeState(**a)),
    ),
    Law(
        "edge_memory",
        "",
        "memory_linearisation",
        _EDGE,
        (),
        _EDGE_STATE,
        2,
        lambda math, term, a: term.remember(math, places.EdgeState(**a)),
    ),
    Law("edge_capacity", "", "", _EDGE, (), (), 2, lambda math, term, a: term.capacity(math, places.EdgeState(**a))),
)


@dataclass(frozen=True)
class LawFunction:
    """A function of a place: its values, its derivatives, or its linearisation.

    variables : by which derivatives are taken
    outputs : floats that it adds up: values and derivatives, row by row; of a linearisation derivatives alone
    """

    kind: str
    law: Law
    name: str
    variables: tuple[str, ...] = ()
    linearised: bool = False

    @property
    def arguments(self) -> tuple[str, ...]:
        return self.law.arguments

    @property
    def outputs(self) -> int:
        return self.law.outputs * (len(self.variables) + (not self.linearised))


def _functions(kind: str, law: Law) -> Iterator[LawFunction]:
    yield LawFunction(kind, law, law.value)
    if law.variables:
        yield LawFunction(kind, law, law.derivatives, law.variables)
    if law.linearisation:
        by_air = _AIR if kind == "segment" else ()
        yield LawFunction(kind, law, law.linearisation, (*law.state, *by_air), linearised=True)


FUNCTIONS: Final = tuple(
    function
    for kind, law in (*LAWS.items(), *(("edge", law) for law in EDGE_LAWS))
    for function in _functions(kind, law)
)
_STRUCT: Final = ("values", "count", "first", "classes")
"""``LawParameters`` as C has it."""


def laws_source(*, linearised: bool = True, edges: bool = False) -> str:
    """Return the Python module that holds the functions of all places for the registry's classes, with or without their
    linearisations and those of the edges.
    """
    functions = [_HELPERS]
    functions += [f"_others_{count} = _callable_at({count})" for count in sorted({f.outputs for f in FUNCTIONS})]
    for function in FUNCTIONS:
        if (linearised or not function.linearised) and (edges or function.kind != "edge"):
            functions.append(_registered(function))
    terrains = [
        f"parameters.first[{index}] < parameters.first[{index + 1}]" for index, _ in classes_of_kind("terrain", TERMS)
    ]
    some = " or ".join([*terrains, _has_others(FUNCTIONS[_place_of("terrain")])])
    functions.append(_definition("uneven(parameters)", [f"return {some}"]))
    return "\n\n".join(functions)


def other_laws_source(others: Sequence[type[Term]]) -> str:
    """Return the Python module of classes that are not in the registry.  It has each place's functions under the names
    of ``laws_source``, which return tuples, and after an ``_address_of_`` what C calls.
    """
    classes = (*TERMS, *others)
    functions = [f"# shared: {hash_of_shared()}", _HELPERS]
    for function in FUNCTIONS:
        if not classes_of_kind(function.kind, others):
            continue
        lines, sums = _sums(function, classes, len(TERMS))
        given = [*function.arguments, *(_AIR if function.kind == "segment" else ())]
        more = ["by_parameter"] if function.linearised else []
        head = f"{function.name}({', '.join(['parameters', *given, *more])})"
        functions.append(_definition(head, [*lines, f"return ({', '.join(sums)},)"]))
        begin = ["parameters = _LawParameters(_carray(values, count), _carray(first, classes), 0, _carray(first, 1))"]
        begin += [f"by_parameter = _carray(by_parameter, ({function.law.outputs}, count))"] if more else []
        head = f"_address_of_{function.name}({', '.join(['out', *_STRUCT, *given, *more])})"
        call = f"{function.name}({', '.join(['parameters', *given, *more])})"
        fill = [f"found = {call}", *(f"out[{place}] = found[{place}]" for place in range(function.outputs))]
        functions.append(_definition(head, [*begin, *fill], f"_law_address({function.name})"))
    return "\n\n".join(functions)


def hash_of_shared(*modules: ModuleType) -> str:
    """Tell one version of what generated modules import from another: the shared modules and ``modules``."""
    shared = (maths, vectors, law_parameters, plugin_addresses, surface, *modules)
    return ", ".join(hashlib.sha256(source_file(module).read_bytes()).hexdigest() for module in shared)


def source_file(module: ModuleType) -> Path:
    """Return the file of a module.  Raises ValueError where it has none."""
    if module.__file__ is None:
        raise ValueError(f"the template {module.__name__} has no source file")
    return Path(module.__file__)


@cache  # tracing and differentiating all laws takes 50 ms, and several modules hold the same
def _registered(function: LawFunction) -> str:
    """Return a place's function for the classes of the registry, which calls those of others."""
    law, arguments = function.law, list(function.arguments)
    lines, sums = _sums(function, TERMS, 0)
    given = [*arguments, *(_AIR if function.kind == "segment" else ())]
    lines += _of_others(function, given, sums)
    head = f"{function.name}({', '.join(['parameters', *arguments])}"
    if not function.linearised:
        return _definition(f"{head})", [*lines, f"return {', '.join(sums)}"])
    width = len(sums) // law.outputs
    rows = [sums[row * width : (row + 1) * width] for row in range(law.outputs)]
    for row, names in enumerate(rows):
        lines += [f"by_state[{row}, {column}] = {name}" for column, name in enumerate(names[: len(law.state)])]
    if function.kind == "segment":  # the wind's own derivatives, then what they make of the force
        by_air = f"({', '.join(name for names in rows for name in names[len(law.state) :])})"
        lines += ["wind_linearisation(parameters, t, f, l, by_state, by_parameter)"]
        lines += [f"_by_air(by_state, 0, 2, {by_air})"]
        for index, _ in classes_of_kind("wind", TERMS):
            lines += [f"_by_air(by_parameter, parameters.first[{index}], parameters.first[{index + 1}], {by_air})"]
        ends = len(FUNCTIONS), len(FUNCTIONS) + 1
        lines += [f"_by_air(by_parameter, parameters.addresses[{ends[0]}], parameters.addresses[{ends[1]}], {by_air})"]
    return _definition(f"{head}, by_state, by_parameter)", lines)


def _sums(function: LawFunction, classes: Sequence[type[Term]], begin: int) -> tuple[list[str], list[str]]:
    """Return the lines that go over the terms of the place's classes from ``begin`` on, and the names of their sums."""
    kind, law = function.kind, function.law
    sums = [f"sum{i}" for i in range(function.outputs)]
    lines = [f"{name} = 0.0" for name in sums]
    if kind == "segment" and begin == 0:  # which no call of ``air_velocity`` gives as fast
        lines += [f"{name} = 0.0" for name in _AIR]
        for index, cls in classes_of_kind("wind", classes):
            tape, outputs = _traced(LAWS["wind"], index, cls)
            lines += _over_terms(index, cls, tape, [(f"{name} +=", x) for name, x in zip(_AIR, outputs, strict=True)])
        lines += _of_others(FUNCTIONS[_place_of("wind")], ["t", "f", "l"], _AIR)
    for index, cls in classes_of_kind(kind, classes):
        if index < begin:
            continue
        tape, outputs = _traced(law, index, cls)
        columns = [tape.derivatives(outputs, tape.name(variable)) for variable in function.variables]
        rows = [column[row] for row in range(law.outputs) for column in columns]
        values = rows if function.linearised else [*outputs, *rows]
        added = [(f"{name} +=", x) for name, x in zip(sums, values, strict=True)]
        for place in range(len(quantities(cls)) if function.linearised else 0):
            slopes = tape.derivatives(outputs, tape.name(_parameter(index, place)))
            added += [(f"by_parameter[{row}, at{index} + {place}] =", slope) for row, slope in enumerate(slopes)]
        lines += _over_terms(index, cls, tape, added)
    return lines, sums


def _of_others(function: LawFunction, given: Sequence[str], sums: Sequence[str]) -> list[str]:
    """Return the lines that add what the place's other classes give."""
    more = "by_parameter" if function.linearised else "None"
    place = FUNCTIONS.index(function)
    return [
        f"if _rarely({_has_others(function)}):",
        f"    more = _others_{function.outputs}({place}, parameters, ({', '.join(given)},), {more})",
        *(f"    {name} += more[{at}]" for at, name in enumerate(sums)),
    ]


def _has_others(function: LawFunction) -> str:
    return f"parameters.others & {2 ** FUNCTIONS.index(function)} != 0"


def _place_of(kind: str) -> int:
    """Return where the first function of a place stands among all."""
    return next(place for place, function in enumerate(FUNCTIONS) if function.kind == kind)


def classes_of_kind(kind: str, classes: Sequence[type[Term]]) -> list[tuple[int, type[Term]]]:
    """Return the classes of a place, each with where it stands among all."""
    return [(index, cls) for index, cls in enumerate(classes) if cls.kind == kind]


def _parameter(index: int, place: int) -> str:
    return f"p{index}_{place}"


def _traced(law: Law, index: int, cls: type[Term]) -> tuple[Tape, tuple[Operand, ...]]:
    """Return what a term of that class gives, with names where it has numbers."""
    tape = Tape()
    names: dict[str, Any] = {name: tape.name(_parameter(index, place)) for place, name in enumerate(quantities(cls))}
    arguments: dict[str, Operand] = {name: tape.name(name) for name in law.arguments}
    if law is LAWS["segment"]:
        arguments |= {name: tape.name(name) for name in _AIR}
    return tape, tuple(law.trace(TapeMath(tape), cls(**names), arguments))


def _over_terms(index: int, cls: type[Term], tape: Tape, added: Sequence[tuple[str, Operand]]) -> list[str]:
    """Return the loop over the terms of a class that does with each operand what stands before it."""
    wanted = [(target, x) for target, x in added if isinstance(x, Node) or x != 0.0 or not target.endswith("+=")]
    lines, results = source_lines(tape, [x for _, x in wanted], prefix=f"x{index}_")
    used = {node.operation for node in needed(tape, [x for _, x in wanted])}
    count = len(quantities(cls))
    names = [(_parameter(index, place), place) for place in range(count)]
    body = [f"{name} = parameters.values[at{index} + {place}]" for name, place in names if name in used]
    body += [*lines, *(f"{target} {result}" for (target, _), result in zip(wanted, results, strict=True))]
    # not range(), which divides to count its steps; no names for the arrays, whose references would be counted; and an
    # index that is known not to be negative needs no look whether it counts from the end
    return [
        f"at{index} = parameters.first[{index}]  # {cls.__name__}",
        f"while 0 <= at{index} < parameters.first[{index + 1}]:",
        *(f"    {line}" for line in (*body, f"at{index} += {count}")),
    ]


def _definition(head: str, lines: Sequence[str], decorator: str = "_compiled") -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"@{decorator}\ndef {head}:\n{body}\n"
