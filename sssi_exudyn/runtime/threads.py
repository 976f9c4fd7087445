"""Parallel work in this process: compiled loops and NumPy let other threads run meanwhile."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import wraps
from typing import Final, ParamSpec, TypeVar

LINEAR_ALGEBRA: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment that say how many threads a product of matrices takes."""

First = TypeVar("First")
Second = TypeVar("Second")
Item = TypeVar("Item")
Result = TypeVar("Result")
P = ParamSpec("P")


def use_one_thread_for_products() -> None:
    """Have products of matrices take one thread each, unless the environment says otherwise.

    The program's own threads use the cores.  More for each product waited for each other: a fit took half as much
    computing again.  After NumPy is imported its library has read them, and ``with_one_thread_for_products`` does it.
    """
    if "numpy" in sys.modules:
        return
    for name in LINEAR_ALGEBRA:
        os.environ.setdefault(name, "1")


def with_one_thread_for_products(function: Callable[P, Result]) -> Callable[P, Result]:
    """Return the function with products of matrices that take one thread each, unless the environment says otherwise.

    It is for sessions in which NumPy may be at work already; afterwards products take as many threads as before.
    """

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> Result:
        if any(name in os.environ for name in LINEAR_ALGEBRA):
            return function(*args, **kwargs)
        import scipy.linalg  # noqa: F401  with NumPy's library, whose threads can only be limited once both are loaded
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return function(*args, **kwargs)

    return call


def cores_used(most: int | None = None) -> int:
    """Return the number of cores that work in parallel: ``most``, or all that this process may use if None.

    Schedulers of clusters and containers give a process some of a machine's cores; macOS and Windows do not say so.
    """
    if most:
        return most
    all_cores = os.cpu_count() or 1
    return min(all_cores, len(os.sched_getaffinity(0))) if hasattr(os, "sched_getaffinity") else all_cores


def side_by_side(
    function: Callable[[Item], Result], items: Iterable[Item], *, cores: int | None = None
) -> list[Result]:
    """Return the results of ``function`` for each item, in the items' order, computed in parallel threads."""
    listed = list(items)
    if len(listed) < 2:
        return [function(item) for item in listed]
    with ThreadPoolExecutor(cores_used(cores)) as pool:
        return list(pool.map(function, listed))


def both(first: Callable[[], First], second: Callable[[], Second]) -> tuple[First, Second]:
    """Return the results of two functions, computed in parallel threads."""
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(first)
        result = second()
        return waiting.result(), result


def one_ahead(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield the results of ``function``, one item after the other; while one is used, the next is computed."""
    with ThreadPoolExecutor(1) as pool:
        waiting = None
        for item in items:
            following = pool.submit(function, item)
            if waiting is not None:
                yield waiting.result()
            waiting = following
        if waiting is not None:
            yield waiting.result()
