"""Functions that only some operating systems have; on the others they are None, and their users have a substitute.

``SSSI_WITHOUT_POSIX`` in the environment takes it away here too, so that the substitutes are tested on any system.
"""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from types import ModuleType
from typing import Any, Final

_FORCED: Final = "SSSI_WITHOUT_POSIX"
_STATM: Final = Path("/proc/self/statm")


def posix_module(name: str) -> Any | None:
    """Return the module ``fcntl`` or ``resource``; None where the system has none."""
    if os.environ.get(_FORCED):
        return None
    try:
        module: ModuleType = importlib.import_module(name)
    except ImportError:
        return None
    return module


def pages() -> tuple[int, int] | None:
    """Return this process's bytes of address space and of memory; None where the system does not show them."""
    resource = posix_module("resource")
    if resource is None or not _STATM.exists():
        return None
    size, resident = _STATM.read_text(encoding="ascii").split()[:2]
    return int(size) * resource.getpagesize(), int(resident) * resource.getpagesize()
