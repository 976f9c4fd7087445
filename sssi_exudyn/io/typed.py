"""Frozen dataclasses as JSON files: written whole, read back with every field checked against its declared type.

One way of doing it for all results: ``summary.json``, ``diagnosis.json`` and whatever else holds figures.  Keys that a
reader does not know are passed over, so that files may be extended.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

import msgspec

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.writing import to_plain

T = TypeVar("T")


def read_json(path: Path, kind: type[T]) -> T:
    """The object of type ``kind`` in the JSON file ``path``.

    Raises InputError for a file that is missing, no regular file, too large or no JSON, and for a field that is
    missing or of another type, with its place (``$.findings[0].name``).
    """
    content = read_bytes(path)
    try:
        return msgspec.json.decode(content, type=kind)
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at ")
        raise InputError(path, place.strip("`"), problem[:1].lower() + problem[1:], "run again") from None
    except (msgspec.DecodeError, RecursionError, ValueError) as error:
        raise InputError(path, "", f"not JSON ({error})", "run again") from None


def encode(value: Any) -> bytes:
    """Dataclasses, sequences, mappings, texts and finite numbers as JSON."""
    return msgspec.json.encode(value)


def decode(content: bytes, kind: type[T]) -> T:
    """The object of type ``kind`` that ``encode`` gave.  Raises ValueError for anything else."""
    try:
        return msgspec.json.decode(content, type=kind)
    except RecursionError as error:
        raise ValueError(str(error)) from None


def convert(value: Any, kind: type[T]) -> T:
    """Plain data (mappings, lists, numbers) as an object of type ``kind``.  Raises ValueError where they do not fit."""
    return msgspec.convert(to_plain(value), type=kind)


def json_schema(kind: type) -> dict[str, Any]:
    """The JSON Schema (2020-12) of what a file of that type holds."""
    return msgspec.json.schema(kind)
