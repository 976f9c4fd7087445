"""The steps of ``validate`` and ``report``: a result is judged by a recording, and shown.

All raise InputError for bad input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sssi_exudyn.commands.recordings import SILENT
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.writing import check_file_name, folder_lock, write_atomically
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.reports.report import render, render_folder, render_pdf
from sssi_exudyn.results.folder import MEASURED, amend_result, read_series, read_summary
from sssi_exudyn.results.measured import measured_table
from sssi_exudyn.results.stored import StoredRun, read_run
from sssi_exudyn.results.summary import (
    Summary,
    summary_from_dict,
)
from sssi_exudyn.runtime.progress import Progress
from sssi_exudyn.sweeps.sweep import is_sweep
from sssi_exudyn.sweeps.sweep import render_folder as render_sweep_folder
from sssi_exudyn.validation.agreement import judge_loads, judge_track


def validate(folder: Path, result: Path, out: Path, *, progress: Progress = SILENT) -> Summary:
    """Compare the run in the folder ``result`` with the recording's GPS and insoles, into ``out``.

    Returns the new summary.
    """
    with folder_lock(out), progress.stage("validate"):
        recording = read_recording(folder)
        series = read_series(result)
        groups = {
            "trajectory": judge_track(series, recording.gps),
            "pressure_ratio": judge_loads(series, recording.insoles),
        }
        figures = summary_from_dict(groups)  # so that figures which do not apply are null
        measured = measured_table(recording.gps, recording.insoles)
        amend_result(
            result,
            out,
            {name: getattr(figures, name) for name in groups},
            tables={MEASURED: measured},
            render=render_folder,
        )
        return read_summary(out)


def report(results: Sequence[Path], out: Path) -> Path:
    """Write the report of one result folder, of several side by side, or of a sweep's folder.

    ``out`` is a page (.html) or a document to print (.pdf).  Returns that file's path; raises InputError for another
    ending.
    """
    _check_ending(out)
    if is_sweep(results[0]):
        if len(results) > 1 or out.suffix != ".html":
            raise InputError(results[0], "", "this is a sweep", "give it alone, and a name that ends in .html")
        write_atomically(out, render_sweep_folder(results[0]))
        return out
    return write_report([(read_run(result), result.resolve().name) for result in results], out)


def write_report(results: Sequence[tuple[StoredRun, str]], out: Path) -> Path:
    """Write the report of results, each with a name that distinguishes it from others of the same recording."""
    _check_ending(out)
    names = [run.name for run, _ in results]
    runs = []
    for run, own in results:
        several = names.count(run.name) > 1  # results of one recording
        summary = replace(run.summary, recording=f"{run.name} ({own})") if several else run.summary
        runs.append(replace(run, summary=summary))
    write_atomically(out, render(runs) if out.suffix == ".html" else render_pdf(runs))
    return out


def _check_ending(out: Path) -> None:
    """Raise InputError where a report's file is neither a page nor a document, or cannot be."""
    if out.suffix not in (".html", ".pdf"):
        raise InputError(out, "", "neither a page nor a document", "end its name in .html or .pdf")
    check_file_name(out)
