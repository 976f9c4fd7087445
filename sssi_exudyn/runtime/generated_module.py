"""Modules of generated code, run from files that Python's import knows nothing of."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def run_module(name: str, path: Path) -> ModuleType:
    """Run the file as the module ``name``.  Its byte code on disk, where it is damaged, is made again."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (EOFError, ValueError, TypeError):  # of truncated byte code
        Path(importlib.util.cache_from_source(str(path))).unlink(missing_ok=True)
        spec.loader.exec_module(module)
    return module
