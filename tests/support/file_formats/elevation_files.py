"""An elevation model in a file, and the track of a run on it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.terrain.elevation_model import open_elevations

EAST, NORTH = 500_000.0, 5_200_000.0
"""Place in UTM zone 32, m, on its middle meridian, 9° E."""


def height_at(east: Array, north: Array) -> Array:
    return 2000.0 + 0.2 * east - 0.1 * north + 2.0 * np.sin(east / 20.0)


def write(path: Path, **options: Any) -> Path:
    """Write 80 by 60 cells of 2 m, the north-west corner at the place above."""
    import rasterio

    rows, columns = np.mgrid[0:80, 0:60]
    cells = height_at(2.0 * (columns + 0.5), -2.0 * (rows + 0.5)).astype("float32")
    cells[options.pop("hole", (slice(0), slice(0)))] = -9999.0
    about = {
        "driver": "GTiff",
        "height": 80,
        "width": 60,
        "count": 1,
        "dtype": "float32",
        "crs": "EPSG:32632",
        "nodata": -9999.0,
        "transform": rasterio.transform.from_origin(EAST, NORTH, 2.0, 2.0),
    }
    with rasterio.open(path, "w", **(about | options)) as dataset:
        dataset.write(cells, 1)
    return path


def places(east: Array, north: Array) -> tuple[Array, Array]:
    """Return latitude and longitude of places counted from the corner (m)."""
    from rasterio.warp import transform

    longitude, latitude = transform("EPSG:32632", "EPSG:4326", list(EAST + east), list(NORTH + north))
    return np.asarray(latitude), np.asarray(longitude)


def sample_elevations(path: Path, latitude: Array, longitude: Array, needed: int, crs: str = "") -> Array:
    with open_elevations(path, crs) as sample:
        return sample(latitude, longitude, needed)


def track() -> tuple[Array, Array]:
    s = np.linspace(0.0, 1.0, 40)
    return 20.0 + 60.0 * s, -20.0 - 100.0 * s


def sample_track(path: Path, crs: str = "") -> Array:
    """Return the heights along the track."""
    return sample_elevations(path, *places(*track()), 40, crs)
