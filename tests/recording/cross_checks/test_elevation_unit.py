"""Elevation models in other units than metres, by the fixes over them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pymap3d
import pytest
from tiny import AZIMUTH_DEG, INCLINATION_DEG, ORIGIN, TOML, Tiny, csv, motion

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.read import read_recording

rasterio = pytest.importorskip("rasterio")


def model(folder: Path, factor: float, zero: float = 0.0, **options: Any) -> Path:
    """Write the tiny run's plane, its heights over ``zero`` m times ``factor``, as a grid of degrees."""
    rows, columns = np.mgrid[0:120, 0:120]
    step = 1e-5
    latitude, longitude = ORIGIN[0] + step * (60 - rows), ORIGIN[1] + step * (columns - 30)
    east, north, _ = pymap3d.geodetic2enu(latitude, longitude, ORIGIN[2], *ORIGIN)
    along = east * np.sin(np.radians(AZIMUTH_DEG)) + north * np.cos(np.radians(AZIMUTH_DEG))
    heights = factor * (ORIGIN[2] - zero - np.tan(np.radians(INCLINATION_DEG)) * along)
    about = {"driver": "GTiff", "height": 120, "width": 120, "count": 1, "crs": "EPSG:4326", "dtype": "float32"}
    corner = rasterio.transform.from_origin(longitude[0, 0] - step / 2.0, latitude[0, 0] + step / 2.0, step, step)
    scale = options.pop("scales", None)
    with rasterio.open(folder / "hill.tif", "w", transform=corner, **(about | options)) as dataset:
        dataset.write(np.round(heights) if scale else heights.astype("float32"), 1)
        if scale:
            dataset.scales, dataset.offsets = scale, (zero,)
    return folder


def recording(folder: Path, datum: str = "other") -> Path:
    return Tiny(toml=TOML + f'\n[terrain]\nfile = "hill.tif"\ndatum = "{datum}"\n').write(folder)


def test_a_model_in_metres_is_no_fault(tmp_path: Path) -> None:
    assert read_recording(model(recording(tmp_path, "gps"), 1.0)).notices == ()


@pytest.mark.parametrize(("metres", "unit"), [(0.3048, "feet"), (0.1, "decimetres"), (0.3048006, "feet")])
@pytest.mark.parametrize("datum", ["other", "gps"])
def test_another_unit_is_named_with_its_factor(tmp_path: Path, metres: float, unit: str, datum: str) -> None:
    zero = ORIGIN[2] - 800.0 if unit == "decimetres" else 0.0  # beyond 9000 m no model is taken at all
    folder = model(recording(tmp_path, datum), 1.0 / metres, zero)
    with pytest.raises(InputError, match=f"heights look like {unit}: the path falls"):
        read_recording(folder)


@pytest.mark.parametrize("datum", ["other", "gps"])
def test_fixes_in_feet_are_named_and_not_the_model(tmp_path: Path, datum: str) -> None:
    folder = model(recording(tmp_path, datum), 1.0)
    columns = motion()[1]
    feet = csv(columns | {"altitude_m": columns["altitude_m"] / 0.3048})
    (folder / "gps.csv").write_text(feet, encoding="utf-8")
    toml = (folder / "recording.toml").read_text(encoding="utf-8")
    without_slope = toml[: toml.index("[slope]")] + toml[toml.index("[motion]") :]
    (folder / "recording.toml").write_text(without_slope, encoding="utf-8")
    with pytest.raises(InputError, match=r"gps.csv: column altitude_m: its heights look like feet: .*times 0.3048"):
        read_recording(folder)


@pytest.mark.parametrize("scale", [0.1, 0.05, 0.25])
def test_scale_and_offset_of_the_band_are_applied(tmp_path: Path, scale: float) -> None:
    folder = model(recording(tmp_path), 1.0 / scale, 1500.0, dtype="int16", scales=(scale,))
    assert read_recording(folder).notices == ()


def test_a_fall_that_no_unit_explains_is_doubted(tmp_path: Path) -> None:
    words = read_recording(model(recording(tmp_path), 1.9)).notices
    assert len(words) == 1
    assert "the path falls 1.9" in words[0]
