"""Points of C3D files, read in a process of its own: the library is native code, and files are untrusted.

As a program, this module reads the file in its argument and writes an ``.npz`` to stdout.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_NUMBERS
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.runtime.optional import library
from sssi_exudyn.runtime.posix import pages, posix_module

_MEMORY: Final = 600_000_000
"""Maximum address space, bytes, beyond what the process has at its start."""
_SECONDS: Final = 8
"""Maximum computing time, s."""
_PATIENCE: Final = 60
"""Maximum waiting time, s, on a machine that has other work too."""
_UNITS: Final = {"mm": 0.001, "cm": 0.01, "m": 1.0}


@dataclass(frozen=True)
class Points:
    """The labelled points of a file.

    rate : Hz; names : labels as in the file, without the subject's prefix; places : (n, p, 3) m, NaN for a lost point
    sizes : the subject's measures in the file (group PROCESSING), in the unit of the places: m
    """

    rate: float
    names: tuple[str, ...]
    places: Array
    sizes: dict[str, float]


def read_points(path: Path) -> Points:
    """Read a C3D file.  Raises InputError where the library is missing, or the file is damaged or without points."""
    library("ezc3d", path)
    read_bytes(path)  # refuses a missing, empty or too large file
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    try:
        done = subprocess.run(
            [sys.executable, "-m", "sssi_exudyn.importing.c3d_points", str(path.resolve())],
            capture_output=True,
            timeout=_PATIENCE,
            check=False,
            env=os.environ | {"PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
        )
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as archive:
            rate, unit = float(archive["rate"]), str(archive["unit"])
            names = tuple(str(name) for name in archive["names"])
            places = np.asarray(archive["places"], dtype=np.float64)
            sizes = dict(zip(archive["size_names"].tolist(), archive["sizes"].tolist(), strict=True))
    except (subprocess.TimeoutExpired, ValueError, OSError, EOFError, KeyError):
        raise InputError(path, "", "damaged, or no C3D file", "export the capture again") from None
    if unit not in _UNITS:
        raise InputError(path, "POINT:UNITS", f"{unit[:20]!r} is no unit of length", "export in mm or m")
    if not 20.0 <= rate <= 2000.0 or len(places) < 3:
        raise InputError(path, "POINT", f"{len(places)} frames at {rate:g} Hz are no capture", "export the whole run")
    bare = tuple(name.rsplit(":", 1)[-1].strip() for name in names)
    return Points(rate, bare, _UNITS[unit] * places, {name: _UNITS[unit] * size for name, size in sizes.items()})


def _limit() -> None:
    """Bound this process's memory and time as far as the system can; the parent's patience bounds the rest."""
    resource, used = posix_module("resource"), pages()
    if resource is None:
        return
    if used is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (used[0] + _MEMORY, hard))
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _child(path: str) -> None:
    """Read ``path`` within bounds of time and memory and write its content to stdout."""
    _limit()
    file = library("ezc3d", Path(path)).c3d(path)
    point = file["parameters"]["POINT"]
    labels = [*point["LABELS"]["value"], *point.get("LABELS2", {"value": []})["value"]]
    if 3 * file["data"]["points"][0].size > MAX_NUMBERS:
        raise ValueError("more points than any run has")
    places = np.moveaxis(file["data"]["points"][:3], 0, -1).swapaxes(0, 1)  # frames, points, x y z
    lost = file["data"]["meta_points"]["residuals"][0].T < 0.0
    places[lost] = np.nan
    unit = "".join(point["UNITS"]["value"][:1]).strip().lower()
    kept = {
        name: float(about["value"][0])
        for name, about in file["parameters"].get("PROCESSING", {}).items()
        if name != "__METADATA__" and len(about["value"]) == 1 and not isinstance(about["value"][0], str)
    }
    made = io.BytesIO()
    np.savez(
        made,
        rate=float(point["RATE"]["value"][0]),
        unit=unit,
        names=np.array(labels[: places.shape[1]], dtype=str),
        places=places,
        size_names=np.array(list(kept), dtype=str),
        sizes=np.array(list(kept.values()), dtype=float),
    )
    sys.stdout.buffer.write(made.getvalue())


if __name__ == "__main__":
    _child(sys.argv[1])
