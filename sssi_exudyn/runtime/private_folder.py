"""The user's own folder: generated code that is run, and the secret that marks what this user's program computed."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

_SECRET: Final = "secret"
_LENGTH: Final = 32
"""bytes of the secret."""


def cache_folder() -> Path:
    """Where generated modules are kept: ``SSSI_CACHE_DIR``, or the user's cache, or a folder for this process only.

    What lies there is run.  A folder that someone else owns or may write is therefore not used.
    """
    named = os.environ.get("SSSI_CACHE_DIR")
    folder = Path(named) if named else user_cache_path("sssi_exudyn")
    try:
        if not folder.exists():
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        usable = _is_private(folder) and os.access(folder, os.W_OK)
    except OSError:
        return _folder_of_this_process()
    return folder if usable else _folder_of_this_process()


def secret() -> bytes:
    """Bytes that only this user's processes know; made when they are first asked for.

    Where the folder cannot be written, or what is there is no secret, they are those of this process only.
    """
    path = cache_folder() / _SECRET
    with contextlib.suppress(OSError):
        if not path.exists():
            made = path.with_name(f".{_SECRET}.{os.getpid()}")
            with os.fdopen(os.open(made, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(secrets.token_bytes(_LENGTH))
            made.replace(path)
        found = path.read_bytes() if path.is_file() else b""
        if len(found) == _LENGTH:
            return found
    return _secret_of_this_process()


def _is_private(folder: Path) -> bool:
    """True for a folder, no link, that belongs to this user and that nobody else may write."""
    about = folder.lstat()
    if not stat.S_ISDIR(about.st_mode):
        return False
    # Windows has neither owners' numbers nor these bits; the user's cache is the user's there
    return not hasattr(os, "getuid") or (about.st_uid == os.getuid() and not about.st_mode & 0o022)


@cache
def _folder_of_this_process() -> Path:
    return Path(tempfile.mkdtemp(prefix="sssi_exudyn_"))


@cache
def _secret_of_this_process() -> bytes:
    return secrets.token_bytes(_LENGTH)
