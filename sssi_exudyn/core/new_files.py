"""Files and folders that are made where others may have put links: what is written never follows one."""

from __future__ import annotations

import errno
import hashlib
import os
from pathlib import Path
from typing import BinaryIO, Final

_LONGEST: Final = 200
"""Greatest length of a name, bytes, to which something may be added: file systems take 255."""


def unfinished(path: Path) -> Path:
    """Return the path under which this process writes a file before it moves it to ``path``."""
    name = os.fsencode(path.name)
    kept = path.name if len(name) <= _LONGEST else hashlib.sha256(name).hexdigest()
    return path.with_name(f".{kept}.{os.getpid()}")


def open_new(path: Path) -> BinaryIO:
    """Open a new file for writing, in the place of one that a killed process left, or of a link.

    Raises OSError where it cannot be made.
    """
    path.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)  # O_EXCL: fails at a link
    return os.fdopen(os.open(path, flags, 0o666), "wb")


def make_folder(path: Path) -> None:
    """Make a folder unless it is there.  Raises OSError where it cannot be made, or where a link stands for it."""
    path.mkdir(parents=True, exist_ok=True)
    check_no_link(path)


def check_no_link(path: Path) -> None:
    """Raise OSError where ``path`` is a link."""
    if path.is_symlink():
        raise OSError(errno.ELOOP, f"{path.name} is a link, which is not followed", str(path))
