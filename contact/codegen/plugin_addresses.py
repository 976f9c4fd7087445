"""Laws that are compiled apart from the kernels and called by their addresses.

What a kernel calls by name is compiled into it, once more for every other text.  A law of a user's own is called by its
address instead: the kernels stay as they are, and the law alone is compiled.

A law takes ``LawParameters``, floats and, where it is linearised, the array of derivatives by the parameters; it
returns a tuple of floats.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import SimpleNamespace
from typing import Any, Final

from sssi_exudyn.runtime.jit import FAULT, compile_entry, njit

_PLAIN: Final[list[Callable[..., tuple[float, ...]]]] = []
"""Laws where there is no compiler; their addresses count from one."""

carray: Any = None
"""Numba's array at an address; None where there is no compiler."""
if not FAULT:  # modules that say nothing of their types
    ir: Any = import_module("llvmlite.ir")
    numba: Any = import_module("numba")
    types, carray = numba.types, numba.carray
    cgutils: Any = import_module("numba.core.cgutils")
    intrinsic: Any = import_module("numba.extending").intrinsic


def callable_at(outputs: int) -> Any:
    """Return a compiled function that calls a law at its place among ``LawParameters.addresses`` and gives its
    ``outputs`` floats.  It takes the place, the parameters, a tuple of the floats, and ``by_parameter`` or None.

    There is one for each number of outputs, since compiled functions know the lengths of their tuples.  It takes the
    arrays out of the struct itself: in a tuple Numba would count their references.
    """
    if FAULT:
        return lambda place, parameters, given, by_parameter: _PLAIN[parameters.addresses[place] - 1](
            parameters, *given, *(() if by_parameter is None else (by_parameter,))
        )

    def call(_typing: Any, place: Any, parameters: Any, given: Any, by_parameter: Any) -> Any:
        arrays = [*parameters.types, by_parameter]
        if any(isinstance(kind, types.Array) and kind.layout != "C" for kind in arrays):
            raise numba.TypingError("a law that is called by its address takes arrays without gaps only")
        return types.UniTuple(types.float64, outputs)(types.int64, parameters, given, by_parameter), write

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place, parameters, given, by_parameter = arguments
        _, struct, floats, array = signature.args

        def field(name: str) -> Any:
            at = struct.fields.index(name)
            return context.make_array(struct.types[at])(context, builder, builder.extract_value(parameters, at))

        out = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), outputs))
        passed = [builder.bitcast(out, ir.DoubleType().as_pointer())]
        for name in ("values", "first"):
            passed += [field(name).data, builder.extract_value(field(name).shape, 0)]
        for at, kind in enumerate(floats.types):
            passed.append(context.cast(builder, builder.extract_value(given, at), kind, types.float64))
        if isinstance(array, types.Array):
            passed.append(context.make_array(array)(context, builder, by_parameter).data)
        law = ir.FunctionType(ir.VoidType(), [value.type for value in passed])
        address = builder.load(builder.gep(field("addresses").data, [place]))
        builder.call(builder.inttoptr(address, law.as_pointer()), passed)
        outputs_of_law = [builder.load(cgutils.gep_inbounds(builder, out, 0, at)) for at in range(outputs)]
        return context.make_tuple(builder, signature.return_type, outputs_of_law)

    written = intrinsic(call)
    return njit(lambda place, parameters, given, more: written(place, parameters, given, more), error_model="numpy")


def expected_false() -> Any:
    """Return a compiled function that gives the truth it is given, and lets the compiler lay out what follows for
    False.
    """
    if FAULT:
        return bool

    def expect(_typing: Any, truth: Any) -> Any:
        def write(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            bit = ir.IntType(1)
            function = builder.module.declare_intrinsic("llvm.expect", [bit], ir.FunctionType(bit, [bit, bit]))
            return builder.call(function, [arguments[0], ir.Constant(bit, 0)])

        return types.boolean(truth), write

    written = intrinsic(expect)
    return njit(lambda truth: written(truth))


def law_address(law: Callable[..., tuple[float, ...]]) -> Callable[[Callable[..., None]], Any]:
    """Return a decorator of the function that C would call to have ``law``: what it returns has its ``address``.

    The function's arguments are those of ``callable_at`` as C has them: an array to be filled, the two of
    ``LawParameters`` each with its length, floats, and ``by_parameter`` where the law is linearised.
    """

    def address(entry: Callable[..., None]) -> Any:
        names = entry.__code__.co_varnames[: entry.__code__.co_argcount]
        if FAULT:
            _PLAIN.append(law)
            return SimpleNamespace(address=len(_PLAIN))
        floats, whole = types.CPointer(types.float64), types.CPointer(types.int64)
        kinds = {"out": floats, "values": floats, "count": types.intp, "first": whole, "classes": types.intp}
        kinds["by_parameter"] = floats
        signature = types.void(*(kinds.get(name, types.float64) for name in names))
        return compile_entry(signature, entry)

    return address
