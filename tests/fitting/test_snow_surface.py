"""The snow surface of a recording: seen in its fixes' heights, taken from an elevation model, refused with one line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from bundled import bundled
from tiny import AZIMUTH_DEG, INCLINATION_DEG, ORIGIN, TOML, Tiny, motion

from sssi_exudyn import commands
from sssi_exudyn.contact.terms.terrain import SlopeChange
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.number_ref import FRICTION
from sssi_exudyn.fitting.first_fit import NUISANCES, problem_of
from sssi_exudyn.fitting.observations import measurements_of
from sssi_exudyn.fitting.snow_surface import on_snow_surface, snow_heights, snow_surface, surface_process
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.recording.inspection import format_surface
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording
from sssi_exudyn.terrain.from_heights import TILTS
from sssi_exudyn.terrain.surface import Surface

EXAMPLE = Path(__file__).parents[2] / "examples" / "beginner"


def roll(east: Array, north: Array) -> Array:
    """m: waves of 30 m, half a metre high, in any direction."""
    return np.asarray(0.25 * np.sin((east + 0.5 * north) / 5.0) + 0.25 * np.cos(north / 6.0))


@pytest.fixture
def on_a_roll(tmp_path: Path) -> Path:
    """The beginner's recording with fixes that rise and fall with a roll of the snow."""
    folder = tmp_path / "roll"
    shutil.copytree(EXAMPLE, folder)
    table = pd.read_csv(folder / "gps.csv")
    names = {name.partition("_")[0]: name for name in table.columns}
    latitude, longitude, altitude = (table[names[name]].to_numpy() for name in ("latitude", "longitude", "altitude"))
    east, north, _ = pymap3d.geodetic2enu(latitude, longitude, altitude, latitude[0], longitude[0], altitude[0])
    table[names["altitude"]] = altitude + roll(east, north)
    table.to_csv(folder / "gps.csv", index=False)
    return folder


def parts(folder: Path) -> tuple[Recording, Motion, Model]:
    recording, (example, motion) = read_recording(folder), bundled("beginner")
    if recording.name != example.name:  # whose posture is the same on any snow
        motion = motion_from_recording(recording)
    return recording, motion, model_of(recording, motion)


def write_elevations(recording: Recording, path: Path, shift: float, shape: Callable[[Array, Array], Array]) -> None:
    """A GeoTIFF of the example's slope: its plane through the antenna's first place less 1.4 m, with a shape on it."""
    rasterio = pytest.importorskip("rasterio")
    assert recording.gps is not None
    latitude, longitude, altitude = recording.gps.origin
    inclination, azimuth = recording.slope.inclination, recording.slope.fall_line_azimuth
    step = 2.0 / 111_000.0  # 2 m to the north, less to the east
    size = 220
    rows, columns = np.mgrid[0:size, 0:size]
    north = latitude + step * (size // 2 - rows - 0.5)
    east = longitude + step * (columns + 0.5 - size // 2)
    e, n, _ = pymap3d.geodetic2enu(north, east, altitude, latitude, longitude, altitude)
    down = e * np.sin(azimuth) + n * np.cos(azimuth)
    cells = altitude - 1.4 - np.tan(inclination) * down + shape(e, n) + shift
    transform = rasterio.transform.from_origin(longitude - step * size / 2, latitude + step * size / 2, step, step)
    with rasterio.open(
        path, "w", driver="GTiff", height=size, width=size, count=1, dtype="float64", crs="EPSG:4326",
        transform=transform,
    ) as dataset:  # fmt: skip
        dataset.write(cells, 1)


@pytest.mark.long
def test_the_fixes_heights_show_the_snow(on_a_roll: Path) -> None:
    recording, motion, model = parts(on_a_roll)
    surface = on_snow_surface(model, recording, motion).surface
    assert surface is not None
    flat = on_snow_surface(model_of(*bundled("beginner")), *bundled("beginner")).surface
    assert flat is not None
    heights = snow_heights(recording.gps, motion, model)  # type: ignore[arg-type]
    rolling = surface.at(heights.places)[:, 0] - flat.at(heights.places)[:, 0]
    enu = recording.gps.enu[(recording.gps.time >= motion.start) & (recording.gps.time <= motion.stop)]  # type: ignore[union-attr]
    true = roll(enu[:, 0], enu[:, 1]) * np.cos(model.inclination)
    # fixes are sure to 3 cm; the surface is the antenna's roll set off by up to 0.5 m, which is 5 cm of a slope of 0.1
    assert np.std(rolling - true) < 0.06
    assert np.std(true) > 0.2


@pytest.mark.long
def test_a_barometers_heights_count_with_coarse_fixes(on_a_roll: Path) -> None:
    recording, motion, model = parts(on_a_roll)
    assert recording.gps is not None
    coarse = replace(recording.gps, sigma=np.full(len(recording.gps.time), 5.0))
    spread = []
    for gps in (coarse, replace(coarse, barometric=True)):
        estimate = snow_surface(model, replace(recording, gps=gps), motion)
        assert estimate is not None
        spread.append(float(np.std(estimate[0].at(estimate[1].places)[:, 0])))
    # the snow rolls by 0.25 m, root mean square; under fixes of 5 m nothing of that is to be seen, and a barometer that
    # wanders by 0.2 m in a second shows about half of waves that take 3 s
    assert spread[0] < 0.05
    assert spread[1] > 0.08


def test_heights_may_be_poorer_than_places(on_a_roll: Path) -> None:
    text = (on_a_roll / "recording.toml").read_text(encoding="utf-8")
    (on_a_roll / "recording.toml").write_text(text.replace("sigma_m = 0.02", "sigma_m = 0.02\nheight_sigma_m = 5.0"))
    recording, motion, model = parts(on_a_roll)
    assert recording.gps is not None
    assert np.median(recording.gps.sigma) == pytest.approx(0.02)
    estimate = snow_surface(model, recording, motion)
    assert estimate is not None
    assert np.median(estimate[1].sigma) == pytest.approx(5.0 * 1.4 / 1.5)  # as declared of a height
    # the snow rolls by 0.25 m, root mean square: heights that are off by 5 m show nothing of it
    assert np.std(estimate[0].at(estimate[1].places)[:, 0]) < 0.05
    heights = measurements_of(recording, model, motion.start, motion.stop).usual.height
    assert heights.sigma == pytest.approx(5.0 * 1.4 / 1.5)


def test_what_is_open_of_the_snow_is_fitted_along(on_a_roll: Path) -> None:
    recording, motion, model = parts(on_a_roll)
    model = on_snow_surface(model, recording, motion)
    problem = problem_of(recording, motion, model, "joint")
    assert model.surface is not None
    assert problem.names == FRICTION + NUISANCES + model.surface.names
    assert len(model.surface.names) > 0
    assert problem_of(recording, motion, model_of(recording, motion), "paper").names == FRICTION


@pytest.mark.long
def test_an_elevation_model_stands_in_for_the_heights(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(EXAMPLE, folder)
    recording = read_recording(folder)
    write_elevations(recording, folder / "dem.tif", 0.0, roll)
    with (folder / "recording.toml").open("a", encoding="utf-8") as file:
        file.write('\n[terrain]\nfile = "dem.tif"\nsigma_m = 0.5\n')
    recording, motion, model = parts(folder)
    assert "dem.tif" in recording.hashes
    assert recording.elevations is not None
    assert recording.elevations.sigma == 0.5
    surface = on_snow_surface(model, recording, motion).surface
    assert surface is not None
    # far from the path it is the elevation model's, on it the fixes', which know of no roll
    heights = snow_heights(recording.gps, motion, model)  # type: ignore[arg-type]
    assert np.std(surface.at(heights.places)[:, 0]) < 0.1
    assert np.std(surface.mean) > 0.15


@pytest.mark.long
@pytest.mark.parametrize("datum", ["gps", "other"])
def test_another_datum_is_noticed(tmp_path: Path, datum: str) -> None:
    folder = tmp_path / "run"
    shutil.copytree(EXAMPLE, folder)
    write_elevations(read_recording(folder), folder / "dem.tif", -48.0, roll)
    with (folder / "recording.toml").open("a", encoding="utf-8") as file:
        file.write(f'\n[terrain]\nfile = "dem.tif"\ndatum = "{datum}"\n')
    recording, motion, model = parts(folder)
    if datum == "other":
        assert on_snow_surface(model, recording, motion).surface is not None
        return
    with pytest.raises(InputError, match=r"dem\.tif.* m below the fixes'"):
        on_snow_surface(model, recording, motion)


@pytest.mark.long
@pytest.mark.parametrize("lines", ['datum = "other"', 'datum = "geoid"', 'datum = "geoid"\ngeoid_height_m = 48.0'])
def test_heights_from_elsewhere_give_the_same_surface(tmp_path: Path, lines: str) -> None:
    """What they differ by is taken out before places are found: it must not shift the ground along the slope."""
    means = []
    for name, lift, datum in (("same", 0.0, 'datum = "ellipsoid"'), ("elsewhere", -48.0, lines)):
        folder = tmp_path / name
        shutil.copytree(EXAMPLE, folder)
        write_elevations(read_recording(folder), folder / "dem.tif", lift, roll)
        with (folder / "recording.toml").open("a", encoding="utf-8") as file:
            file.write(f'\n[terrain]\nfile = "dem.tif"\nsigma_m = 0.5\n{datum}\n')
        recording, motion, model = parts(folder)
        surface = on_snow_surface(model, recording, motion).surface
        assert surface is not None
        means.append(surface.mean)
    # Single precision of the file's heights, 2000 m, is 0.1 mm; 12 m along the slope would be some decimetres.
    np.testing.assert_allclose(means[1], means[0], atol=2e-3)


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        ('file = "none.tif"', r"none\.tif"),
        ('file = "gps.csv"\ndatum = "gps"\ngeoid_height_m = 40.0', "geoid_height_m"),
        ('file = "gps.csv"', r"gps\.csv"),
        ('file = "gps.csv"\ndatum = "sea"', "datum"),
        ('file = "gps.csv"\nsigma_m = 0.0', "sigma_m"),
        ('file = "../gps.csv"', "file"),
        ('colour = "white"', "colour"),
    ],
)
def test_a_wrong_terrain_is_refused(tmp_path: Path, lines: str, place: str) -> None:
    folder = tmp_path / "run"
    shutil.copytree(EXAMPLE, folder)
    with (folder / "recording.toml").open("a", encoding="utf-8") as file:
        file.write(f"\n[terrain]\n{lines}\n")
    with pytest.raises(InputError, match=place):
        commands.terrain(folder)


@pytest.mark.long
def test_the_surface_is_drawn_and_put_into_figures(on_a_roll: Path, tmp_path: Path) -> None:
    figures = commands.terrain(on_a_roll, out=tmp_path / "snow.svg")
    assert figures.highest_m - figures.lowest_m > 0.5
    assert 0.0 < figures.band_m < 0.1
    assert figures.inclination_least_deg < figures.inclination_most_deg
    assert "<svg" in (tmp_path / "snow.svg").read_text(encoding="utf-8")
    inspection = commands.inspect(on_a_roll)
    assert inspection.surface == figures


BESIDE = 7.0
"""m to the left of the first run, where the second one goes."""


@pytest.fixture
def two_runs(tmp_path: Path) -> Path:
    """The first of two runs on a roll of the snow, 7 m apart; the second receiver's heights have another origin."""
    across = slope_to_enu(np.radians(INCLINATION_DEG), np.radians(AZIMUTH_DEG))[:, 1] * BESIDE
    for name, moved, lift in (("first", np.zeros(3), 0.0), ("second", across, 30.0)):
        columns = motion()[1]
        east, north, up = pymap3d.geodetic2enu(*(columns[name] for name in tuple(columns)[1:]), *ORIGIN)
        east, north = east + moved[0], north + moved[1]
        places = pymap3d.enu2geodetic(east, north, up + roll(east, north) + lift, *ORIGIN)
        toml = TOML + ('\n[terrain]\nruns = ["../second"]\n' if name == "first" else "")
        Tiny(toml=toml, gps={**columns, **dict(zip(tuple(columns)[1:], places, strict=True))}).write(tmp_path / name)
    return tmp_path / "first"


@pytest.mark.long
def test_runs_of_one_slope_share_its_surface(two_runs: Path) -> None:
    recording, motion, model = parts(two_runs)
    assert recording.gps is not None
    along = snow_heights(recording.gps, motion, model).places
    aside = along + [0.0, BESIDE]
    errors = []
    for runs in ((), recording.runs):
        estimate = snow_surface(model, replace(recording, runs=runs), motion)
        assert estimate is not None
        for places in (along, aside):
            enu = np.column_stack([places, np.zeros(len(places))])
            enu = enu @ slope_to_enu(model.inclination, model.fall_line_azimuth).T
            # the antenna rises and falls with the snow below it: it is 0.3 m down the slope of the snow under the skis
            true = roll(enu[:, 0], enu[:, 1]) * np.cos(model.inclination)
            errors.append(float(np.std(estimate[0].at(places)[:, 0] - true)))
    alone, alone_aside, shared, shared_aside = errors
    assert alone < 0.06  # fixes are sure to 3 cm, the rest is the 0.3 m
    assert shared < 0.06
    # 7 m aside of its path a run knows little of waves of 30 m; a run that went there knows them as well as its own
    assert alone_aside > 0.15
    assert shared_aside < 0.06
    process = surface_process(model, recording, motion)
    assert process is not None
    assert process.smooth.shape == (len(process.places), len(process.measured))
    # what the model's terms make of the snow, nothing here, leaves the heights' surface as it is
    again = process.without_terms_of(model).at(along)[:, 0]
    np.testing.assert_allclose(again, process.surface.at(along)[:, 0], atol=1e-12)


@pytest.mark.long
def test_how_many_runs_show_the_snow_is_said(two_runs: Path) -> None:
    figures = commands.terrain(two_runs)
    assert figures.runs == 2
    assert commands.inspect(two_runs).surface == figures
    assert commands.terrain(two_runs.parent / "second").runs == 1
    assert format_surface(figures).endswith("from the heights of 2 runs")


@pytest.mark.long
def test_a_slope_of_two_runs_and_an_elevation_model(two_runs: Path) -> None:
    recording = read_recording(two_runs)
    write_elevations(recording, two_runs / "dem.tif", 0.0, roll)
    toml = two_runs / "recording.toml"
    lines = '[terrain]\nfile = "dem.tif"\ndatum = "other"\nsigma_m = 0.5'
    toml.write_text(toml.read_text(encoding="utf-8").replace("[terrain]", lines), encoding="utf-8")
    recording, motion, model = parts(two_runs)
    estimate = snow_surface(model, recording, motion)
    assert estimate is not None
    along = estimate[1].places
    without = snow_surface(*(model, replace(recording, elevations=None), motion))
    assert without is not None
    # where both runs went, the elevation model, which is right, says what they say
    for places in (along, along + [0.0, BESIDE]):
        apart = estimate[0].at(places)[:, 0] - without[0].at(places)[:, 0]
        assert np.std(apart) < 0.05


def test_the_process_holds_the_surface_that_the_heights_show(on_a_roll: Path) -> None:
    """Mean and modes together are the estimate, and stay it next to what a term makes of the snow."""
    recording, motion, model = parts(on_a_roll)
    surface = on_snow_surface(model, recording, motion).surface
    process = surface_process(model, recording, motion)
    assert surface is not None
    assert process is not None
    path = process.places

    def along(surface: Surface) -> Array:
        return surface.at(path)[:, 0] - surface.at(path)[0, 0]

    np.testing.assert_allclose(along(process.surface), along(surface), atol=1e-9)  # the same numbers, rearranged
    held = process.at(replace(surface, mean=surface.mean + 0.1 * surface.deviation))
    expected = replace(surface, mean=surface.mean + 0.1 * surface.deviation)
    np.testing.assert_allclose(along(held.surface), along(expected), atol=1e-9)
    steeper = replace(model, terms=(*model.terms, SlopeChange(0.02, float(path[len(path) // 2, 0]), 5.0)))
    rest = process.without_terms_of(steeper)
    whole = along(rest) + steeper.snow(path)[0]
    # what the term raises the surface gives back, but for the corner: the heights are seen through noise of 3 cm
    assert np.max(np.abs(whole - along(process.surface))) < 0.03
    assert np.max(np.abs(along(rest) - along(process.surface))) > 0.15
    alone = np.array(process.surface.amounts[TILTS:])
    assert np.max(np.abs(alone)) < 6.0  # half a metre in waves of 30 m is rough, not impossible


@pytest.mark.long
def test_the_process_is_held_where_a_surface_over_other_nodes_is(on_a_roll: Path) -> None:
    """A posture that was corrected moves the fixes' places on the snow, and the nodes about them with it."""
    recording, motion, model = parts(on_a_roll)
    surface = on_snow_surface(model, recording, motion).surface
    process = surface_process(model, recording, motion)
    assert surface is not None
    assert process is not None
    inner = process.surface.mean[1:, :-1]
    corner = (process.surface.origin[0] + process.surface.spacing - 0.3, process.surface.origin[1] + 0.2)
    empty = replace(surface, origin=corner, mean=inner, deviation=inner, modes=inner[None][:0], amounts=())
    other = replace(empty, mean=surface.at(empty.nodes())[:, 0].reshape(inner.shape))
    shifted, expected = (
        process.at(other_surface).surface.at(process.places)[:, 0] for other_surface in (other, surface)
    )
    # a roll over 5 m between nodes 2 m apart, met by the spline of the shifted ones
    np.testing.assert_allclose(shifted, expected, atol=2e-3)
