"""A template of a kernel that sums the force of snow over contact points, for tests of compiled terms."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

_TEXT = """
from __future__ import annotations

from collections.abc import Callable

from numba import njit

point_force: Callable[..., float]


@njit(cache=True, error_model="numpy")
def load(parameters, depth, rate, length):
    total = 0.0
    for i in range(depth.shape[0]):
        total += point_force(parameters, depth[i], rate[i], length)
    return total
"""


def kernel_template(folder: Path) -> ModuleType:
    """Write the template into a folder and load it from there."""
    path = folder / "load_template.py"
    path.write_text(_TEXT, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("load_template", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
