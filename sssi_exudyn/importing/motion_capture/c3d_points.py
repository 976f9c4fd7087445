"""Points of C3D files, read in a process of its own: the library is native code, and files are untrusted.

As a program, this module reads the file in its argument and answers with an ``.npz``.
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_NUMBERS
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.runtime.confined import confined, serve
from sssi_exudyn.runtime.optional import library

_MEMORY: Final = 600_000_000
"""Maximum address space, bytes, beyond what the process has at its start."""
_SECONDS: Final = 8
"""Maximum computing time, s."""
UNITS: Final = {"mm": 0.001, "cm": 0.01, "m": 1.0}


@dataclass(frozen=True)
class Points:
    """The labelled points of a file.

    rate : Hz; names : labels as in the file, without the subject's prefix; places : (n, p, 3) m, NaN for a lost point
    sizes : the subject's measures in the file (group PROCESSING), in the unit of the places: m
    poses : (n, 4, 4) by label, where the file has segments in place of points: axes in the laboratory and origin, m
    """

    rate: float
    names: tuple[str, ...]
    places: Array
    sizes: dict[str, float]
    poses: dict[str, Array] = field(default_factory=dict)

    @property
    def time(self) -> Array:
        """Return the time (n,) s of every frame."""
        return np.arange(len(self.places)) / self.rate


def read_points(path: Path) -> Points:
    """Read a C3D file.  Raises InputError where the library is missing, or the file is damaged or without points."""
    library("ezc3d", path)
    read_bytes(path)  # refuses a missing, empty or too large file
    try:
        with confined("sssi_exudyn.importing.motion_capture.c3d_points", path, {}) as process:
            content = process.ask(b"")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            rate, unit = float(archive["rate"]), str(archive["unit"])
            names = tuple(str(name) for name in archive["names"])
            places = np.asarray(archive["places"], dtype=np.float64)
            sizes = dict(zip(archive["size_names"].tolist(), archive["sizes"].tolist(), strict=True))
            poses = dict(zip(archive["pose_names"].tolist(), np.asarray(archive["poses"], np.float64), strict=True))
    except (ValueError, OSError, EOFError, KeyError):
        raise InputError(path, "", "damaged, or no C3D file", "export the capture again") from None
    if unit not in UNITS:
        raise InputError(path, "POINT:UNITS", f"{unit[:20]!r} is no unit of length", "export in mm or m")
    if not 20.0 <= rate <= 2000.0 or len(places) < 3:
        raise InputError(path, "POINT", f"{len(places)} frames at {rate:g} Hz are no capture", "export the whole run")
    bare = tuple(name.rsplit(":", 1)[-1].strip() for name in names)
    for pose in poses.values():
        pose[:, :3, 3] *= UNITS[unit]
    sizes = {name: UNITS[unit] * size for name, size in sizes.items()}
    return Points(rate, bare, UNITS[unit] * places, sizes, {name.strip(): pose for name, pose in poses.items()})


def _answer(path: Path, _request: bytes) -> bytes:
    """Return the content of the file ``path`` as an ``.npz``."""
    file = library("ezc3d", path).c3d(str(path))
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
    rate, pose_names, poses = _poses(file)
    if len(pose_names):  # such a file has no points
        places = np.zeros((poses.shape[1], 0, 3))
    made = io.BytesIO()
    np.savez(
        made,
        rate=rate or float(point["RATE"]["value"][0]),
        pose_names=pose_names,
        poses=poses,
        unit=unit,
        names=np.array(labels[: places.shape[1]], dtype=str),
        places=places,
        size_names=np.array(list(kept), dtype=str),
        sizes=np.array(list(kept.values()), dtype=float),
    )
    return made.getvalue()


def _poses(file: Any) -> tuple[float, np.ndarray, Array]:
    """Return rate (Hz), labels (k,) and poses (k, n, 4, 4) of a file's group ROTATION; a rate of 0 without it."""
    about = file["parameters"].get("ROTATION", {})
    rotations = np.asarray(file["data"].get("rotations", np.zeros((4, 4, 0, 0))), dtype=np.float64)
    labels = [str(label) for label in about.get("LABELS", {"value": []})["value"]][: rotations.shape[2]]
    if not labels or "RATE" not in about:
        return 0.0, np.array([], dtype=str), np.zeros((0, 0, 4, 4))
    if rotations.size > MAX_NUMBERS:
        raise ValueError("more segments than any run has")
    poses = np.moveaxis(rotations[:, :, : len(labels)], (2, 3), (0, 1))
    return float(about["RATE"]["value"][0]), np.array(labels, dtype=str), poses


if __name__ == "__main__":
    serve(partial(_answer, Path(sys.argv[1])), _MEMORY, _SECONDS)
