"""SRTM tiles: heights of a degree by a degree, in a file whose name is the tile's south-west corner (N47E011.hgt).

A tile has no header: 1201 or 3601 rows from north to south, each of as many heights from west to east, whole metres
over the geoid (EGM96) as big-endian int16, with the first and last ones on the degrees (WGS84).
Source: NASA, *SRTM Topography* (SRTM_Topo.pdf).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.terrain.cells import DEGREE, heights_between, smoothing_of_steps, window_of

SUFFIX: Final = ".hgt"
SYSTEM: Final = "EPSG:4326"
"""Coordinate system of every tile."""
SIGMA: Final = 5.0
"""Standard deviation, m, of a tile's relative heights: 8.7 m for 90 % of Eurasia (Farr et al. 2007, table 1)."""
_SIDES: Final = {2 * side * side: side for side in (1201, 3601)}
"""Heights along a side, by the size of the file in bytes."""
_NAME: Final = re.compile(r"([NS])([0-9]{2})([EW])([0-9]{3})", re.IGNORECASE)
_VOID: Final = -32768


@dataclass(frozen=True)
class Tile:
    """A tile that was read.

    south, west : its corner, degrees
    cells : heights (side, side), m, from north to south and west to east
    """

    path: Path
    south: int
    west: int
    cells: NDArray[Any]

    def sample(self, latitude: Array, longitude: Array, needed: int) -> Array:
        """Return heights (n,) m over the geoid, as ``elevation_model.Sample`` has it.

        Raises InputError for needed places that the tile does not cover, and for voids there.
        """
        last = len(self.cells) - 1
        place = np.stack([self.south + 1 - latitude, longitude - self.west]) * last
        fix = f"the tile is {self.path.stem}; join several to a GeoTIFF (gdal_merge.py)"
        place, low, high = window_of(self.path, place, needed, self.cells.shape, fix)
        cells = self.cells[low[0] : high[0], low[1] : high[1]]
        if np.any(cells == _VOID):
            raise InputError(self.path, "", "holes under the run", "fill them in a GeoTIFF (gdal_fillnodata)")
        smoothing = smoothing_of_steps(1.0, DEGREE / last)
        return heights_between(self.path, cells.astype(np.float64), place - low[:, None], smoothing)


def tile_name(path: Path) -> str:
    """Return the usual name of a tile's file.  Raises InputError for a name that is no tile's."""
    south, west = _corner(path)
    return f"{'NS'[south < 0]}{abs(south):02d}{'EW'[west < 0]}{abs(west):03d}{SUFFIX}"


def read_tile(path: Path) -> Tile:
    """Read a tile.  Raises InputError for a name that is no tile's, and for a file of another size."""
    south, west = _corner(path)
    try:
        size = path.stat().st_size
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "correct the file's name") from None
    content = read_bytes(path, max(_SIDES)) if size in _SIDES else b""
    if len(content) not in _SIDES:
        known = " or ".join(str(bytes_) for bytes_ in _SIDES)
        raise InputError(path, "", f"{size} bytes are no SRTM tile, which has {known}", "unpack or load it again")
    side = _SIDES[len(content)]
    return Tile(path, south, west, np.frombuffer(content, dtype=">i2").reshape(side, side))


def _corner(path: Path) -> tuple[int, int]:
    """Return the latitude and longitude (degrees) in a tile's name."""
    parts = _NAME.fullmatch(path.stem)
    if parts is not None:
        of_south, south, of_west, west = parts[1].upper() == "S", int(parts[2]), parts[3].upper() == "W", int(parts[4])
        if of_south <= south <= 89 + of_south and of_west <= west <= 179 + of_west:
            return (-south if of_south else south), (-west if of_west else west)
    raise InputError(path, "", "the name is not a tile's south-west corner", "name it like N47E011.hgt")
