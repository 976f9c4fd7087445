"""Turns of a synthetic sensor on a skier: its yaw rate, its lean, and its noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sssi_exudyn.analysis.sensor_turns import turns_of_sensor
from sssi_exudyn.analysis.turns import Turns
from sssi_exudyn.core.frames import GRAVITY, Array

STEP = 0.1
TURN = 2.4
ANGLE = np.radians(60.0)
SPEED = 10.0
KICKS = 1.0
"""rad/s; the turns' own rate is 0.68 rad/s at most."""


def sensor(seed: int, kicks: float, mounting: Rotation, count: int = 16) -> tuple[Array, Array, Array]:
    """Return time, yaw rate and vertical of a sensor in linked turns, the first to the left.

    A thigh kicks about up with a standard deviation of ``kicks`` rad/s, and about the path with 3°, for 0.3 s each.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, TURN * count, STEP)
    rate = 0.5 * ANGLE * np.pi / TURN * np.sin(np.pi * time / TURN)
    noise = np.stack([np.convolve(rng.normal(size=len(time)), np.ones(3) / np.sqrt(3.0), "same") for _ in range(2)])
    lean = -np.arctan(SPEED * rate / GRAVITY) + np.radians(3.0) * noise[1]
    up = (mounting * Rotation.from_euler("x", lean[:, None])).inv().as_matrix()[:, :, 2]
    return time, rate + kicks * noise[0], up


def sides(turns: Turns) -> list[str]:
    return [turn.side for turn in turns.turns]


@pytest.mark.parametrize("seed", range(5))
def test_lean_tells_the_sides_where_a_thigh_kicks(seed: int) -> None:
    time, yaw, up = sensor(seed, KICKS, Rotation.random(random_state=seed))
    turns = turns_of_sensor(time, yaw, up, np.full(len(time), SPEED))
    assert sides(turns) == ["left", "right"] * 8
    starts = [turn.start for turn in turns.turns]
    assert np.allclose(starts, TURN * np.arange(16), atol=0.4)  # kicks of 0.3 s, and 0.1 s between samples


def test_the_yaw_rate_alone_counts_kicks() -> None:
    counts = []
    for seed in range(5):
        time, yaw, _ = sensor(seed, KICKS, Rotation.identity())
        counts.append(len(turns_of_sensor(time, yaw, np.zeros((len(time), 3)), np.full(len(time), SPEED)).turns))
    assert sum(count != 16 for count in counts) >= 3  # otherwise these kicks are too small to show what the lean is for


def test_how_the_sensor_sits_does_not_matter() -> None:
    runs = [sensor(3, 0.2, Rotation.random(random_state=seed)) for seed in range(3)]
    bounds = [
        [turn.start for turn in turns_of_sensor(time, yaw, up, np.full(len(time), SPEED)).turns]
        for time, yaw, up in runs
    ]
    assert np.allclose(bounds[0], bounds[1], atol=0.15)  # a ridge on each axis is not quite the same on turned ones
    assert np.allclose(bounds[0], bounds[2], atol=0.15)


def test_a_few_turns_are_those_of_the_yaw_rate() -> None:
    time, yaw, up = sensor(1, 0.0, Rotation.identity(), count=3)
    speed = np.full(len(time), SPEED)
    assert sides(turns_of_sensor(time, yaw, up, speed)) == ["left", "right", "left"]
    rng = np.random.default_rng(1)
    assert sides(turns_of_sensor(time, yaw, rng.normal(size=up.shape), speed)) == ["left", "right", "left"]


def test_the_radius_follows_the_sensors_course_where_the_path_is_straight() -> None:
    """A receiver that smooths the course leaves a straight path; the radius is its length over the sensor's turn."""
    time, yaw, up = sensor(1, 0.0, Rotation.identity(), count=6)
    turns = turns_of_sensor(time, yaw, up, np.full(len(time), SPEED))
    within = (time >= turns.turns[2].start) & (time <= turns.turns[2].end)
    path = np.column_stack([SPEED * time, np.zeros(len(time))])[within]
    # transitions are known to a sample of 0.1 s, of 2.4 s
    assert turns.radius(time[within], path) == pytest.approx(SPEED * TURN / ANGLE, rel=0.1)
