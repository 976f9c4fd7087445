"""Types of arguments that several functions take, with how the command line takes each.

Nothing heavy is imported: the command line is made from the functions' signatures before any work begins.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias, TypeVar

from sssi_exudyn.core.command_line import Argument, Option, PythonOnly
from sssi_exudyn.core.errors import InputError

if TYPE_CHECKING:
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.contact.term import Term
    from sssi_exudyn.model.model import Model
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.runtime.progress import Progress

_MOST_WORKERS: Final = 10_000
T = TypeVar("T")


def read_count(text: str) -> int:
    """Read a number of processes.  Raises ValueError for anything else."""
    if not text.isdecimal() or not 1 <= int(text) <= _MOST_WORKERS:
        raise ValueError(f"{text!r} is no number of processes, 1 to {_MOST_WORKERS}")
    return int(text)


def read_positive(text: str) -> float:
    """Read a number above zero.  Raises ValueError for anything else."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise ValueError(f"{text!r} is no number above zero")
    return value


def read_stretch(text: str) -> tuple[float, float]:
    """Read a stretch of a recording, FROM:TO in s; without one of the two it goes to the recording's own end.

    Raises ValueError for anything else.
    """
    first, colon, last = text.partition(":")
    try:
        begin, end = float(first or "-inf"), float(last or "inf")
    except ValueError:
        begin = end = float("nan")
    if not colon or not begin < end:
        raise ValueError(f"{text!r} is no stretch of time such as 3:12.5 (s)")
    return begin, end


AnyPath: TypeAlias = str | os.PathLike[str]
RecordingFolder: TypeAlias = Annotated[AnyPath, Argument("FOLDER", Path)]
RecordingFolders: TypeAlias = Annotated[Sequence[AnyPath], Argument("FOLDER", Path, "+")]
RecordingOrFolder: TypeAlias = Annotated["Recording | AnyPath", Argument("FOLDER", Path)]
DiagnosedRecording: TypeAlias = Annotated["Recording | AnyPath", Argument("FOLDER", Path, "+")]
"""The command line may have several: they are compared as runs of one day."""
ResultOrRecording: TypeAlias = Annotated["Result | Recording | AnyPath", Argument("FOLDER", Path, "?")]
"""The command line may leave it out to list muscles."""
ResultOrFolder: TypeAlias = "Result | AnyPath"
Results: TypeAlias = Annotated["ResultOrFolder | Sequence[ResultOrFolder]", Argument("DIR", Path, "+")]
ModelOrFile: TypeAlias = Annotated["Model | AnyPath", Option(metavar="TOML", read=Path)]
OutFolder: TypeAlias = Annotated[AnyPath, Option(metavar="DIR", required=True)]
"""Where a result is written: Python may leave it out where the type says so, the command line may not."""
Picture: TypeAlias = Annotated[AnyPath, Option("--out", metavar="PICTURE")]
Terms: TypeAlias = Annotated[Sequence["Term | str"], Option("--term", metavar="NAME", read=str)]
Workers: TypeAlias = Annotated[int, Option(metavar="N", read=read_count)]
PositiveNumber: TypeAlias = Annotated[float, Option(read=read_positive)]
Seconds: TypeAlias = Annotated["str | tuple[float, float]", Option(metavar="FROM:TO", read=read_stretch)]
Plugins: TypeAlias = Annotated[Sequence[AnyPath], PythonOnly("--plugin stands before or after any command")]
ProgressWanted: TypeAlias = Annotated[
    "bool | Callable[[str, float | None, str], None] | Progress", PythonOnly("--quiet and --verbose choose it")
]


def path_of(path: AnyPath | None) -> Path | None:
    """Return the path, None where there is none."""
    return None if path is None else Path(path)


def recording_of(given: Recording | AnyPath) -> Path | Recording:
    """Return the recording, or the path of its folder.  Raises InputError for anything else."""
    if isinstance(given, str | os.PathLike):
        return Path(given)
    from sssi_exudyn.recording.recording import Recording

    return _of_type(given, Recording, "recording")


def model_in(given: Model | AnyPath | None) -> Path | Model | None:
    """Return the model, or the path of its file.  Raises InputError for anything else."""
    if given is None or isinstance(given, str | os.PathLike):
        return None if given is None else Path(given)
    from sssi_exudyn.model.model import Model

    return _of_type(given, Model, "model")


def stretch_of(given: str | tuple[float, float] | None) -> tuple[float, float] | None:
    """Return the stretch of the recording (s), None for the whole.  Raises InputError for what is none."""
    if given is None:
        return None
    try:
        return read_stretch(":".join(map(str, given)) if isinstance(given, (tuple, list)) else str(given))
    except (TypeError, ValueError) as error:
        raise InputError("argument", "seconds", str(error), "give two times of the recording's clock") from None


def _of_type(given: object, kind: type[T], name: str) -> T:
    """Return an argument of the type that it must have.  Raises InputError for another."""
    if isinstance(given, kind):
        return given
    fix = f"give a {kind.__name__}, or the path of one"
    raise InputError("argument", name, f"a value of type {type(given).__name__} is no {name}", fix)


def use_plugins(plugins: Sequence[AnyPath]) -> None:
    """Run the code of plug-ins and put what they offer to use."""
    if plugins:
        from sssi_exudyn.plugins import use_plugin

        for plugin in plugins:
            use_plugin(os.fspath(plugin))
