"""Libraries that only some formats or commands need; they are imported when they are needed."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

from sssi_exudyn.core.errors import InputError, SssiError


def library(name: str, path: Path) -> ModuleType:
    """Import the module ``name``, which reads files like ``path``; raises InputError where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            path, "", f"files {path.suffix} need the library {name}", "pip install 'sssi-exudyn[import]'"
        ) from None


def import_for(what: str, name: str, extra: str) -> ModuleType:
    """Import the module ``name``, which ``what`` needs; raises SssiError where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        package = name.partition(".")[0]
        raise SssiError(f"{what} needs the library {package}: pip install 'sssi-exudyn[{extra}]'") from None
