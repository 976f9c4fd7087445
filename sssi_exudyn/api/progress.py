"""Progress of a call, shown as its caller wants it."""

from __future__ import annotations

import sys

from sssi_exudyn.runtime.progress import Listener, Progress


def progress_of(wanted: bool | Listener | Progress) -> Progress:
    """Return the progress that the caller asked for: none, lines on stderr, or calls of a function."""
    if isinstance(wanted, Progress):
        return wanted
    if isinstance(wanted, bool):
        return Progress(sys.stderr if wanted else None)
    return Progress(listener=wanted)
