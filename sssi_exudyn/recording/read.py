"""The reader of a recording's folder: ``recording.toml`` and the files it names, each checked against the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from sssi_exudyn.bodies.skier.boot import Cuff
from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.core.text import one_line, plus_minus
from sssi_exudyn.io.files import inside, sha256
from sssi_exudyn.io.settings import (
    Settings,
    check_keys,
    name_of,
    numbers_of,
    read_toml,
    table_of,
    text_of,
)
from sssi_exudyn.recording.cross_checks.catalogue import CHECKS
from sssi_exudyn.recording.cross_checks.check import Evidence, hold_against_each_other
from sssi_exudyn.recording.equipment import read_equipped_ski
from sssi_exudyn.recording.few_sensors.complete import Ground, complete, ground_of, use_barometer_heights
from sssi_exudyn.recording.few_sensors.posture_model import JOINTS, Body
from sssi_exudyn.recording.file_tables import (
    about_plants,
    keys_of,
    read_elevations,
    read_gps_table,
    read_insoles_table,
    read_motion,
    read_poles_table,
)
from sssi_exudyn.recording.instruments.bvh import Bvh
from sssi_exudyn.recording.instruments.gps import Gps, enu_from
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.recording.recording import (
    _AZIMUTH,
    _STEEPEST,
    FILE,
    NEARBY,
    OPTIONAL,
    Equipment,
    Heading,
    Recording,
    Skier,
    Slope,
)
from sssi_exudyn.recording.sensor_tables import read_sensors
from sssi_exudyn.recording.slope_and_heading import CAPTURE_HEADING_SIGMA, SlopeAndHeading, estimate_slope_and_heading
from sssi_exudyn.recording.snow import read_snow
from sssi_exudyn.recording.uncertainty import Uncertainty

NOT_GIVEN: Final = "is not stated; estimated:"
"""Words of a notice about slope or heading that were estimated."""
_ASSUMED: Final = {
    "skier.mass_kg": ("the skier weighs", "kg"),
    "skier.height_m": ("the skier is", "m tall"),
    "equipment.skis": ("the skis are", ""),
    "equipment.ski_mass_kg": ("a ski weighs", "kg"),
    "equipment.boot_mass_kg": ("a boot weighs", "kg"),
    "equipment.ankle_to_ski_base_m": ("the ankle is", "m above the snow"),
    "equipment.boot_centre_m": ("the boot's centre is", "m ahead of the ankle"),
    "gps.segment": ("the receiver is carried at the joint", ""),
    "gps.offset_m": ("it is", "m to the left of, above and ahead of that joint"),
    "gps.sigma_m": ("a fix is exact to", "m"),
}
"""Words before and after each value that an import may assume."""
_TABLES: Final = (
    *("format", "name", "note", "notes", "assumed", "skier", "equipment", "slope", "snow", "terrain", "uncertainty"),
    "began",
    *("motion", "sensors", "barometer", "gps", "insoles", "poles"),
)
_FEWEST_FIXES: Final = 4
"""Minimum number of fixes; a track of fewer has no direction to start from."""
_SHORTEST: Final = 1.0
"""Minimum time that all instruments cover together, s; less is no run."""
_LONGEST_NOTICE: Final = 500
_MOST_RUNS: Final = 8
"""Maximum number of other runs of a slope: each takes as long to read as the run itself, and eight show nearly all."""

_STEEP_PISTE: Final = float(np.deg2rad(40.0))
"""Inclination of the steepest groomed pistes, rad: 78 %, 38°."""


def read_recording(folder: str | Path) -> Recording:
    """Read the recording in ``folder``, and other runs of the slope that it names.

    Raises InputError, with file, place and fix, for anything in a folder that cannot be used.
    """
    folder, settings = _read_settings(Path(folder))
    return _with_runs(_read_alone(folder, settings), settings)


def _read_settings(folder: Path) -> tuple[Path, Settings]:
    """Return a recording's folder and the content of its file."""
    if not folder.is_dir():
        what = "this is a file, not a recording's folder" if folder.exists() else "the folder does not exist"
        raise InputError(folder, "", what, f"give the folder that holds {FILE}")
    toml = folder / FILE
    inside(folder, FILE, toml, "")
    settings = read_toml(toml)
    check_keys(
        settings,
        _TABLES,
        toml,
        "",
    )
    if settings.get("format") != 1 or isinstance(settings["format"], bool):
        raise InputError(toml, "format", f"{settings.get('format')!r} is not known", "write format = 1")
    return folder, settings


def _read_alone(folder: Path, settings: Settings) -> Recording:
    """Read the recording of a folder without other runs."""
    toml = folder / FILE
    name = name_of(settings, "name", toml, "")
    hashes = {FILE: sha256(toml)}
    skier, notices = _read_skier(settings, toml)
    notices += _read_notes(settings, toml)
    equipment = _read_equipment(folder, settings, toml, hashes)
    given_slope = _read_slope(settings, toml)
    if "sensors" in settings:
        return _read_few_sensors(folder, settings, toml, hashes, skier, equipment, given_slope, notices)
    notices += _assumed_boots(settings, toml)
    bvh, given_heading = read_motion(folder, settings, toml, hashes)
    gps = read_gps_table(folder, settings, toml, hashes, bvh.names, (float(bvh.time[0]), float(bvh.time[-1])))
    insoles = read_insoles_table(folder, settings, toml, hashes)
    poles = read_poles_table(folder, settings, toml, hashes)
    start, stop, cut = _overlap(toml, bvh, gps, insoles)
    notices += bvh.notes + cut
    if poles is not None:
        notices += about_plants(poles)
    if insoles is not None:
        notices += insoles.notes
    setting = SlopeAndHeading(None, None, ("there is no [gps]",))
    if gps is not None:
        notices += gps.notes
        setting = estimate_slope_and_heading(bvh, gps, equipment.ankle_to_ski_base, given_heading)
    elevations = read_elevations(folder, settings, toml, hashes, gps)
    evidence = Evidence(
        toml=toml,
        skier=skier,
        equipment=equipment,
        files=_files(folder, settings),
        bvh=bvh,
        gps=gps,
        insoles=insoles,
        elevations=elevations,
        start=start,
        stop=stop,
        slope=given_slope,
        heading=given_heading,
        setting=setting,
    )
    checked, doubts = hold_against_each_other(evidence, CHECKS)
    notices += doubts
    if checked.clock_sigma > 0.0 and checked.bvh is not None and checked.gps is not None:
        # slope and heading from clocks that disagreed
        bvh, gps, insoles, start, stop = checked.bvh, checked.gps, checked.insoles, checked.start, checked.stop
        setting = estimate_slope_and_heading(bvh, gps, equipment.ankle_to_ski_base, given_heading)
    slope, slope_notices = _choose_slope(given_slope, setting, toml)
    heading, heading_notices = _choose_heading(given_heading, setting, toml)
    return Recording(
        name=name,
        note=text_of(settings, "note", toml, "", default=""),
        folder=folder,
        skier=skier,
        equipment=equipment,
        slope=slope,
        bvh=bvh,
        heading=heading,
        gps=gps,
        insoles=insoles,
        start=start,
        stop=stop,
        hashes=hashes,
        notices=_clean(notices + slope_notices + heading_notices),
        elevations=elevations,
        uncertainty=_read_uncertainty(settings, toml, checked.clock_sigma),
        poles=poles,
        began=_read_began(settings, toml),
        snow=read_snow(settings, toml),
    )


def _read_few_sensors(
    folder: Path,
    settings: Settings,
    toml: Path,
    hashes: dict[str, str],
    skier: Skier,
    equipment: Equipment,
    given: Slope | None,
    notices: tuple[str, ...],
) -> Recording:
    """Read a recording without a capture: its posture is completed from its sensors."""
    if "motion" in settings:
        raise InputError(toml, "[[sensors]]", "there is a [motion] as well", "leave one of them")
    if "poles" in settings:
        problem = "load cells of poles need captured hands"
        raise InputError(toml, "[poles]", problem, "leave [poles] out, or record the motion")
    imus, barometer = read_sensors(folder, settings, toml, hashes)
    covered = (max(float(imu.time[0]) for imu in imus), min(float(imu.time[-1]) for imu in imus))
    gps = read_gps_table(folder, settings, toml, hashes, JOINTS, covered)
    if gps is None:
        raise InputError(toml, "[gps]", "the table is missing", "few sensors also need fixes: add [gps]")
    notices += gps.notes
    if barometer is not None:
        gps, done = use_barometer_heights(gps, barometer)
        notices += done
    try:
        setting = SlopeAndHeading(None, None if given else ground_of(gps, gps.barometric))
    except SssiError as error:
        setting = SlopeAndHeading(None, None, (str(error),))
    evidence = Evidence(toml, skier, equipment, _files(folder, settings), imus=imus, gps=gps)
    evidence, doubts = hold_against_each_other(evidence, CHECKS)
    slope, slope_notices = _choose_slope(given, setting, toml)
    body = Body(skier.height, skier.mass, equipment.boot_mass + equipment.ski_mass, equipment.ankle_to_ski_base)
    try:
        made = complete(evidence.imus, gps, Ground(slope.inclination, slope.fall_line_azimuth), body)
    except SssiError as error:
        raise InputError(
            toml, "[[sensors]]", str(error), "give the run itself, with sensors and fixes on one clock"
        ) from None
    insoles = read_insoles_table(folder, settings, toml, hashes)
    start, stop, cut = _overlap(toml, made.bvh, made.gps, insoles)
    if insoles is not None:
        notices += insoles.notes
    elevations = read_elevations(folder, settings, toml, hashes, gps)
    evidence = replace(
        evidence, imus=(), gps=made.gps, insoles=insoles, elevations=elevations, start=start, stop=stop, slope=given
    )
    doubts += hold_against_each_other(evidence, CHECKS)[1]
    return Recording(
        name=name_of(settings, "name", toml, ""),
        note=text_of(settings, "note", toml, "", default=""),
        folder=folder,
        skier=skier,
        equipment=equipment,
        slope=slope,
        bvh=made.bvh,
        heading=Heading(slope.fall_line_azimuth, True, made.heading_sigma),
        gps=made.gps,
        insoles=insoles,
        start=start,
        stop=stop,
        hashes=hashes,
        notices=_clean(notices + slope_notices + doubts + made.notes + cut),
        completed=made,
        elevations=elevations,
        uncertainty=_read_uncertainty(settings, toml, 0.0 if made.lag is None else made.lag.sigma),
        began=_read_began(settings, toml),
        snow=read_snow(settings, toml),
    )


def _files(folder: Path, settings: Settings) -> dict[str, Path]:
    """Return the path of every instrument's file, by its table; sensors are counted from 1."""
    tables = {name: settings[name] for name in ("motion", "gps", "insoles") if name in settings}
    tables |= {f"sensors {number}": table for number, table in enumerate(settings.get("sensors", ()), 1)}
    return {name: folder / table["file"] for name, table in tables.items()}


def _clean(notices: tuple[str, ...]) -> tuple[str, ...]:
    """Return notices as lines that can be shown, since they hold names from files."""
    return tuple(one_line(notice, _LONGEST_NOTICE) for notice in notices)


def _read_skier(settings: Settings, toml: Path) -> tuple[Skier, tuple[str, ...]]:
    table = table_of(settings, "skier", toml)
    check_keys(table, keys_of(Skier, "sex", "name"), toml, "[skier]")
    sex = text_of(table, "sex", toml, "[skier]", default="male")
    if sex not in ("male", "female"):
        raise InputError(toml, "[skier] sex", f"{sex!r} has no anthropometric table", 'write "male" or "female"')
    notices = () if "sex" in table else (f"{FILE}: the skier's sex is not stated; the table for men is used",)
    name = name_of(table, "name", toml, "[skier]") if "name" in table else ""
    return Skier(sex=sex, name=name, **numbers_of(Skier, table, toml, "[skier]")), notices


def _read_began(settings: Settings, toml: Path) -> float | None:
    """Return the UTC of the clock's zero, s since 1970; None where it is not stated."""
    if "began" not in settings:
        return None
    began = settings["began"]
    if not isinstance(began, datetime) or began.tzinfo is None:
        problem = f"{str(began)[:40]!r} is no date and time of day with its zone"
        raise InputError(toml, "began", problem, "write it without quotes, such as began = 2026-02-17 10:12:00Z")
    return began.timestamp()


def _read_notes(settings: Settings, toml: Path) -> tuple[str, ...]:
    """Return the values that were assumed when the folder was made, and the notes of the readers of that time."""
    lists = {}
    for key in ("assumed", "notes"):
        lists[key] = settings.get(key, [])
        if not isinstance(lists[key], list) or not all(isinstance(text, str) for text in lists[key]):
            raise InputError(toml, key, "this is not a list of texts", f'write {key} = ["…"]')
    if not lists["assumed"]:
        return tuple(lists["notes"])
    values = []
    for name in lists["assumed"]:
        table, _, key = name.partition(".")
        place = settings.get(table)
        if not isinstance(place, Mapping) or key not in place:
            raise InputError(toml, "assumed", f"{name!r} is nowhere in this file", "take it off the list")
        values.append(_assumed_words(name, place[key]))
    words = f"assumed, as it was not stated: {'; '.join(values)}; to correct it, see the list in {FILE}"
    return (words, *lists["notes"])


def _assumed_words(name: str, value: object) -> str:
    """Say an assumed value in words; one that no import assumes has its name."""
    before, after = _ASSUMED.get(name, (name.replace("_", " ").replace(".", ", "), ""))
    shown = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    return f"{before} {shown} {after}".rstrip()


def _read_equipment(folder: Path, settings: Settings, toml: Path, hashes: dict[str, str]) -> Equipment:
    table = table_of(settings, "equipment", toml)
    check_keys(table, (*keys_of(Equipment, "skis"), *keys_of(Cuff)), toml, "[equipment]")
    skis = name_of(table, "skis", toml, "[equipment]")
    if "/" in skis or skis.endswith(".toml"):  # a ski file; other names are looked up in the catalogue
        hashes[skis] = sha256(inside(folder, skis, toml, "[equipment] skis"))
    cuffs = numbers_of(Cuff, table, toml, "[equipment]", optional=tuple(quantities(Cuff)))
    equipment = Equipment(skis=skis, **numbers_of(Equipment, table, toml, "[equipment]", optional=OPTIONAL), **cuffs)
    read_equipped_ski(equipment, folder, toml)
    return equipment


def _assumed_boots(settings: Settings, toml: Path) -> tuple[str, ...]:
    """Return a notice of the assumed place of the boots on the skis, where it is not stated."""
    if "boot_centre_m" in table_of(settings, "equipment", toml):
        return ()
    words = "the ski's mark is assumed to be under the ankle; with a real boot it is some 7 cm ahead"
    return (f"{FILE}: the boot's centre on the ski (boot_centre_m) is not stated; {words}",)


def _read_slope(settings: Settings, toml: Path) -> Slope | None:
    if "slope" not in settings:
        return None
    table = table_of(settings, "slope", toml)
    check_keys(table, keys_of(Slope), toml, "[slope]")
    numbers = numbers_of(Slope, table, toml, "[slope]")
    return Slope(numbers["inclination"], numbers["fall_line_azimuth"])


def _with_runs(recording: Recording, settings: Settings) -> Recording:
    """Add the other runs of the slope that ``[terrain]`` names; each is read without the runs that it names itself."""
    names = settings.get("terrain", {}).get("runs", [])
    gps, folder, toml, place = recording.gps, recording.folder, recording.folder / FILE, "[terrain] runs"
    if not isinstance(names, list) or not all(isinstance(name, str) and name.strip() for name in names):
        raise InputError(toml, place, "this is no list of folders", 'write runs = ["../other_run"]')
    if len(names) > _MOST_RUNS:
        raise InputError(toml, place, f"{len(names)} runs", f"name {_MOST_RUNS} at most, those that lie nearest")
    runs, hashes, known = [], dict(recording.hashes), {folder.resolve()}
    for name in names:
        shown = repr(one_line(name, _LONGEST_NOTICE))
        other_folder, others = _read_settings(_beside(folder, name, toml, place))
        if other_folder.resolve() in known:
            raise InputError(toml, place, f"{shown} is this run or named before", "leave it out")
        known.add(other_folder.resolve())
        other = _read_alone(other_folder, others)
        if other.gps is None or gps is None:
            raise InputError(toml, place, f"{shown} has no fixes whose heights show the snow", "leave it out")
        apart = _apart(gps, other.gps)
        if apart > NEARBY:
            problem = f"{shown} lies {apart:.0f} m from this run's path"
            raise InputError(toml, place, problem, f"name runs within {NEARBY:.0f} m")
        runs.append(other)
        hashes |= {f"{name}/{file}": digest for file, digest in other.hashes.items()}
    return replace(recording, runs=tuple(runs), hashes=hashes)


def _beside(folder: Path, name: str, toml: Path, place: str) -> Path:
    """Return the folder of another run, which has to be in the same folder as this one, links followed.

    A recording may come from someone else: it names what lies next to it, nothing farther away.
    """
    shown = repr(one_line(name, _LONGEST_NOTICE))
    try:
        path, around = (folder / name).resolve(), folder.resolve().parent
    except (OSError, RuntimeError, ValueError):  # a loop of links, a NUL
        path, around = Path(), folder
    if path.parent != around or not path.is_dir():
        problem = f"there is no folder {shown} next to this recording"
        raise InputError(toml, place, problem, 'put the runs of a slope into one folder, and write "../other_run"')
    return folder / name


def _apart(gps: Gps, other: Gps) -> float:
    """Return the distance over ground between the nearest fixes of two runs, m."""
    there = enu_from(other.enu, other.origin, gps.origin)
    return float(np.min(cKDTree(gps.enu[:, :2]).query(there[:, :2])[0]))


def _read_uncertainty(settings: Settings, toml: Path, lag: float = 0.0) -> Uncertainty:
    """Read ``[uncertainty]``; what it leaves out has its usual value.

    ``lag`` (s) is the standard deviation of a clock that was estimated.
    """
    usual = replace(Uncertainty(), clock=max(Uncertainty.clock, lag))
    if "uncertainty" not in settings:
        return usual
    table = table_of(settings, "uncertainty", toml)
    check_keys(table, keys_of(Uncertainty), toml, "[uncertainty]")
    names = tuple(quantities(Uncertainty))
    return replace(usual, **numbers_of(Uncertainty, table, toml, "[uncertainty]", optional=names))


def _overlap(toml: Path, bvh: Bvh, gps: Gps | None, insoles: Insoles | None) -> tuple[float, float, tuple[str, ...]]:
    """Return the first and last time that all instruments cover, and a notice where much of the motion is lost."""
    spans = {"[motion]": bvh.time}
    if gps is not None:
        spans["[gps]"] = gps.time
    if insoles is not None:
        spans["[insoles]"] = insoles.time
    start = max(float(time[0]) for time in spans.values())
    stop = min(float(time[-1]) for time in spans.values())
    spans_text = ", ".join(f"{name} {time[0]:.2f} to {time[-1]:.2f} s" for name, time in spans.items())
    shortest, time = min(spans.items(), key=lambda span: float(span[1][-1] - span[1][0]))
    if time[-1] - time[0] < _SHORTEST:
        problem = f"{time[-1] - time[0]:.2g} s are too short for a run"
        raise InputError(toml, shortest, problem, f"export the whole run, at least {_SHORTEST:g} s of it")
    if stop - start < _SHORTEST:
        raise InputError(toml, "time_offset_s", f"the clocks do not overlap: {spans_text}", "correct the time_offset_s")
    if gps is not None:
        within = int(np.count_nonzero(gps.between(start, stop)))
        if within < _FEWEST_FIXES:
            problem = f"{within} fixes between {start:.2f} and {stop:.2f} s, where there is motion too: {spans_text}"
            raise InputError(toml, "[gps]", problem, f"at least {_FEWEST_FIXES} are needed; are its times in seconds?")
    motion = float(bvh.time[-1] - bvh.time[0])
    if stop - start < 0.9 * motion:
        return start, stop, (f"all instruments together cover {start:.2f} to {stop:.2f} s only: {spans_text}",)
    return start, stop, ()


def _choose_slope(given: Slope | None, setting: SlopeAndHeading, toml: Path) -> tuple[Slope, tuple[str, ...]]:
    if given is not None:
        return given, ()
    estimate = setting.slope
    if estimate is None or not np.deg2rad(1.0) < estimate.inclination.value < _STEEPEST:
        steep = "" if estimate is None else f"it comes out at {np.rad2deg(estimate.inclination.value):.1f}°"
        why = steep or "; ".join(setting.why_not)
        raise InputError(toml, "[slope]", f"not given, and no estimate is possible: {why}", "give [slope]")
    slope = Slope(
        inclination=estimate.inclination.value,
        fall_line_azimuth=estimate.azimuth.value % _AZIMUTH,
        estimated=True,
        sigma_inclination=estimate.inclination.sigma,
        sigma_fall_line_azimuth=estimate.azimuth.sigma,
    )
    notice = (
        f"{FILE}: the slope {NOT_GIVEN} {_degrees(slope.inclination, slope.sigma_inclination)}"
        f" towards {_degrees(slope.fall_line_azimuth, slope.sigma_fall_line_azimuth)}"
    )
    if slope.inclination > _STEEP_PISTE:
        return slope, (notice, f"{FILE}: that is steeper than pistes are: is the altitude in feet? Give [slope] if not")
    return slope, (notice,)


def _choose_heading(given: float | None, setting: SlopeAndHeading, toml: Path) -> tuple[Heading, tuple[str, ...]]:
    if given is not None:
        return Heading(given, False, CAPTURE_HEADING_SIGMA), ()
    estimate = setting.heading
    if estimate is None:
        raise InputError(
            toml,
            "[motion] heading_deg",
            f"not given, and no estimate is possible: {'; '.join(setting.why_not)}",
            "give it (azimuth of the BVH +z axis, clockwise from north)",
        )
    value = estimate.value % _AZIMUTH
    notice = f"{FILE}: the capture's heading {NOT_GIVEN} {_degrees(value, estimate.sigma)}"
    return Heading(value, True, estimate.sigma), (notice,)


def _degrees(value: float, sigma: float) -> str:
    """Return an angle (rad) in degrees, with the digits that its standard deviation (rad) justifies."""
    return f"{plus_minus(np.rad2deg(value), np.rad2deg(sigma))}°"
