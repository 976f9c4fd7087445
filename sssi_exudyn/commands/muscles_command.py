"""The work of ``sssi muscles``: computed muscles are added to a run in memory, or to a result's folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sssi_exudyn.commands.outcome import Made
from sssi_exudyn.muscle_forces.of_result import MuscleRun, add_muscles, muscle_figures, storage_texts
from sssi_exudyn.reports.report import render_folder
from sssi_exudyn.results.folder import SERIES, amend_result
from sssi_exudyn.results.stored import StoredRun


def add_to_run(made: Made, muscles: MuscleRun) -> Made:
    """Return the run with the forces of its muscles; nothing is written."""
    run = made.run
    summary = replace(run.summary, muscles=muscle_figures(muscles))
    amended = replace(run, summary=summary, series=add_muscles(run.series, muscles))
    return Made(amended, {**made.opensim, **storage_texts(muscles)})


def add_to_folder(folder: Path, out: Path, run: StoredRun, muscles: MuscleRun) -> None:
    """Write the result in ``folder``, which is ``run``, with its muscles to ``out``, which may be the same folder.

    Series, report and summary get them, and files of their own.  Raises InputError where ``out`` cannot be written.
    """
    amend_result(
        folder,
        out,
        {"muscles": muscle_figures(muscles)},
        tables={SERIES: add_muscles(run.series, muscles)},
        texts=storage_texts(muscles),
        render=render_folder,
    )
