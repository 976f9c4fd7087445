"""Numba's compiler where it works; without it, functions stay plain Python."""

from __future__ import annotations

from typing import Any

njit: Any
"""Numba's decorator, or one that leaves the function as it is."""
FAULT = ""
"""Reason why there is no compiler; empty where there is one."""

try:
    from numba import njit
except Exception as error:  # noqa: BLE001  a broken installation may raise anything, and simulating needs no Numba
    FAULT = f"{type(error).__name__}: {error}".splitlines()[0]

    def njit(*given: Any, **_options: Any) -> Any:
        return given[0] if given else lambda function: function


inlined = njit(inline="always", error_model="numpy")
"""For what a compiled function calls in one place: on its own it would be compiled twice."""
