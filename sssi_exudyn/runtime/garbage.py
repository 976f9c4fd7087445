"""The garbage collector of processes that are the program's own."""

from __future__ import annotations

import gc
from typing import Final

_YOUNG: Final = 10_000
"""New objects after which the collector looks through them; Python's usual number is 700."""


def collect_seldom() -> None:
    """Have the garbage collector look seldom in this process: what libraries make as they load lives until its end.

    A command that starts, or writes a page with plots, computes a tenth less.
    """
    gc.set_threshold(_YOUNG)
