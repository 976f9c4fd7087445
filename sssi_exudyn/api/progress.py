"""How far a call is, as its caller wants to know it."""

from __future__ import annotations

import sys

from sssi_exudyn.runtime.progress import Listener, Progress


def progress_of(wanted: bool | Listener) -> Progress:
    """The progress for what the caller gave: nothing, lines on stderr, or calls of a function."""
    if isinstance(wanted, bool):
        return Progress(sys.stderr if wanted else None)
    return Progress(listener=wanted)
