"""A command of ``sssi``, and the parser of all of them."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from importlib import metadata
from typing import Any, Final, NoReturn

from sssi_exudyn.core.command_line import PythonOnly
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.terminal.signature import Parameter, add_parameter, parameters_of, summary_of

_LONGEST: Final = 500
"""Characters of an error about arguments, which may quote one."""
_PLUGIN_HELP: Final = (
    "a file of Python, or an installed package, with force terms, hypotheses or readers; its code is run"
)


@dataclass(frozen=True)
class Command:
    """One command: a function whose signature is its arguments, and how the result is shown.

    words : its name, of two words within a group
    function : gives arguments and help, and is called
    show : writes what was returned as text; it gets the arguments too
    loads : module of the package that is imported before the call, so that an interrupt meanwhile is one line
    help : the command in a list; "" for the first sentence of the function's docstring
    without : parameters of the function that the command does not have
    more : parameters that only the command line has
    call : called in place of the function, with the same arguments
    several : function that is called for several of what ``function`` takes; the command has its options too
    """

    words: str
    function: Callable[..., Any]
    show: Callable[[Any, argparse.Namespace], str]
    loads: str
    help: str = ""
    without: tuple[str, ...] = ()
    more: tuple[Parameter, ...] = ()
    call: Callable[..., Any] | None = None
    several: Callable[..., Any] | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return all that the command line takes for it."""
        own = [parameter for parameter in parameters_of(self.function) if parameter.name not in self.without]
        names = {parameter.name for parameter in own}
        if self.several is not None:  # places are those of the function itself
            further = (parameter for parameter in parameters_of(self.several) if parameter.by_name)
            own += [parameter for parameter in further if parameter.name not in names]
        return (*(parameter for parameter in own if not isinstance(parameter.given, PythonOnly)), *self.more)

    def perform(self, options: argparse.Namespace, progress: Progress) -> Any:
        """Call the function with the arguments that were given, and with ``progress`` where it takes one."""
        call = self.call or self.function
        places, names = [], {}
        for parameter in self.parameters:
            value = getattr(options, parameter.name)
            if parameter.by_name:
                names[parameter.name] = value
            else:
                places.append(value)
        if "progress" in inspect.signature(call).parameters:
            names["progress"] = progress
        return call(*places, **names)


@dataclass(frozen=True)
class Group:
    """Commands of two words that begin alike.

    usage : where it is not the usual one
    """

    help: str
    metavar: str = "COMMAND"
    usage: str | None = None


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line of bounded length, after the usage."""

    def error(self, message: str) -> NoReturn:
        super().error(one_line(message, _LONGEST))


def parser_of(
    commands: Sequence[Command], groups: Mapping[str, Group], words: Set[str] | None = None
) -> argparse.ArgumentParser:
    """Make the parser of all commands; what it returns has the command in ``chosen``.

    Where ``words``, the ones to be read, are given, only commands that may be among them get arguments: to read every
    signature takes longer than anything else before the work begins.
    """
    top = Parser(
        prog="sssi",
        description="Skier, ski and snow, simulated from a recorded run.",
        epilog="Begin with: sssi example beginner, then sssi run beginner --out result, and open result/report.html.",
    )
    top.add_argument("--version", action="version", version=f"sssi {metadata.version('sssi-exudyn')}")
    top.add_argument("--plugin", action="append", default=[], metavar="FILE.py", help=_PLUGIN_HELP)
    every = argparse.ArgumentParser(add_help=False)
    every.add_argument("--plugin", action="append", default=[], dest="more_plugins", help=argparse.SUPPRESS)
    every.add_argument("--debug", action="store_true", help="show where in the program an error came from")
    verbosity = every.add_mutually_exclusive_group()
    verbosity.add_argument("--quiet", action="store_true", help="show no progress")
    verbosity.add_argument(
        "--verbose", action="store_true", help="show every step, a line each, and every figure of the result"
    )
    places: dict[str, Any] = {"": top.add_subparsers(metavar="COMMAND", required=True)}
    for command in commands:
        group, _, word = command.words.rpartition(" ")
        if group not in places:
            about = groups[group]
            within = places[""].add_parser(group, help=about.help, usage=about.usage)
            places[group] = within.add_subparsers(metavar=about.metavar, required=True, prog=f"sssi {group}")
        added = places[group].add_parser(word, parents=[every], help=command.help or summary_of(command.function))
        added.set_defaults(chosen=command)
        if words is not None and not words >= set(command.words.split()):
            continue
        parameters = command.parameters
        if not any(parameter.flag == "--json" for parameter in parameters):
            added.add_argument("--json", action="store_true", help="print the result as JSON")
        for parameter in parameters:
            add_parameter(added, parameter)
    return top
