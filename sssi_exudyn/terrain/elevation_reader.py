"""Heights of an elevation model's cells, read in a process of its own: the libraries are native code.

As a program, this module reads the file in its argument.  Its requests, from ``elevation_model``, are ``.npz`` with
``places``, latitude and longitude (2, n) in degrees (WGS84), and ``needed``, the number of first places that must be
covered.  Its answers have ``heights`` (n,) m, or ``refused``: place, problem and fix.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.confined import serve
from sssi_exudyn.runtime.optional import library

DRIVERS: Final = {".tif": "GTiff", ".tiff": "GTiff", ".asc": "AAIGrid"}
"""GDAL's names of the readable formats, by suffix; no other driver sees the file."""
CELLS: Final = 4_000_000
"""Maximum number of cells that are read."""
_BLOCK: Final = 32_000_000
"""Maximum number of bytes in a block of the file, all bands together, since a block may hold all of them."""
_MEMORY: Final = 600_000_000
"""Maximum address space, bytes, beyond what the process has with its libraries: 4 million cells take 250 MB."""
_SECONDS: Final = 30
"""Maximum computing time, s; a gigabyte of text takes 20."""
_AROUND: Final = 8
"""Number of cells around the outermost place: the border's effect on the spline falls to a quarter with each cell."""
_FEET: Final = ("ft", "feet", "foot", "us_survey_foot", "us-ft")
_STEEPER: Final = float(np.radians(0.1))
"""Error of a slope, rad, that steps of the heights may leave."""
_SMOOTHEST: Final = 4.0
"""Largest standard deviation of the smoothing, in cells."""
_DEGREE: Final = 111_200.0
"""Length of a degree, m."""
_HIGHEST: Final = 9000.0
"""Greatest height of any ground, m; feet written as metres are mostly beyond it, or steeper than any slope."""
_GRIDS: Final = re.compile(r'GRIDS["\s,=]+(?!@NULL["\s])|PARAMETERFILE')
"""Pattern, in capitals, of a coordinate system that names files of its own; @null is none."""


def check_coordinate_system(path: Path, place: str, text: str) -> None:
    """Raise InputError for a coordinate system that names files of shifts: they would be opened, wherever they are."""
    if _GRIDS.search(text.upper()):
        problem = "a coordinate system with files of its own"
        raise InputError(path, place, problem, "write it in one with an EPSG number (gdalwarp -t_srs)")


def _heights(path: Path, places: Array, needed: int) -> Array:
    """Return heights (n,) m at ``places`` (2, n), of which the first ``needed`` have to be covered."""
    dataset = _open(path)
    place = _pixels(path, dataset, places)
    size = np.array([dataset.height, dataset.width])
    covered = place[:, :needed]
    if not np.all(np.isfinite(place)) or np.any(covered < 0.0) or np.any(covered > (size - 1)[:, None]):
        raise InputError(
            path, "", "does not cover the whole run", "take a larger piece, or check its coordinate system"
        )
    place = np.clip(place, 0.0, (size - 1)[:, None])  # beyond the border the nearest cell's height stands
    low = np.maximum(np.floor(place.min(axis=1)).astype(int) - _AROUND, 0)
    high = np.minimum(np.ceil(place.max(axis=1)).astype(int) + _AROUND + 1, size)
    cells = _read_cells(path, dataset, low, high)
    if np.any(np.abs(cells) > _HIGHEST):
        raise InputError(path, "band 1", f"heights beyond {_HIGHEST:.0f} m", "convert the heights to metres")
    cells = gaussian_filter(cells, _smoothing(dataset), mode="nearest", radius=_AROUND)
    return np.asarray(map_coordinates(cells, place - low[:, None], order=3, mode="nearest"))


@cache
def _open(path: Path) -> Any:
    return library("rasterio", path).open(path, driver=DRIVERS[path.suffix], sharing=False)


def _pixels(path: Path, dataset: Any, places: Array) -> Array:
    """Return row and column (2, n) of the places, counted from the middle of the first cell."""
    if dataset.crs is None:
        raise InputError(path, "", "no coordinate system", "put its .prj file next to an .asc, or export a GeoTIFF")
    check_coordinate_system(path, "", dataset.crs.to_wkt())
    transform = dataset.transform
    if transform.is_identity or transform.is_degenerate or not np.all(np.isfinite(transform[:6])):
        raise InputError(path, "", "it does not say where its cells are", "export it with its coordinates (GeoTIFF)")
    unit = (dataset.units[0] or "").lower()
    if any(name in unit.split() or unit.startswith(name) for name in _FEET):
        raise InputError(path, "band 1", f"heights in {one_line(unit)[:40]}", "convert the heights to metres")
    try:
        latitude, longitude = places.tolist()
        x, y = library("rasterio.warp", path).transform("EPSG:4326", dataset.crs, longitude, latitude)
    except Exception:  # noqa: BLE001 - GDAL's errors have no public class
        problem = "the run has no place in its coordinate system"
        raise InputError(path, "", problem, "check that it is the slope's, on Earth") from None
    a, b, c, d, e, f = (~transform)[:6]
    column, row = a * np.asarray(x) + b * np.asarray(y) + c, d * np.asarray(x) + e * np.asarray(y) + f
    return np.stack([row, column]) - 0.5  # heights stand at the cells' middles


def _read_cells(path: Path, dataset: Any, low: Array, high: Array) -> Array:
    """Read the heights of the cells from ``low`` to before ``high`` (2,), row and column."""
    of_cell = sum(np.dtype(kind).itemsize for kind in dataset.dtypes)
    cells_of_block = max(np.prod([int(n) for n in shape], dtype=object) for shape in dataset.block_shapes)
    if cells_of_block * of_cell > _BLOCK:
        problem = f"blocks of more than {_BLOCK / 1e6:.0f} MB, with all {dataset.count} bands"
        raise InputError(path, "", problem, "write one band in tiles (gdal_translate -b 1 -co TILED=YES)")
    if np.prod(high - low) > CELLS:
        raise InputError(path, "", f"more than {CELLS} cells under the run", "take cells of 0.5 m or more")
    if np.dtype(dataset.dtypes[0]).kind not in "iuf":
        raise InputError(path, "band 1", f"cells of {dataset.dtypes[0]} are no heights", "export the heights in metres")
    window = library("rasterio.windows", path).Window(low[1], low[0], high[1] - low[1], high[0] - low[0])
    cells = dataset.read(1, window=window, masked=True).astype(np.float64)
    if np.any(np.ma.getmaskarray(cells)) or not np.all(np.isfinite(cells.data)):
        raise InputError(path, "", "holes under the run", "fill them (gdal_fillnodata)")
    return np.asarray(cells.data) * _number(path, dataset.scales) + _number(path, dataset.offsets)


def _smoothing(dataset: Any) -> float:
    """Return the standard deviation, in cells, of the smoothing that takes the steps out of whole numbers.

    Heights in steps of q have an error of q/√12 in each cell, and slopes of smoothed ones one of q/(√12 √(8π) s² cell).
    """
    if np.dtype(dataset.dtypes[0]).kind not in "iu":
        return 0.0
    metres = _DEGREE if dataset.crs.is_geographic else 1.0
    cell = metres * min(abs(size) for size in dataset.res)
    error = abs(float(dataset.scales[0])) / np.sqrt(12.0) / max(cell, 1e-9)
    return float(min(np.sqrt(error / (np.sqrt(8.0 * np.pi) * _STEEPER)), _SMOOTHEST))


def _number(path: Path, of_bands: Sequence[float]) -> float:
    """Return scale or offset of the first band, by which its numbers become heights.  Raises InputError for NaN."""
    if not np.isfinite(of_bands[0]):
        raise InputError(path, "band 1", "scale or offset is not a number", "export the heights in metres")
    return float(of_bands[0])


def _answer(path: Path, request: bytes) -> bytes:
    with np.load(io.BytesIO(request), allow_pickle=False) as asked:
        places, needed = asked["places"], int(asked["needed"])
    try:
        content = {"heights": _heights(path, places, needed)}
    except InputError as error:
        content = {"refused": np.array([error.place, error.problem, error.fix])}
    except Exception as error:  # noqa: BLE001 - damaged files raise whatever their damage brings
        problem = f"no readable elevation model ({one_line(error)})"
        content = {"refused": np.array(["", problem, "export a GeoTIFF or an ESRI grid"])}
    made = io.BytesIO()
    np.savez(made, allow_pickle=False, **content)
    return made.getvalue()


if __name__ == "__main__":
    library("rasterio.warp", Path())
    serve(partial(_answer, Path(sys.argv[1])), _MEMORY, _SECONDS)
