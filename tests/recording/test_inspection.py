"""The inspection: figures, their text and their picture."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
from bundled import bundled
from tiny import TOML, Tiny

from sssi_exudyn.analysis.skiing import skiing_of
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.inspection import format_inspection, format_surface, inspect_recording
from sssi_exudyn.recording.inspection_plot import plot_inspection
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.terrain.profile import SurfaceFigures


def test_figures_of_a_recording(tmp_path: Path) -> None:
    tiny = Tiny()
    tiny.gps = {name: np.delete(column, slice(30, 34)) for name, column in tiny.gps.items()}
    tiny.insoles["left_1_N"][:] = 0.0
    inspection = inspect_recording(read_recording(tiny.write(tmp_path)))
    motion, gps, insoles = inspection.instruments
    assert (motion.samples, gps.samples, insoles.samples) == (481, 81, 401)
    assert motion.rate_hz == pytest.approx(60.0, rel=1e-6)
    assert gps.rate_hz == pytest.approx(10.0, rel=1e-6)
    assert (inspection.start_s, inspection.stop_s) == pytest.approx((0.0, 8.0))
    assert inspection.mean_speed_mps is not None
    # 8 m/s down the slope, √(1 + (swing·ω)²/2/8²) = 1.02 times that along the path
    assert inspection.mean_speed_mps == pytest.approx(8.2, abs=0.3)
    assert inspection.dead_cells == ("left_1_N",)
    for item in inspection.setting:
        assert item.given
        assert item.estimate_deg is not None
        assert item.sigma_deg is not None
        assert abs(item.estimate_deg - item.used_deg) < 4.0 * item.sigma_deg
    assert json.loads(json.dumps(dataclasses.asdict(inspection)))["name"] == "tiny"


def test_what_is_estimated_shows_the_uncertainty_that_the_recording_states(tmp_path: Path) -> None:
    toml = TOML.replace("heading_deg = 25.0", "")
    recording = read_recording(Tiny(toml=toml).write(tmp_path))
    slope = dataclasses.replace(recording.slope, estimated=True, sigma_inclination=0.02, sigma_fall_line_azimuth=0.3)
    settings = inspect_recording(dataclasses.replace(recording, slope=slope)).setting
    assert [item.given for item in settings] == [False] * 3
    assert [item.sigma_deg for item in settings] == pytest.approx(np.degrees([0.02, 0.3, recording.heading.sigma]))
    assert [item.estimate_deg for item in settings] == [item.used_deg for item in settings]


def test_text_says_what_was_done_and_estimated(tmp_path: Path) -> None:
    tiny = Tiny(toml=TOML.replace("heading_deg = 25.0", ""))
    tiny.gps = {name: np.delete(column, slice(30, 34)) for name, column in tiny.gps.items()}
    text = format_inspection(inspect_recording(read_recording(tiny.write(tmp_path))))
    for words in ("60.0 Hz", "10.0 Hz", "note: gps.csv: 1 short gap(s) interpolated", "16° given", "° estimated"):
        assert words in text


def test_an_estimate_is_printed_once_with_the_digits_of_its_error(tmp_path: Path) -> None:
    recording = read_recording(Tiny(toml=TOML.replace("heading_deg = 25.0", "")).write(tmp_path))
    slope = dataclasses.replace(recording.slope, estimated=True, sigma_inclination=0.02, sigma_fall_line_azimuth=0.26)
    text = format_inspection(inspect_recording(dataclasses.replace(recording, slope=slope)))
    azimuth = np.degrees(slope.fall_line_azimuth)
    assert text.count(f"{azimuth:.0f} ± 15°") == 1  # 0.26 rad
    assert f"{azimuth:.1f}" not in text
    assert any("the capture's heading is not stated; estimated" in notice for notice in recording.notices)
    assert "heading_deg" not in text


def with_rest(tiny: Tiny, seconds: float) -> Tiny:
    """Let the skier of the fixes stand for so long before the run."""
    moved = tiny.gps["time_s"] - seconds
    tiny.gps = {
        name: column if name == "time_s" else np.interp(moved, tiny.gps["time_s"], column)
        for name, column in tiny.gps.items()
    }
    return tiny


def test_turns_speed_and_a_crop_come_from_the_track(tmp_path: Path) -> None:
    skiing = skiing_of(read_recording(Tiny().write(tmp_path / "whole")))
    assert skiing is not None
    assert [turn.side for turn in skiing.turns[:2]] in (["left", "right"], ["right", "left"])
    assert skiing.crop_start_s is None  # it turns all along
    recording = read_recording(with_rest(Tiny(), 4.0).write(tmp_path / "rest"))
    late = skiing_of(recording)
    assert late is not None
    # the skier stands for 4 s, and a second before the first turn is kept
    assert late.crop_start_s == pytest.approx(late.turns[0].start_s - 1.0)
    assert late.crop_start_s > 2.0
    text = format_inspection(inspect_recording(recording, skiing=late))
    assert f"suggested crop: {late.crop_start_s:.1f} to" in text
    assert f"{len(late.turns)} turns" in text.splitlines()[0]
    assert "m/s at most" in text.splitlines()[0]


@pytest.mark.long
def test_a_phone_has_no_empty_panel(tmp_path: Path) -> None:
    recording = dataclasses.replace(read_recording(Tiny().write(tmp_path / "run")), insoles=None)
    plot_inspection(recording, tmp_path / "picture.svg")
    plot_inspection(dataclasses.replace(recording, gps=None), tmp_path / "bare.svg")
    counts = [(tmp_path / name).read_text(encoding="utf-8").count('id="axes_') for name in ("picture.svg", "bare.svg")]
    assert counts == [4, 1]  # track, speed, altitude and sampling; sampling alone


@pytest.mark.long
def test_the_speed_panel_names_what_it_shows(tmp_path: Path) -> None:
    whole = read_recording(Tiny().write(tmp_path / "whole"))
    rest = read_recording(with_rest(Tiny(), 4.0).write(tmp_path / "rest"))
    titles = {}
    for name, recording, skiing in (("whole", whole, skiing_of(whole)), ("rest", rest, skiing_of(rest))):
        plot_inspection(recording, tmp_path / f"{name}.svg", skiing)
        drawn = (tmp_path / f"{name}.svg").read_text(encoding="utf-8")
        titles[name] = re.findall(r"<!-- (Speed.*?) -->", drawn)
    assert titles == {
        "whole": ["Speed, every second turn shaded"],
        "rest": ["Speed, every second turn shaded, suggested crop dashed"],
    }


def test_a_height_that_rounds_to_zero_has_no_minus() -> None:
    surface = SurfaceFigures(-0.68, -0.003, 1.65, 12.9, 13.0, 1)
    assert "-0.68 to +0.00 m" in format_surface(surface)


def test_text_of_motion_alone(tmp_path: Path) -> None:
    inspection = inspect_recording(read_recording(Tiny(toml=TOML.split("[gps]")[0]).write(tmp_path)))
    assert inspection.track_length_m is None
    assert "track" not in format_inspection(inspection)


@pytest.mark.long
@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_picture_is_drawn(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"picture{suffix}"
    plot_inspection(read_recording(Tiny().write(tmp_path / "run")), path)
    assert path.stat().st_size > 5000  # an empty figure is smaller


def test_picture_of_motion_alone(tmp_path: Path) -> None:
    recording = read_recording(Tiny(toml=TOML.split("[gps]")[0]).write(tmp_path / "run"))
    plot_inspection(recording, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").exists()


@pytest.mark.parametrize("name", ["nowhere/picture.png", "picture.doc"])
def test_picture_that_cannot_be_written(tmp_path: Path, name: str) -> None:
    recording = read_recording(Tiny().write(tmp_path / "run"))
    with pytest.raises(InputError):
        plot_inspection(recording, tmp_path / name)


def test_the_top_speed_is_not_the_noise_of_two_fixes() -> None:
    recording, _ = bundled("beginner")
    exact = skiing_of(recording)
    gps = recording.gps
    assert exact is not None
    assert gps is not None
    noise = np.random.default_rng(3).normal(0.0, 0.5, gps.enu.shape)
    noisy = dataclasses.replace(gps, enu=gps.enu + noise, sigma=np.full_like(gps.sigma, 0.5))
    skiing = skiing_of(dataclasses.replace(recording, gps=noisy))
    assert skiing is not None
    # from fix to fix, 0.1 s apart, the noise alone is 7 m/s; at the ends, where a fit has one side alone, 1.4 are left
    assert skiing.top_speed_mps == pytest.approx(exact.top_speed_mps, rel=0.3)
