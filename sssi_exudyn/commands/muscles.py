"""``sssi muscles``."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sssi_exudyn.bodies.muscles.muscles import muscles_table
from sssi_exudyn.commands.runs import _CACHE, _SILENT, run
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import clear_errors, folder_lock
from sssi_exudyn.muscle_forces.of_result import figures as muscle_figures
from sssi_exudyn.muscle_forces.of_result import muscles_of, storages, with_muscles
from sssi_exudyn.reports.html import added
from sssi_exudyn.reports.muscles_section import muscles_section
from sssi_exudyn.results.folder import REPORT, SUMMARY, amend_result, read_report
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.runtime.progress import Progress


def muscles(folder: Path, out: Path | None, *, power: int = 2, progress: Progress = _SILENT) -> dict[str, Any]:
    """The forces of 284 muscles that made a run's joint moments; the summary, with its group ``muscles``.

    ``folder`` is a result, which gets them into its series, its page and files of its own, or is copied to ``out``
    first; or a recording, which is run into ``out`` first.
    """
    if not (folder / SUMMARY).is_file():
        if out is None:
            raise InputError(folder, "", "this is not a result", "give a result's folder, or a recording's and --out")
        run(folder, out, progress=progress)
    elif out is not None and out.resolve() != folder.resolve():
        with folder_lock(folder), folder_lock(out), clear_errors(out):
            shutil.copytree(folder, out, ignore=shutil.ignore_patterns(".*", _CACHE), dirs_exist_ok=True)
    made = out or folder
    with folder_lock(made), progress.stage("muscles") as stage:
        result = read_run(made)
        found = muscles_of(result, made, power)
        stage.advance(1.0, f"{len(found.time)} samples")
        summary = {**result.summary, "muscles": muscle_figures(found)}
        texts = storages(found)
        page = read_report(made)
        if page is not None:
            texts[REPORT] = added(page, muscles_section(found, result.series))
        amend_result(made, summary, with_muscles(result.series, found), texts)
        return summary


def muscles_list() -> list[dict[str, str | float]]:
    """Every muscle of the skier with its figures, not scaled to anyone."""
    return muscles_table()
