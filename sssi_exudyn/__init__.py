"""Skier, ski and snow: from a recorded run to forces, friction and joint moments.

The functions take recordings, models and results as objects or as their folders::

    import sssi_exudyn

    result = sssi_exudyn.run("examples/beginner", "results/beginner")
    print(result.friction.mu_t.value)
    result.plot_track()

Importing the package is quick and starts no solver: what a function needs is loaded when it is called.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from sssi_exudyn.api.catalogue import data_dictionary, hypotheses, identify, terms, turn, use_plugin
from sssi_exudyn.api.diagnosis import diagnose, diagnose_day
from sssi_exudyn.api.muscles import muscles
from sssi_exudyn.api.recordings import example, import_day, import_files, inspect, read_recording
from sssi_exudyn.api.results import load, report
from sssi_exudyn.api.runs import build, fit, model_of, read_model, run, simulate, validate
from sssi_exudyn.api.season import load_season, run_season
from sssi_exudyn.api.sweeps import load_sweep, sweep
from sssi_exudyn.api.whatif import whatif

if TYPE_CHECKING:
    from sssi_exudyn.api.exudyn_model import ExudynModel
    from sssi_exudyn.api.result import Result
    from sssi_exudyn.api.season_result import SeasonResult
    from sssi_exudyn.api.sweep_result import SweepResult
    from sssi_exudyn.bodies.ski.identification import IdentifiedSki
    from sssi_exudyn.bodies.ski.ski import Ski
    from sssi_exudyn.contact.conformance import check_term
    from sssi_exudyn.contact.term import BodyTerm, FootTerm, PointTerm, SegmentTerm, TerrainTerm, WindTerm
    from sssi_exudyn.core.errors import InputError, SimulationDiverged, SssiError
    from sssi_exudyn.core.quantity import quantity
    from sssi_exudyn.importing.answers import Answers
    from sssi_exudyn.importing.motion_capture.motion_formats import MotionReader
    from sssi_exudyn.model.model import Model
    from sssi_exudyn.recording.instruments.gps import FixReader
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.results.summary import Summary
    from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
    from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import SteadyLaw

__all__ = [
    "Answers",
    "BodyTerm",
    "Diagnosis",
    "ExudynModel",
    "FixReader",
    "FootTerm",
    "IdentifiedSki",
    "InputError",
    "Model",
    "MotionReader",
    "PointTerm",
    "Recording",
    "Result",
    "SeasonResult",
    "SegmentTerm",
    "SimulationDiverged",
    "Ski",
    "SssiError",
    "SteadyLaw",
    "Summary",
    "SweepResult",
    "TerrainTerm",
    "WindTerm",
    "build",
    "check_term",
    "data_dictionary",
    "diagnose",
    "diagnose_day",
    "example",
    "fit",
    "hypotheses",
    "identify",
    "import_day",
    "import_files",
    "inspect",
    "load",
    "load_season",
    "load_sweep",
    "model_of",
    "muscles",
    "quantity",
    "read_model",
    "read_recording",
    "report",
    "run",
    "run_season",
    "simulate",
    "sweep",
    "terms",
    "turn",
    "use_plugin",
    "validate",
    "whatif",
]
_ELSEWHERE: Final = {
    "Answers": "importing.answers",
    "BodyTerm": "contact.term",
    "Diagnosis": "validation.diagnosis.diagnosis_data",
    "ExudynModel": "api.exudyn_model",
    "FixReader": "recording.instruments.gps",
    "FootTerm": "contact.term",
    "IdentifiedSki": "bodies.ski.identification",
    "InputError": "core.errors",
    "Model": "model.model",
    "MotionReader": "importing.motion_capture.motion_formats",
    "PointTerm": "contact.term",
    "Recording": "recording.recording",
    "Result": "api.result",
    "SeasonResult": "api.season_result",
    "SegmentTerm": "contact.term",
    "SimulationDiverged": "core.errors",
    "Ski": "bodies.ski.ski",
    "SssiError": "core.errors",
    "SteadyLaw": "validation.diagnosis.hypotheses.hypothesis",
    "Summary": "results.summary",
    "SweepResult": "api.sweep_result",
    "TerrainTerm": "contact.term",
    "WindTerm": "contact.term",
    "check_term": "contact.conformance",
    "quantity": "core.quantity",
}
"""Modules of what is loaded when it is first asked for, since it needs NumPy, pandas or SciPy."""


def __getattr__(name: str) -> Any:
    if name in _ELSEWHERE:
        value = getattr(import_module(f"{__name__}.{_ELSEWHERE[name]}"), name)
    elif name == "__version__":
        value = import_module("importlib.metadata").version("sssi-exudyn")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names that ``help()`` shows, the classes that are not loaded yet included."""
    return [*__all__, *("__all__", "__doc__", "__file__", "__name__", "__path__", "__version__")]
