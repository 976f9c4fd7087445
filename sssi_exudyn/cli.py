"""The command line: reads arguments, calls the function of one command, prints its result.

Exit status: 0 only when the result is whole; 2 for bad input, 1 for any other failure, 130 when interrupted.  Errors
are one line on stderr, where progress is shown too; stdout holds only the result.
"""

from __future__ import annotations

import argparse
import errno
import io
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Final, NoReturn

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.interrupts import INTERRUPTED, end_on_interrupt
from sssi_exudyn.runtime.posix import posix_module
from sssi_exudyn.runtime.progress import progress_on_stderr
from sssi_exudyn.terminal import table
from sssi_exudyn.terminal.command import Command, parser_of

_ADDRESSES: Final = 1_000_000_000
"""Least limit of addresses, bytes: with two threads a simulation of 11 s takes 1.2 GB of them, and 0.5 GB of memory."""


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Read the arguments, do what they say, and end the process with its exit status."""
    with end_on_interrupt():  # argparse imports as it goes
        _prepare_streams()
        options = read_arguments(sys.argv[1:] if arguments is None else arguments)
    sys.exit(_status(options))


def read_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Read the arguments of a command line; end the process with status 2 where they are wrong."""
    words = _with_verb(arguments)
    return parser_of(table.COMMANDS, table.GROUPS, set(words)).parse_args(words)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments that ``sssi`` takes."""
    return parser_of(table.COMMANDS, table.GROUPS)


def _prepare_streams() -> None:
    """Open stdin, stdout and stderr where they are closed, and let every text be written to them.

    Otherwise a file of a result would become one of them.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - for as long as the process
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _with_verb(arguments: Sequence[str]) -> list[str]:
    """Complete ``sssi sweep FILE``, which is short for ``sssi sweep start FILE``, whatever plug-ins stand before."""
    words = list(arguments)
    at = 0
    while at < len(words) and words[at].startswith("--plugin"):
        at += 1 if "=" in words[at] else 2
    verbs = [command.words.removeprefix("sweep ") for command in table.COMMANDS if command.words.startswith("sweep ")]
    rest = words[at + 1 :]
    if words[at : at + 1] == ["sweep"] and rest and rest[0] not in (*verbs, "-h", "--help"):
        words.insert(at + 1, "start")
    return words


def _status(options: argparse.Namespace) -> int:
    """Run the command and print its result; return the exit status."""
    try:
        text = _perform(options)
        try:
            sys.stdout.write(text)
            sys.stdout.flush()
        except OSError as error:
            # Python flushes once more at exit: not there
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            if isinstance(error, BrokenPipeError):  # the reader of stdout has closed it (sssi terms | head)
                return 1
            return _fail(options, 1, f"stdout cannot be written ({(error.strerror or str(error)).lower()})")
    except KeyboardInterrupt:
        return _fail(options, INTERRUPTED, "interrupted; resume with the same command")
    except BrokenPipeError:  # of stderr
        return 1
    except InputError as error:
        return _fail(options, 2, str(error))
    except SssiError as error:
        return _fail(options, 1, str(error))
    except Exception as error:  # noqa: BLE001 - the last line of defence; --debug shows the traceback
        if _is_short_of_memory(error):
            return _fail(options, 1, "there is not enough memory; end other programs, or raise the limit (ulimit -v)")
        if isinstance(error, ImportError) and "libGL" in str(error):
            return _fail(
                options, 1, "Exudyn needs the OpenGL library libGL.so.1; on Debian: sudo apt-get install libgl1"
            )
        fault = one_line(f"{type(error).__name__}: {error}", 500)
        return _fail(options, 1, f"{fault}; this is a bug of the program, --debug shows where")
    return 0


def _is_short_of_memory(error: Exception) -> bool:
    """Tell whether memory was refused, to Python or to a library as it was loaded."""
    if isinstance(error, ImportError):
        return any(words in str(error).lower() for words in ("failed to map segment", "cannot allocate memory"))
    return isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM)


def _check_addresses() -> None:
    """Raise SssiError where the addresses of this process are bounded to less than its libraries take.

    Some of them wait without end for what they are refused.
    """
    resource = posix_module("resource")
    if resource is None:
        return
    bound = resource.getrlimit(resource.RLIMIT_AS)[0]
    if bound != resource.RLIM_INFINITY and bound < _ADDRESSES:
        problem = f"the limit of {bound / 1e6:.0f} MB (ulimit -v) is less than the program's libraries take"
        raise SssiError(f"{problem}; raise it to {_ADDRESSES / 1e6:.0f} MB or more")


def _perform(options: argparse.Namespace) -> str:
    """Load what the command needs, call its function, and return the result as text for stdout."""
    command: Command = options.chosen
    _check_addresses()
    with end_on_interrupt():  # here, so that --help and --version answer at once
        from sssi_exudyn.runtime.exudyn_build import take_fast_build

        take_fast_build()
        import_module(f"sssi_exudyn.{command.loads}")

    plugins = [*options.plugin, *options.more_plugins]
    if plugins:
        from sssi_exudyn.plugins import use_plugins

        use_plugins(plugins)
    if not options.debug:
        warnings.simplefilter("ignore")  # of libraries, about figures that are checked here: the error line says it
    progress = progress_on_stderr(quiet=options.quiet, verbose=options.verbose)
    return command.show(command.perform(options, progress), options)


def _fail(options: argparse.Namespace, status: int, line: str) -> int:
    """Write an error's line to stderr, with its traceback where that is asked for; return the exit status."""
    if options.debug:
        traceback.print_exc()
    sys.stderr.write(f"sssi: {line}\n")
    return status
