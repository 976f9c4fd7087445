"""How long work reports its progress: ``advance(share, detail)``, as often as it likes."""

from __future__ import annotations

from collections.abc import Callable

Advance = Callable[[float | None, str], None]
"""Function called with the share done in [0, 1] (None where there is no news of it) and a detail such as the error."""


def silent(_share: float | None, _detail: str) -> None:
    """Report nothing."""


def part_of(advance: Advance, begin: float, end: float) -> Advance:
    """Return what a part of the work calls: its share goes from ``begin`` to ``end`` of the whole."""
    return lambda share, detail: advance(None if share is None else begin + share * (end - begin), detail)
