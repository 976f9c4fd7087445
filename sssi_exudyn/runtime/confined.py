"""A process of its own for native libraries that read untrusted files, within bounds of memory and computing.

The parent sends requests to the process' stdin, and gets an answer to each from its stdout; both are bytes.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import IO, Final

from sssi_exudyn.runtime.posix import pages, posix_module

_PATIENCE: Final = 60
"""Maximum waiting time for an answer, s, on a machine that has other work too."""
_LENGTH: Final = 8
"""Bytes before a message that hold its length."""
_LONGEST: Final = 1_000_000_000
"""Maximum length of a message, bytes: a process that has been taken over may promise any."""


@dataclass(frozen=True)
class Confined:
    """A running process, as ``confined`` starts it."""

    process: subprocess.Popen[bytes]

    def ask(self, request: bytes) -> bytes:
        """Return the answer to ``request``.  Raises OSError where the process died, or did not answer in time."""
        writing, reading = self.process.stdin, self.process.stdout
        assert writing is not None
        assert reading is not None
        timer = Timer(_PATIENCE, self.process.kill)
        timer.start()
        try:
            _send(writing, request)
            return _receive(reading)
        finally:
            timer.cancel()


@contextmanager
def confined(module: str, file: Path, environment: Mapping[str, str]) -> Iterator[Confined]:
    """Start ``module``, which calls ``serve``, as a program, and end it after the block.

    Parameters
    ----------
    file : what it reads, its argument
    environment : variables that it has besides this process' own
    """
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        [sys.executable, "-m", module, str(file.absolute())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"} | dict(environment),
    ) as process:
        try:
            yield Confined(process)
        finally:
            process.kill()


def serve(answer: Callable[[bytes], bytes], memory: int, seconds: int) -> None:
    """Answer requests until the parent has no more; the process ends at an error.

    Parameters
    ----------
    memory : maximum address space, bytes, beyond what the process has now
    seconds : maximum computing time of all answers, s
    """
    reading, writing = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # libraries may print
    _limit(memory, seconds)
    while True:
        try:
            request = _receive(reading)
        except OSError:
            return
        _send(writing, answer(request))


def _limit(memory: int, seconds: int) -> None:
    """Bound this process's memory and time as far as the system can; the parent's patience bounds the rest."""
    resource, used = posix_module("resource"), pages()
    if resource is None:
        return
    bounds = {resource.RLIMIT_CPU: seconds, resource.RLIMIT_CORE: 0}
    if used is not None:
        bounds[resource.RLIMIT_AS] = used[0] + memory
    for kind, most in bounds.items():
        _, hard = resource.getrlimit(kind)  # which the user may have set lower
        least = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (least, least))


def _send(stream: IO[bytes], message: bytes) -> None:
    stream.write(len(message).to_bytes(_LENGTH, "little") + message)
    stream.flush()


def _receive(stream: IO[bytes]) -> bytes:
    """Read one message.  Raises OSError where the stream ends before it, or it is longer than any."""
    length = int.from_bytes(_read(stream, _LENGTH), "little")
    if length > _LONGEST:
        raise OSError("a message longer than any")
    return _read(stream, length)


def _read(stream: IO[bytes], count: int) -> bytes:
    content = stream.read(count)
    if len(content) < count:
        raise OSError("the stream ended")
    return content
