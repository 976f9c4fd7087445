"""Lines of tables whose cells may be separated by semicolons or tabs, with commas in their place.

Spreadsheets and apps write semicolons and decimal commas where a country does, and may name the separator on a line of
its own.  All readers of tables see commas and decimal points.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.long_table import Rows, pieces_of_lines

_SEPARATORS: Final = (",", ";", "\t")
_MARK: Final = re.compile(r'"?sep=.?"?\s*', re.IGNORECASE)
"""First line of a table that names the separator for spreadsheets."""


def pieces_of_table(path: Path) -> Iterator[Rows]:
    """Yield the lines of a table with commas between cells; see ``pieces_of_lines``, whose errors it raises."""
    separator = ""
    for rows in pieces_of_lines(path):
        kept = rows if separator else _without_mark(rows)
        if kept:
            separator = separator or _separator_of(kept[0][1])
            yield _with_commas(kept, separator)


def rows_of_table(path: Path) -> Rows:
    """Return the lines of a table that are not empty, with commas between cells.

    Raises InputError for what ``read_text`` refuses, and for a table without any line.
    """
    rows = [(number, line) for number, line in enumerate(read_text(path).split("\n"), 1) if line.strip()]
    kept = _without_mark(rows)
    if not kept:
        raise InputError(path, "", "the table is empty", "export it again")
    return _with_commas(kept, _separator_of(kept[0][1]))


def _without_mark(rows: Rows) -> Rows:
    return rows[1:] if _MARK.fullmatch(rows[0][1]) else rows


def _separator_of(header: str) -> str:
    return max(_SEPARATORS, key=header.count)


def _with_commas(rows: Rows, separator: str) -> Rows:
    """Return lines whose cells are separated by commas; commas within cells are decimal ones."""
    if separator == ",":
        return rows
    return [(number, line.replace(",", ".").replace(separator, ",")) for number, line in rows]
