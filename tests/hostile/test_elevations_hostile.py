"""Elevation models of strangers: nothing next to them is opened or fetched, memory is bounded, faults are one line."""

from __future__ import annotations

import http.server
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from elevation_files import EAST, NORTH, height_at, sample_track, track, write
from limited import run_limited

from sssi_exudyn.core.errors import InputError

rasterio = pytest.importorskip("rasterio")


@pytest.fixture(scope="module")
def requests_seen() -> Iterator[tuple[str, list[str]]]:
    """Serve nothing on the loopback; yield a picture's address there, and the list of all requests."""
    seen: list[str] = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            seen.append(f"{self.command} {self.path}")
            self.send_error(404)

        do_HEAD = do_GET

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/x.tif", seen
    server.shutdown()


def virtual(source: str) -> str:
    """Return a virtual raster that is read from elsewhere, with the flags of a mask."""
    return (
        '<VRTDataset rasterXSize="60" rasterYSize="80"><Metadata><MDI key="INTERNAL_MASK_FLAGS_1">2</MDI></Metadata>'
        '<VRTRasterBand dataType="Byte" band="1"><SimpleSource><SourceFilename relativeToVRT="0">'
        f"{source}</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>"
    )


@pytest.mark.long
@pytest.mark.parametrize("side_file", [".tif.msk", ".tif.ovr", ".tif.aux.xml", ".msk", ".ovr", ".aux.xml"])
@pytest.mark.parametrize("scheme", ["", "/vsicurl/"])
def test_what_lies_next_to_a_model_is_not_fetched(
    tmp_path: Path, requests_seen: tuple[str, list[str]], side_file: str, scheme: str
) -> None:
    address, seen = requests_seen
    path = write(tmp_path / "dem.tif", nodata=None)
    if side_file.endswith(".aux.xml"):
        item = f'<MDI key="OVERVIEW_FILE">{scheme}{address}</MDI>'
        text = f'<PAMDataset><Metadata domain="OVERVIEWS">{item}</Metadata></PAMDataset>'
    else:
        text = virtual(scheme + address)
    (tmp_path / f"dem{side_file}").write_text(text, encoding="utf-8")
    heights = sample_track(path)
    np.testing.assert_allclose(heights, height_at(*track()), atol=3e-4)  # as without: float32, and a spline's error
    assert seen == []


@pytest.mark.long
@pytest.mark.parametrize(
    "side_file", [".tif.msk", ".tif.aux.xml", ".tif.ovr", ".tfw", ".prj", ".asc.aux.xml", ".asc.msk"]
)
def test_pipes_next_to_a_model_are_not_waited_for(tmp_path: Path, side_file: str) -> None:
    driver = {"driver": "AAIGrid"} if ".asc" in side_file else {}
    path = write(tmp_path / ("dem.asc" if driver else "dem.tif"), nodata=None, **driver)
    (tmp_path / f"dem{side_file}").unlink(missing_ok=True)
    os.mkfifo(tmp_path / f"dem{side_file}")
    assert len(sample_track(path)) == 40


def test_a_pipe_in_place_of_a_coordinate_system_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "dem.asc", driver="AAIGrid")
    (tmp_path / "dem.prj").unlink()
    os.mkfifo(tmp_path / "dem.prj")
    with pytest.raises(InputError, match=r"dem\.prj: this is not a file"):
        sample_track(path)


def test_a_coordinate_system_behind_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    path = write(tmp_path / "in" / "dem.asc", driver="AAIGrid")
    (tmp_path / "in" / "dem.prj").replace(tmp_path / "secret")
    (tmp_path / "in" / "dem.prj").symlink_to(tmp_path / "secret")
    with pytest.raises(InputError, match="leads out"):
        sample_track(path)


def grid_of_its_own(tmp_path: Path) -> Path:
    """Write a model whose coordinate system names a pipe as its file of shifts."""
    os.mkfifo(tmp_path / "pipe.gsb")
    path = write(tmp_path / "dem.asc", driver="AAIGrid")
    prj = tmp_path / "dem.prj"
    text = rasterio.crs.CRS.from_epsg(32632).to_wkt()
    grid = f'EXTENSION["PROJ4_GRIDS","{tmp_path}/pipe.gsb"]'
    prj.write_text(text.replace('AUTHORITY["EPSG","6326"]', grid), encoding="utf-8")
    assert "PROJ4_GRIDS" in prj.read_text(encoding="utf-8")
    return path


def no_such_grid(tmp_path: Path) -> Path:
    system = f"+proj=utm +zone=32 +ellps=WGS84 +nadgrids={tmp_path}/nothing.gsb +no_defs"
    return write(tmp_path / "dem.tif", crs=system)


MOON = "+proj=longlat +a=1737400 +b=1737400 +no_defs"
AT_THE_RUN = rasterio.transform.from_origin(8.99, 47.0, 1e-4, 1e-4)
FAULTS: dict[str, tuple[Callable[[Path], Path], str]] = {
    "a pipe of shifts": (grid_of_its_own, "files of its own"),
    "shifts that are not there": (no_such_grid, "files of its own"),
    "no geotransform": (
        lambda folder: write(folder / "dem.tif", transform=rasterio.Affine.identity()),
        "does not say where its cells are",
    ),
    "a geotransform without extent": (
        lambda folder: write(folder / "dem.tif", transform=rasterio.Affine(0.0, 0.0, EAST, 0.0, 0.0, NORTH)),
        "does not say where its cells are",
    ),
    "a geotransform of one direction": (
        lambda folder: write(folder / "dem.tif", transform=rasterio.Affine(2.0, 2.0, EAST, 2.0, 2.0, NORTH)),
        "does not say where its cells are",
    ),
    "the Moon": (lambda folder: write(folder / "dem.tif", crs=MOON, transform=AT_THE_RUN), "no place in its"),
    "the Moon, by its authority": (
        lambda folder: write(folder / "dem.tif", crs="IAU_2015:30100", transform=AT_THE_RUN),
        "no place in its",
    ),
    "the far side of the globe": (
        lambda folder: write(folder / "dem.tif", crs="+proj=ortho +lat_0=-47 +lon_0=-171"),
        "no place in its",
    ),
    "heights that are complex": (
        lambda folder: write(folder / "dem.tif", dtype="complex64", nodata=None),
        "no heights",
    ),
    "cut in the middle": (lambda folder: cut(write(folder / "dem.tif", compress="deflate")), "no readable elevation"),
}


def cut(path: Path) -> Path:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


@pytest.mark.long
@pytest.mark.parametrize("name", FAULTS)
def test_a_model_that_is_of_no_use_is_one_line(tmp_path: Path, name: str) -> None:
    make, words = FAULTS[name]
    path = make(tmp_path)
    with pytest.raises(InputError, match=words) as error:
        sample_track(path)
    assert Path(error.value.file).parent == tmp_path


@pytest.mark.parametrize("interleave", ["pixel", "band"])
def test_many_bands_take_no_memory(tmp_path: Path, interleave: str) -> None:
    transform = rasterio.transform.from_origin(EAST, NORTH, 0.1, 0.1)
    about = {"height": 1999, "width": 1999, "count": 200, "dtype": "float64", "nodata": None, "transform": transform}
    tiles = {"tiled": True, "blockxsize": 1984, "blockysize": 1984, "interleave": interleave, "sparse_ok": True}
    with rasterio.open(
        tmp_path / "dem.tif", "w", driver="GTiff", crs="EPSG:32632", compress="deflate", **about, **tiles
    ):
        pass
    assert (tmp_path / "dem.tif").stat().st_size < 20_000
    outcome = run_limited(lambda: sample_track(tmp_path / "dem.tif"))
    assert outcome.verdict == "refused", outcome
    assert "blocks of more than 32 MB" in outcome.text


def test_a_model_behind_a_link_is_read(tmp_path: Path) -> None:
    path = write(tmp_path / "dem.tif")
    (tmp_path / "link.tif").symlink_to(path)
    assert len(sample_track(tmp_path / "link.tif")) == 40
