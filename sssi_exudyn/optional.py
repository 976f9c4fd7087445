"""Libraries that only some formats need: asked for when such a file comes."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

from sssi_exudyn.errors import InputError


def library(name: str, path: Path) -> ModuleType:
    """The module ``name``, which reads files like ``path``; raises InputError where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            path, "", f"files {path.suffix} need the library {name}", "pip install 'sssi-exudyn[import]'"
        ) from None
