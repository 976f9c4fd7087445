"""Files in ZIP archives from outside: the list of them and what is unpacked are bounded before the work."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_BYTES
from sssi_exudyn.io.files import read_bytes

_END, _END_SIZE, _LOCATOR = b"PK\x05\x06", 22, b"PK\x06\x07"
_MOST_LISTED: Final = 200_000
"""Maximum size of an archive's list of files, bytes; apps write a dozen files."""
_DAMAGED: Final = (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError, ValueError, OSError)
"""What damaged, encrypted or unknown archives raise."""


def member_of(path: Path, names: tuple[str, ...], limit: int = MAX_BYTES) -> tuple[str, bytes]:
    """Return name and content of the first of ``names`` that an archive has, in whichever folder of it.

    Raises InputError for a damaged or encrypted archive, one with more files than any app writes, none of the names,
    and more than ``limit`` bytes.
    """
    data = read_bytes(path, limit)
    tail = data[-65_536 - _END_SIZE :]
    end = tail.rfind(_END)
    fix = "export it from the app again"
    if end < 0 or len(tail) - end < _END_SIZE:
        raise InputError(path, "", "damaged, or no archive", fix)
    (listed,) = struct.unpack_from("<I", tail, end + 12)
    if listed > _MOST_LISTED or tail[max(end - 20, 0) : end].startswith(_LOCATOR):
        raise InputError(path, "", "more files than any app writes", fix)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            there = {PurePosixPath(name).name: name for name in archive.namelist()}
            name = next((name for name in names if name in there), "")
            if not name:
                listed_names = ", ".join(sorted(there))[:200]
                raise InputError(path, "", f"it holds no {' or '.join(names)}, but {listed_names or 'nothing'}", fix)
            with archive.open(there[name]) as stream:
                content = stream.read(limit + 1)
    except _DAMAGED:
        raise InputError(path, "", "the archive is damaged or encrypted", fix) from None
    if len(content) > limit:
        raise InputError(path, name, f"it has more than {limit / 1e6:.0f} MB", "export the day alone")
    return name, content
