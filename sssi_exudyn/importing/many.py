"""Import of a folder of many runs: every run becomes a recording, and one table lists all of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.new_files import check_no_link
from sssi_exudyn.core.text import csv_of
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.app_exports import app_files
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.insole_exports import SUFFIXES as INSOLE_EXPORTS
from sssi_exudyn.importing.insole_exports import is_insole_export
from sssi_exudyn.importing.motion_formats import MOTION_READERS
from sssi_exudyn.importing.sensor_logs import BAROMETER
from sssi_exudyn.io.writing import clear_errors, folder_lock, write_atomically
from sssi_exudyn.recording.instruments.fixes_gnss_logger import is_gnss_log
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as CAMERAS
from sssi_exudyn.recording.instruments.gps import READERS
from sssi_exudyn.recording.instruments.imu import PLACES
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.runtime.progress import Stage

TABLE: Final = "recordings.csv"
"""Name of the table of every run and the outcome of its import."""
_MOST: Final = 10_000
"""Maximum number of runs in a folder."""


@dataclass(frozen=True)
class ImportedRun:
    """A row of the table.

    recording : its folder in ``out``
    status : "imported", "there already" or "failed"
    error : why it failed
    assumed : facts that were not stated, with the usual values assumed for them
    notes : all other notices
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


def import_many(folder: Path, out: Path, answers: Answers, stage: Stage | None = None) -> list[ImportedRun]:
    """Import every run in ``folder`` into a folder of its own in ``out``.

    Returns one row per run, which ``out/recordings.csv`` holds too.

    A run is a folder with its files, or the files of one name in ``folder`` itself (``run_07.mvnx`` and
    ``run_07.gpx``).  A file named after a sensor's place (``left_ski.csv``) is that sensor's.  A faulty run does not
    stop the others; runs that exist already stay as they are.

    Raises InputError where there is no run, or where ``out`` cannot be written.
    """
    runs = _runs_in(folder)
    if not runs:
        raise InputError(folder, "", "no run is in this folder", "put each run's files into a folder of its own")
    with folder_lock(out):
        rows = []
        for count, (name, files) in enumerate(runs.items(), 1):
            rows.append(_import_one(name, files, out / name, answers))
            write_atomically(out / TABLE, csv_of(rows, ImportedRun))
            if stage is not None:
                stage.advance(count / len(runs), f"{count} of {len(runs)} runs, {_failed(rows)} failed")
    return rows


def _failed(rows: Sequence[ImportedRun]) -> int:
    return sum(row.status == "failed" for row in rows)


def _runs_in(folder: Path) -> dict[str, list[Path]]:
    """Return the files of every run, by its name."""
    runs: dict[str, list[Path]] = {}
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not path.name.startswith("."):
            files = app_files(path) or list(_usable(path))
            if files:
                runs[path.name] = files
    for path in _usable(folder):
        runs.setdefault(path.name.partition(".")[0], []).append(path)
    if len(runs) > _MOST:
        raise InputError(folder, "", f"{len(runs)} runs, more than {_MOST}", "import some of them")
    return {name: _without_films(files) for name, files in runs.items()}


def _without_films(files: list[Path]) -> list[Path]:
    """Return the files of a run; a film next to others shows the skier, and is no instrument."""
    others = [path for path in files if path.suffix.lower() not in CAMERAS]
    return others or files


def _usable(folder: Path) -> Iterator[Path]:
    """Yield the files that a reader takes; files of single sensors have their place before the name.

    Of plain texts, which may be anything, those are taken that a reader recognises.
    """
    for path in sorted(folder.iterdir()):
        suffix = path.suffix.lower()
        if not path.is_file() or suffix not in (*MOTION_READERS, *READERS, *INSOLE_EXPORTS):
            continue
        if suffix in (".txt", ".asc") and not _is_recognised(path):
            continue
        place = path.stem.lower()
        yield Path(f"{place}={path}") if place in (*PLACES, BAROMETER) else path


def _is_recognised(path: Path) -> bool:
    try:
        return is_insole_export(path) or (path.suffix.lower() == ".txt" and is_gnss_log(path))
    except InputError:  # no text
        return False


def _import_one(name: str, files: Sequence[Path], out: Path, answers: Answers) -> ImportedRun:
    try:
        with clear_errors(out):
            check_no_link(out)
        if (out / FILE).exists():
            return _row(name, "there already", read_recording(out))
        return _row(name, "imported", import_recording(files, out, _named(answers, name)))
    except SssiError as error:
        return ImportedRun(name, "failed", error=str(error))


def _named(answers: Answers, name: str) -> Answers:
    return Answers(**{entry.name: getattr(answers, entry.name) for entry in fields(Answers)} | {"name": name})


def _row(name: str, status: str, recording: Recording) -> ImportedRun:
    gps = recording.gps
    assumed = [notice for notice in recording.notices if notice.startswith("assumed")]
    return ImportedRun(
        recording=name,
        status=status,
        duration_s=round(recording.stop - recording.start, 2),
        fixes=None if gps is None else len(gps.time),
        fix_sigma_m=None if gps is None else round(float(np.median(gps.sigma)), 3),
        inclination_deg=round(float(np.degrees(recording.slope.inclination)), 2),
        track_length_m=None if gps is None else round(float(_length(gps.enu)), 1),
        assumed="; ".join(assumed),
        notes="; ".join(notice for notice in recording.notices if notice not in assumed),
    )


def _length(places: np.ndarray) -> float:
    return float(np.sum(np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)))
