"""The commands of ``sssi`` as functions from folder to folder; each is loaded when it is first used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssi_exudyn.commands.catalogue import identify, terms
    from sssi_exudyn.commands.diagnosis import benchmark, diagnose, diagnose_day, diagnose_known, semi_real
    from sssi_exudyn.commands.examples import example
    from sssi_exudyn.commands.muscles_command import muscles, muscles_list
    from sssi_exudyn.commands.recordings import import_files, import_folder, inspect, terrain
    from sssi_exudyn.commands.runs import fit, report, run, simulate, validate
    from sssi_exudyn.commands.ski_turn import turn

__all__ = [
    "benchmark",
    "diagnose",
    "diagnose_day",
    "diagnose_known",
    "example",
    "fit",
    "identify",
    "import_files",
    "import_folder",
    "inspect",
    "muscles",
    "muscles_list",
    "report",
    "run",
    "semi_real",
    "simulate",
    "terms",
    "terrain",
    "turn",
    "validate",
]
_MODULES = {
    "catalogue": ("identify", "terms"),
    "diagnosis": ("benchmark", "diagnose", "diagnose_day", "diagnose_known", "semi_real"),
    "examples": ("example",),
    "muscles_command": ("muscles", "muscles_list"),
    "recordings": ("import_files", "import_folder", "inspect", "terrain"),
    "ski_turn": ("turn",),
    "runs": ("fit", "report", "run", "simulate", "validate"),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
