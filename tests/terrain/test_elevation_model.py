"""Elevation models in files: heights where they are known, and one line for each unusable file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from elevation_files import height_at, places, sample_elevations, sample_track, track, write

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.terrain.elevation_model import epsg_of

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


@pytest.mark.parametrize(
    ("name", "options"),
    [("dem.tif", {}), ("dem.asc", {"driver": "AAIGrid"}), ("dem.asc", {"driver": "AAIGrid", "dtype": "int32"})],
)
def test_a_file_without_coordinate_system_is_read_in_the_stated_one(
    tmp_path: Path, name: str, options: dict[str, Any]
) -> None:
    path = write(tmp_path / name, crs=None, **options)
    with pytest.raises(InputError, match=r"no coordinate system; state it \(--dem-crs or \[terrain\] crs"):
        sample_track(path)
    # Cut to whole metres, heights are 0.5 m lower on average, and smoothing over 4 cells of 2 m takes 8 % of the waves
    # of 2 m.  The rest of the 0.3 m is what it leaves of the steps.
    lower, tolerance = (0.5, 0.3) if "dtype" in options else (0.0, 3e-4)
    np.testing.assert_allclose(sample_track(path, "EPSG:32632"), height_at(*track()) - lower, atol=tolerance)


@pytest.mark.parametrize(("crs", "latitude", "longitude"), [("EPSG:31254", 47.27, 11.39), ("EPSG:4326", 46.8, 9.8)])
def test_places_are_those_of_the_stated_system(tmp_path: Path, crs: str, latitude: float, longitude: float) -> None:
    from rasterio.warp import transform

    (x,), (y,) = transform("EPSG:4326", crs, [longitude], [latitude])
    side = 2e-5 if crs == "EPSG:4326" else 2.0
    corner = rasterio.transform.from_origin(x - 30.0 * side, y + 40.0 * side, side, side)
    path = write(tmp_path / "dem.tif", crs=None, transform=corner)
    heights = sample_elevations(path, np.array([latitude]), np.array([longitude]), 1, crs)
    np.testing.assert_allclose(heights, height_at(np.array([60.0]), np.array([-80.0])), atol=3e-4)


def test_a_system_of_the_same_places_is_no_contradiction(tmp_path: Path) -> None:
    path = write(tmp_path / "dem.tif")  # on WGS84
    for crs in ("EPSG:32632", "EPSG:25832"):  # and on ETRS89, which PROJ takes for the same
        np.testing.assert_allclose(sample_track(path, crs), height_at(*track()), atol=3e-4)


@pytest.mark.parametrize("name", ["dem.tif", "dem.asc"])
@pytest.mark.parametrize("crs", ["EPSG:31254", "EPSG:32633", "EPSG:4326"])
def test_a_stated_system_that_contradicts_the_file_is_refused(tmp_path: Path, name: str, crs: str) -> None:
    path = write(tmp_path / name, **({"driver": "AAIGrid"} if name.endswith(".asc") else {}))
    with pytest.raises(
        InputError, match=rf"{name}: the file states another coordinate system \(.*\) than {crs}; leave"
    ):
        sample_track(path, crs)


@pytest.mark.parametrize(
    ("crs", "problem"),
    [
        ("EPSG:999999", "EPSG:999999 is not known"),
        ("EPSG:0", "EPSG:0 is not known"),
        ("EPSG:5773", "EPSG:5773 is no coordinate system of a map"),  # heights alone
        ("EPSG:4978", "EPSG:4978 is no coordinate system of a map"),  # from the centre of the Earth
        ("EPSG:32733", "does not cover the whole run"),
    ],
)
def test_a_number_that_is_of_no_use_is_one_line(tmp_path: Path, crs: str, problem: str) -> None:
    path = write(tmp_path / "dem.tif", crs=None)
    with pytest.raises(InputError, match=problem):
        sample_track(path, crs)


@pytest.mark.parametrize(
    "text",
    [
        "31254",
        "EPSG:",
        "EPSG:31254 ;x",
        "EPSG:1234567",
        "+proj=utm +zone=32",
        "EPSG:\u0663\u0661",
        "/etc/passwd",
        "E" * 10**6,
        "EPSG:3\n4",
    ],
)
def test_a_text_that_is_no_epsg_number_is_one_short_line(text: str) -> None:
    with pytest.raises(InputError, match="write its EPSG number, such as EPSG:31254") as error:
        epsg_of(text, "recording.toml", "[terrain] crs")
    assert len(str(error.value)) < 200
    assert "\n" not in str(error.value)


def test_an_epsg_number_may_be_in_small_letters() -> None:
    assert epsg_of(" epsg:31254 ", "recording.toml", "[terrain] crs") == "EPSG:31254"
