"""The evidence against what it is by definition: a normal density with everything integrated out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_linear_model import LEVELS, covariance, instruments, linear_model

from sssi_exudyn.fitting.evidence import (
    Freedom,
    LinearModel,
    best_levels,
    evidence_and_slopes,
    evidence_over_noise,
    fewer_columns,
    log_evidence,
    log_factors,
    overlaps,
    uncertain,
    whitener,
)
from sssi_exudyn.fitting.noise import level_priors, log_prior, usual_levels


def test_evidence_is_the_density_with_everything_integrated_out() -> None:
    one, other = linear_model(2), linear_model(3)
    extra = Freedom(np.roll(one.free.columns[:, :1], 1), np.array([0.3]))

    def density(given: LinearModel, extra: Freedom | None) -> float:
        free = given.free.columns * given.free.scales
        whole = covariance(given) + free @ free.T
        if extra is not None:
            more = extra.columns * extra.scales
            whole = whole + more @ more.T
        _, volume = np.linalg.slogdet(whole)
        return float(-0.5 * volume - 0.5 * given.residual @ np.linalg.solve(whole, given.residual))

    # the same constant is left out everywhere, so differences are compared; 1e-6: rounding of covariances whose
    # numbers span eleven decades
    for first, second in (((one, None), (one, extra)), ((one, extra), (other, None))):
        given = log_evidence(first[0], LEVELS, first[1]) - log_evidence(second[0], LEVELS, second[1])
        assert given == pytest.approx(density(*first) - density(*second), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("widths", [(1, 1, 1), (2, 2), (3, 3), (1, 2, 3, 1)])
def test_factors_of_candidates_are_differences_of_evidence(widths: tuple[int, ...]) -> None:
    given = linear_model()
    rng = np.random.default_rng(5)
    candidates = [Freedom(rng.normal(size=(len(given.residual), width)), np.full(width, 0.2)) for width in widths]
    sizes = (0.5, 1.0, 3.0)
    factors = log_factors(*overlaps(given, LEVELS, uncertain(given, LEVELS), candidates), sizes)[..., 0]
    nothing = log_evidence(given, LEVELS)
    expected = [
        [log_evidence(given, LEVELS, Freedom(c.columns, size * c.scales)) - nothing for c in candidates]
        for size in sizes
    ]
    np.testing.assert_allclose(factors, expected, atol=1e-8)  # rounding


def test_fewer_columns_have_the_covariance_of_all() -> None:
    given = linear_model()
    rng = np.random.default_rng(8)
    scale = given.residual.std()
    columns = scale * rng.normal(size=(len(given.residual), 5)) @ rng.normal(size=(5, 40))
    faint = np.hstack([columns, 1e-7 * columns[:, :9]])
    fewer = fewer_columns(given.measurements, faint)
    assert fewer.shape[1] == 5
    # what is left out is at most 0.02 of the noise: 4e-4 of its variance
    noise = np.diag(covariance(given))
    bound = 4e-4 * np.sqrt(np.outer(noise, noise))
    assert np.all(np.abs(fewer @ fewer.T - faint @ faint.T) < 10.0 * bound)  # usual noise for that of these levels


@pytest.mark.parametrize("extra", [None, Freedom(np.ones((50, 1)), np.array([0.2]))], ids=["alone", "with more"])
def test_slopes_of_the_evidence_are_those_of_differences(extra: Freedom | None) -> None:
    given = linear_model()
    _, slopes = evidence_and_slopes(given, LEVELS, extra)
    numbers, step = LEVELS.numbers, 1e-4

    def value(name: str, change: float) -> float:
        return log_evidence(given, LEVELS.with_numbers({name: numbers[name] * np.exp(change)}), extra)

    expected = {name: (value(name, step) - value(name, -step)) / (2.0 * step) for name in numbers}
    assert slopes.keys() == expected.keys()
    # a step of 1e-4 leaves 1e-8 of slopes that are some tens, and rounding 1e-12 / 1e-4 of an evidence of thousands
    np.testing.assert_allclose([slopes[name] for name in expected], list(expected.values()), rtol=1e-6, atol=1e-5)


def test_whitener_makes_the_noise_white() -> None:
    given = linear_model()
    white = whitener(given, LEVELS)
    np.testing.assert_allclose(
        white(white(covariance(given)).T), np.eye(len(given.residual)), atol=1e-6
    )  # rounding, and the last 10⁻¹² of the diagonal that keeps it definite


def test_noise_levels_are_found() -> None:
    measurements = replace(instruments(fixes=400, windows=400), counts=np.ones(400))
    rng = np.random.default_rng(7)
    residual = np.zeros(len(measurements.measured))
    for name, place in measurements.blocks.items():
        time, noise = measurements.time_of(name), LEVELS.of(name)
        cov = noise.sigma**2 * np.exp(-np.abs(time[:, None] - time) / noise.correlation_time)
        residual[place] = np.linalg.cholesky(cov) @ rng.normal(size=len(time))
    size = len(residual)
    none = np.zeros((size, 0))
    given = LinearModel(measurements, residual, Freedom(none, np.zeros(0)))
    levels, _ = best_levels(given, measurements.usual)
    # 40 s of noise that remembers for 2 s are some 20 independent samples an axis: its σ is known to 20 %
    assert levels.gps.sigma == pytest.approx(LEVELS.gps.sigma, rel=0.4)
    assert levels.load.sigma == pytest.approx(LEVELS.load.sigma, rel=0.15)


def test_levels_of_which_all_is_given_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    given = linear_model()
    priors = level_priors(given.measurements.usual)
    held = {name: replace(prior, spread=0.0) for name, prior in priors.items()}
    monkeypatch.setattr("sssi_exudyn.fitting.evidence.level_priors", lambda usual: held)
    levels, evidence = best_levels(given, LEVELS)
    assert levels == LEVELS
    assert evidence == pytest.approx(log_evidence(given, LEVELS) + log_prior(given.measurements.usual, LEVELS))


@pytest.mark.long(seconds=3)
def test_evidence_over_the_noise_of_fixes_is_that_of_a_fine_grid() -> None:
    given = linear_model()
    levels, _ = best_levels(given, given.measurements.usual)
    usual = given.measurements.usual
    priors = [level_priors(usual)[f"gps.{name}"] for name in ("sigma", "correlation_time")]
    steps = [np.linspace(-5.0, 5.0, 36) * prior.spread for prior in priors]
    logs = [
        log_evidence(given, other) + log_prior(usual, other)
        for sigma in np.exp(steps[0])
        for memory in np.exp(steps[1])
        for other in [
            levels.with_numbers(
                {
                    "gps.sigma": sigma * levels.gps.sigma,
                    "gps.correlation_time": memory * levels.gps.correlation_time,
                }
            )
        ]
    ]
    cell = np.prod([step[1] - step[0] for step in steps]) / (2.0 * np.pi * np.prod([p.spread for p in priors]))
    expected = np.logaddexp.reduce(logs) + np.log(cell)
    # 15 nodes of an integrand that is normal but for its skewness, which moves it by some hundredths
    assert evidence_over_noise(given, levels) == pytest.approx(expected, abs=0.05)


def test_a_telephone_s_noise_is_slow_and_below_what_it_states() -> None:
    receiver, telephone = (usual_levels(fix, 1.5 * fix, 700.0, 20.0) for fix in (0.02, 3.0))
    assert receiver.null_force is None
    assert telephone.null_force is not None
    assert telephone.gps.sigma < 0.5 * 3.0
    assert telephone.gps.correlation_time > 5.0 * receiver.gps.correlation_time
    assert telephone.load == receiver.load
    priors = level_priors(telephone)
    # a telephone that is as far off as it states, for some seconds, is within what is known beforehand
    assert priors["gps.sigma"].low < 3.0 < priors["gps.sigma"].high
    assert priors["gps.correlation_time"].low < 3.0
