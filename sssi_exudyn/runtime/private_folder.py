"""The user's own folder: generated code that is run, and the secret that marks what this user's program computed."""

from __future__ import annotations

import atexit
import contextlib
import os
import secrets
import shutil
import stat
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

_SECRET: Final = "secret"
_LENGTH: Final = 32
"""Length of the secret, bytes."""


def cache_folder() -> Path:
    """Return the folder of generated modules: ``SSSI_CACHE_DIR``, the user's cache, or one for this process only.

    Its content is run.  Therefore a folder that someone else owns or may write is not used.
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
    """Return bytes that only this user's processes know; they are made at the first request.

    They are those of this process only where the folder cannot be written, or where the file there is no secret.
    """
    path = cache_folder() / _SECRET
    with contextlib.suppress(OSError):
        if not path.exists():
            made = path.with_name(f".{_SECRET}.{os.getpid()}")
            with os.fdopen(os.open(made, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "wb") as file:
                file.write(secrets.token_bytes(_LENGTH))
            made.replace(path)
        content = path.read_bytes() if path.is_file() else b""
        if len(content) == _LENGTH:
            return content
    return _secret_of_this_process()


def _is_private(folder: Path) -> bool:
    """Return True for a folder, no link, that belongs to this user and that no other user may write."""
    about = folder.lstat()
    if not stat.S_ISDIR(about.st_mode):
        return False
    # Windows has neither owners' numbers nor these bits; the user's cache is the user's there
    return not hasattr(os, "getuid") or (about.st_uid == os.getuid() and not about.st_mode & 0o022)


@cache
def _folder_of_this_process() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="sssi_exudyn_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def _secret_of_this_process() -> bytes:
    return secrets.token_bytes(_LENGTH)
