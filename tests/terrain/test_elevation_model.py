"""Elevation models in files: heights where they are known, and one line for each unusable file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elevation_files import height_at, places, sample_elevations, track, write

from sssi_exudyn.core.errors import InputError

rasterio = pytest.importorskip("rasterio")


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
