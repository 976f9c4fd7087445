"""Arguments of what scripts call, held against the annotations of the function before its work begins."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import cache, wraps
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

from sssi_exudyn.core.command_line import Argument
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import did_you_mean, one_line

P = ParamSpec("P")
T = TypeVar("T")
_WORDS: Final = {
    bool: "True or False",
    int: "a whole number",
    float: "a number",
    str: "a text",
    os.PathLike: "a path",
    Mapping: "a table of names and values",
}
_LONGEST: Final = 60
"""Characters of a wrong value that a message repeats."""


def checked(function: Callable[P, T]) -> Callable[P, T]:
    """Return the function with arguments that are checked by name, number and type when it is called.

    A call raises InputError with the argument and what it takes.  Quoted types within an annotation are not checked.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        _check(function, args, kwargs)
        return function(*args, **kwargs)

    return call


def _check(function: Callable[..., Any], args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> None:
    signature = inspect.signature(function)
    try:
        given = signature.bind(*args, **kwargs).arguments
    except TypeError as error:
        names = [name for name in signature.parameters if name != "self"]
        unknown = next((name for name in kwargs if name not in names), None)
        fix = f"the arguments are: {', '.join(names) or 'none'}" if unknown is None else did_you_mean(unknown, names)
        raise InputError(function.__name__, "", str(error), fix) from None
    for name, annotation in _annotations(function).items():
        if name not in given:
            continue
        value = given[name]
        if not _takes(annotation, value):
            problem = f"{one_line(repr(value), _LONGEST)} cannot be used here"
            raise InputError(function.__name__, name, problem, f"give {_words(annotation)}")
        if _is_one_or_more(annotation) and isinstance(value, Sequence) and not value:
            raise InputError(function.__name__, name, "it is empty", "give one or more")


@cache
def _annotations(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the evaluated annotations of parameters that are one value each."""
    single = [
        parameter.name
        for parameter in inspect.signature(function).parameters.values()
        if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
    ]

    def parameters() -> None:
        """Carry the annotations."""

    texts = function.__annotations__  # that of the result may name what only a type checker imports
    parameters.__annotations__ = {name: texts[name] for name in single if name in texts}
    return inspect.get_annotations(parameters, globals=vars(sys.modules[function.__module__]), eval_str=True)


def _is_one_or_more(annotation: Any) -> bool:
    declared = annotation.__metadata__[0] if get_origin(annotation) is Annotated else None
    return isinstance(declared, Argument) and declared.count == "+"


def _takes(kind: Any, value: object) -> bool:
    """Return whether a value is of a type; what is neither a type nor made of types takes everything."""
    origin, parts = get_origin(kind), get_args(kind)
    match origin or kind:
        case _ if origin is Annotated:
            return _takes(kind.__origin__, value)
        case _ if origin in (Union, UnionType):
            return any(_takes(part, value) for part in parts)
        case _ if origin is Literal:
            return isinstance(value, Hashable) and value in parts
        case _ if origin is tuple:
            return _is_listed(value, parts[0]) and isinstance(value, Sequence) and len(value) == len(parts)
        case _ if origin is Sequence:
            return _is_listed(value, parts[0])
        case _ if kind in (int, float):
            return isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
        case type() as plain:
            return isinstance(value, plain)
    return kind is not None or value is None


def _is_listed(value: object, kind: Any) -> bool:
    """Return whether the value is a list, an array or the like; elements are looked at where that uses none up."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        return False
    return not isinstance(value, Sequence) or all(_takes(kind, part) for part in value)


def _words(kind: Any) -> str:
    """Return what a type takes, in words."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _words(kind.__origin__)
    if origin in (Union, UnionType):
        path = any(get_origin(part) is os.PathLike for part in parts)  # where a path goes, so does its text
        kinds = [part for part in parts if part is not NoneType and not (path and part is str)]
        return " or ".join(dict.fromkeys(_words(part) for part in kinds))
    if origin is Literal:
        return " or ".join(repr(part) for part in parts)
    if origin is Sequence:
        return f"a list, each {_words(parts[0])}"
    if origin is tuple:
        return f"{len(parts)} values, each {_words(parts[0])}"
    plain = origin or kind
    return _WORDS.get(plain) or f"a {getattr(plain, '__name__', plain)}"
