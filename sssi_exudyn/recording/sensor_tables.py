"""``[[sensors]]`` and ``[barometer]`` of a ``recording.toml``: the single sensors and their places on the skier."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import quantities, quantity
from sssi_exudyn.io.files import inside, sha256
from sssi_exudyn.io.settings import Settings, check_keys, key_of, numbers_of, table_of, text_of
from sssi_exudyn.recording.instruments.imu import PLACES, Barometer, Imu, read_barometer, read_imu

_DAY: Final = 86400.0


@dataclass(frozen=True)
class _Offset:
    time_offset: float = quantity(
        0.0, "s", low=-_DAY, high=_DAY, source="a day", meaning="added to the instrument's time"
    )


def read_sensors(
    folder: Path, settings: Settings, toml: Path, hashes: dict[str, str]
) -> tuple[tuple[Imu, ...], Barometer | None]:
    """Read every file that the tables name, and store its hash in ``hashes``.

    Raises InputError for anything but tables, for unknown or repeated places, and for faulty files.
    """
    tables = settings["sensors"]
    if not isinstance(tables, list) or not tables or not all(isinstance(table, Mapping) for table in tables):
        raise InputError(
            toml, "[[sensors]]", "this must be tables", "write [[sensors]] with file and on, once a sensor"
        )
    imus: list[Imu] = []
    for number, table in enumerate(tables, 1):
        where = f"[[sensors]] {number}"
        check_keys(table, ("file", "on", *_keys()), toml, where)
        place = text_of(table, "on", toml, where)
        if place not in PLACES:
            raise InputError(toml, f"{where} on", f"{place!r} is no place", f"use one of: {', '.join(PLACES)}")
        if place in [imu.place for imu in imus]:
            raise InputError(toml, f"{where} on", f"there is a sensor on {place!r} already", "leave one of them")
        imus.append(read_imu(_file(folder, table, toml, where, hashes), place, _offset(table, toml, where)))
    if "barometer" not in settings:
        return tuple(imus), None
    table = table_of(settings, "barometer", toml)
    check_keys(table, ("file", *_keys()), toml, "[barometer]")
    path = _file(folder, table, toml, "[barometer]", hashes)
    return tuple(imus), read_barometer(path, _offset(table, toml, "[barometer]"))


def _keys() -> tuple[str, ...]:
    return tuple(key_of(about) for about in quantities(_Offset).values())


def _offset(table: Settings, toml: Path, where: str) -> float:
    return numbers_of(_Offset, table, toml, where, optional=("time_offset",)).get("time_offset", 0.0)


def _file(folder: Path, table: Settings, toml: Path, where: str, hashes: dict[str, str]) -> Path:
    name = text_of(table, "file", toml, where)
    hashes[name] = sha256(inside(folder, name, toml, f"{where} file"))
    return folder / name
