"""Few sensors instead of a capture: they are read, checked and completed to a whole posture, against a known run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from strapped import LAG, truth, write_few

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.model.from_recording import first_guess
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.few_sensors.attitude import align_sensor, attitude_of
from sssi_exudyn.recording.few_sensors.complete import use_barometer_heights
from sssi_exudyn.recording.few_sensors.course import find_lag, note_what_is_left_out, skiing_stretch
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import Barometer, Imu, read_barometer, read_imu
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.recording import Recording

EXAMPLE = Path(__file__).parents[3] / "examples" / "intermediate"


@pytest.fixture(scope="module")
def whole() -> Recording:
    return read_recording(EXAMPLE)


@pytest.fixture(scope="module")
def on_skis(whole: Recording, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    places = ("left_ski", "right_ski", "chest")
    return read_recording(write_few(whole, places, tmp_path_factory.mktemp("few") / "skis"))


@pytest.fixture(scope="module")
def in_a_pocket(whole: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_few(whole, ("pocket",), tmp_path_factory.mktemp("few") / "pocket")


def off_deg(made: Recording, whole: Recording, joint: str) -> tuple[float, float]:
    """Return the standard deviations (°) of a joint's heading and roll against the truth.

    A constant offset is a sensor's mounting and does not count.
    """
    time = made.bvh.time
    wrong = [a - b for a, b in zip(truth(made, joint, time), truth(whole, joint, time), strict=True)]
    heading, roll = (float(np.degrees(np.std(error))) for error in wrong)
    return heading, roll


def test_a_mounting_and_a_drifting_heading_are_estimated_together() -> None:
    time = np.arange(0.0, 40.0, 0.1)
    roll, heading = np.radians(40.0) * np.sin(1.7 * time), np.radians(35.0) * np.cos(1.7 * time)
    expected = Rotation.from_euler("ZX", np.stack([heading, roll], axis=1))
    mounting = Rotation.from_euler("xyz", [0.4, -0.9, 2.2])
    drift = Rotation.from_rotvec(np.radians(0.3) * time[:, None] * [0.0, 0.0, 1.0] + [0.0, 0.0, 1.3])
    seen = drift * expected * mounting.inv()
    alignment = align_sensor(time, seen.as_matrix(), expected.as_matrix(), np.ones(len(time)))
    apart = Rotation.from_matrix(alignment.rotation) * expected.inv()
    # 50 rounds of a contraction; tilts alone separate a mounting from the first heading
    assert np.degrees(np.max(apart.magnitude())) < 1.0
    # at the ends a little of a heading that swings by ±35° counts as drift
    assert np.degrees(alignment.drift) == pytest.approx(12.0, abs=3.0)


def test_the_gyroscopes_bias_is_estimated_at_rest() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.02)
    bias = np.radians([0.8, -0.4, 0.6])
    rate = bias + rng.normal(0.0, 0.005, (len(time), 3))
    force = np.array([3.0, -2.0, 9.1]) + rng.normal(0.0, 0.05, (len(time), 3))
    attitude = attitude_of(Imu("still", "pocket", time, rate, force, None))
    # white noise of 0.3 °/s over 500 independent samples, the mean of an estimate that took a second to settle
    np.testing.assert_allclose(attitude.bias, bias, atol=np.radians(0.06))
    assert abs(float(np.mean(attitude.yaw_rate))) < np.radians(0.1)


def test_the_lag_of_fixes_behind_a_yaw_rate_is_estimated() -> None:
    time = np.arange(0.0, 60.0, 0.02)
    rate = 0.8 * np.sin(1.5 * time) + 0.3 * np.sin(0.4 * time + 1.0)
    course = -np.cumsum(rate) * 0.02
    fixes = np.arange(4.0, 56.0)
    late = np.interp(fixes - 1.37, time, course)
    velocity = 7.0 * np.stack([np.cos(late), np.sin(late)], axis=1)
    lag = find_lag(fixes, velocity, time, 0.7 * rate)
    # a parabola through steps of 0.02 s, and half a sample of the integrated rate
    assert lag.value == pytest.approx(1.37, abs=0.02)
    assert lag.correlation > 0.999
    with pytest.raises(SssiError, match="fewer than 8 fixes"):
        find_lag(fixes[:6], velocity[:6], time, rate)


def test_the_skiing_is_the_longest_stretch_at_speed() -> None:
    time = np.arange(0.0, 100.0)
    speed = np.where((time > 20.0) & (time < 80.0), 6.0, 0.2)
    speed[50:53] = 0.5
    assert skiing_stretch(time, speed, -time) == (21.0, 79.0)
    with pytest.raises(SssiError, match="never faster"):
        skiing_stretch(time, np.full(100, 0.3), -time)


def test_what_is_skied_beyond_a_rest_is_said() -> None:
    time = np.arange(0.0, 200.0)
    enu = np.stack([5.0 * time, 0.0 * time, -time], axis=1)
    gps = Gps(time, enu, np.full(200, 3.0), (47.0, 11.0, 2000.0), "Hips", np.zeros(3))
    assert note_what_is_left_out(gps, 0.0, 199.0) == []
    assert note_what_is_left_out(gps, 3.0, 196.0) == []  # a few seconds
    (note,) = note_what_is_left_out(gps, 0.0, 120.0)
    assert "79 s after it, 79 m down, are left out" in note
    both = note_what_is_left_out(gps, 50.0, 120.0)[0]
    assert "50 s before it, 50 m down and 79 s after it" in both
    level = replace(gps, enu=enu * [1.0, 1.0, 0.0])
    assert note_what_is_left_out(level, 0.0, 120.0) == []  # a lift's queue


def test_a_longer_way_up_is_no_skiing() -> None:
    time = np.arange(0.0, 200.0)
    speed = np.where((time < 100.0) | (time > 120.0), 5.0, 0.2)
    height = np.where(time < 110.0, time, 110.0 - 0.8 * (time - 110.0))
    assert skiing_stretch(time, speed, height) == (121.0, 199.0)
    assert skiing_stretch(time, speed, 0.0 * time) == (0.0, 99.0)  # level: the longest


@pytest.mark.long
def test_ski_sensors_give_edges_and_headings_however_they_are_mounted(whole: Recording, on_skis: Recording) -> None:
    for joint in ("LeftFoot", "RightFoot"):
        heading, roll = off_deg(on_skis, whole, joint)
        # the filter's tilt under a skier's acceleration is 1 to 2° off; edges swing by ±50°, headings by ±45°
        assert roll < 3.0
        assert heading < 3.0
    assert off_deg(on_skis, whole, "Spine2")[1] < 3.0


def test_the_receivers_lag_is_taken_off(on_skis: Recording) -> None:
    assert on_skis.completed is not None
    assert on_skis.completed.lag is not None
    # skis that skid turn before the course does, which looks like more lag
    assert on_skis.completed.lag.value == pytest.approx(LAG, abs=2.0 * on_skis.completed.lag.sigma)
    assert any("lag the sensors" in notice for notice in on_skis.notices)
    # the remaining lag is as uncertain as the estimate
    assert on_skis.uncertainty.clock == on_skis.completed.lag.sigma


def test_a_telephone_in_a_pocket_makes_a_whole_motion(whole: Recording, in_a_pocket: Path) -> None:
    made = read_recording(in_a_pocket)
    heading, roll = off_deg(made, whole, "LeftFoot")
    assert made.completed is not None
    # assumed angles must lie within their stated standard deviations
    assert np.radians(heading) < made.completed.sigma.yaw
    assert np.radians(roll) < made.completed.sigma.roll
    assert any("edge angle" in line for line in made.completed.assumed)
    motion = motion_from_recording(made)
    worst = max(row.filtered_rms for row in motion.round_trip if row.segment != "head")
    assert np.degrees(worst) < 0.1  # the posture bends hinges only, so that the chain follows it
    assert motion.antenna is not None


def test_a_coarse_receivers_own_velocity_is_the_first_guess(on_skis: Recording) -> None:
    gps, motion = on_skis.gps, motion_from_recording(on_skis)
    assert gps is not None
    fall = on_skis.slope.fall_line_azimuth
    course, many = fall + np.radians(30.0), len(gps.time)
    measured = replace(gps, sigma=np.full(many, 8.0), speed=np.full(many, 6.0), course=np.full(many, course))
    guess = first_guess(measured, motion, on_skis.slope.inclination, fall)
    # to the right of the fall line, and along the snow a little longer than over ground
    assert guess.velocity_f == pytest.approx(6.0 * np.cos(np.radians(30.0)) / np.cos(on_skis.slope.inclination))
    assert guess.velocity_l == pytest.approx(-3.0)


def test_without_a_slope_the_plane_is_the_tracks(in_a_pocket: Path, tmp_path: Path, whole: Recording) -> None:
    toml = (in_a_pocket / "recording.toml").read_text(encoding="utf-8")
    head, rest = toml.split("[slope]")
    _copy(in_a_pocket, tmp_path / "copy", head + "[[sensors]]" + rest.split("[[sensors]]", 1)[1])
    made = read_recording(tmp_path / "copy")
    assert made.slope.estimated
    assert made.slope.sigma_inclination > 0.0
    apart = abs(made.slope.inclination - whole.slope.inclination)
    assert apart < 3.0 * made.slope.sigma_inclination


def test_a_barometer_that_covers_a_part_is_used_there() -> None:
    time = np.arange(0.0, 40.0, 1.0)
    height = 2000.0 - 3.0 * time
    noise = np.random.default_rng(3).normal(0.0, 2.0, len(time))
    places = np.column_stack([time, time, height + 7.0 + noise])
    gps = Gps(time, places, np.full(40, 3.0), (46.0, 8.0, 0.0), "Hips", np.zeros(3))
    pressure = 101325.0 * (1.0 - height / 44330.8) ** (1.0 / 0.190263)  # the standard atmosphere
    inside = (time >= 10.0) & (time <= 29.0)
    made, (words,) = use_barometer_heights(gps, Barometer(time[inside], pressure[inside]))
    assert "from 10 s to 29 s, before and after them the receiver's" in words
    assert not made.barometric  # not everywhere as exact as one
    np.testing.assert_allclose(np.diff(made.enu[inside, 2]), -3.0)
    # at the joints the receiver's heights are shifted by the mean of ten differences: 2 m of noise leave 0.6 m
    rest = made.enu[:, 2] - made.enu[10, 2] - (height - height[10])
    assert np.max(np.abs(rest[~inside] - noise[~inside])) < 3.0 * 0.63
    assert "feet" not in words
    feet = replace(gps, enu=places * [1.0, 1.0, 1.0 / 0.3048])
    _, (words,) = use_barometer_heights(feet, Barometer(time[inside], pressure[inside]))
    assert "look like feet, give the altitude in metres" in words
    few, (words,) = use_barometer_heights(gps, Barometer(time[:5], pressure[:5]))
    assert few is gps
    assert "hardly a fix" in words


def test_a_barometers_heights_are_used(in_a_pocket: Path, tmp_path: Path) -> None:
    toml = (in_a_pocket / "recording.toml").read_text(encoding="utf-8")
    barometer = '[barometer]\nfile = "sensors/barometer.csv"\n\n[gps]'
    _copy(in_a_pocket, tmp_path / "copy", toml.replace("[gps]", barometer))
    fixes = pd.read_csv(in_a_pocket / "gps.csv")
    height = fixes.altitude_m
    pressure = 101325.0 * (1.0 - height / 44330.8) ** (1.0 / 0.190263)
    table = pd.DataFrame({"time_s": fixes.time_s, "pressure_Pa": pressure})
    table.to_csv(tmp_path / "copy" / "sensors" / "barometer.csv", index=False)
    made = read_recording(tmp_path / "copy")
    assert any("heights are the barometer's" in notice for notice in made.notices)
    assert made.gps is not None
    # the tangent plane falls off from the geoid by 1 mm over 100 m
    np.testing.assert_allclose(made.gps.enu[:, 2], height - height[0], atol=0.02)
    table.assign(pressure_Pa=table.pressure_Pa / 100.0).to_csv(tmp_path / "hpa.csv", index=False)
    with pytest.raises(InputError, match="pascals, not hectopascals"):
        read_barometer(tmp_path / "hpa.csv")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop(columns="rate_z_radps"), "missing columns rate_z_radps"),
        (lambda t: t.assign(rate_x_radps=t.rate_x_radps * 180.0 / np.pi + 71.0), "not degrees a second"),
        (lambda t: t.assign(**{c: t[c] / 9.81 for c in t.columns if c.startswith("acc")}), "give m/s², not g"),
        (lambda t: t.assign(rate_y_radps=0.25), "a dead channel"),
        (lambda t: t.iloc[::50], "do not show turns"),
        (lambda t: t.assign(time_s=t.time_s.to_numpy()[::-1]), "runs back"),
    ],
)
def test_broken_channels_are_reported(in_a_pocket: Path, tmp_path: Path, change: object, message: str) -> None:
    table = pd.read_csv(in_a_pocket / "sensors" / "pocket.csv")
    change(table).to_csv(tmp_path / "broken.csv", index=False)  # type: ignore[operator]
    with pytest.raises(InputError, match=message):
        read_imu(tmp_path / "broken.csv", "pocket")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('on = "pocket"', 'on = "hat"', "is no place"),
        ("[gps]", '[[sensors]]\nfile = "sensors/pocket.csv"\non = "pocket"\n[gps]', "a sensor on 'pocket' already"),
        ("[[sensors]]", "[sensors]", "this must be tables"),
        ("[gps]", '[motion]\nfile = "x.bvh"\n[gps]', "there is a \\[motion\\] as well"),
        ("sensors/pocket.csv", "../pocket.csv", "leads out of the recording"),
    ],
)
def test_broken_tables_are_reported(in_a_pocket: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    toml = (in_a_pocket / "recording.toml").read_text(encoding="utf-8")
    _copy(in_a_pocket, tmp_path / "copy", toml.replace(old, new))
    with pytest.raises(InputError, match=message):
        read_recording(tmp_path / "copy")


def _copy(folder: Path, to: Path, toml: str) -> None:
    (to / "sensors").mkdir(parents=True)
    for name in ("gps.csv", "sensors/pocket.csv"):
        (to / name).write_bytes((folder / name).read_bytes())
    (to / "recording.toml").write_text(toml, encoding="utf-8")
