"""Noise of which single samples have more, against dense covariances and differences."""

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, uneven_covariance
from sssi_exudyn.core.noise import whiten as whiten_even
from sssi_exudyn.fitting.uneven_noise import (
    draw_uneven_noise,
    log_divisors,
    whiten,
    whiten_with_slope,
)

NOISE = ExponentialNoise(sigma=0.3, correlation_time=2.0)


def drawn(n: int = 60) -> tuple[Array, Array, Array]:
    """Times (n,), scales (n,) with a spell and single samples that are noisier, columns (n, 4)."""
    rng = np.random.default_rng(1)
    scale = np.where(rng.uniform(size=n) < 0.1, 20.0, 1.2)
    scale[20:30] = 12.0
    return np.cumsum(rng.uniform(0.02, 0.3, n)), scale, rng.normal(size=(n, 4))


def test_it_is_the_dense_covariance() -> None:
    time, scale, columns = drawn()
    dense = uneven_covariance(time, NOISE, scale)
    white = whiten(time, columns, NOISE, scale)
    # the filter and the dense inverse are the same number: rounding of a 60 x 60 solve only
    np.testing.assert_allclose(white.T @ white, columns.T @ np.linalg.solve(dense, columns), rtol=1e-9)
    assert log_divisors(time, NOISE, scale) == pytest.approx(0.5 * np.linalg.slogdet(dense)[1], rel=1e-12)
    np.testing.assert_allclose(np.diag(dense), (NOISE.sigma * scale) ** 2, rtol=1e-12)


def test_equal_scales_only_scale() -> None:
    time, _, columns = drawn()
    scale = np.full(len(time), 3.0)
    even = whiten_even(time, columns, ExponentialNoise(3.0 * NOISE.sigma, NOISE.correlation_time))
    np.testing.assert_array_equal(whiten(time, columns, NOISE, scale), even)
    # and the filter itself gives the same where almost nothing is uneven
    scale[-1] *= 1.0 + 1e-13
    np.testing.assert_allclose(whiten(time, columns, NOISE, scale), even, rtol=1e-9, atol=1e-9)


def test_slopes_are_those_of_differences() -> None:
    time, scale, columns = drawn()
    white, slope, by_volume = whiten_with_slope(time, columns, NOISE, scale)
    np.testing.assert_array_equal(white, whiten(time, columns, NOISE, scale))
    step = 1e-5
    above, below = (ExponentialNoise(0.3, 2.0 * np.exp(sign * step)) for sign in (1.0, -1.0))
    difference = (whiten(time, columns, above, scale) - whiten(time, columns, below, scale)) / (2.0 * step)
    # central differences of numbers of order 10: step² of truncation, rounding over the step
    np.testing.assert_allclose(slope, difference, atol=1e-7)
    volumes = [log_divisors(time, noise, scale) for noise in (above, below)]
    assert by_volume == pytest.approx((volumes[0] - volumes[1]) / (2.0 * step), abs=1e-7)


def test_a_sample_that_is_far_off_carries_no_information_on_its_neighbours() -> None:
    time = 0.1 * np.arange(41)
    residual = np.full(41, 0.3)  # a slow error of one standard deviation
    usual = np.sum(whiten(time, residual[:, None], NOISE, np.ones(41)) ** 2)
    far = residual.copy()
    far[20] = 6.0
    scale = np.ones(41)
    scale[20] = 20.0
    # one more sample, off by its own standard deviation; scaled alone, its neighbours would be off by some three each
    assert np.sum(whiten(time, far[:, None], NOISE, scale) ** 2) == pytest.approx(usual, abs=1.2)


def test_white_noise_is_only_scaled() -> None:
    _, scale, columns = drawn()
    white = whiten(np.arange(60.0), columns, ExponentialNoise(0.5, 0.0), scale)
    np.testing.assert_allclose(white, columns / (0.5 * scale[:, None]), rtol=1e-12)


def test_what_is_drawn_is_white_once_whitened() -> None:
    time, scale, _ = drawn(400)
    rng = np.random.default_rng(3)
    columns = np.stack([draw_uneven_noise(rng, time, NOISE, scale) for _ in range(20)], axis=1)
    # mean square of 8000 independent numbers: 1 to within √(2/8000) = 0.016, four times that
    assert np.mean(whiten(time, columns, NOISE, scale) ** 2) == pytest.approx(1.0, abs=0.064)
