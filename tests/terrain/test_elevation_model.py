"""Elevation models in files: heights where they are known, and one line for each unusable file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.terrain.elevation_model import open_elevations

rasterio = pytest.importorskip("rasterio")

EAST, NORTH = 500_000.0, 5_200_000.0
"""Place in UTM zone 32, m, on its middle meridian, 9° E."""
LATITUDE = 46.95304
"""Latitude of that northing, degrees, to a metre."""


def height_at(east: Array, north: Array) -> Array:
    return 2000.0 + 0.2 * east - 0.1 * north + 2.0 * np.sin(east / 20.0)


def write(path: Path, **options: Any) -> Path:
    """Write 80 by 60 cells of 2 m, the north-west corner at the place above."""
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


def sample_elevations(path: Path, latitude: Array, longitude: Array, needed: int) -> Array:
    with open_elevations(path) as sample:
        return sample(latitude, longitude, needed)


def track() -> tuple[Array, Array]:
    s = np.linspace(0.0, 1.0, 40)
    return 20.0 + 60.0 * s, -20.0 - 100.0 * s


@pytest.mark.parametrize("name", ["dem.tif", "dem.asc"])
def test_heights_are_those_of_the_ground(tmp_path: Path, name: str) -> None:
    options = {"driver": "AAIGrid"} if name.endswith(".asc") else {}
    path = write(tmp_path / name, **options)
    heights = sample_elevations(path, *places(*track()), 40)
    # a cubic spline of cells of 2 m over waves of 126 m: 1e-5 m; heights of 2000 m as float32: 1e-4 m
    np.testing.assert_allclose(heights, height_at(*track()), atol=3e-4)


def test_only_the_run_has_to_be_covered(tmp_path: Path) -> None:
    path = write(tmp_path / "dem.tif")
    east, north = track()
    latitude, longitude = places(np.append(east, -30.0), np.append(north, -50.0))
    assert np.all(np.isfinite(sample_elevations(path, latitude, longitude, 40)))
    with pytest.raises(InputError, match="does not cover the whole run"):
        sample_elevations(path, latitude, longitude, 41)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"crs": None}, "no coordinate system"),
        ({"hole": (slice(30, 33), slice(25, 28))}, "holes under the run"),
        ({"crs": "EPSG:32633"}, "does not cover"),
        ({"driver": "PNG", "dtype": "uint8", "nodata": None}, "no readable elevation model"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path: Path, options: dict[str, Any], problem: str) -> None:
    path = write(tmp_path / "dem.tif", **options)
    with pytest.raises(InputError, match=problem):
        sample_elevations(path, *places(*track()), 40)


def test_heights_in_feet_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "dem.tif")
    with rasterio.open(path, "r+") as dataset:
        dataset.units = ["ft"]
    with pytest.raises(InputError, match="heights in ft; convert"):
        sample_elevations(path, *places(*track()), 40)


def test_a_grid_of_another_size_than_it_says_is_refused_cheaply(tmp_path: Path) -> None:
    path = tmp_path / "dem.asc"
    path.write_text(
        "ncols 2000000000\nnrows 2000000000\nxllcorner 0\nyllcorner 0\ncellsize 1\nNODATA_value -1\n1 2 3\n",
        encoding="ascii",
    )
    with pytest.raises(InputError, match=r"dem\.asc"):
        sample_elevations(path, *places(*track()), 40)


def test_what_is_no_grid_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "dem.tif"
    path.write_bytes(b"II*\0" + bytes(range(256)) * 4)
    with pytest.raises(InputError, match="no readable elevation model"):
        sample_elevations(path, *places(*track()), 40)
