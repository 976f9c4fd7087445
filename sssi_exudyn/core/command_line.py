"""How a function's parameter is given on the command line, declared in the parameter's annotation.

``speed: Annotated[float, Option(metavar="M/S")] = 10.0`` is ``--speed M/S``.  The name of a parameter, its type, its
default and the words of a ``Literal`` are not declared again, and its help is the first sentence of its entry in the
function's docstring.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Reader = Callable[[str], object]
"""Turns the text of an argument into a value; raises ValueError with what is wrong about the text."""


@dataclass(frozen=True)
class Argument:
    """A parameter that is given by its place, without a name before it.

    metavar : what usage and help call it
    count : "?" where it may be left out, "+" for one or more
    """

    metavar: str
    read: Reader = str
    count: Literal["?", "+"] | None = None


@dataclass(frozen=True)
class Option:
    """A parameter that is given after its name.

    flag : the name on the command line; "" for the parameter's own, with dashes
    metavar : what usage and help call the value; None for the unit at the end of a number's name, or the name
    count : "*" for any number of values after one flag; None for one, and in a sequence for one a flag
    required : whether the command line demands it although the function does not
    """

    flag: str = ""
    metavar: str | tuple[str, ...] | None = None
    read: Reader | None = None
    count: Literal["*"] | None = None
    required: bool = False


@dataclass(frozen=True)
class PythonOnly:
    """A parameter that the command line does not have, and the reason."""

    reason: str
