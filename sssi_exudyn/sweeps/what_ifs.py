"""What-ifs of a sweep: the recorded runs that they ask about, and the figures of an answer."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.contact.registry import known_terms
from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.io.files import sha256
from sssi_exudyn.motion.correction_file import FILE as POSTURE
from sssi_exudyn.results.folder import MODEL, SERIES, SKELETON, SUMMARY
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.runtime.cache import fingerprint
from sssi_exudyn.sweeps.asked_model import askable, change_model, check_gates, check_steering, gates_of
from sssi_exudyn.sweeps.file import SweepFile
from sssi_exudyn.sweeps.outputs import Column, Figures, complete
from sssi_exudyn.sweeps.parameters import SKIS, Parameter, Values
from sssi_exudyn.terrain.file import FILE as SURFACE
from sssi_exudyn.what_if.answer import departures, last_passed, off_path, reasons_of, seconds_lost
from sssi_exudyn.what_if.corrections import EDGING, FORE_AFT, HEADING, LEAN, PLOUGH, STEERING
from sssi_exudyn.what_if.fastest import solutions
from sssi_exudyn.what_if.intent import STRICT_PATH_SIGMA
from sssi_exudyn.what_if.limits import imbalance, run_figures
from sssi_exudyn.what_if.question import Question
from sssi_exudyn.what_if.recorded_run import RecordedRun, recorded_run
from sssi_exudyn.what_if.solve import Solution

_NEEDED: Final = (SUMMARY, MODEL, SERIES, SKELETON)
_KEPT: Final = 4
"""Number of recorded runs kept for the next questions."""
COLUMNS: Final = (
    Column("seconds_lost_s", "s", "at the last place of the recorded run that the asked one comes to; below 0 won"),
    Column("compared_until_s", "s", "instant of the recorded run at that place"),
    Column("strict_seconds_lost_s", "s", f"of a skier who keeps the path to {STRICT_PATH_SIGMA:g} m"),
    Column("skiable", "1", "1 where the answer is within a skier's limits, 0 where it is not skiable like this"),
    Column("off_path_largest_m", "m", "largest distance from the recorded path"),
    *(
        Column(f"max_{part.name}_{part.in_files[0]}", part.in_files[0], f"largest size of the {part.meaning}")
        for part in (LEAN, FORE_AFT, STEERING, EDGING, PLOUGH, HEADING)
    ),
    Column("mean_speed_mps", "m/s", "of the centre of mass, over time"),
    Column("max_force_bodyweights", "1", "largest normal force on both skis, in body weights"),
    Column("max_knee_extension_Nm_per_kg", "N m/kg", "largest moment that stretches a knee"),
    Column("max_imbalance_Nm", "N m", "largest departure from the recorded run's balance, over 0.33 s"),
    Column("residual_moment_rms_Nm", "N m", "of the residual moment at the pelvis"),
    Column("friction_work_J", "J", "work of the snow's friction on the feet"),
)
USUAL: Final = ("seconds_lost_s", "skiable", "max_lean_deg", "max_steering_deg")


def declared_numbers() -> dict[str, Parameter]:
    """Return the numbers that a sweep of what-ifs may vary, whatever laws its recorded runs have."""
    return askable([cls() for cls in known_terms()])


def result_hashes(folder: Path) -> dict[str, str]:
    """Return the hashes of a result's files that a what-if rests on, by name.

    Raises InputError for a folder that is no result.
    """
    for name in _NEEDED:
        if not (folder / name).is_file():
            fix = "give the folder of a result of sssi fit or sssi run"
            raise InputError(folder, name, "what-ifs ask about results, and this folder is none", fix)
    return {name: sha256(folder / name) for name in (*_NEEDED, POSTURE, SURFACE) if (folder / name).is_file()}


def check_numbers(file: SweepFile, names: tuple[str, ...]) -> None:
    """Raise InputError for a result that no what-if can be asked of, and for a number that its model lacks."""
    check_gates(names, file.keep, file.path, "keep")
    for folder in file.folders:
        recorded = recorded_run(read_run(folder), folder)
        check_steering(recorded, file.keep, file.path, "keep")
        known = askable(recorded.model.terms)
        for name in names:
            if name not in known and name != SKIS:
                problem = f"the model in {folder.name} has no number {name!r}"
                raise InputError(file.path, "[[parameter]] name", problem, did_you_mean(name, known))


def answer_figures(folder: str, digest: str, values: Values, keep: Keep, duration: float | None) -> Figures:
    """Return the figures of a what-if.  Raises SimulationDiverged where the recorded movement cannot be played.

    values : changed numbers in the units of files, and another ski's name under ``SKIS``
    duration : s of the recorded run from its start, None for all of it
    """
    recorded = _recorded(folder, digest)
    if duration is not None:
        recorded = recorded.until(recorded.motion.start + duration)
    changes = {name: float(value) for name, value in values.items() if name != SKIS}
    ski = values.get(SKIS)
    asked = change_model(recorded.model, changes, None if ski is None else str(ski))
    question = Question(recorded, asked, keep, gates_of(changes))
    return _figures(*solutions(question))


def _figures(solution: Solution, strict: Solution | None) -> Figures:
    question, played = solution.question, solution.played
    lost, figures = seconds_lost(question, played), run_figures(played)
    last = last_passed(lost)
    values = {
        "seconds_lost_s": float(lost[last]),
        "compared_until_s": float(question.samples[last]),
        "skiable": float(not reasons_of(solution)),
        "off_path_largest_m": float(np.max(np.abs(off_path(question, played)))),
        "mean_speed_mps": figures.mean_speed_mps,
        "max_force_bodyweights": figures.peak_force_bodyweights,
        "max_knee_extension_Nm_per_kg": figures.peak_knee_extension_Nm_per_kg,
        "max_imbalance_Nm": imbalance(question, played).moment_Nm,
        "residual_moment_rms_Nm": figures.residual_moment_rms_Nm,
        "friction_work_J": figures.friction_J,
    }
    values |= {f"max_{part.name}_{part.unit}": part.largest for part in departures(solution)[0]}
    if strict is not None:
        values["strict_seconds_lost_s"] = float(seconds_lost(question, strict.played)[-1])
    return complete(values, COLUMNS)


@lru_cache(maxsize=_KEPT)
def _recorded(folder: str, digest: str) -> RecordedRun:
    path = Path(folder)
    if fingerprint(result_hashes(path)) != digest:
        raise InputError(path, "", "the result has changed since the sweep began", "begin a new sweep")
    return recorded_run(read_run(path), path)
