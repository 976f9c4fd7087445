"""TOML files, read within bounds: keys carry units in the file, declared quantities are in SI in the program.

A field declared ``quantity(..., "kg", ...)`` as ``mass`` is the key ``mass_kg``; angles stand in degrees in the file.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.quantity import Quantity, quantities
from sssi_exudyn.core.text import did_you_mean, one_line
from sssi_exudyn.io.bounds import MAX_DEPTH, MAX_NAME, MAX_TOML, MAX_VALUES
from sssi_exudyn.io.files import read_text

_IN_FILE: Final = {
    "kg": ("kg", 1.0),
    "m": ("m", 1.0),
    "s": ("s", 1.0),
    "rad": ("deg", math.pi / 180.0),
    "1": ("share", 1.0),
    "log": ("log", 1.0),
    "K": ("C", 1.0),
    "N": ("N", 1.0),
    "m^2": ("m2", 1.0),
    "N m": ("Nm", 1.0),
    "N m/rad": ("Nm_per_deg", 180.0 / math.pi),
}
"""Unit in the key by SI unit, and the factor from it to SI."""
_ZERO: Final = {"K": 273.15}
"""SI value of what is written as zero, where that is not zero: degrees Celsius."""
_MISTAKEN: Final = {
    "m": {"feet": 0.3048, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254},
    "kg": {"pounds": 0.45359237, "grams": 0.001},
}
"""Units that are often written by mistake for a unit, and their size in it."""

_PART: Final = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_LONG_KEY: Final = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{MAX_DEPTH}}}")
"""Pattern of a dotted key of more parts than tables nest; n parts cost the TOML reader n² of time and memory."""

Settings = Mapping[str, Any]  # Any: what TOML holds is checked value by value below


def read_toml(path: Path) -> Settings:
    """Read a TOML file of any kind.

    Raises InputError with the line where it cannot be understood, and for keys, numbers, nesting and counts beyond the
    bounds.
    """
    text = read_text(path, MAX_TOML)
    key = _LONG_KEY.search(text)
    if key is not None:
        line = text.count("\n", 0, key.start()) + 1
        raise InputError(path, f"line {line}", "a key of too many parts", "write it as in the documentation")
    try:
        settings = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(path, "", f"this is not TOML: {error}", "correct that line") from None
    except (RecursionError, ValueError):  # nested or figured beyond what any file needs
        raise InputError(path, "", "this is not TOML", "write it as in the documentation") from None
    _check_bounds(path, settings)
    return settings


def _check_bounds(path: Path, settings: Settings) -> None:
    """Raise InputError for nesting, names, numbers and counts beyond those of any file."""
    count = 0
    waiting: list[tuple[str, object, int]] = [("", settings, 0)]
    while waiting:
        place, value, depth = waiting.pop()
        count += 1
        if depth > MAX_DEPTH or count > MAX_VALUES:
            what = "tables within tables" if depth > MAX_DEPTH else "values"
            raise InputError(path, place, f"more {what} than any file needs", "write it as in the documentation")
        if isinstance(value, Mapping):
            for name in value:
                if len(name) > MAX_NAME or one_line(name) != name:
                    raise InputError(path, f"{place} {name}".strip(), "this is no key", "write a word")
            waiting += [(_below(place, name, inner), inner, depth + 1) for name, inner in value.items()]
        elif isinstance(value, list):
            waiting += [(place, inner, depth + 1) for inner in value]
        elif isinstance(value, int) and abs(value) >= 2**63:
            raise InputError(path, place, "the number is too large: it is not a number of TOML", "correct it")


def _below(place: str, name: str, value: object) -> str:
    """Return the place of a value, as other messages name it: ``[skier] mass_kg``."""
    return f"{place} {name}" if place else (f"[{name}]" if isinstance(value, Mapping) else name)


def key_of(about: Quantity) -> str:
    """Return the key of a declared quantity in the file: its name and the unit written there."""
    return f"{about.name}_{_IN_FILE[about.unit][0]}"


def table_of(settings: Settings, name: str, path: Path) -> Settings:
    """Return the table ``[name]``; raises InputError when it is missing or is not a table."""
    table = settings.get(name)
    if not isinstance(table, Mapping):
        what = "the table is missing" if table is None else "this must be a table"
        raise InputError(path, f"[{name}]", what, f"write a table [{name}] with its keys below")
    return table


def check_keys(table: Settings, known: Iterable[str], path: Path, place: str) -> None:
    """Raise InputError for an unknown key, with the nearest known one."""
    names = set(known)
    for key in table:
        if key not in names:
            raise InputError(path, f"{place} {key}".strip(), "unknown key", did_you_mean(key, names))


def numbers_of(cls: type, table: Settings, path: Path, place: str, optional: Collection[str] = ()) -> dict[str, float]:
    """Read the declared quantities of the dataclass ``cls`` from a table, in SI, by field name.

    Parameters
    ----------
    optional : names of fields that may be missing; the result then lacks them

    Raises InputError for a missing key, a value that is no number, or one outside its bounds.
    """
    values = {}
    for name, about in quantities(cls).items():
        key = key_of(about)
        if key not in table:
            if name in optional:
                continue
            raise InputError(path, f"{place} {key}", "the key is missing", f"add it: {about.meaning}")
        values[name] = _number(table[key], about, path, f"{place} {key}")
    return values


def table_from(owner: object, *classes: type) -> dict[str, float]:
    """Return the table of the quantities that the dataclasses declare, with the values that ``owner`` has.

    ``numbers_of`` reads the table back.  Quantities that are None are left out.
    """
    declared = [item for cls in classes for item in quantities(cls).items()]
    return {
        key_of(about): (getattr(owner, name) - _ZERO.get(about.unit, 0.0)) / _IN_FILE[about.unit][1]
        for name, about in declared
        if getattr(owner, name) is not None
    }


def text_of(table: Settings, key: str, path: Path, place: str, default: str | None = None) -> str:
    """Return a string; raises InputError when it is missing without a default, empty, or not a string."""
    value = table.get(key, default)
    where = f"{place} {key}".strip()
    if value is None:
        raise InputError(path, where, "the key is missing", f'add {key} = "…"')
    if not isinstance(value, str) or (not value.strip() and value != default):
        raise InputError(path, where, f"{str(value)[:MAX_NAME]!r} is not a text", f'write {key} = "…"')
    return value


def name_of(table: Settings, key: str, path: Path, place: str, default: str | None = None) -> str:
    """Return a string that is shown: one line without invisible characters, of bounded length.

    Raises InputError as ``text_of`` does.
    """
    return one_line(text_of(table, key, path, place, default), MAX_NAME).strip()


def vector_of(table: Settings, key: str, path: Path, place: str, limit: float) -> tuple[float, float, float]:
    """Return three numbers (m), none larger than ``limit``; raises InputError otherwise."""
    value = table.get(key)
    where = f"{place} {key}"
    if value is None:
        raise InputError(path, where, "the key is missing", f"add {key} = [x left, y up, z forward]")
    if not isinstance(value, list) or len(value) != 3 or not all(_is_number(part) for part in value):
        raise InputError(path, where, f"{str(value)[:60]} is not three numbers", "write [x left, y up, z forward] in m")
    if max(abs(part) for part in value) > limit:
        raise InputError(path, where, f"{value} reaches more than {limit:g} m", "give metres, not centimetres or feet")
    return float(value[0]), float(value[1]), float(value[2])


def _number(value: object, about: Quantity, path: Path, place: str) -> float:
    unit, factor = _IN_FILE[about.unit]
    if not _is_number(value):
        raise InputError(path, place, f"{str(value)[:40]!r} is not a number", f"give it in {unit}, without quotes")
    number = float(value)  # type: ignore[arg-type]
    zero = _ZERO.get(about.unit, 0.0)
    low, high = (about.low - zero) / factor, (about.high - zero) / factor
    slack = 1e-9 * max(abs(low), abs(high))  # bounds went through degrees and back
    if not low - slack <= number <= high + slack:
        fix = "correct the value or its unit"
        for name, size in _MISTAKEN.get(unit, {}).items():
            if low <= number * size <= high:
                fix = f"{number:g} {name} would be {number * size:.3g} {unit}: give {unit}"
                break
        raise InputError(path, place, f"{number:g} is outside {low:g} to {high:g} {unit}", fix)
    return number * factor + zero


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False
