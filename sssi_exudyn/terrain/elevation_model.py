"""Heights of the ground from an elevation model: a GeoTIFF or an ESRI ASCII grid in any projection, or an SRTM tile.

Only the cells around the requested places are used, whatever the file's size.  Tiles are read here.  GDAL and PROJ read
the other files in a process of its own (``elevation_reader``), where they know no other format, no network and no file
but the model and an ``.asc``'s ``.prj``: next to a model they would open whatever has its name (``.msk``, ``.ovr``,
``.aux.xml``), and what that names.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.text import one_line
from sssi_exudyn.io.files import inside, open_regular, read_bytes
from sssi_exudyn.runtime.confined import Confined, confined
from sssi_exudyn.runtime.optional import library
from sssi_exudyn.terrain.elevation_reader import DRIVERS, check_coordinate_system
from sssi_exudyn.terrain.srtm_tile import SIGMA, SUFFIX, SYSTEM, read_tile, tile_name

SUFFIXES: Final = (*DRIVERS, SUFFIX)
"""Suffixes of the readable formats."""
LARGEST: Final = 1_000_000_000
"""Maximum size of a file that is opened, bytes."""
_LARGEST_PRJ: Final = 100_000
"""Maximum size of the file of a coordinate system, bytes; they have a thousand."""
_EPSG: Final = re.compile(r"EPSG:[0-9]{1,6}")
_SHOWN: Final = 40
"""Characters of a wrong coordinate system that its error shows."""
_PROJECTIONS: Final = (".prj", ".PRJ")
_ENVIRONMENT: Final = {
    "GDAL_DRIVER_PATH": "disable",
    "GDAL_PAM_ENABLED": "NO",
    "GDAL_GEOREF_SOURCES": "INTERNAL",
    "GDAL_CACHEMAX": "64",
    "CPL_VSIL_CURL_ALLOWED_FILENAME": "none",
    "PROJ_NETWORK": "OFF",
}
"""What GDAL and PROJ leave alone there: plug-ins, files of metadata and places next to the model, the network."""

Sample = Callable[[Array, Array, int], Array]
"""Function that returns heights (n,) m over the file's own datum at latitudes and longitudes (n,) in degrees (WGS84).
Between cells the heights are a cubic spline, through smoothed ones where the file has whole numbers.  Its last argument
is the number of first places that must be covered; the others take the nearest cell's height beyond the border.
"""


@contextmanager
def open_elevations(path: Path, crs: str = "") -> Iterator[Sample]:
    """Open a file for heights at places.

    Parameters
    ----------
    crs : coordinate system that the user states, as ``epsg_of`` returns it, for a file without one; "" for none

    Raises InputError, with file, place and fix, for a file of another format, too large, without coordinate system, in
    another than ``crs``, or in feet.  Raises it too for a file that does not cover the places or has a hole there.
    """
    suffix = _checked_suffix(path)
    if suffix == SUFFIX:
        if crs not in ("", SYSTEM):
            raise InputError(path, "", f"an SRTM tile is in {SYSTEM}, not in {crs}", "leave the coordinate system out")
        yield read_tile(path).sample
        return
    rasterio = library("rasterio", path)
    with rasterio.Env() as gdal:
        others = set(gdal.drivers()) - set(DRIVERS.values())
    environment = _ENVIRONMENT | {"GDAL_SKIP": ",".join(sorted(others))}
    with tempfile.TemporaryDirectory(prefix="sssi_exudyn_") as private:
        file = _isolate(path, Path(private) / f"elevations{suffix}")
        with confined("sssi_exudyn.terrain.elevation_reader", file, environment) as process:
            yield partial(_sample, process, path, crs)


def epsg_of(text: str, file: Path | str, place: str) -> str:
    """Return a stated coordinate system, such as EPSG:31254.  Raises InputError for any other text."""
    if _EPSG.fullmatch(text.strip().upper()) is None:
        shown = one_line(text, _SHOWN)
        raise InputError(file, place, f"{shown!r} is no coordinate system", "write its EPSG number, such as EPSG:31254")
    return text.strip().upper()


def usual_sigma(path: Path) -> float:
    """Return the standard deviation (m) by which snow leaves a model smoothly, where none is stated."""
    return SIGMA if path.suffix.lower() == SUFFIX else 1.0


def copy_elevations(path: Path, folder: Path) -> Path:
    """Copy a model, with the ``.prj`` of an ``.asc``, into a folder; return the copy.

    A tile keeps its name, which says where it is.  Raises InputError for a file that ``open_elevations`` does not read.
    """
    suffix = _checked_suffix(path)
    copy = folder / (tile_name(path) if suffix == SUFFIX else f"elevations{suffix}")
    with open_regular(path) as given, copy.open("xb") as made:
        shutil.copyfileobj(given, made)
    _copy_projection(path, copy)
    return copy


def _checked_suffix(path: Path) -> str:
    """Return a model's suffix in small letters.  Raises InputError for another suffix, no file, or too large a file."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(path, "", f"no reader for {path.suffix!r}", f"use one of: {', '.join(SUFFIXES)}")
    try:
        about = path.stat()
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "correct the file's name") from None
    if not stat.S_ISREG(about.st_mode):
        raise InputError(path, "", "this is not a file", "give an elevation model")
    if about.st_size > LARGEST:
        raise InputError(path, "", f"larger than {LARGEST / 1e9:.0f} GB", "cut it to the slope (gdalwarp -te)")
    return suffix


def _isolate(path: Path, alone: Path) -> Path:
    """Put the model, and the ``.prj`` of an ``.asc``, into a folder of their own."""
    try:
        alone.symlink_to(path.resolve())
    except OSError:  # Windows allows links to administrators only
        shutil.copyfile(path, alone)
    _copy_projection(path, alone)
    return alone


def projection_of(path: Path) -> Path | None:
    """Return the ``.prj`` next to an ``.asc``, which is read with it; None for other models, and where there is none.

    Raises InputError for one that is not to be read.
    """
    projections = [path.with_suffix(suffix) for suffix in _PROJECTIONS if os.path.lexists(path.with_suffix(suffix))]
    if path.suffix.lower() != ".asc" or not projections:
        return None
    inside(path.parent, projections[0].name, path, "", _LARGEST_PRJ)
    return projections[0]


def _copy_projection(path: Path, copy: Path) -> None:
    """Put the ``.prj`` of an ``.asc`` next to its copy.  Raises InputError for one that is not to be read."""
    projection = projection_of(path)
    if projection is not None:
        text = read_bytes(projection, _LARGEST_PRJ)
        check_coordinate_system(projection, "", text.decode("latin-1"))
        copy.with_suffix(".prj").write_bytes(text)


def _sample(process: Confined, path: Path, crs: str, latitude: Array, longitude: Array, needed: int) -> Array:
    """Return heights (n,) m, as ``Sample`` has it."""
    request = io.BytesIO()
    np.savez(request, places=np.stack([latitude, longitude]), needed=needed, crs=crs)
    try:
        with np.load(io.BytesIO(process.ask(request.getvalue())), allow_pickle=False) as answer:
            if "refused" in answer:
                raise InputError(path, *(str(words) for words in answer["refused"]))
            return np.asarray(answer["heights"], dtype=np.float64).reshape(len(latitude))
    except (OSError, ValueError, EOFError, KeyError):
        problem = "no readable elevation model (reading it takes too much memory or time)"
        raise InputError(path, "", problem, "export a GeoTIFF or an ESRI grid") from None
