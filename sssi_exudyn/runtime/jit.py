"""Numba's compiler where it works; without it, functions stay plain Python.

What it has compiled it keeps on disk.  A file there that cannot be read (a full disk, a power failure) is a miss.
"""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Callable, Iterator
from typing import Any, Final

from sssi_exudyn.runtime.compiling import compiling

FAULT = ""
"""Reason why there is no compiler; empty where there is one."""

try:
    import numba
    from numba import njit as _njit
except Exception as error:  # noqa: BLE001  a broken installation may raise anything, and simulating needs no Numba
    FAULT = f"{type(error).__name__}: {error}".splitlines()[0]


_FEW: Final = (100_000, 20, 20)
"""Thresholds of the garbage collector while a function is compiled: with the usual ones it looks often and finds
little, as what a compiler makes lives until it has ended."""


@contextlib.contextmanager
def _few_collections() -> Iterator[None]:
    usual = gc.get_threshold()
    gc.set_threshold(*_FEW)
    try:
        yield
    finally:
        gc.set_threshold(*usual)


class _ForgivingCache:
    """Numba's cache of one function, for which a damaged file is a miss; the function's entries are then made again."""

    def __init__(self, cache: Any) -> None:
        self._cache = cache

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled function, or None; it is then compiled."""
        kept = None
        try:
            kept = self._cache.load_overload(signature, context)
        except Exception:  # noqa: BLE001  a damaged pickle raises whatever its damage brings
            with contextlib.suppress(OSError):
                self._cache.flush()
        if kept is None:
            compiling()
        return kept


def njit(*given: Any, **options: Any) -> Any:
    """Return Numba's decorator, or one that leaves the function as it is; arguments are those of ``numba.njit``."""
    if FAULT:
        return given[0] if given else lambda function: function
    options["no_cfunc_wrapper"] = True  # C calls nothing but what ``compile_entry`` makes
    decorated = _njit(*given, **options)
    return (lambda function: _forgiving(decorated(function))) if options.get("cache") else decorated


def _forgiving(compiled: Any) -> Any:
    compiled._cache = _ForgivingCache(compiled._cache)
    compiled._compiler.compile = _few_collections()(compiled._compiler.compile)
    return compiled


def compile_entry(signature: Any, entry: Callable[..., None]) -> Any:
    """Return a function that C can call by its ``address``, kept on disk.  There must be a compiler."""
    decorate = numba.cfunc(signature, cache=True, error_model="numpy")
    try:
        with _few_collections():
            return decorate(entry)
    except Exception:  # noqa: BLE001  of a damaged file, or of the function itself, which is then raised again
        compiled: Any = numba.cfunc(signature, error_model="numpy")(entry)
        compiled.enable_caching()
        compiled._cache.flush()
        return compiled


inlined = njit(inline="always", error_model="numpy")
"""For what a compiled function calls in one place: on its own it would be compiled twice."""
