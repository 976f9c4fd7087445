"""The force kernel as plain Python, calling the terms as they are written: slow, and the reference for the compiled
one.

The loops are the compiled kernel's own text, run by the interpreter; laws, and the formulas of a contact point, are
called as they are written, over floats.  Only the derivatives that Newton's method wants are the generated ones: they
steer the iteration, not the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

from sssi_exudyn.contact import maths
from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen import vectors
from sssi_exudyn.contact.codegen.compiled import compile_kernel
from sssi_exudyn.contact.codegen.formula import formulas_of
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import Term
from sssi_exudyn.simulation.ski_on_snow import ground as ground_kernel
from sssi_exudyn.simulation.ski_on_snow import point
from sssi_exudyn.terrain import surface


def interpreted_kernel(terms: Sequence[Term], template: ModuleType) -> Any:
    """Return a namespace with the functions of ``template`` for ``terms``, none of them compiled: as
    ``compile_kernel``'s module.
    """
    module = compile_kernel(point, ground_kernel, template)
    kernels = {used.__name__ for used in (maths, vectors, surface, module)}
    names: dict[str, Any] = vars(vectors) | vars(surface) | vars(module)
    for name, value in list(names.items()):
        plain = getattr(value, "py_func", value)  # without Numba functions are plain already
        if isinstance(plain, FunctionType) and plain.__module__ in kernels:
            names[name] = FunctionType(plain.__code__, names, name, plain.__defaults__)
    names |= {one.name: partial(one, FloatMath()) for one in formulas_of(point)}
    names |= _laws(terms)
    return SimpleNamespace(**{name: value for name, value in names.items() if not name.startswith("__")})


def _laws(terms: Sequence[Term]) -> dict[str, Callable[..., Any]]:
    """Return the laws under the names and with the arguments that kernels call them by (see ``compiled``)."""
    math = FloatMath()

    def point_force(_: Any, depth: float, rate: float, length: float) -> Any:
        return places.point_force(math, terms, places.PointState(depth, rate, length))

    def foot_force(_: Any, *state: float) -> Any:
        return places.foot_force(math, terms, places.FootState(*state))

    def segment_force(_: Any, t: float, f: float, l: float, *rest: float) -> Any:  # noqa: E741
        wind = places.air_velocity(math, terms, places.PlaceState(t, f, l))
        state = places.SegmentState(rest[:3], wind, rest[3])  # type: ignore[arg-type]
        return places.segment_force(math, terms, state)

    def body_force(_: Any, t: float, f: float, l: float, *velocity: float) -> Any:  # noqa: E741
        return places.body_force(math, terms, places.BodyState(t, f, l, velocity))  # type: ignore[arg-type]

    def terrain_height(_: Any, f: float, l: float) -> Any:  # noqa: E741
        return places.terrain_height(math, terms, f, l)

    return {law.__name__: law for law in (point_force, foot_force, segment_force, body_force, terrain_height)}
