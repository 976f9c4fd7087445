"""Evaluations kept on disk under the hash of their inputs, so that an interrupted run can go on.

One entry is one ``.npz`` of named arrays, written under another name and moved into place: a reader sees a whole entry
or none.  An entry that cannot be read is computed again.  So is one that another user's program wrote, since the folder
may come from someone else.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import math
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.new_files import make_folder, open_new, unfinished
from sssi_exudyn.runtime.private_folder import secret

MAX_ENTRY: Final = 300_000_000
"""Maximum number of bytes of the arrays in one entry."""
_CHECK: Final = "check"
"""Name of the array in an entry that holds the hash of the user's secret, the key and all other arrays."""
Arrays = dict[str, NDArray[np.generic]]
Shapes = Mapping[str, tuple[int | None, ...]]
"""Names and shapes of an entry's arrays; None where any length is allowed."""
_OWN: Final = re.compile(r"[0-9a-f]{64}\.npz|\.[0-9a-f]{64}\.npz\.\d+")
"""Pattern of the names of entries, whole and half written: keys are fingerprints."""

_NAMES: Final = {
    "sssi_exudyn.model.model": "sssi_exudyn.model",
    "sssi_exudyn.model.faults": "sssi_exudyn.sensors",
    "sssi_exudyn.recording.recording": "sssi_exudyn.recording",
    "sssi_exudyn.recording.few_sensors.complete": "sssi_exudyn.few_sensors",
    "sssi_exudyn.motion.motion": "sssi_exudyn.motion",
    "sssi_exudyn.bodies.skier.chain": "sssi_exudyn.chain",
    "sssi_exudyn.bodies.ski.ski": "sssi_exudyn.bodies.ski",
    "sssi_exudyn.contact.terms.friction_corrections": "sssi_exudyn.contact.glide",
    "sssi_exudyn.contact.terms.body_forces": "sssi_exudyn.contact.pushes",
    "sssi_exudyn.contact.terms.penetration": "sssi_exudyn.contact.penetration",
    "sssi_exudyn.contact.terms.friction": "sssi_exudyn.contact.friction",
    "sssi_exudyn.contact.terms.air": "sssi_exudyn.contact.air",
    "sssi_exudyn.contact.terms.wind": "sssi_exudyn.contact.wind",
    "sssi_exudyn.contact.terms.terrain": "sssi_exudyn.contact.terrain",
}
"""Names under which classes are hashed, by module: those of the modules when keys were first kept.  So a sweep or a fit
that began before a module moved goes on.
"""
_LATER: Final = {
    "AirDrag": ("c_l",),
    "Model": ("surface", "posture", "heading", "legs"),
    "Recording": ("elevations", "poles", "began", "snow"),
    "Skier": ("name",),
    "Equipment": (
        "boot_sole_length", "boot_centre", "ramp_angle", "cuff_edging", "cuff_flexion", "cuff_lean", "pole_mass",
        "pole_length",
    ),
    "PolePlant": ("side",),
    "PostureAir": ("c_l",),
    "Start": ("height", "velocity_n"),
    "GpsJump": ("rise",),
    "Ski": ("uncertainty",),
    "Wind": ("begin", "every", "f_1", "f_2", "f_3", "f_4", "f_5", "f_6"),
    "NoiseLevels": ("force",),
    "AnisotropicFriction": ("slip", "sharpness"),
}  # fmt: skip
"""Fields that were added to classes later; while they hold their default, the key is what it was without them."""


def later_defaults(owner: Any) -> set[str]:  # Any: an instance of any dataclass
    """Return the fields of a dataclass that were added to it later, and hold their defaults."""
    later = _LATER.get(type(owner).__name__, ())
    return {
        field.name
        for field in dataclasses.fields(owner)
        if field.name in later and getattr(owner, field.name) == field.default
    }


def fingerprint(*parts: object) -> str:
    """Return the sha256 (hexadecimal) of the parts' content, the same in every process and on every machine.

    Parts are None, bool, int, float, str, bytes, NumPy arrays and scalars, dataclasses, and tuples, lists and mappings
    of those.  Floats are taken bit for bit.  Raises TypeError for anything else, since what has no content to hash
    (functions, open files, paths of this machine) would make a wrong key.
    """
    digest = hashlib.sha256()
    for piece in _pieces(parts):
        digest.update(len(piece).to_bytes(8, "little"))
        digest.update(piece)
    return digest.hexdigest()


@dataclass(frozen=True)
class Cache:
    """Cache entries below ``folder``, which is made when the first entry is kept."""

    folder: Path

    def get(self, key: str) -> Arrays | None:
        """Return the arrays kept under ``key`` (a ``fingerprint``), or None.

        None also stands for an entry that is damaged, belongs to another key, was not written by this user's program or
        would take more than ``MAX_ENTRY`` bytes.
        """
        try:
            path = self._path(key)
            if not path.is_file() or path.stat().st_size > MAX_ENTRY:  # a pipe would never end
                return None
            with zipfile.ZipFile(path) as parts:
                if sum(part.file_size for part in parts.infolist()) > MAX_ENTRY:
                    return None
                arrays = {part.removesuffix(".npy"): _array(parts, part) for part in parts.namelist()}
            check = arrays.pop(_CHECK)
            return arrays if check.shape == () and str(check) == fingerprint(secret(), key, arrays) else None
        except Exception:  # noqa: BLE001 - damaged archives raise whatever their damage brings
            return None

    def get_or_make(self, key: str, make: Callable[[], Mapping[str, NDArray[np.generic]]], shapes: Shapes) -> Arrays:
        """Return the arrays kept under ``key``, or make them with ``make`` and keep them.

        An entry is made again where its arrays have other names or ``shapes``, or numbers that are not finite.  Raises
        OSError where it cannot be written.
        """
        kept = self.get(key)
        if kept is None or not _fits(kept, shapes):
            kept = dict(make())
            self.put(key, kept)
        return kept

    def put(self, key: str, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Keep ``arrays`` under ``key``.  Raises OSError where the folder cannot be written."""
        path = self._path(key)
        make_folder(self.folder)
        made = unfinished(path)
        check = fingerprint(secret(), key, arrays)
        try:
            with open_new(made) as file:
                np.savez(file, allow_pickle=False, **dict(arrays), **{_CHECK: np.array(check)})
            made.replace(path)
        finally:
            made.unlink(missing_ok=True)

    def remove(self) -> None:
        """Remove all entries, and the folder where nothing else is in it.

        Files that this program did not write stay, and links are not followed.
        """
        if self.folder.is_symlink() or not self.folder.is_dir():
            return
        with contextlib.suppress(OSError):
            for path in self.folder.iterdir():
                if _OWN.fullmatch(path.name) and not path.is_dir():
                    path.unlink(missing_ok=True)
            self.folder.rmdir()  # refused while it holds anything

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"


def _fits(arrays: Arrays, shapes: Shapes) -> bool:
    """Return True for arrays of finite numbers or texts with the given names and shapes."""
    return arrays.keys() == shapes.keys() and all(
        len(array.shape) == len(shapes[name])
        and all(due in (None, length) for due, length in zip(shapes[name], array.shape, strict=True))
        and (array.dtype.kind == "U" or (array.dtype.kind in "biuf" and bool(np.all(np.isfinite(array)))))
        for name, array in arrays.items()
    )


def _array(parts: zipfile.ZipFile, name: str) -> NDArray[np.generic]:
    """Read one array of an archive.  Raises ValueError where its header promises other than its bytes hold."""
    with parts.open(name) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, in_columns, kind = read(file)
        if kind.hasobject or math.prod(shape) * kind.itemsize != parts.getinfo(name).file_size - file.tell():
            raise ValueError(name)
        flat = np.frombuffer(file.read(), dtype=kind)
        return flat.reshape(shape, order="F" if in_columns else "C").copy()


def _pieces(value: object) -> Iterator[bytes]:
    """Yield the content of ``value`` as byte strings; each begins with its kind, so that 1, 1.0 and "1" differ."""
    match value:
        case None | bool():
            yield type(value).__name__.encode()
            yield json.dumps(value).encode()
        case str():
            yield b"str"
            yield json.dumps(value).encode()
        case bytes():
            yield b"bytes"
            yield value
        case np.ndarray() | np.generic() | int() | float():
            array = np.asarray(value)
            if array.dtype.hasobject:
                raise TypeError("an array of objects has no content to hash")
            little = array.astype(array.dtype.newbyteorder("<"))
            yield f"array {little.dtype.str} {array.shape}".encode()
            yield little.tobytes()
        case tuple() | list():
            yield f"sequence {len(value)}".encode()
            for entry in value:
                yield from _pieces(entry)
        case Mapping():
            yield f"mapping {len(value)}".encode()
            for name in sorted(value, key=str):
                yield from _pieces(name)
                yield from _pieces(value[name])
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            kind = type(value)
            yield f"{_NAMES.get(kind.__module__, kind.__module__)}.{kind.__qualname__}".encode()
            later = later_defaults(value)
            for entry in dataclasses.fields(value):
                if entry.name in later:
                    continue
                yield from _pieces(entry.name)
                yield from _pieces(getattr(value, entry.name))
        case _:
            raise TypeError(f"no content to hash in a {type(value).__name__}")
