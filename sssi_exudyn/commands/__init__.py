"""The work behind the commands of ``sssi``, from folder to folder; each part is loaded when it is first used.

The options of a command stand in the signature of its function in ``api``; what is here takes paths, recordings and
models.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssi_exudyn.commands.catalogue import data_dictionary, hypotheses, identify, terms
    from sssi_exudyn.commands.diagnosis import diagnose_day, diagnose_known
    from sssi_exudyn.commands.examples import example
    from sssi_exudyn.commands.pages import report, validate
    from sssi_exudyn.commands.recordings import inspect, terrain

__all__ = [
    "data_dictionary",
    "diagnose_day",
    "diagnose_known",
    "example",
    "hypotheses",
    "identify",
    "inspect",
    "report",
    "terms",
    "terrain",
    "validate",
]
_MODULES = {
    "catalogue": ("data_dictionary", "hypotheses", "identify", "terms"),
    "diagnosis": ("diagnose_day", "diagnose_known"),
    "examples": ("example",),
    "recordings": ("inspect", "terrain"),
    "pages": ("report", "validate"),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
