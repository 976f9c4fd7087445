"""A recording's folder made from files of instruments and apps.

Facts that no file holds (who skied, on what, where the antenna sat) come as ``Answers``.  Unstated ones get usual
values, which are reported as assumed.  Clocks, and a slope without fixes, are never assumed: they give an InputError
that names the missing option.  The folder appears only once it reads as a recording.
"""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.defaults import OF_TELEPHONES, PLACES, UNCERTAIN, USUAL
from sssi_exudyn.importing.motion_capture.bvh_writer import bvh_text
from sssi_exudyn.importing.motion_capture.motion_formats import MOTION_READERS, read_motion
from sssi_exudyn.importing.sensors.app_exports import with_places
from sssi_exudyn.importing.sensors.insole_exports import SUFFIXES as INSOLE_EXPORTS
from sssi_exudyn.importing.sensors.insole_exports import InsoleExport, is_insole_export, read_insole_export
from sssi_exudyn.importing.sensors.sensor_logs import (
    BAROMETER,
    PRESSURE,
    Log,
    covered_by,
    cut_log,
    holds_channels,
    read_logs,
    split_place,
    titles_in,
    write_pressure,
    write_sensors,
)
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.separators import rows_of_table
from sssi_exudyn.io.writing import clear_errors, folder_lock
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.fixes import OPTIONAL, REQUIRED, Fixes, number_of
from sssi_exudyn.recording.instruments.fixes_gnss_logger import is_gnss_log
from sssi_exudyn.recording.instruments.fixes_nmea import is_nmea
from sssi_exudyn.recording.instruments.gps import READERS, gps_from_fixes, read_fixes
from sssi_exudyn.recording.instruments.imu import PLACES as IMU_PLACES
from sssi_exudyn.recording.instruments.insoles import is_insoles, read_insoles
from sssi_exudyn.recording.instruments.poles import read_poles
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording
from sssi_exudyn.terrain.elevation_model import SUFFIXES, copy_elevations, epsg_of

MOTION, GPS, INSOLES, POLES, SENSORS = "motion.bvh", "gps.csv", "insoles.csv", "poles.csv", "sensors"
_EQUIPMENT: Final = ("skis", "ski_mass_kg", "boot_mass_kg", "ankle_to_ski_base_m", "boot_centre_m")
_OF_FIXES: Final = ("antenna_joint", "antenna_offset_m", "gps_sigma_m")
_DAY: Final = 86400.0
_LATEST_START: Final = 3600.0
"""Time (s) of the first sample from which on the clock of a logger is not that of a run."""
_LONGEST_NOTE: Final = 500
_LONGEST_HEADER: Final = 300
"""Characters of a header that an error quotes."""
_WORKBOOKS: Final = (".xlsx", ".xlsm", ".xls", ".ods", ".numbers")
_OF_PLACES: Final = re.compile(r"(?<![a-z])(lat|lon|east)", re.IGNORECASE)
"""Beginning of a word that only columns of places have, known ones or not."""
_DIGITS: Final = {"time_s": 6, "latitude_deg": 9, "longitude_deg": 9}
"""Decimals of the columns of fixes; nine of a degree are 0.1 mm.  Other columns have four."""


@dataclass(frozen=True)
class Sources:
    """The file of each kind of data."""

    motion: Path | None
    gps: Path | None
    insoles: Path | None
    poles: Path | None
    sensors: tuple[tuple[str, Path], ...] = ()
    """Place and file of each single sensor, where there is no capture."""
    notes: tuple[str, ...] = ()

    @property
    def first(self) -> Path:
        """File that an error names where no file holds the needed fact."""
        return self.motion or (self.sensors[0][1] if self.sensors else Path())

    @property
    def given(self) -> tuple[Path, ...]:
        """Return all files."""
        given = (self.motion, *(path for _, path in self.sensors), self.gps, self.insoles, self.poles)
        return tuple(path for path in given if path is not None)

    def of(self, name: str) -> Path | None:
        """Return the source of a file of the recording."""
        return {MOTION: self.motion, GPS: self.gps, INSOLES: self.insoles, POLES: self.poles}.get(name)


@dataclass(frozen=True)
class Material:
    """The content of the files of one recording, or of a day of them.

    sources : the files
    fixes, bvh, logs, insoles : the fixes, the capture, the single sensors, and insoles of another format than ours
    began : UTC of time 0 of capture or sensors, s since 1970; None where no file has it
    cut : stretch (s) of the files' clock to which insoles are still to be cut; None for all of it
    about : what is said of the recording besides its files
    start_utc : UTC of the clock's zero where ``began`` no longer tells it, s since 1970
    """

    sources: Sources
    fixes: Fixes | None
    bvh: Bvh | None
    logs: tuple[Log, ...]
    began: float | None
    insoles: InsoleExport | None = None
    cut: tuple[float, float] | None = None
    about: str = ""
    start_utc: float | None = None

    @property
    def covered(self) -> tuple[float, float]:
        """Return the stretch (s) that the capture or all sensors cover."""
        if self.bvh is not None:
            return 0.0, float(self.bvh.time[-1] - self.bvh.time[0])
        return covered_by(self.logs)


def option_of(name: str) -> str:
    """Return the command line's option for an answer."""
    return "--" + name.replace("_", "-")


def import_recording(files: Sequence[Path], out: Path, answers: Answers) -> Recording:
    """Make the recording folder ``out`` from ``files``, recognised by suffix and header.

    The files are one motion capture and at most one file each of fixes, insoles and load cells in the poles.  Instead
    of the capture they may be single sensors' files, each with its place (``sensor_logs.split_place``), or those of a
    telephone's app under their own names (``app_exports``).

    Raises InputError for files without a reader, two of a kind, whatever a reader refuses, and missing answers.  Raises
    it too for an ``out`` that holds a recording already, and for what ``read_recording`` refuses of the result.
    """
    refuse_existing(out)
    sources = sort_sources(files)
    check_posture(sources)
    return import_material(read_material(sources, answers), out, answers)


def import_material(material: Material, out: Path, answers: Answers) -> Recording:
    """Make the recording folder ``out`` of what was read; see ``import_recording``."""
    material, answers = _from_first_sample(material, answers)
    with folder_lock(out), clear_errors(out):
        refuse_existing(out)
        made = out / ".import"
        shutil.rmtree(made, ignore_errors=True)
        made.mkdir()
        try:
            _write(made, material, answers)
            recording = _read_back(made, material.sources, answers)
            names = sorted(path.name for path in made.iterdir() if path.name != FILE)
            for name in (*names, FILE):  # the file that makes it a recording comes last
                (made / name).replace(out / name)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    return replace(recording, folder=out)


def _from_first_sample(material: Material, answers: Answers) -> tuple[Material, Answers]:
    """Return sensors and fixes on a clock whose zero is the whole second before them, and the answers that are left.

    Loggers count from when they were switched on, or from 1970.  A run's own clock begins with the run.
    """
    fixes = material.fixes
    if material.bvh is not None or fixes is None or abs(material.covered[0]) < _LATEST_START:
        return material, answers
    start = math.floor(material.covered[0])
    offset = offset_of_fixes(material, answers)
    columns = {**fixes.columns, "time_s": fixes.columns["time_s"] + (offset - start)}
    began = None if fixes.began is None else fixes.began + start - offset
    moved = replace(
        material,
        fixes=replace(fixes, columns=columns, began=began, common_clock=True),
        logs=tuple(cut_log(log, material.logs[0], start, math.inf) for log in material.logs),
        began=None if material.began is None else material.began + start,
        cut=(start, math.inf),
        about=f"{material.about}; time 0 is {start} s of the sensors' clock",
    )
    return moved, replace(answers, gps_offset_s=None)


def refuse_existing(out: Path) -> None:
    """Raise InputError where a folder holds a recording already."""
    if (out / FILE).exists():
        raise InputError(out / FILE, "", "there is a recording already", "choose another folder with --out")


def sort_sources(files: Sequence[Path]) -> Sources:
    """Return the file of each kind.  Raises InputError for two of a kind, and what cannot be used together."""
    files, notes = with_places(files)
    paths: dict[str, Path] = {}
    sensors = tuple(one for one in map(split_place, files) if one is not None)
    for path in files:
        placed = split_place(path)
        if path.suffix.lower() in _WORKBOOKS:
            file = path if placed is None else placed[1]
            raise InputError(file, "", "it is a workbook of a spreadsheet", "export its sheet as CSV")
        if placed is not None:
            continue
        kind = _kind(path)
        if kind in paths:
            raise InputError(path, "", f"a second file of {kind}, after {paths[kind]}", "give one of a kind")
        paths[kind] = path
    if sensors and "motion" in paths:
        raise InputError(paths["motion"], "", "there are single sensors as well", "give one or the other")
    if sensors and "poles" in paths:
        raise InputError(paths["poles"], "", "forces of poles need a motion capture", "leave them out, or add one")
    motion, fixes, insoles, poles = (paths.get(kind) for kind in ("motion", "fixes", "insoles", "poles"))
    return Sources(motion, fixes, insoles, poles, sensors, notes)


def has_two_of_a_kind(files: Sequence[Path]) -> bool:
    """Return whether files hold two captures, two tracks or two of another kind, so that they are of several runs."""
    kinds = []
    for path in with_places(files)[0]:
        if split_place(path) is None:
            with suppress(InputError):  # what is wrong with a file is said where it is imported
                kinds.append(_kind(path))
    return len(kinds) > len(set(kinds))


def check_posture(sources: Sources) -> None:
    """Raise InputError where no file shows how the skier moves."""
    if sources.motion is None and not any(place in IMU_PLACES for place, _ in sources.sensors):
        problem = "no file holds a motion capture or a sensor's gyroscope and accelerometer"
        fix = f"add a capture ({', '.join(MOTION_READERS)}), or a sensor with its place, such as pocket=phone.csv"
        raise InputError(sources.given[0], "", problem, fix)


def read_material(sources: Sources, answers: Answers) -> Material:
    """Read the files.  Raises InputError for whatever a reader refuses."""
    fixes = None if sources.gps is None else read_fixes(sources.gps, answers.gps_sigma_m)
    bvh, began = (None, None) if sources.motion is None else read_motion(sources.motion, answers.height_m)
    logs = tuple(read_logs(sources.sensors))
    insoles = None if sources.insoles is None or is_insoles(sources.insoles) else read_insole_export(sources.insoles)
    return Material(sources, fixes, bvh, logs, logs[0].began if logs else began, insoles)


def _kind(path: Path) -> str:
    place, has_place, _ = str(path).partition("=")
    if has_place and place.isidentifier() and not path.exists():
        known = ", ".join(f"{place}=" for place in (*IMU_PLACES, BAROMETER, PRESSURE))
        raise InputError(path, "", f"{place!r} is no place of a sensor", f"write one of {known} before the file")
    suffix = path.suffix.lower()
    if suffix in MOTION_READERS:
        return "motion"
    if suffix == ".csv" and holds_channels(path):
        fix = f"write its place before it: pocket={path.name} (or {', '.join(IMU_PLACES)})"
        raise InputError(path, "", "it is a sensor's file, and where the sensor was is not given", fix)
    if suffix == ".csv" and is_insoles(path):
        return "poles" if "pole" in path.stem.lower() else "insoles"  # both have a force left and one right
    if suffix in INSOLE_EXPORTS and is_insole_export(path):
        return "insoles"
    if suffix in READERS:
        _check_fixes(path, suffix)
        return "fixes"
    known = ", ".join(dict.fromkeys((*MOTION_READERS, *READERS, *INSOLE_EXPORTS)))
    raise InputError(path, "", f"no reader for {path.suffix!r}", f"export it as one of {known}")


def _check_fixes(path: Path, suffix: str) -> None:
    """Raise InputError for a table or a text, which may be of anything, without fixes of a known kind."""
    if suffix not in (".csv", ".txt", ".log") or is_nmea(path) or (suffix == ".txt" and is_gnss_log(path)):
        return
    if suffix != ".csv":
        fix = f"export it as one of {', '.join(READERS)}, or write its place before a sensor's file: pocket={path.name}"
        raise InputError(path, "", "it is no log of NMEA or GnssLogger, and no export of insoles", fix)
    titles = titles_in(path)
    if not any(_OF_PLACES.search(title) for title in titles):
        listed = one_line(", ".join(filter(None, titles)), _LONGEST_HEADER)
        fix = f"name the columns of fixes {','.join(REQUIRED)}, or write a sensor's place before it: pocket={path.name}"
        raise InputError(path, "header", f"these columns are none of fixes, forces or a sensor: {listed}", fix)


def _write(made: Path, material: Material, answers: Answers) -> None:
    sources, fixes, logs = material.sources, material.fixes, material.logs
    answers, assumed = _with_usual(answers, sources, fixes)
    notes = sources.notes + (() if fixes is None else fixes.notes)
    if material.bvh is not None:
        notes += material.bvh.notes
        (made / MOTION).write_text(bvh_text(material.bvh), encoding="utf-8")
    notes += tuple(note for log in logs for note in log.notes)
    notes += () if material.insoles is None else material.insoles.notes
    if material.insoles is not None and sources.insoles is not None:
        notes += (
            f"{one_line(sources.insoles.name)}: its clock is taken to count from the same zero as"
            f" {one_line(sources.first.name)}'s, as no file says otherwise; where they were started later, give"
            " [insoles] time_offset_s in recording.toml",
        )
    _check_answers(material, answers)
    names = ", ".join(one_line(path.name) for path in sources.given)
    settings: dict[str, Any] = {
        "format": 1,
        "name": one_line(answers.name or (sources.motion.stem if sources.motion else made.parent.resolve().name)),
        "note": f"imported from {names}{material.about}",
        "skier": _without_none(
            {"name": answers.skier, "mass_kg": answers.mass_kg, "height_m": answers.height_m, "sex": answers.sex}
        ),
        "equipment": _without_none({name: getattr(answers, name) for name in _EQUIPMENT}),
    }
    began = _began(material, answers)
    if began is not None:
        settings["began"] = began
    if assumed:
        settings["assumed"] = [".".join(PLACES[name]) for name in assumed]
        settings["uncertainty"] = {key: sigma for name in assumed for key, sigma in UNCERTAIN.get(name, {}).items()}
    if notes:
        settings["notes"] = [one_line(words, _LONGEST_NOTE) for words in dict.fromkeys(notes)]
    if sources.motion is not None:
        settings["motion"] = _without_none({"file": MOTION, "heading_deg": answers.heading_deg})
    else:
        settings |= write_sensors(logs, made)
    if answers.slope_deg is not None:
        settings["slope"] = {
            "inclination_deg": answers.slope_deg,
            "fall_line_azimuth_deg": answers.fall_line_deg,
        }
    if fixes is not None and sources.gps is not None:
        settings["gps"] = _gps_table(material, sources.gps, fixes, answers)
        (made / GPS).write_text(csv_of_fixes(fixes.columns), encoding="utf-8")
    settings |= _write_forces(made, material, answers.mass_kg or 0.0)
    settings |= _copy_terrain(made, material, answers)
    (made / FILE).write_text(tomli_w.dumps(settings), encoding="utf-8")


def _began(material: Material, answers: Answers) -> datetime | None:
    """Return the UTC of the recording's clock's zero to the second; None where no file has it."""
    fixes, began = material.fixes, material.start_utc if material.began is None else material.began
    if began is None and fixes is not None and fixes.began is not None:
        began = fixes.began - offset_of_fixes(material, answers)
    try:
        return None if began is None else datetime.fromtimestamp(round(began), UTC)
    except (ValueError, OverflowError, OSError):  # years that no calendar has
        return None


def _write_forces(made: Path, material: Material, mass: float) -> dict[str, Any]:
    """Write the forces under the feet and along the poles; return their tables of ``recording.toml``."""
    sources, tables = material.sources, dict[str, Any]()
    for place, path in sources.sensors:
        if place == PRESSURE:
            write_pressure(path, made, mass, material.cut)
            tables["insoles"] = {"file": INSOLES}
    if sources.insoles is not None:
        tables["insoles"] = {"file": INSOLES}
        target = made / INSOLES
        if material.insoles is not None:
            target.write_text(material.insoles.table(mass, material.cut), encoding="utf-8")
            _read_as(read_insoles, target, sources.insoles)
        elif material.cut is None:
            read_insoles(sources.insoles)  # errors name this file, not the copy
            target.write_bytes(read_bytes(sources.insoles))
        else:
            target.write_text(_cut_rows(sources.insoles, *material.cut), encoding="utf-8")
            _read_as(read_insoles, target, sources.insoles)
            tables["insoles"]["time_offset_s"] = -material.cut[0]
    if sources.poles is not None:
        read_poles(sources.poles)
        tables["poles"] = {"file": POLES}
        (made / POLES).write_bytes(read_bytes(sources.poles))
    return tables


def _copy_terrain(made: Path, material: Material, answers: Answers) -> dict[str, Any]:
    """Copy the elevation model; return ``[terrain]``, with the difference between its zero and the fixes' unknown."""
    crs = None if answers.dem_crs is None else epsg_of(answers.dem_crs, "sssi import", option_of("dem_crs"))
    if answers.dem is None:
        if crs is not None:
            raise InputError("sssi import", option_of("dem_crs"), "there is no elevation model", "give one with --dem")
        return {}
    path = Path(answers.dem)
    if material.fixes is None:
        raise InputError(path, "", "there are no fixes that say where the run is on it", "add a file of fixes")
    copy = copy_elevations(path, made)
    return {"terrain": _without_none({"file": copy.name, "datum": "other", "crs": crs})}


def _read_as(read: Callable[[Path], object], made: Path, given: Path) -> None:
    """Read a file that was made, so that an error names the one that was given."""
    try:
        read(made)
    except InputError as error:
        raise InputError(given, error.place, error.problem, error.fix) from None


def _cut_rows(path: Path, start: float, stop: float) -> str:
    """Return the header of a table with ``time_s``, and the rows from ``start`` to ``stop`` (s)."""
    head, *rows = (line for _, line in rows_of_table(path))
    clock = [name.strip() for name in head.split(",")].index("time_s")

    def is_within(row: str) -> bool:
        cells = row.split(",")
        return len(cells) > clock and start <= number_of(cells[clock]) <= stop

    return "\n".join([head, *filter(is_within, rows)]) + "\n"


def _with_usual(answers: Answers, sources: Sources, fixes: Fixes | None) -> tuple[Answers, tuple[str, ...]]:
    """Fill the answers with usual values; return them and the names of the assumed ones.

    A single sensor, with fixes, is a telephone, and the receiver is in it.
    """
    places = {place for place, _ in sources.sensors if place in IMU_PLACES}
    usual = {**USUAL, **(OF_TELEPHONES.get(min(places), {}) if len(places) == 1 else {})}
    if answers.antenna_joint is not None:
        usual["antenna_offset_m"] = (0.0, 0.0, 0.0)  # at the joint that is named, not at another joint's usual place
    kept = fixes is not None and "sigma_m" in fixes.columns
    posed = () if sources.motion is not None else ("boot_centre_m",)  # an assumed posture stands over its ankles
    unused = posed + (() if fixes is not None else _OF_FIXES) + (("gps_sigma_m",) if kept else ())
    assumed = tuple(name for name in usual if getattr(answers, name) is None and name not in unused)
    return replace(answers, **{name: usual[name] for name in assumed}), assumed


def _check_answers(material: Material, answers: Answers) -> None:
    """Raise InputError for sensors without fixes, and one that names every option that is needed and not given."""
    sources, fixes, needed = material.sources, material.fixes, list[str]()
    if answers.slope_deg is not None or answers.fall_line_deg is not None:
        needed += ["slope_deg", "fall_line_deg"]
    if fixes is None and sources.motion is None:
        fix = f"add a file of fixes ({', '.join(READERS)})"
        raise InputError(sources.first, "", "there are no fixes, without which single sensors show no run", fix)
    if fixes is None:
        needed += ["slope_deg", "fall_line_deg", "heading_deg"]
    elif not _common_clock(sources, fixes) and (fixes.began is None or material.began is None):
        needed.append("gps_offset_s")
    missing = [option_of(name) for name in dict.fromkeys(needed) if getattr(answers, name) is None]
    if missing:
        fix = "give these options (sssi import --help)"
        if option_of("gps_offset_s") in missing:
            fix += ", --gps-offset-s 0 where motion and fixes count from the same zero"
        raise InputError(sources.first, "", f"no file holds {', '.join(missing)}", fix)


def offset_of_fixes(material: Material, answers: Answers) -> float:
    """Return what is added (s) to the times of the fixes for those of capture or sensors.

    Raises InputError for clocks more than a day apart, and for missing answers.
    """
    _check_answers(material, answers)
    fixes, began = material.fixes, material.began
    if answers.gps_offset_s is not None:
        return answers.gps_offset_s
    if fixes is None or _common_clock(material.sources, fixes) or fixes.began is None or began is None:
        return 0.0
    offset = fixes.began - began
    if abs(offset) > _DAY:
        difference = f"by their clocks the fixes begin {offset / _DAY:.4g} days after the capture"
        raise InputError(material.sources.gps or material.sources.first, "", difference, "give --gps-offset-s")
    return offset


def _gps_table(material: Material, path: Path, fixes: Fixes, answers: Answers) -> dict[str, Any]:
    """Return ``[gps]``."""
    offset = offset_of_fixes(material, answers)
    where = np.array(answers.antenna_offset_m)
    # errors name this file and its places, not the copy
    gps_from_fixes(
        path,
        fixes,
        segment=str(answers.antenna_joint),
        offset=where,
        sigma=answers.gps_sigma_m,
        time_offset=offset,
        covered=material.covered,
    )
    return _without_none(
        {
            "file": GPS,
            "segment": answers.antenna_joint,
            "offset_m": list(answers.antenna_offset_m or ()),
            "sigma_m": None if "sigma_m" in fixes.columns else answers.gps_sigma_m,
            "time_offset_s": round(offset, 6) or None,
        }
    )


def _common_clock(sources: Sources, fixes: Fixes) -> bool:
    """Return whether fixes count from the same zero as the capture or the sensors."""
    return fixes.common_clock or (fixes.clock_of_sensors and bool(sources.sensors))


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if value is not None}


def csv_of_fixes(columns: dict[str, Array]) -> str:
    """Return fixes as a file that ``fixes_csv`` reads; (n,) columns by name."""
    names = [name for name in (*REQUIRED, *OPTIONAL) if name in columns]
    row = ",".join(f"%.{_DIGITS.get(name, 4)}f" for name in names)
    values = np.column_stack([columns[name] for name in names])
    return "\n".join([",".join(names), *(row % tuple(line) for line in values.tolist())]) + "\n"


def _read_back(made: Path, sources: Sources, answers: Answers) -> Recording:
    """Read the recording like any other; an error names the file that the user gave."""
    try:
        return read_recording(made)
    except InputError as error:
        name = Path(error.file).name
        source = {"[motion]": sources.motion, "[gps]": sources.gps, "[insoles]": sources.insoles}.get(
            error.place, sources.of(name)
        )
        if answers.dem is not None and Path(name).suffix in SUFFIXES:
            source = Path(answers.dem)
        if source is not None:
            raise InputError(source, error.place, error.problem, error.fix) from None
        fix = error.fix
        if error.place == "[slope]":
            fix = f"give {option_of('slope_deg')} and {option_of('fall_line_deg')}, or fixes of a run downhill"
        raise InputError(sources.first, error.place, error.problem, fix) from None
