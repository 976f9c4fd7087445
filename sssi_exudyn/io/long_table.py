"""Logs of hours, read in pieces: what is not numbers of the needed columns is dropped as soon as it was seen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_LINE, MAX_LOG, MAX_LOG_LINES
from sssi_exudyn.io.files import open_regular

_PIECE: Final = 4_000_000
"""Bytes that are held as text at once; more than the longest line has."""

Rows = list[tuple[int, str]]
"""Line number and text of lines that are not empty."""


def pieces_of_lines(path: Path) -> Iterator[Rows]:
    """Yield the lines of a UTF-8 text piece by piece; every line ending is taken, empty lines are left out.

    Raises InputError where the file cannot be read, is empty, is no UTF-8, or has more bytes, lines or longer lines
    than any log has.
    """
    number, size, rest = 1, 0, b""
    with open_regular(path) as stream:
        while True:
            try:
                read = stream.read(_PIECE)
            except OSError as error:
                fix = "put it there or correct its path"
                raise InputError(path, "", f"the file cannot be read ({error.strerror})", fix) from None
            size += len(read)
            if size > MAX_LOG:
                raise InputError(path, "", f"the file has more than {MAX_LOG / 1e6:.0f} MB", "cut it to one day")
            whole, rest = _split(path, rest + read, number, last=not read)
            rows = _rows(path, whole, number)
            number += whole.count(b"\n")
            if number > MAX_LOG_LINES:
                raise InputError(path, f"line {number}", "more lines than any day has", "cut the file to one day")
            if rows:
                yield rows
            if not read:
                break
    if not size:
        raise InputError(path, "", "the file is empty", "export it again")


def _split(path: Path, data: bytes, number: int, *, last: bool) -> tuple[bytes, bytes]:
    """Return the whole lines of a piece, with plain line feeds, and the line that goes on in the next piece."""
    if not last and data.endswith(b"\r"):  # a line feed may follow
        whole, held = data[:-1], data[-1:]
    else:
        whole, held = data, b""
    if b"\r" in whole:
        whole = whole.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    end = len(whole) if last else whole.rfind(b"\n") + 1
    rest = whole[end:] + held
    if len(rest) > MAX_LINE:
        place = f"line {number + whole.count(bytes([10]))}"
        raise InputError(path, place, "longer than any line of a run", "export it again")
    return whole[:end], rest


def _rows(path: Path, whole: bytes, number: int) -> Rows:
    """Return the lines of a piece that begins at line ``number``."""
    try:
        text = whole.decode("utf-8-sig" if number == 1 else "utf-8")
    except UnicodeDecodeError:
        raise InputError(path, f"line {number} or behind it", "this is not UTF-8 text", "save it as UTF-8") from None
    rows = [(number + i, line) for i, line in enumerate(text.split("\n")) if line.strip()]
    for place, line in rows:
        if len(line) > MAX_LINE:
            raise InputError(path, f"line {place}", "longer than any line of a run", "export it again")
    return rows
