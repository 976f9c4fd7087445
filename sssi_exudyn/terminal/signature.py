"""Arguments of the command line, made from the signature of a function.

The name, the type and the default of a parameter tell most; the rest is declared in its annotation
(``core.command_line``).  Its help is the first sentence of its entry in the docstring; further ones are for Python.
"""

from __future__ import annotations

import argparse
import inspect
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, Unpack, get_args, get_origin, get_type_hints

from sssi_exudyn.api.arguments import AnyPath
from sssi_exudyn.core.command_line import Argument, Option, PythonOnly, Reader

REQUIRED: Final = inspect.Parameter.empty
"""Default of a parameter that has none."""
_ENTRY: Final = re.compile(r"(\w+) : (.*)")
_SECTION: Final = re.compile(r"^(?:Parameters|Attributes)\n-+\n(.*?)(?:\n\n|\Z)", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Parameter:
    """A parameter of a function, as the command line takes it.

    kind : its type, without None and without what ``Annotated`` adds
    given : how the command line takes it
    help : one sentence, without its full stop
    default : its default, ``REQUIRED`` where there is none
    by_name : whether the function takes it by name alone
    """

    name: str
    kind: Any
    given: Argument | Option | PythonOnly
    help: str
    default: Any = REQUIRED
    by_name: bool = True

    @property
    def flag(self) -> str:
        """Return the name of the option."""
        own = self.given.flag if isinstance(self.given, Option) else ""
        return own or f"--{self.name.replace('_', '-')}"

    @property
    def choices(self) -> tuple[Any, ...] | None:
        """Return the words or numbers that the value is one of; None where it is free."""
        return get_args(self.kind) if get_origin(self.kind) is Literal else None


def summary_of(function: Callable[..., Any]) -> str:
    """Return the first sentence of a function's docstring, as help has it: without capital and full stop."""
    sentence = _first_sentence((function.__doc__ or "").split("\n\n")[0])
    return sentence[:1].lower() + sentence[1:]


def parameters_of(function: Callable[..., Any]) -> tuple[Parameter, ...]:
    """Return the parameters of a function, those of a ``TypedDict`` that it takes as keywords included."""
    annotations = _annotations_of(function)
    texts = texts_of(function.__doc__)
    parameters: list[Parameter] = []
    for parameter in inspect.signature(function).parameters.values():
        annotation = annotations[parameter.name]
        if get_origin(annotation) is Unpack:
            parameters += _of_mapping(*get_args(annotation))
            continue
        by_name = parameter.kind is parameter.KEYWORD_ONLY
        text = _first_sentence(texts.get(parameter.name, ""))
        parameters.append(Parameter(parameter.name, *_kind_of(annotation), text, parameter.default, by_name))
    return tuple(parameters)


def texts_of(docstring: str | None) -> dict[str, str]:
    """Return the entries of a docstring's parameters or attributes by name, each on one line."""
    section = _SECTION.search(inspect.cleandoc(docstring or ""))
    texts: dict[str, str] = {}
    name = ""
    for line in section[1].split("\n") if section else ():
        entry = _ENTRY.match(line)
        if entry:
            name, texts[entry[1]] = entry[1], entry[2]
        else:
            texts[name] += f" {line.strip()}"
    return texts


def add_parameter(parser: argparse.ArgumentParser, parameter: Parameter) -> None:
    """Add a parameter to the arguments that a parser takes, unless it is for Python only."""
    given = parameter.given
    if isinstance(given, PythonOnly):
        return
    settings: dict[str, Any] = {"help": _help(parameter).replace("%", "%%")}
    if isinstance(given, Argument):
        settings |= {"metavar": given.metavar, "type": _checked(given.read), "nargs": given.count}
        parser.add_argument(parameter.name, **settings)
        return
    settings |= {"dest": parameter.name, "required": given.required or parameter.default is REQUIRED}
    if parameter.default is not REQUIRED:
        settings["default"] = list(parameter.default) if isinstance(parameter.default, tuple) else parameter.default
    if parameter.kind is bool:
        settings["action"] = "store_true"
    else:
        settings |= {"metavar": given.metavar or _unit(parameter), **_values(parameter, given)}
    parser.add_argument(parameter.flag, **settings)


def _annotations_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the evaluated annotations of a function's parameters.

    That of its result may name what only a type checker imports, and stays a text; so do quoted ones within the others.
    """

    def parameters() -> None:
        """Carry the annotations."""

    texts = {name: text for name, text in function.__annotations__.items() if name != "return"}
    parameters.__annotations__ = texts
    return inspect.get_annotations(parameters, globals=vars(sys.modules[function.__module__]), eval_str=True)


def _of_mapping(mapping: type) -> Iterator[Parameter]:
    """Yield the keys of a ``TypedDict``, none of which has to be given."""
    texts = texts_of(mapping.__doc__)
    for name, annotation in get_type_hints(mapping, include_extras=True).items():
        yield Parameter(name, *_kind_of(annotation), _first_sentence(texts.get(name, "")), None)


def _kind_of(annotation: Any) -> tuple[Any, Argument | Option | PythonOnly]:
    """Return the type itself, without None, and how the command line takes it: as an option if nothing is declared."""
    if get_origin(annotation) is Annotated:
        kind, declared = annotation.__origin__, annotation.__metadata__[0]
        return _kind_of(kind)[0], declared
    if get_origin(annotation) in (Union, UnionType):
        kinds = tuple(kind for kind in get_args(annotation) if kind is not NoneType)
        return _kind_of(kinds[0]) if len(kinds) == 1 else (Union[kinds], Option())  # noqa: UP007 - of a tuple
    return annotation, Option()


def _values(parameter: Parameter, given: Option) -> dict[str, Any]:
    """Return how an option's values are read: how many, of which type, out of which choices."""
    kind, settings = parameter.kind, dict[str, Any]()
    if parameter.choices is not None:
        return {"choices": parameter.choices, "type": type(parameter.choices[0])}
    if get_origin(kind) is tuple:
        settings["nargs"], kind = len(get_args(kind)), get_args(kind)[0]
    elif get_origin(kind) is Sequence or given.count is not None:
        settings |= {"action": "append"} if given.count is None else {"nargs": given.count}
        kind = get_args(kind)[0]
    return {**settings, "type": _checked(given.read or (Path if kind == AnyPath else kind))}


def _help(parameter: Parameter) -> str:
    """Return the parameter's sentence, with its default and whether it may be repeated."""
    default, given = parameter.default, parameter.given
    repeated = isinstance(given, Option) and given.count is None and get_origin(parameter.kind) is Sequence
    if repeated:
        return f"{parameter.help}; may be given several times"
    if default is None or default is False or default is REQUIRED:
        return parameter.help
    shown = " ".join(f"{number:g}" for number in default) if isinstance(default, tuple) else default
    return f"{parameter.help} (default: {shown})"


def _unit(parameter: Parameter) -> str | None:
    """Return the unit in which a number's name ends; None for other names."""
    return parameter.name.rpartition("_")[2] if parameter.kind is float and "_" in parameter.name else None


def _checked(read: Reader) -> Reader:
    """Return a reader whose ValueError becomes the parser's message; of a type the parser has its own."""
    if isinstance(read, type):
        return read

    def checked(text: str) -> object:
        try:
            return read(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return checked


def _first_sentence(text: str) -> str:
    """Return a text's first sentence, without its full stop and without marks of code."""
    flat = " ".join(text.split()).replace("``", "")
    return re.split(r"(?<=\.) (?=[A-Z\"])", flat)[0].removesuffix(".")
