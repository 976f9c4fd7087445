"""Progress of long steps on stderr, so that stdout holds only results.

On a terminal the line of the running stage is rewritten in place.  Elsewhere (a log, a pipe) a line is written every
half minute: the stage, how much is done, the time left; and one at its end.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final, TextIO

from sssi_exudyn.runtime.compiling import when_compiling

_REWRITE_EVERY: Final = 0.2
"""Time between rewritings on a terminal, s; an eye follows no faster."""
LOG_EVERY: Final = 30.0
"""Time between lines of a log, s."""
_VERBOSE_EVERY: Final = 1.0
"""Time between lines in verbose mode, s."""
_LEAST_SHARE: Final = 0.02
"""Share of a stage from which its speed predicts the time left."""
_LONG: Final = 10.0
"""Duration from which a stage announces its beginning, s."""
_COMPILING: Final = "compiling the force laws, once for each set of laws on this computer: a minute or two"
_CLEAR_LINE = "\r\x1b[K"
Listener = Callable[[str, float | None, str], None]
"""Function called with a stage's name, the share done in [0, 1] (None where unknown) and a detail such as the error."""


@dataclass
class Stage:
    """One long step.  Its work calls ``advance`` as often as it likes.

    expected : rough duration, s; None where it is unknown
    verbose : whether a line is written, not rewritten, every second
    """

    name: str
    stream: TextIO | None
    clock: Callable[[], float]
    listener: Listener | None = None
    expected: float | None = None
    verbose: bool = False
    detail: str = ""
    fraction: float | None = None
    _compiles: bool = field(init=False, default=False)
    _compiled: bool = field(init=False, default=False)
    _counted: tuple[float, float] = field(init=False, default=(0.0, 0.0))
    _begin: float = field(init=False)
    _shared: float = field(init=False, default=0.0)
    _written: float = field(init=False, default=-float("inf"))

    def __post_init__(self) -> None:
        self._begin = self.clock()
        if self.expected is not None and self.expected >= _LONG and not self._rewrites:
            self._write(f"{self.name}: begins, {about(self.expected)}\n")

    @property
    def _rewrites(self) -> bool:
        return self.stream is not None and self.stream.isatty() and not self.verbose

    def advance(self, fraction: float | None, detail: str = "") -> None:
        """Report how far the stage is.

        Parameters
        ----------
        fraction : share done in [0, 1]; None where there is no news of it
        detail : a text such as the current error, with its unit
        """
        self.detail = detail
        if fraction is not None and fraction != self.fraction:
            now = self.clock() - self._begin
            if not self._compiles:  # what the compiler takes says nothing of the rest
                self._counted = (
                    self._counted[0] + now - self._shared,
                    self._counted[1] + fraction - (self.fraction or 0.0),
                )
            self.fraction, self._shared, self._compiles = fraction, now, False
        if self.listener is not None:
            self.listener(self.name, fraction, detail)
        if self.stream is None or not (self._rewrites or self.verbose):
            return
        if self.clock() - self._written >= (_VERBOSE_EVERY if self.verbose else _REWRITE_EVERY):
            self.write()

    def compile(self) -> None:
        """Report once that the work waits for the compiler."""
        self._compiles = True
        if self._compiled:
            return
        self._compiled = True
        self.advance(None, _COMPILING)
        if self.stream is not None and not self._rewrites:
            self._write(f"{self.name}: {_COMPILING}\n")

    def write(self) -> None:
        """Write how far the stage is."""
        if self.stream is None:
            return
        self._written = self.clock()
        since = self._written - self._begin
        share = "" if self.fraction is None else f" {100.0 * self.fraction:3.0f} %"
        left = self._left(since)
        if self._rewrites:
            self._write(f"{_CLEAR_LINE}{self.name}{share} {self.detail}{left and f' ({left})'}".rstrip())
        else:
            detail = self.detail and f" ({self.detail})"
            self._write(f"{self.name}:{share} after {duration(since)}{left and f', {left}'}{detail}\n")

    def _left(self, since: float) -> str:
        """Return the time left in words; "" where it cannot be predicted."""
        long, (counted, share) = max(since, self.expected or 0.0) >= _LONG, self._counted
        whole = self.expected
        if self.fraction is not None and share >= _LEAST_SHARE:
            whole = self._shared + (1.0 - self.fraction) * counted / share
        return f"{about(whole - since)} left" if whole is not None and long and since < whole else ""

    def end(self, word: str) -> None:
        """Write the stage's last line: its name, ``word``, how long it took and the last detail."""
        if self.stream is None:
            return
        detail = f" ({self.detail})" if self.detail else ""
        clear = _CLEAR_LINE if self._rewrites else ""
        self._write(f"{clear}{self.name}: {word} after {self.clock() - self._begin:.1f} s{detail}\n")

    def _write(self, text: str) -> None:
        assert self.stream is not None
        self.stream.write(text)
        self.stream.flush()


@dataclass(frozen=True)
class Progress:
    """A writer of stages to ``stream`` that also calls ``listener``; where both are None it is silent."""

    stream: TextIO | None = None
    clock: Callable[[], float] = time.monotonic
    listener: Listener | None = None
    verbose: bool = False

    @contextmanager
    def stage(self, name: str, expected: float | None = None) -> Iterator[Stage]:
        """Run one stage, which takes about ``expected`` s.  An error or an interrupt ends it with "stopped"."""
        shown = None if self.stream is None else expected
        stage = Stage(name, self.stream, self.clock, self.listener, shown, self.verbose)
        stage.advance(None)
        with _written_regularly(stage), when_compiling(stage.compile):
            try:
                yield stage
            except BaseException:
                stage.end("stopped")
                raise
            stage.end("done")


@contextmanager
def _written_regularly(stage: Stage) -> Iterator[None]:
    """Write a line every half minute where none is rewritten, also while the work is silent (one long compilation)."""
    if stage.stream is None or stage.stream.isatty():
        yield
        return
    ended = threading.Event()

    def write() -> None:
        while not ended.wait(LOG_EVERY):
            try:
                stage.write()
            except (OSError, ValueError):  # the reader of stderr has gone, or it is closed
                return

    threading.Thread(target=write, daemon=True).start()
    try:
        yield
    finally:
        ended.set()


def progress_on_stderr(*, quiet: bool = False, verbose: bool = False) -> Progress:
    """Return the progress that the command line shows."""
    return Progress(None if quiet else sys.stderr, verbose=verbose)


def duration(seconds: float) -> str:
    """Return a time in words, to the second below an hour."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"


def about(seconds: float) -> str:
    """Return a roughly known time in words."""
    if seconds < 90.0:
        return f"about {10 * max(1, round(seconds / 10.0))} s"
    return f"about {round(seconds / 60.0)} min" if seconds < 5400.0 else f"about {seconds / 3600.0:.1f} h"
