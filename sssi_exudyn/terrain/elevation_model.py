"""Heights of the ground from an elevation model: a GeoTIFF or an ESRI ASCII grid in any projection.

Only the cells around the requested places are read, whatever the file's size.
"""

from __future__ import annotations

import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.optional import library

DRIVERS: Final = {".tif": "GTiff", ".tiff": "GTiff", ".asc": "AAIGrid"}
"""GDAL's names of the readable formats, by suffix; no other driver sees the file."""
LARGEST: Final = 1_000_000_000
"""Maximum size of a file that is opened, bytes."""
CELLS: Final = 4_000_000
"""Maximum number of cells that are read, and of cells in a block of the file: 16 MB."""
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


Sample = Callable[[Array, Array, int], Array]
"""Function that returns heights (n,) m over the file's own datum at latitudes and longitudes (n,) in degrees (WGS84).
Between cells the heights are a cubic spline, through smoothed ones where the file has whole numbers.  Its last argument
is the number of first places that must be covered; the others take the nearest cell's height beyond the border.
"""


@contextmanager
def open_elevations(path: Path) -> Iterator[Sample]:
    """Open a file for heights at places.

    Raises InputError, with file, place and fix, for a file of another format, too large, without coordinate system or
    in feet.  Raises it too for a file that does not cover the places or has a hole there.
    """
    rasterio = library("rasterio", path)
    driver = DRIVERS.get(path.suffix.lower())
    if driver is None:
        raise InputError(path, "", f"no reader for {path.suffix!r}", f"use one of: {', '.join(DRIVERS)}")
    try:
        about = path.stat()
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "correct the file's name") from None
    if not stat.S_ISREG(about.st_mode):
        raise InputError(path, "", "this is not a file", "give an elevation model")
    if about.st_size > LARGEST:
        raise InputError(path, "", f"larger than {LARGEST / 1e9:.0f} GB", "cut it to the slope (gdalwarp -te)")
    try:
        with rasterio.Env(GDAL_CACHEMAX=64), rasterio.open(path, driver=driver, sharing=False) as dataset:
            yield partial(_sample, path, dataset)
    except (rasterio.errors.RasterioError, ValueError, MemoryError) as error:
        problem = one_line(str(error))[:200]
        raise InputError(
            path, "", f"no readable elevation model ({problem})", "export a GeoTIFF or an ESRI grid"
        ) from None


def _sample(path: Path, dataset: Any, latitude: Array, longitude: Array, needed: int) -> Array:
    place = _pixels(path, dataset, latitude, longitude)
    size = np.array([dataset.height, dataset.width])
    covered = place[:, :needed]
    if not np.all(np.isfinite(place)) or np.any(covered < 0.0) or np.any(covered > (size - 1)[:, None]):
        raise InputError(
            path, "", "does not cover the whole run", "take a larger piece, or check its coordinate system"
        )
    low = np.maximum(np.floor(place.min(axis=1)).astype(int) - _AROUND, 0)
    high = np.minimum(np.ceil(place.max(axis=1)).astype(int) + _AROUND + 1, size)
    cells = _read_cells(path, dataset, low, high)
    if np.any(np.abs(cells) > _HIGHEST):
        raise InputError(path, "band 1", f"heights beyond {_HIGHEST:.0f} m", "convert the heights to metres")
    cells = gaussian_filter(cells, _smoothing(dataset), mode="nearest", radius=_AROUND)
    return np.asarray(map_coordinates(cells, place - low[:, None], order=3, mode="nearest"))


def _pixels(path: Path, dataset: Any, latitude: Array, longitude: Array) -> Array:
    """Return row and column (2, n) of the places, counted from the middle of the first cell."""
    if dataset.crs is None:
        raise InputError(path, "", "no coordinate system", "put its .prj file next to it, or export a GeoTIFF")
    unit = (dataset.units[0] or "").lower()
    if any(name in unit.split() or unit.startswith(name) for name in _FEET):
        raise InputError(path, "band 1", f"heights in {one_line(unit)[:40]}", "convert the heights to metres")
    x, y = library("rasterio.warp", path).transform("EPSG:4326", dataset.crs, longitude.tolist(), latitude.tolist())
    a, b, c, d, e, f = (~dataset.transform)[:6]
    column, row = a * np.asarray(x) + b * np.asarray(y) + c, d * np.asarray(x) + e * np.asarray(y) + f
    return np.stack([row, column]) - 0.5  # heights stand at the cells' middles


def _read_cells(path: Path, dataset: Any, low: Array, high: Array) -> Array:
    """Read the heights of the cells from ``low`` to before ``high`` (2,), row and column."""
    if max(np.prod([int(n) for n in shape], dtype=object) for shape in dataset.block_shapes) > CELLS:
        raise InputError(path, "band 1", f"blocks of more than {CELLS} cells", "write it in tiles (TILED=YES)")
    if np.prod(high - low) > CELLS:
        raise InputError(path, "", f"more than {CELLS} cells under the run", "take cells of 0.5 m or more")
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
