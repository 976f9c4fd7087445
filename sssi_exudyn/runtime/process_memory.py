"""Memory of processes that are the program's own: when it is looked through, and when the system has it back."""

from __future__ import annotations

import ctypes
import gc
import sys
from typing import Final

_YOUNG: Final = 10_000
"""New objects after which the collector looks through them; Python's usual number is 700."""
_MALLOPT: Final = {
    -8: 1,  # M_ARENA_MAX: one heap for all threads, of which each part serves the next array
    -1: 2**31 - 1,  # M_TRIM_THRESHOLD: nothing is given back before the process ends
    -2: 64 * 2**20,  # M_TOP_PAD: the heap grows by so many bytes at once
    -3: 32 * 2**20,  # M_MMAP_THRESHOLD, the largest there is: smaller arrays live on the heap
}
"""What glibc's ``mallopt`` is told, by the numbers of its ``malloc.h``."""


def prepare_memory() -> None:
    """Have this process spend little time on its memory, which ends with it."""
    collect_seldom()
    keep_freed_memory()


def collect_seldom() -> None:
    """Have the garbage collector look seldom: what libraries make as they load lives until the process ends.

    A command that starts, or writes a page with plots, computes a tenth less.
    """
    gc.set_threshold(_YOUNG)


def keep_freed_memory() -> None:
    """Have freed memory stay with the process, on Linux with glibc; elsewhere, and where its addresses are limited
    (``ulimit -v``), do nothing.

    Arrays of some megabytes come and go by the hundred.  Each time the system took their pages back and cleared others:
    a seventh of a fit's computing.
    """
    if not sys.platform.startswith("linux"):
        return
    import resource  # here: it is of Unix alone

    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)  # other C libraries have none
    if mallopt is not None:
        for option, value in _MALLOPT.items():
            mallopt(option, value)
