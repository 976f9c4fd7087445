"""Numba's compiler where it is installed; without it functions stay what they are, Python."""

from __future__ import annotations

from typing import Any

njit: Any
"""Numba's decorator, or one that leaves the function as it is."""

try:
    from numba import njit
except ImportError:

    def njit(*given: Any, **_options: Any) -> Any:
        return given[0] if given else lambda function: function

    COMPILES = False
else:
    COMPILES = True
