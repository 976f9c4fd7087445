"""Frozen dataclasses as JSON files: written whole, read back with every field checked against its declared type.

All results use it: ``summary.json``, ``diagnosis.json`` and every other file of figures.  Keys that a
reader does not know are ignored, so that files may be extended.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import msgspec

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.bounds import MAX_DEPTH, MAX_JSON, MAX_NUMBER, MAX_TEXT
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.writing import to_plain

T = TypeVar("T")
_DIGITS = 18
"""Maximum number of digits of a whole number, so that it fits into 64 bits."""


def read_json(path: Path, kind: type[T]) -> T:
    """Read the object of type ``kind`` in the JSON file ``path``.

    Raises InputError for what ``read_table`` refuses, and for a field that is missing or of another type, with its
    place (``$.findings[0].name``).
    """
    table = read_table(path)
    try:
        return msgspec.convert(table, type=kind)
    except ValueError as error:
        raise wrong_field(path, error) from None


def read_table(path: Path) -> dict[str, Any]:
    """Read the JSON object in the file ``path``; its texts are one printable line each, its numbers finite and bounded.

    Raises InputError for a file that is missing, not regular or too large, and for anything but a JSON object.  Raises
    it too for numbers and nesting beyond those of any result.
    """
    content = read_bytes(path, MAX_JSON)
    try:
        table = json.loads(content, parse_float=_number, parse_int=_whole_number, parse_constant=_refuse)
        if not isinstance(table, dict):
            raise InputError(path, "", "holds no table of figures", "run again with this version")
        return {one_line(name): _clean(value, 1) for name, value in table.items()}
    except (RecursionError, ValueError) as error:
        raise InputError(path, "", f"not JSON ({error})", "run again") from None


def wrong_field(path: Path, error: ValueError) -> InputError:
    """Make the error line for a field of another type from the error of ``convert``."""
    problem, _, place = str(error).partition(" - at ")
    return InputError(path, place.strip("`"), problem[:1].lower() + problem[1:], "run again")


def _clean(value: Any, depth: int) -> Any:
    """Return the value with every text on one printable line.  Raises ValueError where it is nested too deeply."""
    if depth > MAX_DEPTH:
        raise ValueError("more tables within tables than any result has")
    if isinstance(value, dict):
        return {one_line(name): _clean(entry, depth + 1) for name, entry in value.items()}
    if isinstance(value, list):
        return [_clean(entry, depth + 1) for entry in value]
    return one_line(value, MAX_TEXT) if isinstance(value, str) else value


def _number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number) or abs(number) > MAX_NUMBER:
        raise ValueError("a number larger than any quantity")
    return number


def _whole_number(text: str) -> int:
    if len(text) > _DIGITS:
        raise ValueError("a number larger than any quantity")
    return int(text)


def _refuse(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number")


def encode(value: Any) -> bytes:
    """Encode dataclasses, sequences, mappings, texts and finite numbers as JSON."""
    return msgspec.json.encode(value)


def decode(content: bytes, kind: type[T]) -> T:
    """Decode the object of type ``kind`` that ``encode`` gave.  Raises ValueError for anything else."""
    try:
        return msgspec.json.decode(content, type=kind)
    except RecursionError as error:
        raise ValueError(str(error)) from None


def convert(value: Any, kind: type[T]) -> T:
    """Convert plain data (mappings, lists, numbers) to an object of type ``kind``.

    Raises ValueError where they do not fit.
    """
    return msgspec.convert(to_plain(value), type=kind)


def json_schema(kind: type) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a file that holds an object of that type."""
    return msgspec.json.schema(kind)
