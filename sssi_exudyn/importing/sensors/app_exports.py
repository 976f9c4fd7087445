"""Files of a telephone's app under the names that the app gives them, paired to one sensor without further words.

Sensor Logger writes ``Gyroscope.csv``, ``TotalAcceleration.csv`` (or ``Accelerometer.csv`` and ``Gravity.csv``),
``Barometer.csv`` and ``Location.csv``; phyphox ``Gyroscope.csv``, ``Accelerometer.csv``, ``Pressure.csv`` and
``Location.csv``.  A film of a GoPro camera holds fixes and a sensor.  ``RUN_imu.csv`` is a telephone's sensors in one
file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.sensors.opensense import SUFFIX, places_in
from sssi_exudyn.importing.sensors.sensor_logs import BAROMETER, split_place
from sssi_exudyn.io.archive import unpack
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as CAMERAS

_GYROSCOPE, _LOCATION = "gyroscope", "location"
SENSOR: Final = "imu"
"""Last word of the name of a telephone's sensors in one file, next to its track (``RUN_imu.csv``)."""
_ACCELERATIONS: Final = (("totalacceleration",), ("accelerometer", "gravity"), ("accelerometer",))
"""Files that hold the acceleration with gravity, the first of which that are there are taken."""
_PRESSURES: Final = ("barometer", "pressure")
ARCHIVE: Final = ".zip"
_USUAL_PLACE, _CAMERA_PLACE = "pocket", "helmet"
_IN_A_POCKET: Final = "the telephone is assumed to have been in a pocket (give PLACE=FILE, such as chest=, where not)"


_NAMES: Final = (_GYROSCOPE, _LOCATION, *dict.fromkeys(name for names in _ACCELERATIONS for name in names), *_PRESSURES)
"""Files of an export that are read, without their suffix."""


def app_files(folder: Path) -> list[Path]:
    """Return the files of an app's export that are read, where ``folder`` holds one; else nothing."""
    by_name = {path.stem.lower(): path for path in sorted(folder.iterdir()) if path.suffix.lower() == ".csv"}
    if not {_GYROSCOPE, _LOCATION} <= by_name.keys():
        return []
    return [by_name[name] for name in _NAMES if name in by_name]


@contextmanager
def files_given(files: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield the files themselves; of one folder or one archive with an app's export, the files in it.

    An archive is unpacked into a folder that is there as long.  Raises InputError for an archive without an export.
    """
    if len(files) != 1:
        yield list(files)
    elif files[0].suffix.lower() == ARCHIVE:
        with TemporaryDirectory() as name:
            folder = Path(name)
            unpack(files[0], tuple(f"{stem}.csv" for stem in _NAMES), folder)
            within = app_files(folder)
            if not within:
                problem = "it holds no Gyroscope.csv and Location.csv of a telephone's app"
                raise InputError(files[0], "", problem, "unpack it, and give its files with their places")
            yield within
    else:
        yield (app_files(files[0]) if files[0].is_dir() else []) or list(files)


def with_places(files: Sequence[Path]) -> tuple[list[Path], tuple[str, ...]]:
    """Return the files with the place of a telephone in a pocket before an app's gyroscope and accelerometer, or before
    the one file of a telephone's sensors.

    Files that have a place already keep it, and where a sensor has one nothing is assumed.  Orientations of sensors
    (``opensense``) come once for each place that their columns name.  The second value says in words what was assumed.
    """
    files = [placed for path in files for placed in _sensors_in(path)]
    free = {path.stem.lower(): path for path in files if split_place(path) is None and path.suffix.lower() == ".csv"}
    films = [path for path in files if split_place(path) is None and path.suffix.lower() in CAMERAS]
    placed = {pair[0] for path in files if (pair := split_place(path)) is not None}
    places: dict[Path, str | None] = {}
    notes: tuple[str, ...] = ()
    if _GYROSCOPE in free and not placed - {BAROMETER}:
        taken = next((names for names in _ACCELERATIONS if free.keys() >= set(names)), ())
        unused = {name for names in _ACCELERATIONS for name in names} - set(taken)
        places |= {free[name]: _USUAL_PLACE for name in (_GYROSCOPE, *taken)}
        places |= {free[name]: None for name in unused if name in free}  # the acceleration in another form
        notes = (_IN_A_POCKET,)
    elif len(logs := [free[name] for name in free if name.split("_")[-1] == SENSOR]) == 1 and not placed - {BAROMETER}:
        places[logs[0]] = _USUAL_PLACE
        notes = (_IN_A_POCKET,)
    elif len(films) == 1 and not placed - {BAROMETER}:
        files = [*files, Path(f"{_CAMERA_PLACE}={films[0]}")]
        notes = ("the camera is assumed to have been on the helmet (give PLACE=FILE, such as chest=, where not)",)
    if BAROMETER not in placed:
        pressure = next((free[name] for name in _PRESSURES if name in free), None)
        places |= {} if pressure is None else {pressure: BAROMETER}
    given: list[Path] = []
    for path in files:
        place = places.get(path, "")
        if place is not None:
            given.append(Path(f"{place}={path}") if place else path)
    return given, notes


def _sensors_in(path: Path) -> list[Path]:
    """Return a file with the place of every sensor in it, or the file alone where its columns name none."""
    known = path.suffix.lower() == SUFFIX and split_place(path) is None and path.is_file()
    places = places_in(path) if known else ()
    return [Path(f"{place}={path}") for place in places] or [path]
