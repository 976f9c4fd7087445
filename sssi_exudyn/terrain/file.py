"""A snow surface on disk: ``[surface]`` of ``model.toml``, and its heights in an NPY file next to it."""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from pathlib import Path
from tokenize import TokenError
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.quantity import quantities, quantity
from sssi_exudyn.io.bounds import MAX_DURATION
from sssi_exudyn.io.files import inside, is_as_written, read_bytes
from sssi_exudyn.io.settings import Settings, check_keys, key_of, numbers_of, text_of
from sssi_exudyn.terrain.surface import MOST_MODES, Surface

FILE: Final = "surface.npy"
_MOST_BYTES: Final = 50_000_000
_FARTHEST: Final = 100.0 * MAX_DURATION
"""Greatest distance from the frame's origin, m; no one skis faster than 100 m/s."""
_MOST_AMOUNT: Final = 10.0
_HIGHEST: Final = 1e4
"""Greatest height over the slope's plane, m."""


@dataclass(frozen=True)
class _Grid:
    origin_f: float = quantity(
        0.0, "m", low=-_FARTHEST, high=_FARTHEST, source="100 m/s", meaning="place of the first node down the slope"
    )
    origin_l: float = quantity(
        0.0, "m", low=-_FARTHEST, high=_FARTHEST, source="100 m/s", meaning="place of the first node to the left"
    )
    spacing: float = quantity(
        2.0, "m", low=0.1, high=50.0, source="any grid of a slope", meaning="distance between nodes"
    )


_KEYS: Final = ("file", "sha256", "amounts", *(key_of(about) for about in quantities(_Grid).values()))


def surface_to_dict(surface: Surface) -> dict[str, Any]:
    """Return the table ``[surface]``; the heights are ``surface_bytes``."""
    return {
        "file": FILE,
        "sha256": hashlib.sha256(surface_bytes(surface)).hexdigest(),
        "origin_f_m": surface.origin[0],
        "origin_l_m": surface.origin[1],
        "spacing_m": surface.spacing,
        "amounts": [float(np.real(amount)) for amount in surface.amounts],
    }


def surface_bytes(surface: Surface) -> bytes:
    """Return mean, deviation and modes, (2 + k, nf, nl) m, as an NPY file."""
    stream = io.BytesIO()
    np.save(stream, surface.grids, allow_pickle=False)
    return stream.getvalue()


def read_surface(table: Settings, path: Path) -> Surface:
    """Read the surface that ``[surface]`` of the file ``path`` names.

    Raises InputError for unknown keys and for numbers out of bounds.  Raises it too for a file that is missing, too
    large, not such an array, or not the one that the table was written with.
    """
    check_keys(table, _KEYS, path, "[surface]")
    place = _Grid(**numbers_of(_Grid, table, path, "[surface]"))
    file = inside(path.parent, text_of(table, "file", path, "[surface]"), path, "[surface] file")
    grid = _read_grid(file)
    amounts = table.get("amounts", [0.0] * (len(grid) - 2))
    if not isinstance(amounts, list) or len(amounts) != len(grid) - 2:
        raise InputError(
            path, "[surface] amounts", f"the surface has {len(grid) - 2} modes", "give one number for each"
        )
    if not all(_is_amount(amount) for amount in amounts):
        bound = f"give {-_MOST_AMOUNT:g} to {_MOST_AMOUNT:g}"
        raise InputError(path, "[surface] amounts", "not a number in its bounds", bound)
    values = tuple(float(amount) for amount in amounts)
    surface = Surface((place.origin_f, place.origin_l), place.spacing, grid[0], grid[1], grid[2:], values)
    if not is_as_written(file, table.get("sha256"), lambda: surface.digest):
        raise InputError(
            file, "", "not the surface that the model was written with", f"take it away from {path.name}: sha256"
        )
    return surface


def _read_grid(path: Path) -> Array:
    """Read a grid (2 + k, nf, nl) m from an NPY file; its header is checked before memory is taken."""
    content = read_bytes(path, _MOST_BYTES)
    stream = io.BytesIO(content)
    wrong = InputError(path, "", "no grid of heights", "write it with numpy.save: (2 + modes, nf, nl) numbers")
    try:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise wrong
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    except (ValueError, SyntaxError, TypeError, TokenError, MemoryError, RecursionError):
        raise wrong from None
    body = memoryview(content)[stream.tell() :]
    if dtype != np.dtype("<f8") or fortran or len(shape) != 3 or min(shape[1:]) < 2 or shape[0] < 2:
        raise wrong
    if shape[0] > 2 + MOST_MODES or 8 * int(np.prod([int(n) for n in shape], dtype=object)) != len(body):
        raise wrong
    grid = np.frombuffer(body, dtype="<f8").reshape(shape).astype(np.float64)
    if not np.all(np.abs(grid) <= _HIGHEST):
        raise InputError(path, "", "heights that are no numbers, or far from the slope", "correct them")
    return grid


def _is_amount(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _MOST_AMOUNT
