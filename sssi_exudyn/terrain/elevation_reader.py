"""Heights of an elevation model's cells, read in a process of its own: the libraries are native code.

As a program, this module reads the file in its argument.  Its requests, from ``elevation_model``, are ``.npz`` with
``places``, latitude and longitude (2, n) in degrees (WGS84), ``needed``, the number of first places that must be
covered, and ``crs``, the coordinate system that the user states ("" for none).  Its answers have ``heights`` (n,) m, or
``refused``: place, problem and fix.
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

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.runtime.confined import serve
from sssi_exudyn.runtime.optional import library
from sssi_exudyn.terrain.cells import DEGREE, heights_between, smoothing_of_steps, window_of

DRIVERS: Final = {".tif": "GTiff", ".tiff": "GTiff", ".asc": "AAIGrid"}
"""GDAL's names of the readable formats, by suffix; no other driver sees the file."""
_BLOCK: Final = 32_000_000
"""Maximum number of bytes in a block of the file, all bands together, since a block may hold all of them."""
_MEMORY: Final = 600_000_000
"""Maximum address space, bytes, beyond what the process has with its libraries: 4 million cells take 250 MB."""
_SECONDS: Final = 30
"""Maximum computing time, s; a gigabyte of text takes 20."""
_FEET: Final = ("ft", "feet", "foot", "us_survey_foot", "us-ft")
_APART: Final = 0.5
"""Greatest distance, in cells, between a run's places by the file's coordinate system and by the one that is stated."""
_GRIDS: Final = re.compile(r'GRIDS["\s,=]+(?!@NULL["\s])|PARAMETERFILE')
"""Pattern, in capitals, of a coordinate system that names files of its own; @null is none."""


def check_coordinate_system(path: Path, place: str, text: str) -> None:
    """Raise InputError for a coordinate system that names files of shifts: they would be opened, wherever they are."""
    if _GRIDS.search(text.upper()):
        problem = "a coordinate system with files of its own"
        raise InputError(path, place, problem, "write it in one with an EPSG number (gdalwarp -t_srs)")


def _heights(path: Path, places: Array, needed: int, crs: str) -> Array:
    """Return heights (n,) m at ``places`` (2, n), of which the first ``needed`` have to be covered."""
    dataset = _open(path)
    systems = _systems(path, dataset, crs)
    place = _pixels(path, dataset, systems, places)
    fix = "take a larger piece, or check its coordinate system"
    place, low, high = window_of(path, place, needed, (dataset.height, dataset.width), fix)
    cells = _read_cells(path, dataset, low, high)
    return heights_between(path, cells, place - low[:, None], _smoothing(dataset, systems[0]))


@cache
def _open(path: Path) -> Any:
    return library("rasterio", path).open(path, driver=DRIVERS[path.suffix], sharing=False)


def _systems(path: Path, dataset: Any, crs: str) -> list[Any]:
    """Return the coordinate systems that the file and the user state, at least one.  Raises InputError for none."""
    systems = [] if dataset.crs is None else [dataset.crs]
    if crs:
        systems.append(_system_of(path, crs))
    if not systems:
        fix = "state it (--dem-crs or [terrain] crs, such as EPSG:31254), or put its .prj file next to an .asc"
        raise InputError(path, "", "no coordinate system", fix)
    for system in systems:
        check_coordinate_system(path, "", system.to_wkt())
    return systems


def _system_of(path: Path, crs: str) -> Any:
    """Return a coordinate system by its EPSG number.  Raises InputError for unknown ones, and for those of no map."""
    try:
        system = library("rasterio.crs", path).CRS.from_user_input(crs)
    except Exception:  # noqa: BLE001 - GDAL's errors have no public class
        raise InputError(path, "", f"{crs} is not known", "state a number of epsg.io") from None
    if not (system.is_geographic or system.is_projected):
        raise InputError(path, "", f"{crs} is no coordinate system of a map", "state the map's, such as EPSG:31254")
    return system


def _pixels(path: Path, dataset: Any, systems: Sequence[Any], places: Array) -> Array:
    """Return row and column (2, n) of the places, counted from the middle of the first cell.

    Raises InputError where two coordinate systems contradict each other: the places are apart by them.
    """
    transform = dataset.transform
    if transform.is_identity or transform.is_degenerate or not np.all(np.isfinite(transform[:6])):
        raise InputError(path, "", "it does not say where its cells are", "export it with its coordinates (GeoTIFF)")
    unit = (dataset.units[0] or "").lower()
    if any(name in unit.split() or unit.startswith(name) for name in _FEET):
        raise InputError(path, "band 1", f"heights in {one_line(unit)[:40]}", "convert the heights to metres")
    of_file, *stated = [_pixels_in(path, transform, system, places) for system in systems]
    if not all(np.allclose(of_file, other, rtol=0.0, atol=_APART) for other in stated):
        own, other = (one_line(system.to_string())[:40] for system in systems)
        problem = f"the file states another coordinate system ({own}) than {other}"
        raise InputError(path, "", problem, "leave the stated one out (--dem-crs, [terrain] crs), or correct the file")
    return of_file


def _pixels_in(path: Path, transform: Any, system: Any, places: Array) -> Array:
    """Return row and column (2, n) of the places by one coordinate system."""
    try:
        latitude, longitude = places.tolist()
        x, y = library("rasterio.warp", path).transform("EPSG:4326", system, longitude, latitude)
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
    if np.dtype(dataset.dtypes[0]).kind not in "iuf":
        raise InputError(path, "band 1", f"cells of {dataset.dtypes[0]} are no heights", "export the heights in metres")
    window = library("rasterio.windows", path).Window(low[1], low[0], high[1] - low[1], high[0] - low[0])
    cells = dataset.read(1, window=window, masked=True).astype(np.float64)
    if np.any(np.ma.getmaskarray(cells)) or not np.all(np.isfinite(cells.data)):
        raise InputError(path, "", "holes under the run", "fill them (gdal_fillnodata)")
    return np.asarray(cells.data) * _number(path, dataset.scales) + _number(path, dataset.offsets)


def _smoothing(dataset: Any, system: Any) -> float:
    """Return the standard deviation, in cells, of the smoothing that takes the steps out of whole numbers."""
    if np.dtype(dataset.dtypes[0]).kind not in "iu":
        return 0.0
    metres = DEGREE if system.is_geographic else 1.0
    return smoothing_of_steps(float(dataset.scales[0]), metres * min(abs(size) for size in dataset.res))


def _number(path: Path, of_bands: Sequence[float]) -> float:
    """Return scale or offset of the first band, by which its numbers become heights.  Raises InputError for NaN."""
    if not np.isfinite(of_bands[0]):
        raise InputError(path, "band 1", "scale or offset is not a number", "export the heights in metres")
    return float(of_bands[0])


def _answer(path: Path, request: bytes) -> bytes:
    with np.load(io.BytesIO(request), allow_pickle=False) as asked:
        places, needed, crs = asked["places"], int(asked["needed"]), str(asked["crs"])
    try:
        content = {"heights": _heights(path, places, needed, crs)}
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
