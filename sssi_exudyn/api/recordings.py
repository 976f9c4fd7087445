"""``example``, ``inspect``, ``terrain`` and ``import``: recordings before anything is simulated.

Each function is the one signature of its command: the command line makes its options from it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Unpack

from sssi_exudyn.api.arguments import AnyPath, Picture, ProgressWanted, RecordingFolder, path_of
from sssi_exudyn.core.checked import checked
from sssi_exudyn.core.command_line import Argument, Option
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.answers import AnswerOptions, Answers

if TYPE_CHECKING:
    from sssi_exudyn.importing.days.day import DayPiece
    from sssi_exudyn.importing.many import ImportedRun
    from sssi_exudyn.recording.inspection import Inspection
    from sssi_exudyn.recording.recording import Recording
    from sssi_exudyn.terrain.profile import SurfaceFigures


@checked
def example(
    name: Annotated[str, Argument("NAME")], out: Annotated[AnyPath, Option(metavar="FOLDER")] | None = None
) -> Path:
    """Copy a recording, or a ski's bench tests, that come with the program.

    Parameters
    ----------
    name : beginner, intermediate, or bench for the tests of a ski
    out : the new folder (default: a folder of that name)

    Returns the folder.  Raises InputError for an unknown name and where something of that name is there.

    Examples
    --------
    >>> recording = sssi_exudyn.read_recording(sssi_exudyn.example("beginner"))
    """
    from sssi_exudyn import commands

    return commands.example(name, path_of(out))


@checked
def read_recording(folder: AnyPath) -> Recording:
    """Read a recording: the folder of one run with its ``recording.toml``, checked and on one clock.

    Parameters
    ----------
    folder : the recording's folder

    Raises InputError, with file, place and fix, for whatever cannot be used.

    Examples
    --------
    >>> recording = sssi_exudyn.read_recording("examples/beginner")
    >>> recording.skier.mass
    70.0
    """
    from sssi_exudyn.recording.read import read_recording as read

    return read(Path(folder))


@checked
def inspect(recording: RecordingFolder, picture: Picture | None = None) -> Inspection:
    """Show the content of a recording, and its problems.

    These are durations, rates, gaps, estimated slope and heading, and the snow surface.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml
    picture : file to draw it into (.png, .svg or .pdf)

    Examples
    --------
    >>> sssi_exudyn.inspect("examples/beginner").notices
    ()
    """
    from sssi_exudyn import commands

    return commands.inspect(Path(recording), path_of(picture))


def terrain(
    recording: RecordingFolder,
    elevations: Annotated[AnyPath, Option("--dem", metavar="FILE")] | None = None,
    picture: Picture | None = None,
    crs: Annotated[str, Option("--dem-crs", metavar="EPSG:N")] | None = None,
) -> SurfaceFigures:
    """Estimate the snow surface under a run.

    Parameters
    ----------
    recording : the recording: a folder with recording.toml
    elevations : elevation model of the slope (.tif, .asc or .hgt)
    picture : file to draw it into (.png, .svg or .pdf)
    crs : coordinate system of an elevation model that states none, such as EPSG:31254

    Raises InputError for a recording without fixes, and for an elevation model that cannot be used.
    """
    from sssi_exudyn import commands

    return commands.terrain(Path(recording), path_of(elevations), path_of(picture), crs)


@checked
def import_files(
    files: Annotated[AnyPath | Sequence[AnyPath], Argument("FILE", Path, "+")],
    out: Annotated[AnyPath, Option(metavar="FOLDER")],
    run: Annotated[int, Option(metavar="N")] | None = None,
    *,
    defaults: Annotated[AnyPath, Option(metavar="TOML")] | None = None,
    **answers: Unpack[AnswerOptions],
) -> Recording:
    """Make a recording from files of other formats, or one a run from a day of skiing.

    They are MVNX, C3D, .mot, BVH, GPX, TCX, FIT, NMEA, and CSV of telephones.

    Parameters
    ----------
    files : a motion capture, or PLACE=FILE of sensors (gyroscope and accelerometer may be two files of a place).  Files
        of fixes, insoles and poles may follow.  It may also be an app's export, a folder or .zip, or on the command
        line a folder of many runs.
    out : the recording's folder, of a day the folder of its runs.  It is made here.
    run : which descent of a track that holds several, from 1; without it the command line imports all of them
    defaults : a file of answers, such as mass_kg = 71
    answers : what no file holds, by the names of ``Answers``, such as ``mass_kg`` or ``antenna_joint``

    Without ``run`` the descent of a track that leads down most while the other instruments measure is taken; for all of
    them see ``import_day``.  What is usual is assumed for answers that are missing; the recording's notices say what.
    Raises InputError for files that cannot be used, for other answers that are missing, and where ``out`` holds a
    recording.

    Examples
    --------
    >>> sssi_exudyn.import_files(["run.mvnx", "run.gpx"], "monday", mass_kg=70.0, height_m=1.75)
    """
    from sssi_exudyn.importing.days.day import import_run
    from sssi_exudyn.importing.sensors.app_exports import files_given

    known = _answers_of(answers, defaults)
    with files_given(_paths_of(files)) as given:
        return import_run(given, Path(out), known, run)


@checked
def import_day(
    files: Annotated[AnyPath | Sequence[AnyPath], Argument("FILE", Path, "+")],
    out: AnyPath,
    *,
    defaults: AnyPath | None = None,
    progress: ProgressWanted = False,
    **answers: Unpack[AnswerOptions],
) -> list[DayPiece]:
    """Make a recording in ``out`` of every descent of a long track, and a table of them; return its rows.

    See ``import_files``, whose options these are.  Sensors are cut to each run.  Without a sensor that shows the
    skier's posture the runs are listed only.

    Examples
    --------
    >>> pieces = sssi_exudyn.import_day(["pocket=phone.csv", "day.gpx"], "saturday")
    >>> runs = [piece for piece in pieces if piece.kind == "run"]
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.importing.days.day import import_day as work
    from sssi_exudyn.importing.sensors.app_exports import files_given

    known = _answers_of(answers, defaults)
    with progress_of(progress).stage("import") as stage, files_given(_paths_of(files)) as given:
        return work(given, Path(out), known, stage)


def import_any(
    files: Sequence[Path],
    out: Path,
    run: int | None,
    *,
    progress: ProgressWanted,
    defaults: Path | None,
    **answers: Unpack[AnswerOptions],
) -> Recording | list[ImportedRun] | list[DayPiece]:
    """Import files, a day of runs, or a folder of many: what the command line was given."""
    from sssi_exudyn.importing.days.day import holds_several_runs
    from sssi_exudyn.importing.sensors.app_exports import files_given

    with files_given(files) as given:
        if len(given) == 1 and given[0].is_dir():
            if run is not None:
                raise InputError(
                    given[0], "--run", "it takes a run of a track, not of a folder", "give the track's file"
                )
            return import_folder(given[0], out, defaults=defaults, progress=progress, **answers)
        if run is None and holds_several_runs(given, _answers_of(answers, defaults)):
            return import_day(given, out, defaults=defaults, progress=progress, **answers)
        return import_files(given, out, run, defaults=defaults, **answers)


def _paths_of(files: AnyPath | Sequence[AnyPath]) -> list[Path]:
    return [Path(file) for file in ([files] if isinstance(files, str | os.PathLike) else files)]


def import_folder(
    folder: AnyPath,
    out: AnyPath,
    *,
    defaults: AnyPath | None = None,
    progress: ProgressWanted = False,
    **answers: Unpack[AnswerOptions],
) -> list[ImportedRun]:
    """Make recordings in ``out`` of all runs in ``folder``, and a table of them; return its rows.

    See ``import_files``, whose options these are.
    """
    from sssi_exudyn.api.progress import progress_of
    from sssi_exudyn.importing.many import import_many

    known = _answers_of(answers, defaults)
    with progress_of(progress).stage("import") as stage:
        return import_many(Path(folder), Path(out), known, stage)


def _answers_of(given: AnswerOptions, defaults: AnyPath | None) -> Answers:
    """Return the answers, and where there are none those of the file ``defaults``.

    Raises InputError for a name that no answer has.
    """
    from sssi_exudyn.core.text import did_you_mean
    from sssi_exudyn.importing.defaults import fill, read_defaults

    for name in given:
        if name not in AnswerOptions.__annotations__:
            fix = did_you_mean(name, AnswerOptions.__annotations__)
            raise InputError("import_files", name, "no answer has that name", fix)
    answers = Answers(**given)
    return answers if defaults is None else fill(answers, read_defaults(Path(defaults)))
