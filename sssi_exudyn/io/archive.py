"""Files in ZIP archives from outside: the list of them and what is unpacked are bounded before the work."""

from __future__ import annotations

import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO, Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_BYTES, MAX_LOG
from sssi_exudyn.io.files import open_regular

_END, _END_SIZE, _LOCATOR, _LOCATOR_SIZE = b"PK\x05\x06", 22, b"PK\x06\x07", 20
_MOST_LISTED: Final = 200_000
"""Maximum size of an archive's list of files, bytes; apps write a few dozen files."""
_PIECE: Final = 1_000_000
"""Bytes that are unpacked at once."""
_DAMAGED: Final = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, ValueError, OSError)
"""What damaged, encrypted or unknown archives raise."""
_FIX: Final = "export it from the app again"


def member_of(path: Path, names: tuple[str, ...], limit: int = MAX_BYTES) -> tuple[str, bytes]:
    """Return name and content of the first of ``names`` that an archive has, in whichever folder of it.

    Raises InputError for a damaged or encrypted archive, one with more files than any app writes, none of the names,
    and more than ``limit`` bytes.
    """
    with _opened(path) as archive:
        there = _files_in(archive)
        name = next((name for name in names if name in there), "")
        if name:
            with archive.open(there[name]) as stream:
                content = stream.read(limit + 1)
    if not name:
        listed = ", ".join(sorted(there))[:200] or "nothing"
        raise InputError(path, "", f"it holds no {' or '.join(names)}, but {listed}", _FIX)
    if len(content) > limit:
        raise InputError(path, name, f"it has more than {limit / 1e6:.0f} MB", "export the day alone")
    return name, content


def unpack(path: Path, names: tuple[str, ...], folder: Path, limit: int = MAX_LOG) -> None:
    """Write those files of an archive into ``folder`` that have one of ``names``, small letters, in whichever folder.

    Raises InputError for a damaged or encrypted archive, one with more files than any app writes, and a file of more
    than ``limit`` bytes.
    """
    with _opened(path) as archive:
        for name, member in _files_in(archive).items():
            if name.lower() not in names:
                continue
            size = 0
            with archive.open(member) as stream, (folder / name).open("wb") as copy:
                while piece := stream.read(_PIECE):
                    size += len(piece)
                    if size > limit:
                        problem = f"it has more than {limit / 1e6:.0f} MB"
                        raise InputError(path, name, problem, "export one day alone")
                    copy.write(piece)


def _files_in(archive: zipfile.ZipFile) -> dict[str, str]:
    """Return the path in the archive of every file, by its name alone."""
    return {PurePosixPath(name).name: name for name in archive.namelist() if not name.endswith("/")}


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open an archive whose list of files is not too long; what is damaged within raises InputError."""
    with open_regular(path) as stream:
        _check_list(path, stream)
        try:
            with zipfile.ZipFile(stream) as archive:
                yield archive
        except _DAMAGED:
            raise InputError(path, "", "the archive is damaged or encrypted", _FIX) from None


def _check_list(path: Path, stream: BinaryIO) -> None:
    """Raise InputError where the archive's end, which states the size of its list, is missing or the list too long."""
    size = stream.seek(0, 2)
    stream.seek(max(size - 65_536 - _END_SIZE, 0))
    tail = stream.read()
    end = tail.rfind(_END)
    if end < 0 or len(tail) - end < _END_SIZE:
        raise InputError(path, "", "damaged, or no archive", _FIX)
    (listed,) = struct.unpack_from("<I", tail, end + 12)
    if listed > _MOST_LISTED or tail[max(end - _LOCATOR_SIZE, 0) : end].startswith(_LOCATOR):
        raise InputError(path, "", "more files than any app writes", _FIX)
    stream.seek(0)
