"""The tables of ``recording.toml`` that name the file of an instrument or of the ground: checked, and the file read.

Every reader stores the hash of its file in ``hashes``, by the name that the table gives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities, quantity
from sssi_exudyn.io.files import inside, sha256
from sssi_exudyn.io.settings import Settings, check_keys, key_of, numbers_of, table_of, text_of, vector_of
from sssi_exudyn.recording.instruments.bvh import Bvh, read_bvh
from sssi_exudyn.recording.instruments.gps import Gps, read_gps
from sssi_exudyn.recording.instruments.insoles import Insoles, read_insoles
from sssi_exudyn.recording.instruments.poles import Poles, plants_of, read_poles
from sssi_exudyn.recording.recording import _AZIMUTH, Elevations
from sssi_exudyn.terrain.elevation_model import LARGEST, epsg_of, projection_of, usual_sigma

_DATUMS: Final = ("gps", "ellipsoid", "geoid", "other")
"""Zeros of an elevation model's heights: the receiver's, which is the ellipsoid's unless its heights are others; the
geoid; or anything else, which is then taken out.
"""
_DAY: Final = 86400.0


@dataclass(frozen=True)
class _MotionTable:
    heading: float = quantity(
        0.0, "rad", low=-_AZIMUTH, high=_AZIMUTH, source="full circle", meaning="azimuth of the BVH +z axis"
    )
    time_offset: float = quantity(
        0.0, "s", low=-_DAY, high=_DAY, source="a day", meaning="added to the instrument's time"
    )


@dataclass(frozen=True)
class _GpsTable:
    sigma: float = quantity(
        0.02, "m", low=1e-4, high=100.0, source="RTK to telephones", meaning="standard deviation of a horizontal fix"
    )
    height_sigma: float = quantity(
        0.03, "m", low=1e-4, high=1000.0, source="RTK to telephones", meaning="standard deviation of a fix's height"
    )
    time_offset: float = quantity(
        0.0, "s", low=-_DAY, high=_DAY, source="a day", meaning="added to the instrument's time"
    )


@dataclass(frozen=True)
class _FeltTable:
    time_offset: float = quantity(
        0.0, "s", low=-_DAY, high=_DAY, source="a day", meaning="added to the instrument's time"
    )


def read_motion(folder: Path, settings: Settings, toml: Path, hashes: dict[str, str]) -> tuple[Bvh, float | None]:
    """Read ``[motion]``; return the capture, and its heading (rad) where it is stated."""
    table = table_of(settings, "motion", toml)
    check_keys(table, keys_of(_MotionTable, "file"), toml, "[motion]")
    numbers = numbers_of(_MotionTable, table, toml, "[motion]", optional=("heading", "time_offset"))
    path = _instrument(folder, table, toml, "[motion]", hashes)
    if path.suffix.lower() != ".bvh":
        raise InputError(toml, "[motion] file", f"no reader for {path.suffix!r}", "export the motion as .bvh")
    return read_bvh(path, numbers.get("time_offset", 0.0)), numbers.get("heading")


def read_gps_table(
    folder: Path,
    settings: Settings,
    toml: Path,
    hashes: dict[str, str],
    joints: tuple[str, ...],
    covered: tuple[float, float],
) -> Gps | None:
    """Read ``[gps]``; ``covered`` (s) is the stretch that motion capture or sensors cover."""
    if "gps" not in settings:
        return None
    table = table_of(settings, "gps", toml)
    check_keys(table, keys_of(_GpsTable, "file", "segment", "offset_m"), toml, "[gps]")
    numbers = numbers_of(_GpsTable, table, toml, "[gps]", optional=("sigma", "height_sigma", "time_offset"))
    segment = text_of(table, "segment", toml, "[gps]")
    if segment not in joints:
        raise InputError(
            toml, "[gps] segment", f"the motion has no joint {segment!r}", f"use one of: {', '.join(joints[:24])}"
        )
    gps = read_gps(
        _instrument(folder, table, toml, "[gps]", hashes),
        segment=segment,
        offset=np.array(vector_of(table, "offset_m", toml, "[gps]", limit=1.0)),
        sigma=numbers.get("sigma"),
        time_offset=numbers.get("time_offset", 0.0),
        covered=covered,
    )
    if "height_sigma" not in numbers:
        return gps
    return replace(gps, vertical=numbers["height_sigma"] / float(np.median(gps.sigma)))


def read_insoles_table(folder: Path, settings: Settings, toml: Path, hashes: dict[str, str]) -> Insoles | None:
    """Read ``[insoles]``; return None where there is no such table."""
    if "insoles" not in settings:
        return None
    table = table_of(settings, "insoles", toml)
    check_keys(table, keys_of(_FeltTable, "file"), toml, "[insoles]")
    numbers = numbers_of(_FeltTable, table, toml, "[insoles]", optional=("time_offset",))
    return read_insoles(_instrument(folder, table, toml, "[insoles]", hashes), numbers.get("time_offset", 0.0))


def read_poles_table(folder: Path, settings: Settings, toml: Path, hashes: dict[str, str]) -> Poles | None:
    """Read ``[poles]``; return None where there is no such table."""
    if "poles" not in settings:
        return None
    table = table_of(settings, "poles", toml)
    check_keys(table, keys_of(_FeltTable, "file"), toml, "[poles]")
    numbers = numbers_of(_FeltTable, table, toml, "[poles]", optional=("time_offset",))
    return read_poles(_instrument(folder, table, toml, "[poles]", hashes), numbers.get("time_offset", 0.0))


def about_plants(poles: Poles) -> tuple[str, ...]:
    """Describe the pole plants that the load cells show."""
    plants = plants_of(poles)
    impulse = sum(plant.impulse for plant in plants)
    return (*poles.notes, f"the poles were planted {len(plants)} times, {impulse:.0f} N s in all; the model has them")


def read_elevations(
    folder: Path, settings: Settings, toml: Path, hashes: dict[str, str], gps: Gps | None
) -> Elevations | None:
    """Read ``[terrain]``; return None where it names no elevation model."""
    if "terrain" not in settings:
        return None
    table = table_of(settings, "terrain", toml)
    check_keys(table, keys_of(Elevations, "file", "datum", "crs", "runs"), toml, "[terrain]")
    if gps is None:
        raise InputError(toml, "[terrain]", "there are no fixes that say where the run is on it", "add [gps]")
    if set(table) == {"runs"}:
        return None
    datum = text_of(table, "datum", toml, "[terrain]", default="gps")
    if datum not in _DATUMS:
        raise InputError(toml, "[terrain] datum", f"{datum!r} is not known", f"write one of: {', '.join(_DATUMS)}")
    name = text_of(table, "file", toml, "[terrain]")
    hashes[name] = sha256(inside(folder, name, toml, "[terrain] file", LARGEST), LARGEST)
    projection = projection_of(folder / name)
    if projection is not None:
        prj_name = f"{name[: -len(projection.suffix)]}{projection.suffix}"
        hashes[prj_name] = sha256(inside(folder, prj_name, toml, "[terrain] file"))
    crs = epsg_of(text_of(table, "crs", toml, "[terrain]"), toml, "[terrain] crs") if "crs" in table else ""
    numbers = numbers_of(Elevations, table, toml, "[terrain]", optional=("sigma", "geoid_height"))
    if "geoid_height" in numbers and datum != "geoid":
        raise InputError(
            toml, "[terrain] geoid_height_m", f'does not go with datum = "{datum}"', 'write datum = "geoid"'
        )
    same = datum in ("gps", "ellipsoid") or "geoid_height" in numbers
    return Elevations(folder / name, same, crs, **({"sigma": usual_sigma(folder / name)} | numbers))


def _instrument(folder: Path, table: Settings, toml: Path, place: str, hashes: dict[str, str]) -> Path:
    """Return the path of the instrument's file, under the name that the user knows, and store its hash."""
    name = text_of(table, "file", toml, place)
    hashes[name] = sha256(inside(folder, name, toml, f"{place} file"))
    return folder / name


def keys_of(cls: type, *others: str) -> tuple[str, ...]:
    """Return the keys of a table: those of the quantities of a class, and others."""
    return (*(key_of(about) for about in quantities(cls).values()), *others)
