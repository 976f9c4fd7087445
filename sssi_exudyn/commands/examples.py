"""The work of ``sssi example``: a recording that comes with the program, to begin with."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import did_you_mean
from sssi_exudyn.io.writing import clear_errors
from sssi_exudyn.recording.recording import FILE

_PACKAGE: Final = Path(__file__).parents[1]


def example(name: str, out: Path | None = None) -> Path:
    """Copy the bundled recording of that name into the folder ``out``, by default one of its name here.

    Returns that folder.  Raises InputError for an unknown name, where something of that name is there, and where it
    cannot be written.
    """
    places = (_PACKAGE / "examples", _PACKAGE.parent / "examples")  # of an installed package, of a checkout
    folder = next((place for place in places if (place / "beginner" / FILE).is_file()), places[0])
    names = sorted(path.name for path in folder.iterdir() if (path / FILE).is_file()) if folder.is_dir() else []
    if name not in names:
        raise InputError(
            "sssi example", name, "no recording of that name comes with the program", did_you_mean(name, names)
        )
    target = Path(name) if out is None else out
    if target.exists():
        raise InputError(target, "", "something of that name is there already", "choose another folder with --out")
    with clear_errors(target):
        shutil.copytree(folder / name, target)
    return target
