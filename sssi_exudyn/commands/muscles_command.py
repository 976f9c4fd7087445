"""``sssi muscles``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sssi_exudyn.bodies.muscles.muscles import MuscleSet, muscles_table
from sssi_exudyn.commands.recordings import SILENT
from sssi_exudyn.commands.runs import Made, run
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import folder_lock
from sssi_exudyn.muscle_forces.of_result import add_muscles, muscle_figures, muscles_of, storage_texts
from sssi_exudyn.reports.report import render_folder
from sssi_exudyn.results.folder import SERIES, SUMMARY, amend_result, read_summary
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.runtime.progress import Progress


def muscles(
    folder: Path, out: Path | None, *, power: int = 2, chosen: MuscleSet = "full", progress: Progress = SILENT
) -> Summary:
    """The forces of the muscles that made a run's joint moments; the summary, with its group ``muscles``.

    ``folder`` is a result, which gets them into its series, its report and files of its own, or into a copy in ``out``;
    or a recording, which is run into ``out`` first.
    """
    if not (folder / SUMMARY).is_file():
        if out is None:
            raise InputError(folder, "", "this is not a result", "give a result's folder, or a recording's and --out")
        run(folder, out, progress=progress)
        folder = out
    target = out or folder
    with folder_lock(target), progress.stage("muscles") as stage:
        result = read_run(folder)
        found = muscles_of(result, folder, power, chosen)
        stage.advance(1.0, f"{len(found.time)} samples")
        amend_result(
            folder,
            target,
            {"muscles": muscle_figures(found)},
            tables={SERIES: add_muscles(result.series, found)},
            texts=storage_texts(found),
            render=render_folder,
        )
        return read_summary(target)


def make_muscles(made: Made, *, power: int = 2, chosen: MuscleSet = "full", progress: Progress = SILENT) -> Made:
    """A run with the forces of its muscles; nothing is written."""
    with progress.stage("muscles") as stage:
        run = made.run
        found = muscles_of(run, Path(run.name), power, chosen)
        stage.advance(1.0, f"{len(found.time)} samples")
        summary = replace(run.summary, muscles=muscle_figures(found))
        amended = replace(run, summary=summary, series=add_muscles(run.series, found))
        return Made(amended, {**made.opensim, **storage_texts(found)})


def muscles_list(chosen: MuscleSet = "full") -> list[dict[str, str | float]]:
    """Every muscle of a set with its figures, not scaled to anyone."""
    return muscles_table(chosen)
