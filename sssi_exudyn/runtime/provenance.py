"""The origin of a result: hashes of the files read, versions of the programs, settings and seed.

Nothing in it names the machine or its folders, so that results can be passed on and two machines' can be compared.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Final

_PACKAGES: Final = ("exudyn", "numpy", "scipy", "numba", "nlopt", "pandas", "scikit-learn")


def versions() -> dict[str, str]:
    """Return the versions of this program, of Python and of the packages whose version may change a figure."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    """Return the same, read once a process: a command asks several times, and reading takes 30 ms."""
    own = {"sssi_exudyn": metadata.version("sssi-exudyn"), "python": platform.python_version()}
    return own | {name: _version(name) for name in _PACKAGES}


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # a simulation does without Numba
        return "not installed"


@cache
def source_digest() -> str:
    """Return the SHA-256 of this program's sources: two copies with the same digest compute the same."""
    digest = hashlib.sha256()
    folder = Path(__file__).parents[1]
    files = sorted(Path(where) / name for where, _, names in os.walk(folder, followlinks=True) for name in names)
    for path in files:
        if path.suffix in (".py", ".toml"):
            digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def provenance(inputs: Mapping[str, str], settings: Mapping[str, Any], seed: int | None) -> dict[str, Any]:
    """Return the ``provenance`` group of a summary.

    Parameters
    ----------
    inputs : hash of each file that was read, by its name within the recording's folder
    settings : everything the user chose, by name; paths relative to the recording's folder
    seed : seed of the random numbers; None where none were drawn

    Raises ValueError when a setting holds an absolute path.
    """
    for name, value in settings.items():
        if isinstance(value, Path) or (isinstance(value, str) and Path(value).is_absolute()):
            raise ValueError(f"setting {name!r} holds a path of this machine")
    return {
        "inputs": dict(inputs),
        "versions": versions(),
        "sources": source_digest(),
        "settings": dict(settings),
        "seed": seed,
        "platform": {"system": platform.system(), "machine": platform.machine()},
    }
