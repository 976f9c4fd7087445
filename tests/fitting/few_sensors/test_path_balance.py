"""Friction from the balance of energy along a path: on skiers whose friction is known."""

from __future__ import annotations

import numpy as np
import pytest

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise, draw_noise
from sssi_exudyn.fitting.few_sensors.path_balance import PathData, estimate_path, predict_second_half

DRAG = 0.0033
LOAD = float(np.cos(0.2))
WANDER = ExponentialNoise(4.0, 60.0)


def skied(seconds: float, seed: int, *, braking: float = 0.04, holding: float = 0.25) -> tuple[Array, ...]:
    """Return time, speed over ground, height and the effective friction (1,) of a skier who holds the speed."""
    rng = np.random.default_rng(seed)
    step = 0.02
    time = np.arange(0.0, seconds, step)
    waves = 0.04 * np.sin(2.0 * np.pi * np.arange(0.0, 40.0 * seconds) / 90.0 + rng.uniform(0.0, 6.0))
    brakes = braking * np.sin(2.0 * np.pi * time / 3.1)
    speed, height = np.zeros(len(time)), np.zeros(len(time))
    speed[0], distance, lost, path = 7.0, 0.0, 0.0, 0.0
    for i in range(len(time) - 1):
        slope = 0.2 + waves[int(distance)]
        longer, v = np.hypot(1.0, slope), speed[i]
        friction = 0.13 + 1.1 * (slope - 0.2) + holding / GRAVITY * (v - 7.0) + brakes[i]
        pull = GRAVITY * (slope / longer - LOAD * friction) - DRAG * (longer * v) ** 2
        speed[i + 1] = v + step * pull / longer
        height[i + 1] = height[i] - slope * v * step
        distance += v * step
        lost += friction * longer * v * step
        path += longer * v * step
    return time, speed, height, np.array([lost / path])


def measured(seconds: float, seed: int, *, noise: bool = True) -> tuple[PathData, float]:
    """Return what a telephone shows of such a skier, and the effective friction."""
    time, speed, height, effective = skied(seconds, seed)
    at = np.arange(0.5, seconds - 0.5)
    rng = np.random.default_rng(1000 + seed)
    v, z = np.interp(at, time, speed), np.interp(at, time, height)
    if noise:
        v = v + rng.normal(0.0, 0.3, len(at))
        z = z + rng.normal(0.0, 0.5, len(at)) + draw_noise(rng, at, WANDER)
    return PathData(at, v, 0.3, at, z, 0.5, WANDER, LOAD, DRAG), float(effective[0])


def test_friction_of_a_run_without_noise() -> None:
    data, effective = measured(100.0, 0, noise=False)
    path = estimate_path(data)
    assert path.converged
    # half a second between nodes, fixes a second apart: what brakes do between fixes averages out within 2 %
    assert path.effective == pytest.approx(effective, rel=0.02)


@pytest.mark.long
def test_intervals_hold_the_friction_as_often_as_they_say() -> None:
    errors = []
    for seed in range(24):
        data, effective = measured(100.0, seed)
        path = estimate_path(data)
        errors.append((path.effective - effective) / path.effective_sigma)
    # of 24 intervals of 90 % fewer than 18 hold the truth with a probability of 1 %; the errors' deviation is 1 ± 0.15
    assert np.count_nonzero(np.abs(errors) < 1.645) >= 18
    assert 0.55 < np.std(errors) < 1.45


def test_cost_is_linear_in_the_length_of_the_run() -> None:
    short, long = (estimate_path(measured(seconds, 3)[0]) for seconds in (100.0, 400.0))
    nodes = len(long.time) / len(short.time)
    assert nodes == pytest.approx(4.0, rel=0.02)  # the first and the last half second have no fixes
    # the unknowns of the run itself, five, and their corner of the curvature do not grow
    assert long.unknowns - 5 == pytest.approx(nodes * (short.unknowns - 5), rel=1e-9)
    assert long.stored - 25 == pytest.approx(nodes * (short.stored - 25), rel=1e-9)
    assert long.iterations <= 2 * short.iterations


def test_sources_of_the_error_add_up() -> None:
    path = estimate_path(measured(60.0, 5)[0])
    assert path.effective_sigma**2 == pytest.approx(path.track**2 + path.heights**2 + path.air**2, rel=1e-9)
    # a wander of 4 m from end to end of some 80 m of drop is most of it
    assert path.heights > path.track
    assert path.heights > path.air


def test_better_heights_make_the_interval_narrow() -> None:
    data, effective = measured(60.0, 7, noise=False)
    by_barometer = PathData(
        data.time, data.speed, 0.3, data.height_time, data.height, 0.12, ExponentialNoise(0.5, 60.0), LOAD, DRAG
    )
    path = estimate_path(by_barometer)
    assert path.heights < 0.5 * estimate_path(data).heights
    assert abs(path.effective - effective) < 3.0 * path.effective_sigma


def test_a_skier_who_holds_the_speed_is_predicted_better_than_by_the_mean() -> None:
    better = []
    for seed in range(8):
        data, _ = measured(100.0, seed)
        half = predict_second_half(data, estimate_path(data))
        better.append(half.speed_rms < 1.1 * half.usual_rms)
        np.testing.assert_array_equal(half.measured, data.speed)
    # who holds the speed well is hardly predicted better than by the mean, and should not be predicted much worse
    assert np.mean(better) > 0.7


def test_a_run_that_gathers_speed_is_predicted_from_its_first_half() -> None:
    time, speed = np.arange(0.0, 40.0), np.zeros(40)
    speed = 12.0 - 9.0 * np.exp(-time / 12.0)
    slope = 0.2 * np.ones(40)
    height = -np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * slope[1:])])
    data = PathData(time, speed, 0.3, time, height, 0.5, WANDER, LOAD, DRAG)
    half = predict_second_half(data, estimate_path(data))
    assert half.speed_rms < 0.5 * half.usual_rms


def test_too_few_fixes_are_refused() -> None:
    data, _ = measured(20.0, 1)
    with pytest.raises(ValueError, match="four fixes"):
        estimate_path(data.until(3.0))
