"""Noise of which single samples have more, against dense covariances and differences."""

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, Scale, uneven_covariance
from sssi_exudyn.core.noise import whiten as whiten_even
from sssi_exudyn.fitting.autocorrelated_noise import (
    draw_uneven_noise,
    log_divisors,
    noise_information,
    whiten,
    whiten_with_slope,
)

NOISE = ExponentialNoise(sigma=0.3, correlation_time=2.0)


def drawn(n: int = 60) -> tuple[Array, Scale, Array]:
    """Times (n,), scales (n,) with a spell and single samples that are noisier, within it too, columns (n, 4)."""
    rng = np.random.default_rng(1)
    lasting = np.full(n, 1.2)
    lasting[20:30] = 12.0
    total = np.where(rng.uniform(size=n) < 0.2, 20.0, lasting)
    assert np.any(total[20:30] > 12.0)
    return np.cumsum(rng.uniform(0.02, 0.3, n)), Scale(lasting, total), rng.normal(size=(n, 4))


def test_it_is_the_dense_covariance() -> None:
    time, scale, columns = drawn()
    dense = uneven_covariance(time, NOISE, scale)
    white = whiten(time, columns, NOISE, scale)
    # the filter and the dense inverse are the same number: rounding of a 60 x 60 solve only
    np.testing.assert_allclose(white.T @ white, columns.T @ np.linalg.solve(dense, columns), rtol=1e-9)
    assert log_divisors(time, NOISE, scale) == pytest.approx(0.5 * np.linalg.slogdet(dense)[1], rel=1e-12)
    np.testing.assert_allclose(np.diag(dense), (NOISE.sigma * scale.total) ** 2, rtol=1e-12)


def test_equal_scales_only_scale() -> None:
    time, _, columns = drawn()
    three = np.full(len(time), 3.0)
    scale = Scale(three, three)
    even = whiten_even(time, columns, ExponentialNoise(3.0 * NOISE.sigma, NOISE.correlation_time))
    np.testing.assert_array_equal(whiten(time, columns, NOISE, scale), even)
    # and the filter itself gives the same where almost nothing is uneven
    more = three.copy()
    more[-1] *= 1.0 + 1e-13
    for uneven in (Scale(more, more), Scale(three, more)):
        assert not uneven.even
        np.testing.assert_allclose(whiten(time, columns, NOISE, uneven), even, rtol=1e-9, atol=1e-9)


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
    one = np.ones(41)
    usual = np.sum(whiten(time, residual[:, None], NOISE, Scale(one, one)) ** 2)
    far = residual.copy()
    far[20] = 6.0
    total = one.copy()
    total[20] = 20.0
    # one more sample, off by its own standard deviation; scaled alone, its neighbours would be off by some three each
    for lasting in (one, total):
        white = whiten(time, far[:, None], NOISE, Scale(lasting, total))
        assert np.sum(white**2) == pytest.approx(usual, abs=1.2)


def test_a_fix_may_be_off_to_the_other_side_of_a_spell() -> None:
    time = 0.2 * np.arange(41)
    lasting = np.where(np.abs(time - 4.0) < 1.5, 10.0, 1.0)
    residual = np.where(lasting > 1.0, 3.0, 0.0)[:, None]  # of a spell that is off by its standard deviation
    residual[20] = -6.0
    total = lasting.copy()
    total[20] = 30.0  # 9 m
    alone = np.sum(whiten(time, residual, NOISE, Scale(lasting, total)) ** 2)
    together = np.sum(whiten(time, residual, NOISE, Scale(total, total)) ** 2)
    residual[20] = 3.0
    without = np.sum(whiten(time, residual, NOISE, Scale(lasting, lasting)) ** 2)
    assert alone == pytest.approx(without, abs=1.5)  # one more sample, off by its own standard deviation
    assert together > without + 10.0


def test_white_noise_is_only_scaled() -> None:
    _, scale, columns = drawn()
    white = whiten(np.arange(60.0), columns, ExponentialNoise(0.5, 0.0), scale)
    np.testing.assert_allclose(white, columns / (0.5 * scale.total[:, None]), rtol=1e-12)


def test_what_is_drawn_is_white_once_whitened() -> None:
    time, scale, _ = drawn(400)
    rng = np.random.default_rng(3)
    columns = np.stack([draw_uneven_noise(rng, time, NOISE, scale) for _ in range(20)], axis=1)
    # mean square of 8000 independent numbers: 1 to within √(2/8000) = 0.016, four times that
    assert np.mean(whiten(time, columns, NOISE, scale) ** 2) == pytest.approx(1.0, abs=0.064)


def test_noise_is_known_as_its_dense_covariance_has_it() -> None:
    time, _, _ = drawn()
    even, step = np.ones(len(time)), 1e-5

    def covariance(log_sigma: float, log_time: float) -> Array:
        noise = ExponentialNoise(0.3 * np.exp(log_sigma), 2.0 * np.exp(log_time))
        return uneven_covariance(time, noise, Scale(even, even))

    changes = [
        np.linalg.solve(covariance(0.0, 0.0), covariance(*at) - covariance(*-at)) / (2.0 * step)
        for at in step * np.eye(2)
    ]
    # Fisher's information of a normal density, its covariance differentiated by central differences
    expected = [[0.5 * np.trace(first @ second) for second in changes] for first in changes]
    np.testing.assert_allclose(noise_information(time, NOISE), expected, rtol=1e-6)
