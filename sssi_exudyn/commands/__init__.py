"""The commands of ``sssi`` as functions from folder to folder."""

from sssi_exudyn.commands.catalogue import identify, terms
from sssi_exudyn.commands.diagnosis import benchmark, diagnose, diagnose_day, diagnose_known
from sssi_exudyn.commands.muscles import muscles, muscles_list
from sssi_exudyn.commands.recordings import import_files, inspect
from sssi_exudyn.commands.runs import fit, report, run, simulate, validate

__all__ = [
    "benchmark",
    "diagnose",
    "diagnose_day",
    "diagnose_known",
    "fit",
    "identify",
    "import_files",
    "inspect",
    "muscles",
    "muscles_list",
    "report",
    "run",
    "simulate",
    "terms",
    "validate",
]
