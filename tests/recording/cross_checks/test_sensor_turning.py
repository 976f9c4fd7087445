"""Single sensors against the course: accelerations that point down, rates in degrees, and neither."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.recording.cross_checks.check import Evidence, hold_against_each_other
from sssi_exudyn.recording.cross_checks.sensor_turning import SensorTurning
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.imu import Imu
from sssi_exudyn.recording.recording import Equipment, Skier

LAG = 1.2


def turning(time: Array) -> tuple[Array, Array]:
    """Return yaw (rad, left positive) and its rate (rad/s) of a skier in turns of several lengths."""
    yaw = 0.7 * np.sin(1.3 * time) + 0.3 * np.sin(0.47 * time + 1.0)
    return yaw, 0.7 * 1.3 * np.cos(1.3 * time) + 0.3 * 0.47 * np.cos(0.47 * time + 1.0)


def sensor(place: str, seed: int) -> Imu:
    """Return a sensor that was mounted somehow on a body that turns about up and sways a little."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 60.0, 0.04)
    yaw, rate = turning(time)
    mounting = Rotation.random(random_state=seed)
    sway = 0.1 * np.sin(2.1 * time + seed)
    body = Rotation.from_euler("ZX", np.column_stack([yaw, sway]))
    spin = body.inv().apply(np.column_stack([0.0 * rate, 0.0 * rate, rate]))
    spin[:, 0] += 0.21 * np.cos(2.1 * time + seed)
    up = body.inv().apply(np.tile([0.0, 0.0, GRAVITY], (len(time), 1)))
    noise = rng.normal(0.0, 1.0, (2, len(time), 3))
    return Imu(
        f"{place}.csv", place, time, mounting.apply(spin) + 0.01 * noise[0], mounting.apply(up) + 0.3 * noise[1], None
    )


def fixes() -> Gps:
    """Return fixes, one a second, whose course turns like the body a lag earlier."""
    time = np.arange(2.0, 59.0)
    course = -turning(time - LAG)[0]
    speed = np.full(len(time), 8.0)
    enu = np.cumsum(np.column_stack([8.0 * np.sin(course), 8.0 * np.cos(course), np.full(len(time), -1.5)]), axis=0)
    return Gps(time, enu, np.full(len(time), 3.0), (46.0, 8.0, 2000.0), "Hips", np.zeros(3), speed, course)


def judged(*imus: Imu) -> tuple[tuple[Imu, ...], tuple[str, ...]]:
    evidence = Evidence(Path("recording.toml"), Skier(), Equipment(), imus=imus, gps=fixes())
    evidence, notices = hold_against_each_other(evidence, [SensorTurning()])
    return evidence.imus, notices


def down(imu: Imu) -> Imu:
    assert imu.force is not None
    return replace(imu, force=-imu.force)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_sensors_that_are_right_stay_as_they_are(seed: int) -> None:
    imus = sensor("pocket", seed), sensor("left_ski", seed + 10)
    assert judged(*imus) == (imus, ())


@pytest.mark.parametrize(("place", "seed"), [("pocket", 1), ("chest", 5), ("left_boot", 9)])
def test_an_acceleration_that_points_down_is_turned_with_a_note(place: str, seed: int) -> None:
    right = sensor(place, seed)
    (imu,), notices = judged(down(right))
    np.testing.assert_array_equal(imu.force, right.force)
    assert len(notices) == 1
    assert "its sign was turned" in notices[0]


def test_of_two_skis_only_the_wrong_one_is_turned() -> None:
    left, right = sensor("left_ski", 3), sensor("right_ski", 4)
    imus, notices = judged(left, down(right))
    np.testing.assert_array_equal(imus[0].force, left.force)
    np.testing.assert_array_equal(imus[1].force, right.force)
    assert ["right_ski" in notice for notice in notices] == [True]


@pytest.mark.parametrize("seed", [2, 6, 8])
def test_rates_in_degrees_are_converted_with_a_note(seed: int) -> None:
    right = sensor("pocket", seed)
    (imu,), notices = judged(replace(right, rate=np.degrees(right.rate)))
    np.testing.assert_allclose(imu.rate, right.rate)
    assert [notice for notice in notices if "taken as degrees a second" in notice]


def test_a_sensor_may_have_both_faults() -> None:
    right = sensor("pocket", 7)
    (imu,), notices = judged(replace(down(right), rate=np.degrees(right.rate)))
    np.testing.assert_allclose(imu.rate, right.rate)
    np.testing.assert_array_equal(imu.force, right.force)
    assert len(notices) == 2
