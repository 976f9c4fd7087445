"""A worker of sweeps within the process, for tests that are not about processes, which take seconds to start."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from sssi_exudyn.sweeps.workers.pools import Crew


@contextmanager
def thread_pool(_workers: int) -> Iterator[Crew]:
    """One thread, whatever number is asked for."""
    with ThreadPoolExecutor(1) as executor:
        yield Crew(executor, lambda: 1)
