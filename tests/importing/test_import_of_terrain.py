"""An elevation model that is imported with a run: its place and coordinate system in the recording, and refusals."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pymap3d
import pytest
from tiny import ANSWERS, AZIMUTH_DEG, INCLINATION_DEG, ORIGIN, Tiny

from sssi_exudyn.cli import main
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.importing.assemble import import_recording
from sssi_exudyn.importing.defaults import read_defaults
from sssi_exudyn.io.settings import read_toml
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Elevations
from sssi_exudyn.terrain.elevation_model import open_elevations


def files(folder: Path) -> list[Path]:
    written = Tiny().write(folder / "raw")
    return [written / "motion.bvh", written / "gps.csv"]


def grid(path: Path, crs: str) -> Path:
    """Write an ESRI grid of the plane that ``Tiny`` skis, 100 by 100 cells of 5 m, without its coordinate system."""
    warp = pytest.importorskip("rasterio.warp")
    (x,), (y,) = warp.transform("EPSG:4326", crs, [ORIGIN[1]], [ORIGIN[0]])
    row, column = np.mgrid[0:100, 0:100]
    east, north = 5.0 * (column - 49.5), 5.0 * (49.5 - row)
    longitude, latitude = warp.transform(crs, "EPSG:4326", list((x + east).ravel()), list((y + north).ravel()))
    east, north, _ = pymap3d.geodetic2enu(np.array(latitude), np.array(longitude), ORIGIN[2], *ORIGIN)
    azimuth = np.radians(AZIMUTH_DEG)
    heights = ORIGIN[2] - np.tan(np.radians(INCLINATION_DEG)) * (east * np.sin(azimuth) + north * np.cos(azimuth))
    head = f"ncols 100\nnrows 100\nxllcorner {x - 250.0}\nyllcorner {y - 250.0}\ncellsize 5\nNODATA_value -9999\n"
    rows = "\n".join(" ".join(f"{height:.3f}" for height in line) for line in heights.reshape(100, 100))
    path.write_text(head + rows + "\n", encoding="ascii")
    return path


def tile(path: Path) -> Path:
    """Write an SRTM tile of the plane that ``Tiny`` skis, cut off 500 m above and below it."""
    row, column = np.mgrid[0:1201, 0:1201]
    latitude, longitude = 47.0 - row / 1200.0, 9.0 + column / 1200.0
    north, east = (latitude - ORIGIN[0]) * 111_170.0, (longitude - ORIGIN[1]) * 76_250.0
    azimuth = np.radians(AZIMUTH_DEG)
    down = np.tan(np.radians(INCLINATION_DEG)) * (east * np.sin(azimuth) + north * np.cos(azimuth))
    path.write_bytes(np.round(ORIGIN[2] - np.clip(down, -500.0, 500.0)).astype(">i2").tobytes())
    return path


@pytest.mark.long
@pytest.mark.parametrize("crs", ["EPSG:31254", "EPSG:32632", "EPSG:2056"])
def test_a_grid_without_coordinate_system_is_imported_in_the_stated_one(tmp_path: Path, crs: str) -> None:
    dem = grid(tmp_path / "slope.asc", crs)
    import_recording(files(tmp_path), tmp_path / "out", replace(ANSWERS, dem=dem, dem_crs=crs.lower()))
    table = read_toml(tmp_path / "out" / "recording.toml")["terrain"]
    assert table == {"file": "elevations.asc", "datum": "other", "crs": crs}
    recording = read_recording(tmp_path / "out")
    assert recording.elevations == Elevations(tmp_path / "out" / "elevations.asc", False, crs, sigma=1.0)
    with open_elevations(recording.elevations.path, recording.elevations.crs) as sample:
        (height,) = sample(np.array([ORIGIN[0]]), np.array([ORIGIN[1]]), 1)
    # heights are written to 1 mm, and a plane in another projection bends by less than that within 250 m
    assert height == pytest.approx(ORIGIN[2], abs=5e-3)


@pytest.mark.long
def test_a_coordinate_system_next_to_a_grid_is_one_of_the_inputs(tmp_path: Path) -> None:
    crs = pytest.importorskip("rasterio.crs").CRS
    dem = grid(tmp_path / "slope.asc", "EPSG:31254")
    dem.with_suffix(".prj").write_text(crs.from_epsg(31254).to_wkt(), encoding="utf-8")
    import_recording(files(tmp_path), tmp_path / "out", replace(ANSWERS, dem=dem))
    before = read_recording(tmp_path / "out").hashes
    prj = tmp_path / "out" / "elevations.prj"
    assert before["elevations.prj"] == f"sha256:{hashlib.sha256(prj.read_bytes()).hexdigest()}"
    prj.write_text(prj.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    after = read_recording(tmp_path / "out").hashes
    assert {name for name in before if before[name] != after[name]} == {"elevations.prj"}


def test_a_tile_keeps_its_name_and_is_less_exact(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dem = tile(tmp_path / "n46e009.hgt")
    command = ["import", *map(str, files(tmp_path)), "--out", str(tmp_path / "out"), "--dem", str(dem)]
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == 0, capsys.readouterr().err
    recording = read_recording(tmp_path / "out")
    assert recording.elevations == Elevations(tmp_path / "out" / "N46E009.hgt", False, sigma=5.0)
    assert "N46E009.hgt" in recording.hashes


@pytest.mark.long
@pytest.mark.parametrize(
    ("dem", "crs", "problem"),
    [
        ("slope.asc", None, r"slope\.asc: no coordinate system; state it \(--dem-crs"),
        ("slope.asc", "EPSG:999999", r"slope\.asc: EPSG:999999 is not known"),
        ("slope.asc", "EPSG:32633", r"slope\.asc: does not cover the whole run"),
        ("slope.asc", "Gauss-Krueger" * 10**5, "sssi import: --dem-crs: .* is no coordinate system; write its EPSG"),
        ("N46E009.hgt", "EPSG:32632", r"N46E009\.hgt: an SRTM tile is in EPSG:4326, not in EPSG:32632"),
        ("N46E010.hgt", None, r"N46E010\.hgt: does not cover the whole run"),
        ("alps.hgt", None, r"alps\.hgt: the name is not a tile's"),
        ("short.xyz", None, r"short\.xyz: no reader for '\.xyz'"),
        (None, "EPSG:31254", "sssi import: --dem-crs: there is no elevation model; give one with --dem"),
    ],
)
def test_what_cannot_be_imported_is_one_line_and_leaves_nothing(
    tmp_path: Path, dem: str | None, crs: str | None, problem: str
) -> None:
    if dem is not None:
        path = tmp_path / dem
        grid(path, "EPSG:31254") if dem.endswith(".asc") else tile(path)
    answers = replace(ANSWERS, dem=None if dem is None else tmp_path / dem, dem_crs=crs)
    with pytest.raises(InputError, match=problem) as error:
        import_recording(files(tmp_path), tmp_path / "out", answers)
    assert len(str(error.value)) < 600
    assert {file.name for file in (tmp_path / "out").iterdir()} <= {".lock"}


def test_an_elevation_model_needs_fixes(tmp_path: Path) -> None:
    answers = replace(ANSWERS, dem=tile(tmp_path / "N46E009.hgt"))
    with pytest.raises(InputError, match=r"N46E009\.hgt: there are no fixes"):
        import_recording(files(tmp_path)[:1], tmp_path / "out", answers)


def test_a_file_of_answers_names_a_model_next_to_it(tmp_path: Path) -> None:
    (tmp_path / "club.toml").write_text('dem = "slope.asc"\ndem_crs = "EPSG:31254"\n', encoding="utf-8")
    answers = read_defaults(tmp_path / "club.toml")
    assert (answers.dem, answers.dem_crs) == (tmp_path / "slope.asc", "EPSG:31254")


@pytest.mark.parametrize("crs", ['"MGI / Austria GK West"', '""', "31254", '["EPSG:31254"]', f'"{"9" * 90_000}"'])
def test_a_recording_with_another_text_is_refused(tmp_path: Path, crs: str) -> None:
    folder = Tiny().write(tmp_path / "tiny")
    toml = folder / "recording.toml"
    table = f'\n[terrain]\nfile = "N46E009.hgt"\ndatum = "other"\ncrs = {crs}\n'
    toml.write_text(toml.read_text(encoding="utf-8") + table, encoding="utf-8")
    tile(folder / "N46E009.hgt")
    with pytest.raises(InputError, match=r"recording\.toml: \[terrain\] crs: ") as error:
        read_recording(folder)
    assert len(str(error.value)) < 600


@pytest.mark.long
def test_an_elevation_model_on_the_command_line_has_its_coordinate_system(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, dem = Tiny().write(tmp_path / "tiny"), grid(tmp_path / "slope.asc", "EPSG:31254")
    for options, code in (
        (["--dem", str(dem), "--dem-crs", "EPSG:31254"], 0),
        (["--dem", str(dem)], 1),
        (["--dem-crs", "EPSG:31254"], 1),
    ):
        with pytest.raises(SystemExit) as end:
            main(["terrain", str(folder), *options])
        assert bool(end.value.code) == bool(code)
    one, other = capsys.readouterr().err.strip().split("\n")[-2:]
    assert "no coordinate system; state it" in one
    assert "there is no elevation model; give one with --dem" in other
