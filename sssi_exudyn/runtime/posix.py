"""What only some operating systems have: everywhere else it is None, and its users have a counterpart.

``SSSI_WITHOUT_POSIX`` in the environment takes it away here too, so that the counterparts are tested on any system.
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
    """The module ``fcntl`` or ``resource``; None where the system has none."""
    if os.environ.get(_FORCED):
        return None
    try:
        module: ModuleType = importlib.import_module(name)
    except ImportError:
        return None
    return module


def pages() -> tuple[int, int] | None:
    """Bytes of address space and of memory that this process has now; None where only the system knows."""
    resource = posix_module("resource")
    if resource is None or not _STATM.exists():
        return None
    size, resident = _STATM.read_text(encoding="ascii").split()[:2]
    return int(size) * resource.getpagesize(), int(resident) * resource.getpagesize()
