"""Recordings that a pattern of a sweep's file names: ``season/*``, ``2024/**/run_?``.

Python's own ``glob`` goes through a folder once for every path to it that a pattern allows: 200 bytes of ``**/`` or
``*/../`` never end.  Here each folder counts once for each part of the pattern, and all that is looked at is counted.
"""

from __future__ import annotations

import fnmatch
import glob
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.recording import FILE

_MOST: Final = 100_000
"""Maximum number of files and folders that are looked at."""


def matching_recordings(start: Path, pattern: str, file: Path) -> list[Path]:
    """Return the folders with a recording that match, sorted; relative patterns begin at ``start``.

    Raises InputError, about ``recordings`` in ``file``, for a pattern that is none, that matches nothing, or that
    leads through too many folders; OSError for a name that is too long.
    """
    parts = Path(pattern).parts
    first = next(count for count, part in enumerate(parts) if glob.has_magic(part))
    for part in parts[first:]:
        if part == ".." or ("**" in part and part != "**"):
            problem = f"{pattern[:60]!r}: {part[:20]!r} cannot be in a pattern"
            raise InputError(file, "recordings", problem, "write * in a name, ** for folders of any depth")
    search = _Search(file, pattern)
    folders = {start.joinpath(*parts[:first]): None}
    for part in parts[first:]:
        folders = {match: None for folder in folders for match in search.step(folder, part)}
    matches = sorted(folder for folder in folders if (folder / FILE).is_file())
    if not matches:
        raise InputError(file, "recordings", f"no recording matches {pattern[:60]!r}", "correct the pattern")
    return matches


class _Search:
    """The folders that parts of a pattern lead to, and the count of all that was looked at."""

    def __init__(self, file: Path, pattern: str) -> None:
        self._file, self._pattern, self._count = file, pattern, 0

    def step(self, folder: Path, part: str) -> Iterator[Path]:
        """Yield the folders to which one part of the pattern leads from ``folder``."""
        if part == "**":
            waiting = [folder]
            while waiting:
                outer = waiting.pop()
                yield outer
                waiting += (inner for inner in self._inside(outer) if not inner.is_symlink())
        elif glob.has_magic(part):
            yield from (inner for inner in self._inside(folder) if fnmatch.fnmatch(inner.name, part))
        elif (folder / part).is_dir():
            yield folder / part

    def _inside(self, folder: Path) -> Iterator[Path]:
        """Yield the folders in ``folder``; none where it cannot be read."""
        with suppress(PermissionError, FileNotFoundError):
            for path in folder.iterdir():
                self._count += 1
                if self._count > _MOST:
                    problem = f"{self._pattern[:60]!r} leads through more than {_MOST} files and folders"
                    raise InputError(self._file, "recordings", problem, "begin it with the folder that they are in")
                if path.is_dir():
                    yield path
