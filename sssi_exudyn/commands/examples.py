"""The work of ``sssi example``: a recording or a ski's bench tests that come with the program, to begin with."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from sssi_exudyn.bodies.ski.bench_tests import FILE as BENCH
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.io.writing import clear_errors
from sssi_exudyn.recording.recording import FILE

_PACKAGE: Final = Path(__file__).parents[1]
_FIRST_FILES: Final = (FILE, BENCH)


def example(name: str, out: Path | None = None) -> Path:
    """Copy the bundled recording, or bench tests, of that name into ``out``, by default a folder of its name here.

    Returns that folder.  Raises InputError for an unknown name, where something of that name is there, and where it
    cannot be written.
    """
    places = (_PACKAGE / "examples", _PACKAGE.parent / "examples")  # of an installed package, of a checkout
    folder = next((place for place in places if (place / "beginner" / FILE).is_file()), places[0])
    present = folder.iterdir() if folder.is_dir() else ()
    names = sorted(path.name for path in present if any((path / file).is_file() for file in _FIRST_FILES))
    if name not in names:
        raise InputError(
            "sssi example", name, "no example of that name comes with the program", did_you_mean(name, names)
        )
    target = Path(name) if out is None else out
    if target.exists():
        raise InputError(target, "", "something of that name is there already", "choose another folder with --out")
    with clear_errors(target):
        shutil.copytree(folder / name, target)
    return target
