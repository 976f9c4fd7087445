"""Parallel work in this process: compiled loops and NumPy let other threads run meanwhile."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def cores_used(most: int | None = None) -> int:
    """Return the number of cores that work in parallel: ``most``, or all if None."""
    return most or os.cpu_count() or 1


def side_by_side(
    function: Callable[[Item], Result], items: Iterable[Item], *, cores: int | None = None
) -> list[Result]:
    """Return the results of ``function`` for each item, in the items' order, computed in parallel threads."""
    with ThreadPoolExecutor(cores_used(cores)) as pool:
        return list(pool.map(function, items))
