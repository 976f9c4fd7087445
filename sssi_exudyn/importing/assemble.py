"""A recording's folder made from files of instruments and apps.

Facts that no file holds (who skied, on what, where the antenna sat) come as ``Answers``.  Unstated ones get usual
values, which are reported as assumed.  Clocks, and a slope without fixes, are never assumed: they give an InputError
that names the missing option.  The folder appears only once it reads as a recording.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.importing.answers import Answers
from sssi_exudyn.importing.bvh_writer import bvh_text
from sssi_exudyn.importing.defaults import OF_TELEPHONES, PLACES, UNCERTAIN, USUAL
from sssi_exudyn.importing.motion_formats import MOTION_READERS, read_motion
from sssi_exudyn.importing.sensor_logs import (
    PRESSURE,
    covered_by,
    read_logs,
    split_place,
    write_pressure,
    write_sensors,
)
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.writing import clear_errors, folder_lock
from sssi_exudyn.recording.instruments.fixes import OPTIONAL, REQUIRED, Fixes
from sssi_exudyn.recording.instruments.gps import READERS, gps_from_fixes, read_fixes
from sssi_exudyn.recording.instruments.imu import PLACES as IMU_PLACES
from sssi_exudyn.recording.instruments.insoles import is_insoles, read_insoles
from sssi_exudyn.recording.instruments.poles import read_poles
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import FILE, Recording

MOTION, GPS, INSOLES, POLES, SENSORS = "motion.bvh", "gps.csv", "insoles.csv", "poles.csv", "sensors"
_EQUIPMENT: Final = ("skis", "ski_mass_kg", "boot_mass_kg", "ankle_to_ski_base_m", "boot_centre_m")
_OF_FIXES: Final = ("antenna_joint", "antenna_offset_m", "gps_sigma_m")
_DAY: Final = 86400.0
_LONGEST_NOTE: Final = 500
_DIGITS: Final = {"time_s": 6, "latitude_deg": 9, "longitude_deg": 9}
"""Decimals of the columns of fixes; nine of a degree are 0.1 mm.  Other columns have four."""


@dataclass(frozen=True)
class _Sources:
    """The file of each kind of data."""

    motion: Path | None
    gps: Path | None
    insoles: Path | None
    poles: Path | None
    sensors: tuple[tuple[str, Path], ...] = ()
    """Place and file of each single sensor, where there is no capture."""

    @property
    def first(self) -> Path:
        """File that an error names where no file holds the needed fact."""
        return self.motion or self.sensors[0][1]

    def of(self, name: str) -> Path | None:
        """Return the source of a file of the recording."""
        return {MOTION: self.motion, GPS: self.gps, INSOLES: self.insoles, POLES: self.poles}.get(name)


def option_of(name: str) -> str:
    """Return the command line's option for an answer."""
    return "--" + name.replace("_", "-")


def import_recording(files: Sequence[Path], out: Path, answers: Answers) -> Recording:
    """Make the recording folder ``out`` from ``files``, recognised by suffix and header.

    The files are one motion capture and at most one file each of fixes, insoles and load cells in the poles.  Instead
    of the capture they may be single sensors' files, each with its place (``sensor_logs.split_place``).

    Raises InputError for files without a reader, two of a kind, whatever a reader refuses, and missing answers.  Raises
    it too for an ``out`` that holds a recording already, and for what ``read_recording`` refuses of the result.
    """
    sources = _sort_sources(files)
    with folder_lock(out), clear_errors(out):
        if (out / FILE).exists():
            raise InputError(out / FILE, "", "there is a recording already", "choose another folder with --out")
        made = out / ".import"
        shutil.rmtree(made, ignore_errors=True)
        made.mkdir()
        try:
            _write(made, sources, answers)
            recording = _read_back(made, sources)
            for name in (MOTION, SENSORS, GPS, INSOLES, POLES, FILE):  # the file that makes it a recording comes last
                if (made / name).exists():
                    (made / name).replace(out / name)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    return replace(recording, folder=out)


def _sort_sources(files: Sequence[Path]) -> _Sources:
    paths: dict[str, Path] = {}
    sensors = tuple(one for one in map(split_place, files) if one is not None)
    for path in files:
        if split_place(path) is not None:
            continue
        kind = _kind(path)
        if kind in paths:
            raise InputError(path, "", f"a second file of {kind}, after {paths[kind]}", "give one of a kind")
        paths[kind] = path
    if sensors and "motion" in paths:
        raise InputError(paths["motion"], "", "there are single sensors as well", "give one or the other")
    if sensors:
        if "poles" in paths:
            raise InputError(paths["poles"], "", "forces of poles need a motion capture", "leave them out, or add one")
        return _Sources(None, paths.get("fixes"), paths.get("insoles"), None, sensors)
    if "motion" not in paths:
        raise InputError(files[0], "", "no file holds a motion capture", f"add one: {', '.join(MOTION_READERS)}")
    return _Sources(paths["motion"], paths.get("fixes"), paths.get("insoles"), paths.get("poles"))


def _kind(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix in MOTION_READERS:
        return "motion"
    if suffix in READERS:
        if suffix == ".csv" and is_insoles(path):
            return "poles" if "pole" in path.stem.lower() else "insoles"  # both have a force left and one right
        return "fixes"
    known = ", ".join((*MOTION_READERS, *READERS))
    raise InputError(path, "", f"no reader for {path.suffix!r}", f"export it as one of {known}")


def _write(made: Path, sources: _Sources, answers: Answers) -> None:
    fixes = None if sources.gps is None else read_fixes(sources.gps, answers.gps_sigma_m)
    answers, assumed = _with_usual(answers, sources, fixes)
    began, notes = None, () if fixes is None else fixes.notes
    covered = (0.0, 0.0)
    if sources.motion is not None:
        bvh, began = read_motion(sources.motion, answers.height_m)
        notes += bvh.notes
        covered = (0.0, float(bvh.time[-1] - bvh.time[0]))
        (made / MOTION).write_text(bvh_text(bvh), encoding="utf-8")
    logs = read_logs(sources.sensors)
    if logs:
        began = logs[0].began
        covered = covered_by(logs)
        notes += tuple(note for log in logs for note in log.notes)
    _check_answers(sources, fixes, began, answers)
    given = (sources.motion, *(path for _, path in sources.sensors), sources.gps, sources.insoles, sources.poles)
    settings: dict[str, Any] = {
        "format": 1,
        "name": one_line(answers.name or (sources.motion.stem if sources.motion else made.parent.resolve().name)),
        "note": f"imported from {', '.join(one_line(path.name) for path in given if path is not None)}",
        "skier": _without_none({"mass_kg": answers.mass_kg, "height_m": answers.height_m, "sex": answers.sex}),
        "equipment": _without_none({name: getattr(answers, name) for name in _EQUIPMENT}),
    }
    if assumed:
        settings["assumed"] = [".".join(PLACES[name]) for name in assumed]
        settings["uncertainty"] = {key: sigma for name in assumed for key, sigma in UNCERTAIN.get(name, {}).items()}
    if notes:
        settings["notes"] = [one_line(words, _LONGEST_NOTE) for words in dict.fromkeys(notes)]
    if sources.motion is not None:
        settings["motion"] = _without_none({"file": MOTION, "heading_deg": answers.heading_deg})
    else:
        settings |= write_sensors(logs, made)
    for place, path in sources.sensors:
        if place == PRESSURE:
            write_pressure(path, made, answers.mass_kg or 0.0)
            settings["insoles"] = {"file": INSOLES}
    if answers.slope_deg is not None:
        settings["slope"] = {
            "inclination_deg": answers.slope_deg,
            "fall_line_azimuth_deg": answers.fall_line_deg,
        }
    if fixes is not None and sources.gps is not None:
        settings["gps"] = _gps_table(sources, fixes, began, answers, covered)
        (made / GPS).write_text(_csv(fixes.columns), encoding="utf-8")
    if sources.insoles is not None:
        read_insoles(sources.insoles)  # errors name this file, not the copy
        settings["insoles"] = {"file": INSOLES}
        (made / INSOLES).write_bytes(read_bytes(sources.insoles))
    if sources.poles is not None:
        read_poles(sources.poles)
        settings["poles"] = {"file": POLES}
        (made / POLES).write_bytes(read_bytes(sources.poles))
    (made / FILE).write_text(tomli_w.dumps(settings), encoding="utf-8")


def _with_usual(answers: Answers, sources: _Sources, fixes: Fixes | None) -> tuple[Answers, tuple[str, ...]]:
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


def _check_answers(sources: _Sources, fixes: Fixes | None, began: float | None, answers: Answers) -> None:
    """Raise InputError that names every option that is needed and not given."""
    needed: list[str] = []
    if answers.slope_deg is not None or answers.fall_line_deg is not None:
        needed += ["slope_deg", "fall_line_deg"]
    if fixes is None:
        needed += ["slope_deg", "fall_line_deg", *(["heading_deg"] if sources.motion else [])]
    elif not _common_clock(sources, fixes) and (fixes.began is None or began is None):
        needed.append("gps_offset_s")
    missing = [option_of(name) for name in dict.fromkeys(needed) if getattr(answers, name) is None]
    if missing:
        fix = "give these options (sssi import --help)"
        if option_of("gps_offset_s") in missing:
            fix += ", --gps-offset-s 0 where motion and fixes count from the same zero"
        raise InputError(sources.first, "", f"no file holds {', '.join(missing)}", fix)


def _gps_table(
    sources: _Sources, fixes: Fixes, began: float | None, answers: Answers, covered: tuple[float, float]
) -> dict[str, Any]:
    """Return ``[gps]``; ``covered`` (s) is the stretch that motion capture or sensors cover."""
    path, offset = sources.first if sources.gps is None else sources.gps, 0.0
    if answers.gps_offset_s is not None:
        offset = answers.gps_offset_s
    elif not _common_clock(sources, fixes) and fixes.began is not None and began is not None:
        offset = fixes.began - began
        if abs(offset) > _DAY:
            difference = f"by their clocks the fixes begin {offset / _DAY:.4g} days after the capture"
            raise InputError(path, "", difference, "give --gps-offset-s")
    where = np.array(answers.antenna_offset_m)
    # errors name this file and its places, not the copy
    gps_from_fixes(
        path,
        fixes,
        segment=str(answers.antenna_joint),
        offset=where,
        sigma=answers.gps_sigma_m,
        time_offset=offset,
        covered=covered,
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


def _common_clock(sources: _Sources, fixes: Fixes) -> bool:
    """Return whether fixes count from the same zero as the capture or the sensors."""
    return fixes.common_clock or (fixes.clock_of_sensors and bool(sources.sensors))


def _without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if value is not None}


def _csv(columns: dict[str, Array]) -> str:
    names = [name for name in (*REQUIRED, *OPTIONAL) if name in columns]
    row = ",".join(f"%.{_DIGITS.get(name, 4)}f" for name in names)
    values = np.column_stack([columns[name] for name in names])
    return "\n".join([",".join(names), *(row % tuple(line) for line in values.tolist())]) + "\n"


def _read_back(made: Path, sources: _Sources) -> Recording:
    """Read the recording like any other; an error names the file that the user gave."""
    try:
        return read_recording(made)
    except InputError as error:
        name = Path(error.file).name
        source = sources.of(name)
        if source is not None:
            raise InputError(source, error.place, error.problem, error.fix) from None
        raise InputError("sssi import", error.place, error.problem, f"{error.fix} (by its option)") from None
