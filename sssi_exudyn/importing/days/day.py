"""A day of many runs: the descents of one long track, each made into a recording, and a table of them.

Sensors that were recorded along with the track are cut to each run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np
import pymap3d

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import csv_of, one_line
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.assemble import (
    Material,
    check_posture,
    csv_of_fixes,
    import_material,
    offset_of_fixes,
    read_material,
    refuse_existing,
    sort_sources,
)
from sssi_exudyn.importing.days.descents import LEAST_DROP, LEAST_TIME, Piece, averaged_speed, split_day
from sssi_exudyn.importing.sensors.sensor_logs import cut_log
from sssi_exudyn.io.bounds import MAX_SENSOR
from sssi_exudyn.io.files import open_regular
from sssi_exudyn.io.writing import folder_lock, write_atomically
from sssi_exudyn.recording.instruments.fixes import REQUIRED, Fixes
from sssi_exudyn.recording.instruments.imu import PLACES as IMU_PLACES
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.runtime.progress import Stage

TABLE: Final = "runs.csv"
"""Name of the table of a day."""
_WHY: Final = {
    "lift": "leads up",
    "pause": "the skier stands or walks",
    "too short": f"less than {LEAST_DROP:g} m down or {LEAST_TIME:g} s",
    "no fixes": "the receiver was lost",
}
"""Why a piece is no run, by its kind."""
_MOST_RUNS: Final = 200
"""Maximum number of runs of a day; seven hours have a hundred of them on the shortest lifts."""
_PIECE: Final = 4_000_000
"""Bytes that are hashed at once."""
_BESIDE: Final = 10.0
"""Stretch of the sensors, s, that is kept before and after a run: receivers lag by up to four seconds."""


@dataclass(frozen=True)
class DayPiece:
    """A row of the table: a run of the day, or what is between two.

    Attributes
    ----------
    run : number of the run; None for what is none
    kind : "run", "lift", "pause", "too short" or "no fixes"
    start_utc : date and time of day of its first fix; empty where the file has none
    start_s : time of its first fix, s after the track's first
    duration_s : from its first to its last fix
    vertical_m : how far it leads down
    length_m : along the snow
    mean_mps, top_mps : speed; the largest is the receiver's own where it writes one, else a mean of 5 s
    recording : its folder in that of the day; empty where there is none
    status : "imported", "there already", "failed", "listed" or "not a run"
    why : why there is no recording, or why it is no run
    first_fix, last_fix : their places in the file
    file, sha256 : the track's file
    """

    run: int | None
    kind: str
    start_utc: str
    start_s: float
    duration_s: float
    vertical_m: float
    length_m: float
    mean_mps: float
    top_mps: float
    recording: str
    status: str
    why: str
    first_fix: str
    last_fix: str
    file: str
    sha256: str


@dataclass(frozen=True)
class _Track:
    """Fixes of a day, local: (n,) s, (n, 3) m east-north-up, (n,) m/s; and their pieces."""

    path: Path
    fixes: Fixes
    enu: Array
    speed: Array
    pieces: tuple[Piece, ...]

    @property
    def time(self) -> Array:
        return self.fixes.columns["time_s"]

    @property
    def runs(self) -> tuple[Piece, ...]:
        return tuple(piece for piece in self.pieces if piece.kind == "run")


def holds_several_runs(files: Sequence[Path], answers: Answers) -> bool:
    """Return whether files have a track with more than one descent, and no motion capture that shows which is meant."""
    sources = sort_sources(files)
    if sources.motion is not None or sources.gps is None:
        return False
    return len(_track_of(read_material(replace(sources, sensors=()), answers)).runs) > 1


def import_run(files: Sequence[Path], out: Path, answers: Answers, number: int | None = None) -> Recording:
    """Make the recording folder ``out`` of one run of a day, or of files that hold one run.

    Parameters
    ----------
    number : which descent of the track, from 1; None for the whole track, except that sensors' logs that are longer
        than any run are cut to the one descent that it holds

    Raises InputError for a number that no run has, for one next to a motion capture, for long logs of several runs, and
    whatever ``import_recording`` raises.
    """
    refuse_existing(out)
    sources = sort_sources(files)
    if sources.motion is not None and number is not None:
        problem = "a motion capture covers one run, which is taken of the track"
        raise InputError(sources.motion, "--run", problem, "leave --run out")
    check_posture(sources)
    material = read_material(sources, answers)
    longest = max((log for log in material.logs), key=lambda log: len(log.table.lines), default=None)
    if number is None and (longest is None or material.fixes is None or len(longest.table.lines) <= MAX_SENSOR):
        return import_material(material, out, answers)
    track = _track_of(material)
    if number is None and longest is not None and len(track.runs) != 1:
        problem = f"{len(longest.table.lines)} samples are more than any run has, and the track has {len(track.runs)}"
        raise InputError(longest.table.file, "", problem, "take one with --run N, or all with import_day")
    number = 1 if number is None else number
    if not 1 <= number <= len(track.runs):
        problem = f"the track holds {len(track.runs)} run(s), and none of number {number}"
        raise InputError(track.path, "--run", problem, "leave --run out to see them")
    offset = offset_of_fixes(material, answers)
    if _shared(material, track, track.runs[number - 1], offset) < LEAST_TIME:
        fix = "take another run, or give the sensors' files of this one"
        raise InputError(track.path, "--run", f"no sensor covers run {number}", fix)
    return import_material(_cut(material, track, number, offset), out, replace(answers, gps_offset_s=None))


def import_day(files: Sequence[Path], out: Path, answers: Answers, stage: Stage | None = None) -> list[DayPiece]:
    """Make a recording ``run_01``, ``run_02`` … in ``out`` of every descent of a track, and the table ``runs.csv``.

    Returns its rows.  Without a sensor that shows the skier's posture the runs are listed only, and their fixes kept as
    ``run_01.csv``, ``run_02.csv`` …  A run that cannot be imported does not stop the others; recordings that exist
    already stay as they are.

    Raises InputError where no file holds fixes, there is a motion capture, or files cannot be read.
    """
    sources = sort_sources(files)
    if sources.motion is not None:
        problem = "a motion capture covers one run only"
        raise InputError(sources.motion, "", problem, "import it alone with the track: the run that it covers is taken")
    material = read_material(sources, answers)
    track = _track_of(material)
    offset = offset_of_fixes(material, answers) if material.logs else 0.0
    digest = _digest(track.path)
    rows: list[DayPiece] = []
    count = 0
    with folder_lock(out):
        for piece in track.pieces:
            recording, status, why = "", "not a run", _WHY.get(piece.kind, "")
            if piece.kind == "run":
                count += 1
                recording, status, why = _import_one(material, track, count, offset, out, answers)
                if status == "listed":
                    kept = {name: column[piece.first : piece.last + 1] for name, column in track.fixes.columns.items()}
                    write_atomically(out / f"{run_name(count, len(track.runs))}.csv", csv_of_fixes(kept))
                if stage is not None:
                    stage.advance(count / len(track.runs), f"{count} of {len(track.runs)} runs")
            number = count if piece.kind == "run" else None
            rows.append(_row(track, piece, number, digest, recording, status, why))
        write_atomically(out / TABLE, csv_of(rows, DayPiece))
    return rows


def run_name(number: int, count: int) -> str:
    """Return the name of a run of a day, from 1, that has ``count`` of them."""
    return f"run_{number:0{max(2, len(str(count)))}d}"


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file, which may be a film of gigabytes."""
    digest = hashlib.sha256()
    with open_regular(path) as stream:
        while piece := stream.read(_PIECE):
            digest.update(piece)
    return digest.hexdigest()


def _import_one(
    material: Material, track: _Track, number: int, offset: float, out: Path, answers: Answers
) -> tuple[str, str, str]:
    """Import a run of a day; return its folder's name, how it went, and why it has none."""
    name = run_name(number, len(track.runs))
    if (out / name / FILE).exists():
        return name, "there already", ""
    if not any(log.place in IMU_PLACES for log in material.logs):
        return "", "listed", "no sensor shows the skier's posture"
    if _shared(material, track, track.runs[number - 1], offset) < LEAST_TIME:
        return "", "listed", "no sensor covers it"
    named = replace(answers, gps_offset_s=None, name=f"{answers.name or out.resolve().name} {name}")
    try:
        import_material(_cut(material, track, number, offset), out / name, named)
    except SssiError as error:
        return "", "failed", str(error)
    return name, "imported", ""


def _track_of(material: Material) -> _Track:
    """Split the fixes of a day.  Raises InputError where no file holds any."""
    fixes, path = material.fixes, material.sources.gps
    if fixes is None or path is None:
        given = material.sources.given[0]
        raise InputError(given, "", "no file holds fixes, which show the runs of a day", "add the track")
    time, *degrees, height = (fixes.columns[name] for name in REQUIRED)
    enu = np.stack(pymap3d.geodetic2enu(*degrees, height, degrees[0][0], degrees[1][0], height[0]), axis=-1)
    flat = enu[:, :2]  # heights are taken as they are: level ground falls off the first fix's plane by 8 m in 10 km
    pieces = tuple(split_day(time, flat, height))
    count = sum(piece.kind == "run" for piece in pieces)
    if count > _MOST_RUNS:
        raise InputError(path, "", f"{count} runs are more than any day has", "export one day alone")
    speed = fixes.columns.get("speed_mps", averaged_speed(time, flat))
    return _Track(path, fixes, np.column_stack([flat, height - height[0]]), speed, pieces)


def _shared(material: Material, track: _Track, piece: Piece, offset: float) -> float:
    """Return for how long (s) all sensors cover a run."""
    start, stop = material.covered
    first, last = (float(track.time[at]) + offset for at in (piece.first, piece.last))
    return min(last, stop) - max(first, start)


def _cut(material: Material, track: _Track, number: int, offset: float) -> Material:
    """Return the files' content of one run, on a clock that begins shortly before it."""
    piece = track.runs[number - 1]
    within = slice(piece.first, piece.last + 1)
    start = max(float(track.time[piece.first]) + offset - _BESIDE, material.covered[0])
    stop = min(float(track.time[piece.last]) + offset + _BESIDE, material.covered[1])
    columns = {name: column[within] for name, column in track.fixes.columns.items()}
    columns["time_s"] = columns["time_s"] + offset - start
    fixes = replace(track.fixes, columns=columns, places=track.fixes.places[within], began=None, common_clock=True)
    logs = tuple(cut_log(log, material.logs[0], start, stop) for log in material.logs)
    began = _utc(track, piece.first)
    about = f"; run {number} of {len(track.runs)} of the track" + (f", {began}" if began else "")
    zero = None if track.fixes.began is None else track.fixes.began + start - offset
    return replace(material, fixes=fixes, logs=logs, began=None, cut=(start, stop), about=about, start_utc=zero)


def _utc(track: _Track, at: int) -> str:
    """Return the date and time of day of a fix (ISO 8601, UTC), empty where the file has none."""
    if track.fixes.began is None:
        return ""
    try:
        moment = datetime.fromtimestamp(track.fixes.began + float(track.time[at]), UTC)
    except (ValueError, OverflowError, OSError):  # years that no calendar has
        return ""
    return f"{moment:%Y-%m-%dT%H:%M:%SZ}"


def _row(
    track: _Track, piece: Piece, number: int | None, digest: str, recording: str, status: str, why: str
) -> DayPiece:
    within = slice(piece.first, piece.last + 1)
    start, stop = float(track.time[piece.first]), float(track.time[piece.last])
    length = float(np.sum(np.linalg.norm(np.diff(track.enu[within], axis=0), axis=1)))
    return DayPiece(
        run=number,
        kind=piece.kind,
        start_utc=_utc(track, piece.first),
        start_s=round(start - float(track.time[0]), 3),
        duration_s=round(stop - start, 3),
        vertical_m=round(float(track.enu[piece.first, 2] - track.enu[piece.last, 2]), 1),
        length_m=round(length, 1),
        mean_mps=round(length / (stop - start), 2),
        top_mps=round(float(np.max(track.speed[within])), 2),
        recording=recording,
        status=status,
        why=why,
        first_fix=track.fixes.places[piece.first],
        last_fix=track.fixes.places[piece.last],
        file=one_line(track.path.name),
        sha256=digest,
    )
