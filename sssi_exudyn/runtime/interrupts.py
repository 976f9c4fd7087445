"""Ctrl-C while a process starts.  Imports of libraries turn an interrupt into whatever error they raise."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

INTERRUPTED: Final = 130
"""Exit status after an interrupt: 128 and the signal's number, as shells have it."""


@contextmanager
def end_on_interrupt() -> Iterator[None]:
    """End the process at once with one line on an interrupt within; there is nothing to clean up yet.

    It has no effect where interrupts are ignored or handled otherwise, and in other threads than the first.
    """
    first = threading.current_thread() is threading.main_thread()
    if not first or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _end)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(_number: int, _frame: object) -> None:
    try:
        os.write(2, b"sssi: interrupted; resume with the same command\n")
    finally:
        os._exit(INTERRUPTED)
