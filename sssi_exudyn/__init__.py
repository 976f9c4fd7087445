"""Skier, ski and snow: from a recorded run to forces, friction and joint moments.

The commands of ``sssi`` as functions: ``inspect``, ``simulate``, ``fit``, ``diagnose``, ``validate``, ``run``,
``sweep`` and ``terms``.  Those that write a result return its ``Summary``.  They are loaded when first used, so that
importing the package is quick and starts no solver.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssi_exudyn.commands.catalogue import terms
    from sssi_exudyn.commands.diagnosis import diagnose
    from sssi_exudyn.commands.recordings import inspect
    from sssi_exudyn.commands.runs import fit, run, simulate, validate
    from sssi_exudyn.sweeps.sweep import sweep

__all__ = ["diagnose", "fit", "inspect", "run", "simulate", "sweep", "terms", "validate"]


def __getattr__(name: str) -> Any:
    if name == "sweep":
        return import_module("sssi_exudyn.sweeps.sweep").sweep
    if name in __all__:
        return getattr(import_module("sssi_exudyn.commands"), name)
    if name == "__version__":
        return import_module("importlib.metadata").version("sssi-exudyn")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
