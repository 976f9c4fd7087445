"""Force terms as machine code: each is traced once, summed with others of its place, written as Python and compiled.

What is written depends on the terms' classes only; parameters arrive in an array, in the order of
``parameter_values``.  The functions of all six places share that array:

    point_force(parameters, depth, rate, length) → F_N
    foot_force(parameters, load, v_t, v_n, edge, groove, t, f, l, side) → along, across
    segment_force(parameters, t, f, l, v_f, v_l, v_n, area) → f, l, n           (the wind terms are inside)
    body_force(parameters, t, f, l, v_f, v_l, v_n) → f, l, n
    air_velocity(parameters, t, f, l) → f, l, n
    terrain_height(parameters, f, l) → h, ∂h/∂f, ∂h/∂l

and, with the same arguments, each followed by its derivatives, row by row:

    point_derivatives → F_N, ∂F_N/∂depth, ∂F_N/∂rate
    foot_derivatives → along, across, ∂along/∂(load, v_t, v_n), ∂across/∂(load, v_t, v_n)
    segment_derivatives, body_derivatives → f, l, n, ∂f/∂v, ∂l/∂v, ∂n/∂v

and the whole of its linearisation, written into two arrays:

    point_linearisation, foot_…, segment_…, body_…, terrain_linearisation(parameters, …, by_state, by_parameter)

with the same arguments once more.  by_state (outputs, variables) holds the derivatives by depth and rate; load, v_t,
v_n, edge, groove, f and l; f, l and the velocity; f and l.  by_parameter (outputs, all parameters) holds those by the
parameters on which the place depends, listed in ``POINT_PARAMETERS``, ``FOOT_PARAMETERS`` …; the rest is left alone.

The text is kept as a module in a cache folder, under its own hash, so that Numba's cache on disk holds across
processes.  A kernel that calls these functions is compiled into the same module (``compile_kernel``): Numba keeps no
compiled caller of functions that come in from outside.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import numpy as np

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.backends import structs, vectors
from sssi_exudyn.contact.backends.tape import Node, Operand, Tape, TapeMath, source_lines
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.private_folder import cache_folder
from sssi_exudyn.terrain import surface

_HELPERS: Final = """
import math as _math

from sssi_exudyn.runtime.jit import njit as _njit

# a division by zero is infinite, as in NumPy, and raises nothing
_compiled = _njit(cache=True, error_model="numpy")
_inner = _njit(error_model="numpy")  # kept on disk within their callers


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
"""

_Trace = Callable[[TapeMath, Sequence[Term], dict[str, Operand]], Sequence[Operand]]


@dataclass(frozen=True)
class _Law:
    """How one place's functions are traced: their names and arguments, those by which ``derivatives`` are taken, and
    those by which the linearisation is.
    """

    value: str
    derivatives: str
    linearisation: str
    arguments: tuple[str, ...]
    variables: tuple[str, ...]
    state: tuple[str, ...]
    trace: _Trace


def _velocity(a: dict[str, Operand]) -> tuple[Operand, Operand, Operand]:
    return a["v_f"], a["v_l"], a["v_n"]


def _segment(math: TapeMath, terms: Sequence[Term], a: dict[str, Operand]) -> Sequence[Operand]:
    wind_f, wind_l, wind_n = places.air_velocity(math, terms, places.PlaceState(a["t"], a["f"], a["l"]))
    state = places.SegmentState(_velocity(a), (wind_f, wind_l, wind_n), a["area"])
    return places.segment_force(math, terms, state)


_VELOCITY: Final = ("v_f", "v_l", "v_n")
_LAWS: Final = {
    "point": _Law(
        "point_force",
        "point_derivatives",
        "point_linearisation",
        ("depth", "rate", "length"),
        ("depth", "rate"),
        ("depth", "rate"),
        lambda math, terms, a: (places.point_force(math, terms, places.PointState(**a)),),
    ),
    "foot": _Law(
        "foot_force",
        "foot_derivatives",
        "foot_linearisation",
        ("load", "v_t", "v_n", "edge", "groove", "t", "f", "l", "side"),
        ("load", "v_t", "v_n"),
        ("load", "v_t", "v_n", "edge", "groove", "f", "l"),
        lambda math, terms, a: places.foot_force(math, terms, places.FootState(**a)),
    ),
    "segment": _Law(
        "segment_force",
        "segment_derivatives",
        "segment_linearisation",
        ("t", "f", "l", *_VELOCITY, "area"),
        _VELOCITY,
        ("f", "l", *_VELOCITY),
        _segment,
    ),
    "body": _Law(
        "body_force",
        "body_derivatives",
        "body_linearisation",
        ("t", "f", "l", *_VELOCITY),
        _VELOCITY,
        ("f", "l", *_VELOCITY),
        lambda math, terms, a: places.body_force(math, terms, places.BodyState(a["t"], a["f"], a["l"], _velocity(a))),
    ),
    "wind": _Law(
        "air_velocity",
        "",
        "wind_linearisation",
        ("t", "f", "l"),
        (),
        ("f", "l"),
        lambda math, terms, a: places.air_velocity(math, terms, places.PlaceState(**a)),
    ),
    "terrain": _Law(
        "terrain_height",
        "",
        "terrain_linearisation",
        ("f", "l"),
        (),
        ("f", "l"),
        lambda math, terms, a: places.terrain_height(math, terms, a["f"], a["l"]),
    ),
}


@dataclass(frozen=True)
class CompiledLaw:
    """All terms of one place as compiled functions of floats.

    value, derivatives, linearisation : as listed above; ``derivatives`` is None for wind and terrain
    parameters : what the functions take as their first argument, (n,) in the terms' units
    """

    value: Callable[..., Any]
    derivatives: Callable[..., Any] | None
    linearisation: Callable[..., Any]
    parameters: Array


def parameter_values(terms: Iterable[Term]) -> Array:
    """(n,) the parameters of all terms, one after the other, each in the order of its declaration."""
    return np.array([value for term in terms for value in places.parameters(term).values()], dtype=np.float64)


def laws_source(terms: Sequence[Term], *, linearised: bool = True) -> str:
    """The Python module that holds the functions of all places for ``terms``, with their linearisations or without."""
    functions = [_HELPERS]
    for law in _LAWS.values():
        functions.append(_function(law, law.value, terms, ()))
        if law.variables:
            functions.append(_function(law, law.derivatives, terms, law.variables))
        if linearised:
            functions.append(_linearisation(law, terms))
    return "\n\n".join(functions)


def _function(law: _Law, name: str, terms: Sequence[Term], variables: Sequence[str]) -> str:
    tape = Tape()
    arguments: dict[str, Operand] = {argument: tape.name(argument) for argument in law.arguments}
    outputs = tuple(law.trace(TapeMath(tape), _on_tape(terms, tape), arguments))
    slopes = [tape.derivatives(outputs, tape.name(variable)) for variable in variables]
    rows = [column[row] for row in range(len(outputs)) for column in slopes]
    body = "\n".join(f"    {line}" for line in source_lines(tape, (*outputs, *rows)))
    return f"@_compiled\ndef {name}(parameters, {', '.join(law.arguments)}):\n{body}\n"


def _linearisation(law: _Law, terms: Sequence[Term]) -> str:
    tape = Tape()
    arguments: dict[str, Operand] = {argument: tape.name(argument) for argument in law.arguments}
    outputs = tuple(law.trace(TapeMath(tape), _on_tape(terms, tape), arguments))
    count = sum(len(places.parameters(term)) for term in terms)
    slots: list[str] = []
    found: list[Operand] = []
    for column, name in enumerate(law.state):
        slopes = tape.derivatives(outputs, tape.name(name))
        slots += [f"by_state[{row}, {column}]" for row in range(len(outputs))]
        found += slopes
    depends = []
    for index in range(count):
        slopes = tape.derivatives(outputs, tape.name(f"parameters[{index}]"))
        moving = [(row, slope) for row, slope in enumerate(slopes) if isinstance(slope, Node) or slope != 0.0]
        slots += [f"by_parameter[{row}, {index}]" for row, _ in moving]
        found += [slope for _, slope in moving]
        depends += [index] if moving else []
    *lines, values = source_lines(tape, found)
    stores = zip(slots, values.removeprefix("return ").split(", "), strict=True) if slots else ()
    body = "\n".join(f"    {line}" for line in [*lines, *(f"{slot} = {value}" for slot, value in stores)])
    listed = law.linearisation.replace("_linearisation", "_parameters").upper()
    head = f"def {law.linearisation}(parameters, {', '.join(law.arguments)}, by_state, by_parameter):"
    return f"{listed} = {tuple(depends)!r}\n\n\n@_compiled\n{head}\n{body}\n"


def _on_tape(terms: Sequence[Term], tape: Tape) -> tuple[Term, ...]:
    """The same terms with places in the array of parameters where they had values."""
    traced, index = [], 0
    for term in terms:
        names = list(places.parameters(term))
        symbols: dict[str, Any] = {name: tape.name(f"parameters[{index + i}]") for i, name in enumerate(names)}
        traced.append(replace(term, **symbols))
        index += len(names)
    return tuple(traced)


def _module(source: str) -> ModuleType:
    """The module with that text, from the cache folder, written there first if need be."""
    name = "sssi_exudyn_generated_" + hashlib.sha256(source.encode()).hexdigest()
    if name in sys.modules:
        return sys.modules[name]
    path = cache_folder() / f"{name}.py"
    if not (path.is_file() and path.read_bytes() == source.encode()):
        # a name of its own and then a move: another process sees the whole file or none
        made = path.with_name(f".{name}.{os.getpid()}")
        made.write_bytes(source.encode())
        made.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def compile_kernel(terms: Sequence[Term], *templates: ModuleType) -> ModuleType:
    """A module with the contents of the templates and the functions of ``terms``, compiled and cached as one.

    A template is a module whose Numba functions call ``point_force`` and so on as globals of its own; to please a
    type checker it may declare them without a value (``point_force: Callable[..., float]``), and so it may the
    functions of a template before it.  It should decorate with ``njit(cache=True)``, call Numba functions of no other
    modules but ``vectors`` and ``terrain.surface`` (Numba's cache would not see a change there; this module's name
    does), and leave names that begin with an underscore to the generated functions.

    Raises ValueError for a template without a source file.
    """
    kinds = (templates, tuple(type(term) for term in terms))  # the text holds the terms' laws, not their numbers
    if kinds not in _kernels:
        _kernels[kinds] = _kernel_module(terms, templates)
    return _kernels[kinds]


_kernels: dict[tuple[tuple[ModuleType, ...], tuple[type[Term], ...]], ModuleType] = {}
"""What was asked for in this process; to write the laws down takes 10 ms."""


def _kernel_module(terms: Sequence[Term], templates: Sequence[ModuleType]) -> ModuleType:
    shared = [hashlib.sha256(_source_file(module).read_bytes()).hexdigest() for module in (vectors, structs, surface)]
    # imports from __future__ must come first; Numba looks names up when a function is first called
    texts = [_source_file(template).read_text(encoding="utf-8").replace(_FUTURE, "") for template in templates]
    laws = laws_source(terms, linearised=any("_linearisation(" in text for text in texts))  # they take time to write
    return _module("\n\n".join([_FUTURE, *texts, f"# shared: {', '.join(shared)}", laws]))


def _source_file(module: ModuleType) -> Path:
    if module.__file__ is None:
        raise ValueError(f"the template {module.__name__} has no source file")
    return Path(module.__file__)


_FUTURE: Final = "from __future__ import annotations\n"


def _compiled(place: str, terms: Sequence[Term]) -> CompiledLaw:
    module, law = _module(laws_source(terms)), _LAWS[place]
    derivatives = getattr(module, law.derivatives) if law.variables else None
    linearisation = getattr(module, law.linearisation)
    return CompiledLaw(getattr(module, law.value), derivatives, linearisation, parameter_values(terms))


def compile_point(terms: Sequence[Term]) -> CompiledLaw:
    """The point terms among ``terms``."""
    return _compiled("point", terms)


def compile_foot(terms: Sequence[Term]) -> CompiledLaw:
    """The foot terms among ``terms``."""
    return _compiled("foot", terms)


def compile_segment(terms: Sequence[Term]) -> CompiledLaw:
    """The segment terms among ``terms``, in the air that the wind terms move."""
    return _compiled("segment", terms)


def compile_body(terms: Sequence[Term]) -> CompiledLaw:
    """The body terms among ``terms``."""
    return _compiled("body", terms)


def compile_wind(terms: Sequence[Term]) -> CompiledLaw:
    """The wind terms among ``terms``."""
    return _compiled("wind", terms)


def compile_terrain(terms: Sequence[Term]) -> CompiledLaw:
    """The terrain terms among ``terms``."""
    return _compiled("terrain", terms)
