"""OpenSim's storage format (``.mot``, ``.sto``), written and read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.table import numbers

GROUND_FROM_LEVEL: Final[Array] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from (x forward, y left, z up) to (x forward, y up, z right)."""
_LONGEST_HEAD: Final = 1 << 16
"""Bytes in which the names of all columns stand."""


@dataclass(frozen=True)
class Storage:
    """A table as ``.mot`` and ``.sto`` hold it: ``values`` (n, c) under ``columns``, the first of them time (s)."""

    name: str
    columns: tuple[str, ...]
    values: Array
    in_degrees: bool


def storage_text(table: Storage) -> str:
    """Return the table as OpenSim reads it (version 1 of the format).

    13 figures: places that are differentiated twice at 2 ms then give accelerations to some 1e-5 m/s².
    """
    head = (
        f"{table.name}\nversion=1\nnRows={len(table.values)}\nnColumns={len(table.columns)}\n"
        f"inDegrees={'yes' if table.in_degrees else 'no'}\nendheader\n"
    )
    rows = "\n".join("\t".join(f"{value:.13g}" for value in row) for row in table.values)
    return f"{head}{chr(9).join(table.columns)}\n{rows}\n"


def storage_columns(path: Path) -> tuple[str, ...]:
    """Return the names of the columns of a ``.mot`` or ``.sto``; none where its head holds none."""
    with path.open("rb") as file:
        lines = file.read(_LONGEST_HEAD).decode("utf-8", "replace").split("\n")
    ends = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), len(lines))
    return tuple(lines[ends + 1].split()) if ends + 1 < len(lines) else ()


def read_storage(path: Path, text: str) -> Storage:
    """Read a ``.mot`` or ``.sto`` strictly: the header's counts must be those of the table.

    Raises InputError with the line of the fault.
    """
    lines = text.split("\n")
    ends = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if ends is None or ends + 1 >= len(lines):
        raise InputError(path, "header", "no line 'endheader' with a table after it", "write it again from OpenSim")
    pairs = (line.partition("=") for line in lines[:ends])
    head = {key.strip().lower(): value.strip() for key, separator, value in pairs if separator}
    columns = tuple(lines[ends + 1].split())
    rows = [(number, line) for number, line in enumerate(lines[ends + 2 :], ends + 3) if line.strip()]
    for key, count in (("nrows", len(rows)), ("ncolumns", len(columns)), ("datarows", len(rows))):
        if key in head and head[key] != str(count):
            raise InputError(path, "header", f"{key} is {head[key]}, the table has {count}", f"write {count}")
    if not rows or columns[:1] != ("time",):
        raise InputError(path, "table", "no rows, or the first column is not time", "write it again from OpenSim")
    values = numbers(path, rows, len(columns), None)
    said = any("angles are in degrees" in line.lower() for line in lines[:ends])  # OpenSim before 3, and its analyses
    in_degrees = head["indegrees"].lower() == "yes" if "indegrees" in head else said
    return Storage(lines[0].strip(), columns, values, in_degrees)
