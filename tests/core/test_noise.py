"""Statistics of autocorrelated noise, tested on noise that was drawn with known parameters."""

import itertools

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import (
    ExponentialNoise,
    autocorrelation_time,
    chi_square_per_dof,
    covariance_in_cells,
    effective_samples,
    fit_noise,
    parts_in_cells,
    tail_weight,
    whiten,
)

NOISE = ExponentialNoise(sigma=0.3, correlation_time=2.0)

HELD = 0.4
"""s for which a process stays the same."""


def covariance(time: Array, noise: ExponentialNoise) -> Array:
    return noise.sigma**2 * np.exp(-np.abs(time[:, None] - time) / noise.correlation_time)


def uneven_times(n: int, rng: np.random.Generator) -> Array:
    return np.cumsum(rng.uniform(0.02, 0.3, n))


def test_whitened_squares_are_the_full_covariances_quadratic_form() -> None:
    # The Markov recursion and the dense inverse are the same number: rounding of a 60 x 60 solve only.
    rng = np.random.default_rng(1)
    time = uneven_times(60, rng)
    residual = rng.normal(size=60)
    dense = residual @ np.linalg.solve(covariance(time, NOISE), residual)
    assert np.sum(whiten(time, residual, NOISE) ** 2) == pytest.approx(dense, rel=1e-9)


@pytest.mark.parametrize("lengths", [(0.4, 0.4, 0.4), (1.2, 1.2), (0.4, 2.0, 0.8, 10.0)])
def test_cells_have_the_means_of_a_process_in_steps(lengths: tuple[float, ...]) -> None:
    edges = np.concatenate([[0.0], np.cumsum(lengths)])
    steps = np.arange(0.5 * HELD, edges[-1], HELD)
    means = np.array([(steps > begin) & (steps < end) for begin, end in itertools.pairwise(edges)], dtype=float)
    means /= means.sum(axis=1, keepdims=True)
    expected = means @ covariance(steps, NOISE) @ means.T
    np.testing.assert_allclose(covariance_in_cells(edges, NOISE, HELD), expected, rtol=1e-9)
    parts = parts_in_cells(edges, NOISE, HELD)
    np.testing.assert_allclose(parts @ parts.T, expected, rtol=1e-9)


def test_long_cells_of_a_short_memory_stay_finite() -> None:
    edges = np.linspace(0.0, 1200.0, 49)
    variances = np.diag(covariance_in_cells(edges, ExponentialNoise(1.0, 0.3), HELD))
    # 62 steps of 0.4 s, next ones correlated by ρ = exp(−4/3): (1 + ρ) / (1 − ρ) / 62, less what is lost at the ends
    ratio = np.exp(-HELD / 0.3)
    assert variances == pytest.approx((1.0 + ratio) / (1.0 - ratio) / 62.0, rel=0.02)


def test_white_noise_is_only_scaled() -> None:
    residual = np.array([[0.1, 0.2], [0.3, -0.4], [0.5, 0.0]])
    whitened = whiten(np.arange(3.0), residual, ExponentialNoise(0.5, 0.0))
    np.testing.assert_allclose(whitened, residual / 0.5)


def test_fit_recovers_the_noise_it_was_made_of() -> None:
    rng = np.random.default_rng(2)
    time = uneven_times(1500, rng)
    residual = np.linalg.cholesky(covariance(time, NOISE)) @ rng.normal(size=(1500, 3))
    fitted = fit_noise(time, residual)
    # 240 s and three columns hold 360 correlation times, so T is known to √(2/360) = 7 % and σ to 4 %: four times that.
    assert fitted.correlation_time == pytest.approx(2.0, rel=0.30)
    assert fitted.sigma == pytest.approx(0.3, rel=0.16)


def test_chi_square_of_the_right_noise_is_one() -> None:
    rng = np.random.default_rng(3)
    time = uneven_times(1500, rng)
    residual = np.linalg.cholesky(covariance(time, NOISE)) @ rng.normal(size=1500)
    # χ²/dof of 1500 values scatters by √(2/1500) = 0.037: four times that.
    assert chi_square_per_dof(time, residual, NOISE) == pytest.approx(1.0, abs=0.15)


def test_fitted_parameters_take_degrees_of_freedom() -> None:
    time, residual = np.arange(4.0), np.ones(4)
    white = ExponentialNoise(1.0, 0.0)
    assert chi_square_per_dof(time, residual, white, parameters=2) == pytest.approx(2.0)
    with pytest.raises(ValueError, match="degree of freedom"):
        chi_square_per_dof(time, residual, white, parameters=4)


def test_autocorrelation_time_of_ar1() -> None:
    rng = np.random.default_rng(4)
    phi, n = 0.9, 40_000
    residual = np.zeros(n)
    for k, kick in enumerate(rng.normal(size=n - 1)):
        residual[k + 1] = phi * residual[k] + kick
    expected = (1.0 + phi) / (1.0 - phi)
    # Sokal: relative standard error √(2(2M + 1)/n) with M = 5·19 lags, 10 %; here three times that.
    assert autocorrelation_time(residual) == pytest.approx(expected, rel=0.3)
    assert effective_samples(residual) == pytest.approx(n / autocorrelation_time(residual))


def test_extremes_of_the_autocorrelation_time() -> None:
    white = np.random.default_rng(5).normal(size=20_000)
    # Five lags of noise, each 1/√n = 0.7 %, twice: a standard error of 3 %; four times that.
    assert autocorrelation_time(white) == pytest.approx(1.0, abs=0.12)
    assert autocorrelation_time(np.full(50, 0.7)) == 50.0


@pytest.mark.parametrize("dimensions", [1, 2])
def test_tails_count_less_and_ordinary_noise_as_it_is(dimensions: int) -> None:
    square = np.sum(np.random.default_rng(5).standard_normal((200_000, dimensions)) ** 2, axis=1)
    weight = tail_weight(square, dimensions)
    # a hundredth of ordinary samples lies beyond what counts fully
    assert np.mean(weight < 1.0) == pytest.approx(0.0124, abs=0.001)
    # so levels of noise and standard errors of Gaussian measurements stay what they are: 1.2 % of the level
    assert np.mean(weight * square) / dimensions == pytest.approx(1.0, abs=0.03)
    far = np.array([0.0, 100.0, 400.0])
    assert tail_weight(far, dimensions)[0] == 1.0
    assert tail_weight(far, dimensions)[1] == pytest.approx(4.0 * tail_weight(far, dimensions)[2])
