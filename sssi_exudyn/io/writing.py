"""Files and folders, written whole or not at all and by one process at a time; values as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import filelock
import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.new_files import check_no_link, open_new, unfinished

_LOCK = ".lock"


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold ``folder`` (made when missing) against other processes.  Calls may be nested within one thread.

    Raises InputError when another process holds it, when it cannot be made, and when the work done meanwhile cannot be
    written.
    """
    with clear_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        check_no_link(folder / _LOCK)  # it would be made, or emptied, where it leads
        lock = filelock.FileLock(folder / _LOCK, timeout=0, is_singleton=True)
        try:
            lock.acquire()
        except filelock.Timeout as error:
            raise InputError(
                folder, "", "another process is writing here", "wait for it, or choose another folder with --out"
            ) from error
    try:
        with clear_errors(folder):
            yield
    finally:
        lock.release()


def is_locked(folder: Path) -> bool:
    """Return True while a process holds the lock of ``folder``."""
    if not (folder / _LOCK).exists():
        return False
    lock = filelock.FileLock(folder / _LOCK, timeout=0)
    try:
        lock.acquire()
    except filelock.Timeout:
        return True
    lock.release()
    return False


@contextmanager
def clear_errors(path: Path) -> Iterator[None]:
    """Turn the operating system's refusals (read-only, full, missing, not a folder) into one clear InputError."""
    try:
        yield
    except BrokenPipeError:  # the reader of stderr or stdout has gone: no fault of ``path``
        raise
    except OSError as error:
        raise InputError(
            path, "", (error.strerror or str(error)).lower(), "check the path, its permissions and the space left"
        ) from error


def check_file_name(path: Path) -> None:
    """Raise InputError, before anything is computed for it, for a file that cannot be made under that name."""
    with clear_errors(path):
        try:
            path.lstat()  # names that are too long, of a folder that is none
        except FileNotFoundError:
            if not path.parent.is_dir():
                raise


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write one file whole or not at all, text as UTF-8; bytes of names that are no text become ``\\udcff``.

    Raises InputError where it cannot be written.
    """
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    partial = unfinished(path)
    with clear_errors(path):
        try:
            with open_new(partial) as file:
                file.write(data)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def to_json(value: Any) -> str:
    """Return a value as JSON text that people can read too; it may be anything that ``to_plain`` takes."""
    return json.dumps(to_plain(value), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def to_plain(value: Any) -> Any:
    """Convert to what JSON can hold: dataclasses to mappings, NumPy's values to Python's, infinite and NaN to None."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {entry.name: getattr(value, entry.name) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): to_plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return to_plain(value.tolist())
    if isinstance(value, list | tuple):
        return [to_plain(entry) for entry in value]
    if isinstance(value, str):
        return value.encode(errors="backslashreplace").decode()  # names of files may be no text
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
