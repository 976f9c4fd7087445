"""The files of each run or day below a folder, and the files that belong to none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.assemble import has_two_of_a_kind
from sssi_exudyn.importing.motion_capture.motion_formats import MOTION_READERS
from sssi_exudyn.importing.sensors.app_exports import ARCHIVE, SENSOR, app_files
from sssi_exudyn.importing.sensors.insole_exports import SUFFIXES as INSOLE_EXPORTS
from sssi_exudyn.importing.sensors.insole_exports import is_insole_export
from sssi_exudyn.importing.sensors.sensor_logs import BAROMETER
from sssi_exudyn.io.writing import clear_errors
from sssi_exudyn.recording.instruments.fixes_gnss_logger import is_gnss_log
from sssi_exudyn.recording.instruments.fixes_nmea import is_nmea
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as CAMERAS
from sssi_exudyn.recording.instruments.gps import READERS
from sssi_exudyn.recording.instruments.imu import PLACES
from sssi_exudyn.recording.recording import FILE

_MOST: Final = 10_000
"""Maximum number of files and folders that are looked at: a season of a team has some thousand."""
DEEPEST: Final = 8
"""Maximum depth of folders within folders: season, month, day, skier, telephone and its exports are six."""

_PLACES: Final = (*PLACES, BAROMETER)
_PARTS: Final = (SENSOR, "gnss", "gps", "fixes", "location", "track", *_PLACES)
"""Last words of the names of files that are parts of one run."""


@dataclass
class RunFiles:
    """The files of one run, or of one day.

    name : path of its folder below the folder of recordings, with ``/`` between parts
    files : a file of a single sensor has its place before the path, as in ``left_ski=…``
    others : names of files next to them that no reader takes, such as photos
    """

    name: str
    files: list[Path] = field(default_factory=list)
    others: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Unread:
    """A file or folder that belongs to no run, and why."""

    name: str
    why: str


@dataclass
class _Sorted:
    """What was met below the folder ``top`` so far."""

    top: Path
    runs: dict[str, RunFiles] = field(default_factory=dict)
    unread: list[Unread] = field(default_factory=list)

    def run(self, name: str) -> RunFiles:
        """Return the run of that name, a new one where there is none."""
        return self.runs.setdefault(name, RunFiles(name))

    def name_of(self, path: Path) -> str:
        """Return the path below the top folder."""
        return path.relative_to(self.top).as_posix()


def find_run_files(folder: Path, out: Path) -> tuple[list[RunFiles], list[Unread]]:
    """Return the files of every run below ``folder`` except in ``out``, and what belongs to none.

    A folder below it is one run where its files are one of each kind, such as a capture, a track and insoles.
    Otherwise its files are grouped by their names: ``run_07.mvnx`` and ``run_07.gpx`` are one run, as are
    ``run_07_imu.csv`` and ``run_07_gnss.csv``.  Hidden files and links to folders are left out.

    Raises InputError for more files than any season has, and for a folder that cannot be read.
    """
    met = _Sorted(folder)
    with clear_errors(folder):
        entries = list(_entries(folder, out.resolve()))
        folders = [path for path in entries if path.is_dir()]
        for place in [folder, *(path for path in folders if not path.is_symlink())]:
            _sort_folder(met, place, sorted(path for path in entries if path.parent == place and path.is_file()))
        for path in folders:
            if path.is_symlink():
                met.unread.append(Unread(met.name_of(path), "a link to a folder, which is not followed"))
    for run in met.runs.values():
        run.files = _without_films(run.files)
    return sorted(met.runs.values(), key=lambda run: run.name), sorted(met.unread, key=lambda entry: entry.name)


def _entries(folder: Path, out: Path) -> Iterator[Path]:
    """Yield all that is in a folder and below it, but for what is hidden."""
    count = 0
    waiting = [(folder, 0)]
    while waiting:
        place, depth = waiting.pop()
        for path in sorted(place.iterdir()):
            if path.name.startswith(".") or path.resolve() == out:
                continue
            count += 1
            if count > _MOST:
                raise InputError(folder, "", f"more than {_MOST} files", "import some of them")
            yield path
            if path.is_dir() and not path.is_symlink():
                if depth == DEEPEST:
                    raise InputError(path, "", f"more than {DEEPEST} folders within folders", "import this one alone")
                waiting.append((path, depth + 1))


def _sort_folder(met: _Sorted, place: Path, files: Sequence[Path]) -> None:
    """Add the files of a folder to the runs that they belong to, or to what belongs to none."""
    name = met.name_of(place)
    if (place / FILE).is_file():
        met.unread.append(Unread(name, "a recording already: give the folder that it is in to sssi run"))
        return
    exported = app_files(place)
    if exported:
        run = met.run(name if place != met.top else place.resolve().name)
        run.files += exported
        run.others += [path.name for path in files if path.suffix.lower() not in (".csv", ".json")]  # the app's own
        return
    usable = [path for path in files if _is_usable(path)]
    others = [path for path in files if path not in usable]
    single = [_with_place(path) for path in usable if not _is_archive(path)]
    if place != met.top and single and not has_two_of_a_kind(_without_films(single)):
        run = met.run(name)
        run.files += single
        run.others += [path.name for path in others]
        usable = [path for path in usable if _is_archive(path)]
        others = []
    prefix = "" if place == met.top else f"{name}/"
    parts = {path: _split_name(path) for path in usable}
    shared = Counter(own for own, part in parts.values() if part)
    for path, (base, part) in parts.items():
        own = prefix + (base if shared[base] > 1 else path.name.partition(".")[0])
        placed = Path(f"{part}={path}") if shared[base] > 1 and part in _PLACES else _with_place(path)
        met.run(f"{own}_zip" if _is_archive(path) and own in met.runs else own).files.append(placed)
    for path in others:
        own = prefix + path.name.partition(".")[0]
        if own in met.runs:
            met.runs[own].others.append(path.name)
        else:
            met.unread.append(Unread(met.name_of(path), f"no reader for {path.suffix or path.name!r}"))


def _split_name(path: Path) -> tuple[str, str]:
    """Return the name of a file's run, and which part of it the file is: empty where the name does not say."""
    stem = path.name.partition(".")[0]
    for part in _PARTS:
        if stem.lower().endswith(f"_{part}"):
            return stem[: -len(part) - 1], part
    return stem, ""


def _is_archive(path: Path) -> bool:
    return path.suffix.lower() == ARCHIVE


def _without_films(files: list[Path]) -> list[Path]:
    """Return the files of a run; a film next to others shows the skier, and is no instrument."""
    others = [path for path in files if path.suffix.lower() not in CAMERAS]
    return others or files


def _is_usable(path: Path) -> bool:
    """Return whether a reader takes a file.  Of plain texts, which may be anything, those that it recognises."""
    suffix = path.suffix.lower()
    if suffix not in (*MOTION_READERS, *READERS, *INSOLE_EXPORTS, ARCHIVE):
        return False
    return suffix not in (".txt", ".asc", ".log") or _is_recognised(path)


def _with_place(path: Path) -> Path:
    """Return a file with its place before it where its name is that of a single sensor's place."""
    place = path.stem.lower()
    return Path(f"{place}={path}") if place in _PLACES else path


def _is_recognised(path: Path) -> bool:
    try:
        suffix = path.suffix.lower()
        return (
            is_insole_export(path) or (suffix != ".asc" and is_nmea(path)) or (suffix == ".txt" and is_gnss_log(path))
        )
    except InputError:  # no text
        return False
