"""Files from outside: regular files only, located inside their folder, bounded in size, decoded and hashed.

Every function raises InputError, with a fix, instead of the operating system's errors.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import BinaryIO, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_BYTES, MAX_LINE, MAX_LINES

_PIECE: Final = 1_000_000
"""Bytes that are read at once where a file is not needed whole."""


def inside(folder: Path, name: str, file: Path, place: str, limit: int = MAX_BYTES) -> Path:
    """Return the path of the regular file ``name`` inside ``folder``, with symlinks followed.

    Parameters
    ----------
    folder : the recording's folder
    name : relative path with forward slashes, as written in ``file`` at ``place``
    limit : bytes that the file may have

    Raises InputError when the path leaves the folder (also by a symlink), is missing, is not a file, is empty or
    has more bytes.
    """
    if not name.strip() or "\0" in name:
        raise InputError(file, place, f"{name!r} is not a file name", "write the name of a file in this folder")
    if PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or "\\" in name:
        raise InputError(
            file, place, f"{name!r} is not a relative path with forward slashes", "move the file into this folder"
        )
    root = folder.resolve()
    try:
        path = (root / name).resolve()
    except (OSError, RuntimeError):  # a loop of symlinks
        raise InputError(file, place, f"{name!r} cannot be resolved", "put the file itself into this folder") from None
    if not path.is_relative_to(root):
        raise InputError(file, place, f"{name!r} leads out of the recording's folder", "copy the file into this folder")
    try:
        about = path.stat()
    except OSError as error:
        fix = f"put it there or correct {place} in {file.name}" if place else "give the recording's folder"
        raise InputError(folder / name, "", f"the file {_reason(error)}", fix) from None
    if not stat.S_ISREG(about.st_mode):
        fix = f"put one there or correct {place} in {file.name}" if place else "put a file there"
        raise InputError(folder / name, "", "this is not a file", fix)
    if about.st_size == 0:
        raise InputError(folder / name, "", "the file is empty", "export it again")
    if about.st_size > limit:
        raise InputError(
            folder / name,
            "",
            f"the file has {about.st_size / 1e6:.0f} MB, more than {limit / 1e6:.0f} MB",
            "cut it to the run and export that alone",
        )
    return path


@contextmanager
def open_regular(path: Path) -> Iterator[BinaryIO]:
    """Open a regular file for reading, without waiting for a pipe or a device that may never end.

    Raises InputError where the path is not a regular file or cannot be read.
    """
    try:
        # O_NONBLOCK: else a pipe without a writer would block here already.  Windows has no such flag.
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        regular = stat.S_ISREG(os.fstat(number).st_mode)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise InputError(path, "", f"the file {_reason(error)}", "put it there or correct its path") from None
    if not regular:
        os.close(number)
        raise InputError(path, "", "this is not a file", "give the path of a file")
    with os.fdopen(number, "rb") as stream:
        yield stream


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Read the bytes of a regular file.

    Raises InputError where the file cannot be read, is empty or has more than ``limit`` bytes.
    """
    with open_regular(path) as stream, _clear_errors(path):
        data = stream.read(limit + 1)  # bounded even if the file grows meanwhile
    if not data.strip():
        raise InputError(path, "", "the file is empty", "export it again")
    if len(data) > limit:
        raise InputError(path, "", f"the file has more than {limit / 1e6:.0f} MB", "cut it to the run")
    return data


def read_text(path: Path, limit: int = MAX_BYTES) -> str:
    """Read the text of a UTF-8 file, with or without byte order mark; every line ending becomes a line feed.

    Raises InputError for what ``read_bytes`` refuses, other encodings, more than ``MAX_LINES`` lines and lines of more
    than ``MAX_LINE`` bytes.
    """
    data = read_bytes(path, limit)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    ends = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
    if len(ends) > MAX_LINES:
        raise InputError(path, f"line {MAX_LINES + 1}", "more lines than any run has", "cut the file to the run")
    lengths = np.diff(ends, prepend=-1, append=len(data))
    if np.max(lengths) > MAX_LINE:
        raise InputError(path, f"line {np.argmax(lengths) + 1}", "longer than any line of a run", "export it again")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            path, f"byte {error.start + 1}", "this is not UTF-8 text", "save the file as UTF-8 (plain text)"
        ) from None
    if not text.strip():
        raise InputError(path, "", "the file is empty", "export it again")
    return text


def sha256(path: Path, limit: int = MAX_BYTES) -> str:
    """Return ``"sha256:<hex>"`` of a file's bytes, which are read piece by piece.

    Raises InputError where the file cannot be read, is empty or has more than ``limit`` bytes.
    """
    digest, left = hashlib.sha256(), limit
    with open_regular(path) as stream, _clear_errors(path):
        while piece := stream.read(min(left + 1, _PIECE)):
            digest.update(piece)
            left -= len(piece)
            if left < 0:
                raise InputError(path, "", f"the file has more than {limit / 1e6:.0f} MB", "cut it to the run")
    if left == limit:
        raise InputError(path, "", "the file is empty", "export it again")
    return "sha256:" + digest.hexdigest()


def is_as_written(path: Path, written: object, older: Callable[[], str]) -> bool:
    """Tell whether a file has the SHA-256 that was ``written`` down for it, if any; earlier versions wrote down that
    of its numbers, which ``older`` computes.
    """
    return written is None or written == sha256(path).removeprefix("sha256:") or written == older()


@contextmanager
def _clear_errors(path: Path) -> Iterator[None]:
    """Turn what the system says while a file is read into one clear InputError."""
    try:
        yield
    except OSError as error:
        raise InputError(path, "", f"the file {_reason(error)}", "put it there or correct its path") from None


def _reason(error: Exception) -> str:
    if isinstance(error, FileNotFoundError):
        return "does not exist"
    return f"cannot be read ({error.strerror if isinstance(error, OSError) else 'its name is no name'})"
