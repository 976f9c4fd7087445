"""Files of a recording: found only inside its folder, bounded in size, decoded and hashed; nothing is trusted.

Every function raises InputError, with a fix, instead of the operating system's errors.
"""

from __future__ import annotations

import hashlib
import stat
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Final

from sssi_exudyn.core.errors import InputError

MAX_BYTES: Final = 50_000_000
"""The largest file that is read, bytes: two and a half minutes of capture at 100 Hz, 59 joints with all channels."""
MAX_LINES: Final = 2_000_000
"""The most lines a text may have: five hours at 100 Hz."""


def inside(folder: Path, name: str, file: Path, place: str) -> Path:
    """The regular file ``name`` inside ``folder``, symlinks followed.

    Parameters
    ----------
    folder : the recording's folder
    name : relative path with forward slashes, as written in ``file`` at ``place``

    Raises InputError when the path leaves the folder (also by a symlink), is missing, is not a file, is empty or
    is larger than ``MAX_BYTES``.
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
        reason = "does not exist" if isinstance(error, FileNotFoundError) else f"cannot be read ({error.strerror})"
        fix = f"put it there or correct {place} in {file.name}" if place else "give the recording's folder"
        raise InputError(folder / name, "", f"the file {reason}", fix) from None
    if not stat.S_ISREG(about.st_mode):
        raise InputError(folder / name, "", "this is not a file", f"correct {place} in {file}")
    if about.st_size == 0:
        raise InputError(folder / name, "", "the file is empty", "export it again")
    if about.st_size > MAX_BYTES:
        raise InputError(
            folder / name,
            "",
            f"the file has {about.st_size / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f} MB",
            "cut it to the run and export that alone",
        )
    return path


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """The bytes of a file; raises InputError where it cannot be read, is empty or has more than ``limit`` bytes."""
    try:
        with path.open("rb") as stream:
            data = stream.read(limit + 1)  # bounded even if the file grows meanwhile
    except OSError as error:
        reason = "does not exist" if isinstance(error, FileNotFoundError) else f"cannot be read ({error.strerror})"
        raise InputError(path, "", f"the file {reason}", "put it there or correct its path") from None
    if not data.strip():
        raise InputError(path, "", "the file is empty", "export it again")
    if len(data) > limit:
        raise InputError(path, "", f"the file has more than {limit / 1e6:.0f} MB", "cut it to the run")
    return data


def read_text(path: Path, limit: int = MAX_BYTES) -> str:
    """The text of a UTF-8 file, with or without byte order mark, every line ending as a line feed.

    Raises InputError for what ``read_bytes`` refuses, other encodings and more than ``MAX_LINES`` lines.
    """
    try:
        text = read_bytes(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            path, f"byte {error.start + 1}", "this is not UTF-8 text", "save the file as UTF-8 (plain text)"
        ) from None
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.strip():
        raise InputError(path, "", "the file is empty", "export it again")
    if text.count("\n") > MAX_LINES:
        raise InputError(path, f"line {MAX_LINES + 1}", "more lines than any run has", "cut the file to the run")
    return text


def sha256(path: Path) -> str:
    """``"sha256:<hex>"`` of a file's bytes."""
    return "sha256:" + hashlib.sha256(read_bytes(path)).hexdigest()
