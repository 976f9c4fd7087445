"""Progress of long steps: one line a stage on stderr, so that stdout stays a result.

On a terminal the line of the running stage is rewritten in place; elsewhere (a log, a pipe) only its end is written.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TextIO

_REWRITE_EVERY = 0.2
"""s; a terminal need not be written more often than an eye follows."""
_CLEAR_LINE = "\r\x1b[K"
Listener = Callable[[str, float | None, str], None]
"""Called with a stage's name, the share done in [0, 1] (None where it is not known) and a detail such as the error."""


@dataclass
class Stage:
    """One long step.  Its work calls ``advance`` as often as it likes."""

    name: str
    stream: TextIO | None
    clock: Callable[[], float]
    listener: Listener | None = None
    detail: str = ""
    _begin: float = field(init=False)
    _written: float = field(init=False, default=-float("inf"))

    def __post_init__(self) -> None:
        self._begin = self.clock()

    def advance(self, fraction: float | None, detail: str = "") -> None:
        """Report how far it is.

        Parameters
        ----------
        fraction : share done in [0, 1]; None where it cannot be known
        detail : such as the current error, with its unit
        """
        self.detail = detail
        if self.listener is not None:
            self.listener(self.name, fraction, detail)
        if self.stream is None or not self.stream.isatty() or self.clock() - self._written < _REWRITE_EVERY:
            return
        self._written = self.clock()
        share = "" if fraction is None else f" {100.0 * fraction:3.0f} %"
        self.stream.write(f"{_CLEAR_LINE}{self.name}{share} {detail}".rstrip())
        self.stream.flush()

    def end(self, word: str) -> None:
        """Write the stage's last line: its name, ``word``, how long it took and the last detail."""
        if self.stream is None:
            return
        detail = f" ({self.detail})" if self.detail else ""
        clear = _CLEAR_LINE if self.stream.isatty() else ""
        self.stream.write(f"{clear}{self.name}: {word} after {self.clock() - self._begin:.1f} s{detail}\n")
        self.stream.flush()


@dataclass(frozen=True)
class Progress:
    """Writes stages to ``stream`` and calls ``listener``; where both are None it is silent."""

    stream: TextIO | None = None
    clock: Callable[[], float] = time.monotonic
    listener: Listener | None = None

    @contextmanager
    def stage(self, name: str) -> Iterator[Stage]:
        """One stage; left by an error or an interrupt it ends with "stopped"."""
        stage = Stage(name, self.stream, self.clock, self.listener)
        stage.advance(None)
        try:
            yield stage
        except BaseException:
            stage.end("stopped")
            raise
        stage.end("done")


def progress_on_stderr() -> Progress:
    """The progress that the command line shows."""
    return Progress(sys.stderr)
