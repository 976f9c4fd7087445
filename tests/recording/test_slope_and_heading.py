"""Slope and heading estimated from motion and fixes, against a world where both are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tiny import AZIMUTH_DEG, HEADING_DEG, INCLINATION_DEG, TOML, Tiny, motion

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.slope_and_heading import estimate_slope

SLOPE = TOML[TOML.index("[slope]") : TOML.index("[motion]")]


def track(inclination_deg: float, azimuth_deg: float, width: float, length: float = 80.0) -> Array:
    """Return a swinging path (200, 3) m on a plane."""
    along = np.linspace(0.0, length, 200)
    plane = np.column_stack([along, width * np.sin(along / 5.0), np.zeros(200)])
    points: Array = plane @ slope_to_enu(np.deg2rad(inclination_deg), np.deg2rad(azimuth_deg)).T
    return points


@pytest.mark.parametrize(("inclination", "azimuth"), [(5.0, 0.0), (16.0, 70.0), (35.0, 200.0), (25.0, -120.0)])
def test_plane_without_noise_is_estimated_exactly(inclination: float, azimuth: float) -> None:
    slope = estimate_slope(track(inclination, azimuth, 3.0), sigma=1e-6)
    # the fit is linear and exact but for the prior on the azimuth, which a micrometre's noise makes powerless
    assert np.rad2deg(slope.inclination.value) == pytest.approx(inclination, abs=1e-3)
    apart = np.exp(1j * (slope.azimuth.value - np.deg2rad(azimuth)))
    assert np.rad2deg(np.angle(apart)) == pytest.approx(0.0, abs=1e-3)


def test_outliers_of_height_do_not_tilt_the_plane() -> None:
    points = track(16.0, 70.0, 3.0)
    points[:, 2] += 0.02 * np.random.default_rng(3).standard_normal(200)
    points[20:30, 2] += 5.0
    slope = estimate_slope(points, sigma=0.02)
    # plain least squares would be off by about 5 m·(10/200)·6·0.75/80 m = 0.8°
    assert np.rad2deg(slope.inclination.value) == pytest.approx(16.0, abs=0.1)


def test_straight_path_leaves_the_fall_line_to_the_prior() -> None:
    points = track(16.0, 70.0, 0.0)
    points[:, 2] += 0.02 * np.random.default_rng(4).standard_normal(200)
    slope = estimate_slope(points, sigma=0.02)
    assert np.rad2deg(slope.azimuth.value) == pytest.approx(70.0, abs=1.0)  # along the path
    assert np.rad2deg(slope.azimuth.sigma) == pytest.approx(20.0, abs=2.0)  # the prior's own sigma


def test_uncertainty_of_the_slope_covers_its_error_under_drifting_heights() -> None:
    """Heights are those of a telephone: 3 m, correlated over 10 s."""
    random = np.random.default_rng(5)
    pulls = []
    for _ in range(60):
        drift = np.empty(200)
        drift[0] = random.standard_normal()
        decay = np.exp(-0.1 / 10.0)
        for sample in range(1, 200):
            drift[sample] = decay * drift[sample - 1] + np.sqrt(1.0 - decay**2) * random.standard_normal()
        points = track(16.0, 70.0, 6.0, length=200.0)
        points[:, 2] += 3.0 * drift
        slope = estimate_slope(points, sigma=1.5)
        pulls.append((slope.inclination.value - np.deg2rad(16.0)) / slope.inclination.sigma)
    # 60 pulls have a mean square of 1 ± 0.18; a cautious sigma may be twice too large, none may be half as large
    assert 0.2 < np.mean(np.square(pulls)) < 2.0


def test_track_that_does_not_descend_is_no_slope() -> None:
    with pytest.raises(SssiError, match="downhill"):
        estimate_slope(track(16.0, 70.0, 3.0)[::-1], sigma=0.02)
    with pytest.raises(SssiError, match="nowhere"):
        estimate_slope(0.01 * track(16.0, 70.0, 3.0), sigma=0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slope_and_heading_of_a_recording_are_estimated(tmp_path: Path, seed: int) -> None:
    rotations, gps = motion(noise=0.02, seed=seed)
    tiny = Tiny(toml=TOML.replace(SLOPE, "").replace("heading_deg = 25.0", ""), rotations=rotations, gps=gps)
    recording = read_recording(tiny.write(tmp_path))
    assert recording.slope.estimated
    assert recording.heading.estimated
    assert sum("estimated" in notice for notice in recording.notices) == 2
    # three sigma each; and the sigmas themselves are of the size that fixes of 2 cm over 65 m allow
    assert abs(recording.slope.inclination - np.deg2rad(INCLINATION_DEG)) < 3.0 * recording.slope.sigma_inclination
    assert (
        abs(recording.slope.fall_line_azimuth - np.deg2rad(AZIMUTH_DEG)) < 3.0 * recording.slope.sigma_fall_line_azimuth
    )
    assert abs(recording.heading.value - np.deg2rad(HEADING_DEG)) < 3.0 * recording.heading.sigma
    assert recording.slope.sigma_inclination < np.deg2rad(0.2)
    assert recording.slope.sigma_fall_line_azimuth < np.deg2rad(3.0)
    assert recording.heading.sigma < np.deg2rad(3.0)


def test_straight_run_still_shows_its_heading(tmp_path: Path) -> None:
    rotations, gps = motion(swing=0.0)
    tiny = Tiny(toml=TOML.replace("heading_deg = 25.0", ""), rotations=rotations, gps=gps)
    recording = read_recording(tiny.write(tmp_path))
    assert abs(recording.heading.value - np.deg2rad(HEADING_DEG)) < 3.0 * recording.heading.sigma


def test_estimated_slope_too_steep_for_a_piste_asks_for_the_unit(tmp_path: Path) -> None:
    tiny = Tiny(toml=TOML.replace(SLOPE, ""))
    tiny.gps["altitude_m"] = tiny.gps["altitude_m"] / 0.3048
    assert any("feet" in notice for notice in read_recording(tiny.write(tmp_path)).notices)


def test_level_ground_is_no_slope(tmp_path: Path) -> None:
    tiny = Tiny(toml=TOML.replace(SLOPE, ""))
    tiny.gps["altitude_m"] = 2000.0 + 0.02 * np.sin(np.arange(81.0))
    with pytest.raises(InputError, match=r"\[slope\]: not given, and no estimate is possible"):
        read_recording(tiny.write(tmp_path))
