"""The errors that a user may see.  Each one is one clear line, and the program never shows a traceback for it."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sssi_exudyn.core.text import one_line

_LONGEST: Final = 1000
"""Maximum number of characters of the path, of the problem and of the fix."""


class SssiError(Exception):
    """The program raises this error with one line that a user can act on.

    Examples
    --------
    >>> try:
    ...     result = sssi_exudyn.run("monday")
    ... except sssi_exudyn.SssiError as error:
    ...     print(error)
    """

    def __init__(self, message: object = "") -> None:
        super().__init__(one_line(message, 4 * _LONGEST))


class InputError(SssiError):
    """The input is bad: the error names the file, the place in it, what is wrong and how to fix it.

    The message is one printable line of bounded length, whatever the file and its name hold.

    Parameters
    ----------
    file : path of the offending file (or folder)
    place : where in it, e.g. ``"line 12"``, ``"[gps] sigma_m"``, ``""`` for the whole file
    problem : what is wrong
    fix : what the user can do about it

    Examples
    --------
    >>> try:
    ...     recording = sssi_exudyn.read_recording("monday")
    ... except sssi_exudyn.InputError as error:
    ...     print(error.file, error.place, error.fix)
    """

    def __init__(self, file: str | Path, place: str, problem: str, fix: str) -> None:
        self.file = str(file)
        self.place, self.problem, self.fix = one_line(place), one_line(problem, _LONGEST), one_line(fix, _LONGEST)
        where = one_line(self.file, _LONGEST) + (f": {self.place}" if self.place else "")
        super().__init__(f"{where}: {self.problem}; {self.fix}")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:  # so that it comes back whole from another process
        return type(self), (self.file, self.place, self.problem, self.fix)


class SimulationDiverged(SssiError):
    """The simulation stopped before its end.  ``partial`` keeps what was computed until then.

    Parameters
    ----------
    time : recording's clock at which the solver gave up (s)
    what : which quantity left its range, in words
    partial : the result up to ``time`` (a ``SimulationResult``), or None

    Examples
    --------
    >>> try:
    ...     result = sssi_exudyn.simulate("monday")
    ... except sssi_exudyn.SimulationDiverged as error:
    ...     print(error.time)
    """

    def __init__(self, time: float, what: str, partial: object = None) -> None:
        self.time, self.what, self.partial = time, what, partial
        super().__init__(f"the simulation diverged at {time:.3f} s: {what}")

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return type(self), (self.time, self.what, self.partial)
