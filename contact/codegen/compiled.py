"""Force terms as machine code: every class is traced once, written as Python and compiled.

What is written holds the classes of the registry, whether the terms have them or not.  A place's function goes over the
terms of every class of its place and adds up what they give.  So one kernel serves all models, and a class that no term
has costs a comparison.  Other classes are compiled on their own, and the place's function calls them by their address.
Parameters arrive in a struct (``law_parameters``), which the functions of all places share:

    point_force(parameters, depth, rate, length) → F_N
    foot_force(parameters, load, v_t, v_n, edge, groove, t, f, l, side) → along, across
    segment_force(parameters, t, f, l, v_f, v_l, v_n, area, m_ff … m_nn) → f, l, n  (the wind terms are inside)
    body_force(parameters, t, f, l, v_f, v_l, v_n) → f, l, n
    air_velocity(parameters, t, f, l) → f, l, n
    terrain_height(parameters, f, l) → h, ∂h/∂f, ∂h/∂l
    uneven(parameters) → whether there is a terrain term
    edge_force(parameters, lower, upper, rate, width, groove, offset, step, v_t, v_n, rise, edge, length)
        → normal, along, across, normal at the upper edge
    edge_memory, edge_capacity(parameters, the same) → groove, offset;  the wall's greatest force, its force

and, with the same arguments, each followed by its derivatives, row by row:

    point_derivatives → F_N, ∂F_N/∂depth, ∂F_N/∂rate
    foot_derivatives → along, across, ∂along/∂(load, v_t, v_n), ∂across/∂(load, v_t, v_n)
    segment_derivatives, body_derivatives → f, l, n, ∂f/∂v, ∂l/∂v, ∂n/∂v
    edge_derivatives → the four forces, and each by lower, upper, rate, v_t, v_n, edge

and the whole of its linearisation, written into two arrays:

    point_linearisation, foot_…, segment_…, body_…, wind_…, terrain_…, edge_…,
    memory_linearisation(parameters, …, by_state, by_parameter)

with the same arguments once more.  by_state (outputs, variables) holds the derivatives by depth and rate; load, v_t,
v_n, edge, groove, f and l; f, l and the velocity; f and l; lower, upper, rate, groove, offset, v_t, v_n, rise and edge
for the edge's forces and for its memory.  by_parameter (outputs, all parameters) holds those by the
parameters of the place's terms, for segments those of the wind as well; the rest is left alone.

The text is kept as a module in a cache folder, under its own hash, so that Numba's cache on disk holds across
processes.  A kernel that calls these functions is compiled into the same module (``compile_kernel``): Numba keeps no
compiled caller of functions that come in from outside.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from threading import Lock
from types import ModuleType
from typing import Any, Final

import numpy as np

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen.formula import formulas_of
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.law_source import (
    EDGE_LAWS,
    FUNCTIONS,
    LAWS,
    classes_of_kind,
    hash_of_shared,
    laws_source,
    other_laws_source,
    source_file,
)
from sssi_exudyn.contact.registry import TERMS
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.runtime.generated_module import run_module
from sssi_exudyn.runtime.private_folder import cache_folder


@dataclass(frozen=True)
class CompiledLaw:
    """All terms of one place as compiled functions of floats.

    value, derivatives, linearisation : as listed above; None where there is none
    parameters : what the functions take as their first argument
    """

    value: Callable[..., Any]
    derivatives: Callable[..., Any] | None
    linearisation: Callable[..., Any] | None
    parameters: LawParameters


def law_classes(terms: Iterable[Term]) -> tuple[type[Term], ...]:
    """Return the classes that are compiled for ``terms``: the registry's, then others by places and names."""
    others = {type(term) for term in terms} - set(TERMS)
    return (*TERMS, *sorted(others, key=lambda cls: (cls.kind, cls.__module__, cls.__qualname__)))


def in_order(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Return the same terms, those of a class together, as the kernels have them."""
    classes = law_classes(terms)
    return tuple(sorted(terms, key=lambda term: classes.index(type(term))))


def parameter_values(terms: Sequence[Term]) -> Array:
    """Return the parameters (n,) of all terms ``in_order``, each in the order of its declaration."""
    return np.array([value for term in in_order(terms) for value in places.parameters(term).values()], dtype=np.float64)


def law_parameters(terms: Sequence[Term]) -> LawParameters:
    """Return the terms' parameters as the kernels take them."""
    classes = law_classes(terms)
    sizes = [sum(len(quantities(cls)) for term in terms if type(term) is cls) for cls in classes]
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    winds = [index for index, cls in classes_of_kind("wind", classes) if index >= len(TERMS)]
    ends = (first[winds[0]], first[winds[-1] + 1]) if winds else (0, 0)
    addresses = _addresses(classes[len(TERMS) :])
    others = sum(2**function for function, address in enumerate(addresses) if address)
    return LawParameters(parameter_values(terms), first, others, np.array([*addresses, *ends], dtype=np.int64))


def parameter_index(terms: Sequence[Term], term: Term, name: str) -> int:
    """Return where a parameter of one of the terms stands among ``parameter_values``."""
    before = itertools.takewhile(lambda other: other is not term, in_order(terms))
    return sum(len(quantities(type(other))) for other in before) + list(quantities(type(term))).index(name)


def place_parameters(terms: Sequence[Term], kind: str) -> list[int]:
    """Return where the parameters stand by which the forces of a place may change; the wind's move the segments."""
    owners = [term for term in in_order(terms) for _ in quantities(type(term))]
    return [i for i, term in enumerate(owners) if term.kind == kind or (kind == "segment" and term.kind == "wind")]


def _addresses(others: tuple[type[Term], ...]) -> tuple[int, ...]:
    """Return where the functions of such classes are, in the order of ``FUNCTIONS``; 0 for those that there are not."""
    if not others:
        return (0,) * len(FUNCTIONS)
    with _lock:
        if others not in _compiled_others:
            module = _module(other_laws_source(others))
            laws = [getattr(module, f"_address_of_{function.name}", None) for function in FUNCTIONS]
            _compiled_others[others] = tuple(0 if law is None else law.address for law in laws)
        return _compiled_others[others]


_compiled_others: dict[tuple[type[Term], ...], tuple[int, ...]] = {}
_lock: Final = Lock()
"""So that no thread finds a module that another is still running."""


def _module(source: str) -> ModuleType:
    """Return the module with that text, from the cache folder, written there first if need be."""
    name = "sssi_exudyn_generated_" + hashlib.sha256(source.encode()).hexdigest()
    if name in sys.modules:
        return sys.modules[name]
    path = cache_folder() / f"{name}.py"
    if not (path.is_file() and path.read_bytes() == source.encode()):
        # a name of its own and then a move: another process sees the whole file or none
        made = path.with_name(f".{name}.{os.getpid()}")
        made.write_bytes(source.encode())
        try:
            made.replace(path)
        except PermissionError:  # on Windows, while another process has the same module open
            made.unlink(missing_ok=True)
            if path.read_bytes() != source.encode():
                raise
    return run_module(name, path)


def compile_kernel(*templates: ModuleType) -> ModuleType:
    """Return a module with the contents of the templates and the functions of all places, compiled and cached as one.

    A template is a module whose Numba functions call ``point_force`` and so on as globals of its own; to please a
    type checker it may declare them without a value (``point_force: Callable[..., float]``), and so it may the
    functions of a template before it.  It should decorate with ``njit(cache=True)``, call Numba functions of no other
    modules but ``vectors`` and ``terrain.surface`` (Numba's cache would not see a change there; this module's name
    does), and leave names that begin with an underscore to the generated functions.  A module of formulas (``formula``)
    may stand among the templates: its compiled functions are written instead of its text.

    Raises ValueError for a template without a source file, and where two templates mean different things by a name.
    """
    if templates not in _kernels:
        _check_names(templates)
        # imports from __future__ must come first; Numba looks names up when a function is first called
        formulas = [one for template in templates for one in formulas_of(template)]
        kernels = [template for template in templates if not formulas_of(template)]
        texts = [source_file(template).read_text(encoding="utf-8").replace(_FUTURE, "") for template in kernels]
        linearised, edges = (any(name in text for text in texts) for name in ("_linearisation(", "edge_derivatives("))
        laws = laws_source(linearised=linearised, edges=edges)  # they take time to write
        # Numba's cache on disk finds the templates' classes again by the names of their modules
        names = f"# templates: {', '.join(template.__name__ for template in templates)}"
        shared = f"# shared: {hash_of_shared(*_imported(kernels))}"
        written = [one.source() for one in formulas]
        _kernels[templates] = _module("\n\n".join([_FUTURE, *texts, names, shared, laws, *written]))
    return _kernels[templates]


def _check_names(templates: Sequence[ModuleType]) -> None:
    """Raise ValueError where a template would replace what another one means by a name: they become one module."""
    known: dict[str, tuple[object, ModuleType]] = {}
    for template in templates:
        formulas = formulas_of(template)
        names = {formula.name: formula for formula in formulas} if formulas else vars(template)
        for name, value in names.items():
            other, owner = known.setdefault(name, (value, template))
            same = other is value or (isinstance(value, (float, int, str, tuple)) and other == value)
            if not same and not name.startswith("__"):
                raise ValueError(f"the templates {owner.__name__} and {template.__name__} both define {name}")


def _imported(templates: Sequence[ModuleType]) -> list[ModuleType]:
    """Return the package's modules that hold the structs which templates import: Numba's cache must see them change."""
    values = [value for template in templates for value in vars(template).values()]
    names = {value.__module__ for value in values if isinstance(value, type) and value.__module__.startswith(_PACKAGE)}
    return [sys.modules[name] for name in sorted(names - {template.__name__ for template in templates})]


_PACKAGE: Final = __name__.partition(".")[0] + "."
_kernels: dict[tuple[ModuleType, ...], ModuleType] = {}
"""What was asked for in this process; to write the laws down takes some 0.1 s."""


_FUTURE: Final = "from __future__ import annotations\n"


def _compiled(place: str, terms: Sequence[Term]) -> CompiledLaw:
    module, law = _module(laws_source()), LAWS[place]
    derivatives = getattr(module, law.derivatives) if law.variables else None
    linearisation = getattr(module, law.linearisation)
    return CompiledLaw(getattr(module, law.value), derivatives, linearisation, law_parameters(terms))


def compile_edge(terms: Sequence[Term]) -> tuple[CompiledLaw, CompiledLaw, CompiledLaw]:
    """Compile the edge terms among ``terms``: their force, their memory, the wall's greatest force and its force."""
    module = _module(laws_source(linearised=False, edges=True))
    force, memory, capacity = (
        CompiledLaw(
            getattr(module, law.value),
            getattr(module, law.derivatives) if law.variables else None,
            None,
            law_parameters(terms),
        )
        for law in EDGE_LAWS
    )
    return force, memory, capacity


def compile_point(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the point terms among ``terms``."""
    return _compiled("point", terms)


def compile_foot(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the foot terms among ``terms``."""
    return _compiled("foot", terms)


def compile_segment(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the segment terms among ``terms``, in the air that the wind terms move."""
    return _compiled("segment", terms)


def compile_body(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the body terms among ``terms``."""
    return _compiled("body", terms)


def compile_wind(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the wind terms among ``terms``."""
    return _compiled("wind", terms)


def compile_terrain(terms: Sequence[Term]) -> CompiledLaw:
    """Compile the terrain terms among ``terms``."""
    return _compiled("terrain", terms)
