"""A worker of sweeps within the process.

It serves tests that are not about processes, since these take seconds to start.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from sssi_exudyn.sweeps.workers.pools import Crew


@contextmanager
def thread_pool(_workers: int) -> Iterator[Crew]:
    """Provide one thread, whatever number is requested."""
    with ThreadPoolExecutor(1) as executor:
        yield Crew(executor, lambda: 1)
