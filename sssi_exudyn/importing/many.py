"""Import of a folder of many runs and days: every run becomes a recording, and one table lists all of them.

Nothing is lost: what cannot be read, and runs without a sensor that shows the posture, are rows of the table too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.new_files import check_no_link
from sssi_exudyn.core.text import csv_of, one_line
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import check_posture, sort_sources
from sssi_exudyn.importing.days.day import DayPiece, holds_several_runs, import_day, import_run, run_name
from sssi_exudyn.importing.days.run_files import RunFiles, find_run_files
from sssi_exudyn.importing.sensors.app_exports import files_given
from sssi_exudyn.io.writing import clear_errors, folder_lock, write_atomically
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.runtime.progress import Stage

TABLE: Final = "recordings.csv"
"""Name of the table of every run and the outcome of its import."""
NOT_READ: Final = ("failed", "not read")
"""Outcomes of what cannot be read."""
_LONGEST: Final = 300
"""Maximum number of characters of the names of files that are not read."""


@dataclass(frozen=True)
class ImportedRun:
    """A row of the table.

    recording : its folder in ``out``; of what has none, the name of what was given
    status : "imported", "there already", "listed" for a run that no sensor covers, "failed", or "not read" for a file
        that belongs to no run
    error : why there is no recording
    assumed : facts that were not stated, with the usual values assumed for them
    notes : all other notices
    start_utc : date and time of day at which a run of a day begins
    vertical_m, mean_mps, top_mps : how far a run of a day leads down, and its speed
    """

    recording: str
    status: str
    duration_s: float | None = None
    fixes: int | None = None
    fix_sigma_m: float | None = None
    inclination_deg: float | None = None
    track_length_m: float | None = None
    error: str = ""
    assumed: str = ""
    notes: str = ""
    start_utc: str = ""
    vertical_m: float | None = None
    mean_mps: float | None = None
    top_mps: float | None = None


def import_many(folder: Path, out: Path, answers: Answers, stage: Stage | None = None) -> list[ImportedRun]:
    """Import every run below ``folder`` into a folder of its own in ``out``.

    Returns one row per run, and per file that belongs to none; ``out/recordings.csv`` holds them too.

    ``find_run_files`` says which files are a run.  A file named after a sensor's place (``left_ski.csv``) is that
    sensor's.  A track of several descents becomes one recording a descent.  A faulty run does not stop the others; runs
    that exist already stay as they are.

    Raises InputError where there is no run, or where ``out`` cannot be written.
    """
    if not folder.is_dir():
        raise InputError(folder, "", "this is no folder", "give a folder with the runs' files")
    runs, unread = find_run_files(folder, out)
    if not runs:
        raise InputError(folder, "", "no run is in this folder", "put each run's files into a folder of its own")
    last = [ImportedRun(one_line(entry.name), "not read", error=entry.why) for entry in unread]
    with folder_lock(out):
        rows: list[ImportedRun] = []
        for count, run in enumerate(runs, 1):
            rows += _import_files(run, out, answers)
            write_atomically(out / TABLE, csv_of([*rows, *last], ImportedRun))
            if stage is not None:
                stage.advance(count / len(runs), f"{count} of {len(runs)} runs, {_failed(rows)} failed")
    return [*rows, *last]


def _failed(rows: Sequence[ImportedRun]) -> int:
    return sum(row.status in NOT_READ for row in rows)


def _import_files(run: RunFiles, out: Path, answers: Answers) -> list[ImportedRun]:
    """Return the rows of a run's or a day's files."""
    into = out / run.name
    try:
        with clear_errors(into):
            _check_no_links(out, into)
        if (into / FILE).exists():
            return [_row(run, "there already", read_recording(into))]
        named = replace(answers, name=run.name)
        with files_given(run.files) as files:
            if _is_day(files, named):
                return _rows_of_day(run, import_day(files, into, named))
            return [_row(run, "imported", import_run(files, into, named))]
    except SssiError as error:
        return [ImportedRun(run.name, "failed", error=str(error), notes=_unused(run))]


def _check_no_links(out: Path, into: Path) -> None:
    """Raise OSError where a link stands for a folder between ``out`` and ``into``."""
    for path in (into, *into.parents):
        if path == out:
            return
        check_no_link(path)


def _is_day(files: Sequence[Path], answers: Answers) -> bool:
    """Return whether files are a track of several descents, or a track without a sensor, whose runs are listed."""
    if holds_several_runs(files, answers):
        return True
    sources = sort_sources(files)
    try:
        check_posture(sources)
    except InputError:
        return sources.gps is not None and not sources.sensors
    return False


def _rows_of_day(run: RunFiles, pieces: Sequence[DayPiece]) -> list[ImportedRun]:
    """Return a row of every run of a day."""
    runs = [piece for piece in pieces if piece.run is not None]
    if not runs:
        problem = "the track holds no descent, and no sensor shows the skier's posture"
        return [ImportedRun(run.name, "failed", error=problem, notes=_unused(run))]
    return [
        ImportedRun(
            recording=f"{run.name}/{piece.recording or run_name(number, len(runs))}",
            status=piece.status,
            duration_s=piece.duration_s,
            track_length_m=piece.length_m,
            error=piece.why,
            notes=_unused(run),
            start_utc=piece.start_utc,
            vertical_m=piece.vertical_m,
            mean_mps=piece.mean_mps,
            top_mps=piece.top_mps,
        )
        for number, piece in enumerate(runs, 1)
    ]


def _unused(run: RunFiles) -> str:
    """Return a note of the files next to a run's that no reader takes."""
    return f"not read: {one_line(', '.join(run.others), _LONGEST)}" if run.others else ""


def _row(run: RunFiles, status: str, recording: Recording) -> ImportedRun:
    gps = recording.gps
    assumed = [notice for notice in recording.notices if notice.startswith("assumed")]
    return ImportedRun(
        recording=run.name,
        status=status,
        duration_s=round(recording.stop - recording.start, 2),
        fixes=None if gps is None else len(gps.time),
        fix_sigma_m=None if gps is None else round(float(np.median(gps.sigma)), 3),
        inclination_deg=round(float(np.degrees(recording.slope.inclination)), 2),
        track_length_m=None if gps is None else round(float(_length(gps.enu)), 1),
        assumed="; ".join(assumed),
        notes="; ".join(
            [*(notice for notice in recording.notices if notice not in assumed), *filter(None, [_unused(run)])]
        ),
    )


def _length(places: np.ndarray) -> float:
    return float(np.sum(np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)))
