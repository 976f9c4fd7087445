"""Word that a function is about to be compiled, for what shows progress; it loads no compiler."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

_LISTENERS: Final[list[Callable[[], None]]] = []


def compiling() -> None:
    """Say that a function is compiled now, because the disk does not hold it."""
    for listener in tuple(_LISTENERS):
        listener()


@contextmanager
def when_compiling(listener: Callable[[], None]) -> Iterator[None]:
    """Call ``listener`` whenever a function is compiled."""
    _LISTENERS.append(listener)
    try:
        yield
    finally:
        _LISTENERS.remove(listener)
