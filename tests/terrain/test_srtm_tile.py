"""SRTM tiles: heights at the places that their names say, and one line for each unusable file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from elevation_files import sample_elevations

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array

VOID = -32768


def write_tile(path: Path, side: int = 1201, void: tuple[slice, slice] = (slice(0), slice(0))) -> Path:
    """Write a tile that rises by 2 m a row to the south and by 3 m a column to the east, from 500 m in the corner."""
    row, column = np.mgrid[0:side, 0:side]
    cells = 500 + 2 * row + 3 * column
    cells[void] = VOID
    path.write_bytes(cells.astype(">i2").tobytes())
    return path


def path_over(south: int, west: int) -> tuple[Array, Array]:
    """Return latitude and longitude of 40 places in the tile with that corner."""
    s = np.linspace(0.0, 1.0, 40)
    return south + 0.731 - 0.002 * s, west + 0.262 + 0.003 * s


@pytest.mark.parametrize(
    ("name", "side", "south", "west"),
    [("N47E011.hgt", 1201, 47, 11), ("n46e009.HGT", 3601, 46, 9), ("S34W071.hgt", 1201, -34, -71)],
)
def test_heights_are_those_of_the_tile_that_the_name_says(
    tmp_path: Path, name: str, side: int, south: int, west: int
) -> None:
    path = write_tile(tmp_path / name, side)
    latitude, longitude = path_over(south, west)
    row, column = (south + 1 - latitude) * (side - 1), (longitude - west) * (side - 1)
    heights = sample_elevations(path, latitude, longitude, 40)
    # a plane stays one when it is smoothed, but for what 8 cells leave of the border's effect: 30 m x 0.25**8 = 5e-4 m
    np.testing.assert_allclose(heights, 500.0 + 2.0 * row + 3.0 * column, atol=1e-2)


def test_a_tile_reaches_from_degree_to_degree(tmp_path: Path) -> None:
    path = write_tile(tmp_path / "N47E011.hgt")
    with pytest.raises(InputError, match=r"N47E011\.hgt: does not cover the whole run; .* join several"):
        sample_elevations(path, np.array([47.5, 48.0001]), np.array([11.5, 11.5]), 2)
    corners = sample_elevations(path, np.array([48.0, 47.0]), np.array([11.0, 12.0]), 2)
    assert np.all(np.isfinite(corners))


def test_only_voids_under_the_run_matter(tmp_path: Path) -> None:
    latitude, longitude = path_over(47, 11)
    far = write_tile(tmp_path / "N47E011.hgt", void=(slice(0, 200), slice(0, 1201)))
    assert np.all(np.isfinite(sample_elevations(far, latitude, longitude, 40)))
    row = round((48.0 - latitude[0]) * 1200)
    under = write_tile(tmp_path / "N47E011.hgt", void=(slice(row, row + 1), slice(315, 316)))
    with pytest.raises(InputError, match="holes under the run"):
        sample_elevations(under, latitude, longitude, 40)


@pytest.mark.parametrize(
    "name", ["slope.hgt", "N47.hgt", "N47E11.hgt", "N90E011.hgt", "N47E180.hgt", "S00E011.hgt", "N47E011 (1).hgt"]
)
def test_a_name_that_is_no_tile_is_refused(tmp_path: Path, name: str) -> None:
    path = write_tile(tmp_path / name)
    with pytest.raises(InputError, match=r"not a tile's south-west corner; name it like N47E011\.hgt"):
        sample_elevations(path, *path_over(47, 11), 40)


@pytest.mark.parametrize("size", [0, 1, 2 * 1201 * 1201 - 1, 2 * 1201 * 1201 + 1, 2 * 1201 * 3601, 2 * 3601 * 3601 + 2])
def test_a_file_of_another_size_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "N47E011.hgt"
    with path.open("wb") as stream:
        stream.truncate(size)
    with pytest.raises(InputError, match=rf"N47E011\.hgt: {size} bytes are no SRTM tile"):
        sample_elevations(path, *path_over(47, 11), 40)


def test_a_pipe_and_a_missing_tile_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        sample_elevations(tmp_path / "N47E011.hgt", *path_over(47, 11), 40)
    os.mkfifo(tmp_path / "N47E011.hgt")
    with pytest.raises(InputError, match="this is not a file"):
        sample_elevations(tmp_path / "N47E011.hgt", *path_over(47, 11), 40)


def test_a_tile_is_in_no_other_coordinate_system(tmp_path: Path) -> None:
    path = write_tile(tmp_path / "N47E011.hgt")
    assert len(sample_elevations(path, *path_over(47, 11), 40, "EPSG:4326")) == 40
    with pytest.raises(InputError, match="an SRTM tile is in EPSG:4326, not in EPSG:31254"):
        sample_elevations(path, *path_over(47, 11), 40, "EPSG:31254")
