"""Friction over all explanations: mixtures of normal distributions, and which fits they are made of."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_linear_model import LEVELS, linear_model
from explanations import explained, round_of
from scipy.stats import norm

from sssi_exudyn.core.mixture import Mixture
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom, whiten_columns
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.validation.diagnosis.search.averaged_friction import averaged_friction
from sssi_exudyn.validation.diagnosis.search.explanation import Explanation, OtherForm, Round
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

INTERVAL_90 = THRESHOLDS.interval_90
HALF = float(norm.ppf(0.95))


class Fit:
    """Friction with standard deviations, as a refit or a posterior has it."""

    def __init__(self, mu_t: float, mu_n: float, sigma: float) -> None:
        self.values, self.sigma = {"friction.mu_t": mu_t, "friction.mu_n": mu_n}, sigma
        self.model = self

    def interval(self, name: str, spread: float) -> tuple[float, float, float]:
        value = self.values[name]
        return value, value - spread * self.sigma, value + spread * self.sigma

    def value(self, name: str) -> float:
        return self.values[name]

    def bounds(self, name: str) -> tuple[float, float]:
        assert name in self.values
        return 0.0, 2.0


def explanation(name: str, probability: float, fit: Any) -> Any:
    candidate: Any = SimpleNamespace(
        amplitudes=tuple((NumberRef.of(name, f"delta_{key}"),) for key in ("mu_t", "mu_n"))
    )
    return explained(name, probability=probability, fit=fit, candidate=candidate)


def of_round(*explanations: Explanation) -> Round:
    """Of a run down the fall line at 10 m/s for 6 s."""
    fitted: Any = SimpleNamespace(
        time_edges=np.linspace(0.0, 6.0, 16), time_at=lambda f: f / 10.0, thresholds=THRESHOLDS
    )
    return round_of(*explanations, fitted=fitted)


def test_one_explanation_is_a_normal_distribution() -> None:
    alone = Mixture(np.ones(1), np.array([0.06]), np.array([0.003]))
    assert alone.mean == 0.06
    assert alone.quantile(0.95) == pytest.approx(0.06 + HALF * 0.003, abs=1e-9)


def test_quantiles_of_a_mixture_hold_its_share() -> None:
    mixture = Mixture(np.array([0.7, 0.3]), np.array([0.06, 0.09]), np.array([0.002, 0.004]))
    draws = np.random.default_rng(1)
    which = draws.uniform(size=400_000) < 0.7
    values = np.where(which, draws.normal(0.06, 0.002, which.size), draws.normal(0.09, 0.004, which.size))
    for share in (0.05, 0.5, 0.95):
        # a share of so many draws is known to 0.0008
        assert np.mean(values < mixture.quantile(share)) == pytest.approx(share, abs=4e-3)


def test_where_nothing_else_is_probable_friction_is_the_final_model_s() -> None:
    final: Any = Fit(0.06, 0.55, 0.002)
    last = of_round(explanation("nothing", 1.0, Fit(0.07, 0.6, 0.002)), explanation("gust", 0.0, Fit(0.2, 0.9, 0.002)))
    friction = averaged_friction(last, [], final)
    assert friction["mu_t"].value == pytest.approx(0.06)
    assert friction["mu_t"].high == pytest.approx(0.06 + INTERVAL_90 * 0.002, rel=1e-5)  # 1.6449 for the quantile
    assert friction["mu_n"].low == pytest.approx(0.55 - INTERVAL_90 * 0.002, rel=1e-5)  # 1.6449 for the quantile


def test_a_rival_s_friction_is_in_the_interval() -> None:
    """A patch is 70 % probable, a gust, with which μ_t would be 0.03 more, 30 %."""
    patch, gust = Fit(0.061, 0.55, 0.002), Fit(0.091, 0.55, 0.004)
    chosen = explanation("snow_patch", 0.7, patch)
    first = of_round(chosen, explanation("gust", 0.3, gust), explanation("wind", 0.0, None))
    last = of_round(explanation("nothing", 1.0, Fit(0.06, 0.55, 0.002)))
    final: Any = Fit(0.06, 0.55, 0.002)
    final.values |= {"snow_patch.f0": 20.0, "snow_patch.f1": 40.0}
    friction = averaged_friction(last, [(first, chosen)], final)
    assert friction["mu_t"].value == pytest.approx(0.7 * 0.06 + 0.3 * 0.09)
    assert friction["mu_t"].low < 0.06
    assert friction["mu_t"].high > 0.09
    spread = INTERVAL_90 / HALF
    expected = Mixture(np.array([0.3, 0.7]), np.array([0.09, 0.06]), spread * np.array([0.004, 0.002]))
    assert friction["mu_t"].high == pytest.approx(expected.quantile(0.95), rel=1e-4)  # 1.6449 for the quantile
    assert friction["mu_n"].value == pytest.approx(0.55)


@pytest.mark.parametrize(("begin", "end"), [(1.0, 30.0), (30.0, 59.0)])
def test_faster_snow_at_one_end_of_a_run_may_be_slower_snow_on_the_rest(begin: float, end: float) -> None:
    chosen = explanation("snow_patch", 1.0, Fit(0.13, 0.55, 0.002))
    last = of_round(explanation("nothing", 1.0, Fit(0.13, 0.55, 0.002)))
    final: Any = Fit(0.13, 0.55, 0.002)
    patch = {"delta_mu_t": -0.09, "delta_mu_n": 0.01, "f0": begin, "f1": end}
    final.values |= {f"snow_patch.{key}": value for key, value in patch.items()}
    friction = averaged_friction(last, [(of_round(chosen), chosen)], final)
    assert friction["mu_t"].low < 0.04 < 0.13 < friction["mu_t"].high
    assert friction["mu_n"].low < 0.55 < 0.56 < friction["mu_n"].high
    assert friction["mu_t"].value == pytest.approx(0.085)


def test_either_ski_may_be_the_usual_one() -> None:
    law: Any = SimpleNamespace(amplitudes=((NumberRef("unexplained_friction.delta_mu"),),))
    chosen = replace(explanation("unexplained_friction", 1.0, Fit(0.10, 0.55, 0.002)), candidate=law)
    final: Any = Fit(0.10, 0.55, 0.002)
    final.values["unexplained_friction.delta_mu"] = 0.06
    last = of_round(explanation("nothing", 1.0, Fit(0.10, 0.55, 0.002)))
    friction = averaged_friction(last, [(of_round(chosen), chosen)], final)
    assert friction["mu_t"].low < 0.07 < 0.13 < friction["mu_t"].high
    assert friction["mu_t"].value == pytest.approx(0.10)


def test_friction_is_not_below_zero() -> None:
    final: Any = Fit(0.001, 0.55, 0.01)
    friction = averaged_friction(of_round(explanation("nothing", 1.0, final)), [], final)
    assert friction["mu_t"].low == 0.0


def test_friction_is_within_its_bounds_and_its_interval() -> None:
    """A rival by which friction would be far below zero draws the mean there, too."""
    final: Any = Fit(0.001, 0.55, 0.002)
    chosen = explanation("wind", 0.7, Fit(0.10, 0.55, 0.002))
    first = of_round(chosen, explanation("gust", 0.3, Fit(0.02, 0.55, 0.002)))
    friction = averaged_friction(of_round(explanation("nothing", 1.0, final)), [(first, chosen)], final)["mu_t"]
    assert 0.0 == friction.low <= friction.value <= friction.high


def test_what_is_not_refitted_moves_friction_as_the_linear_model_has_it() -> None:
    """An explanation that was not refitted, against normal densities written out."""
    linear, levels = linear_model(), LEVELS
    count = linear.free.columns.shape[1]
    first = count - 2  # the fit's parameters are the last of what is free
    scales = linear.free.scales[first:]
    parameters = tuple(
        Parameter((name,), Prior(0.1, float(scale)))
        for name, scale in zip(("friction.mu_t", "friction.mu_n"), scales, strict=True)
    )
    base: Any = SimpleNamespace(parameters=parameters)
    # it does nearly what the first friction does
    column = linear.free.columns[:, [first]] + 0.1 * linear.free.columns[:, [0]]
    candidate: Any = SimpleNamespace(free=Freedom(column, 2.0 * scales[:1]))
    likely = explained("nothing", probability=0.7, fit=Fit(0.1, 0.1, 0.01), levels=levels)
    weak = explained("wind", probability=0.3, candidate=candidate, levels=levels)
    searched = round_of(likely, weak, linear=linear, base=base)
    final: Any = Fit(0.06, 0.55, 0.002)
    friction = averaged_friction(searched, [], final)

    def posterior(extra: Freedom | None) -> tuple[float, float]:
        free = linear.all_free(levels)
        columns = free.columns * free.scales
        if extra is not None:
            columns = np.hstack([columns, extra.columns * extra.scales])
        table = whiten_columns(linear, levels, np.column_stack([linear.residual, columns]))
        covariance = np.linalg.inv(table[:, 1:].T @ table[:, 1:] + np.eye(columns.shape[1]))
        mean = covariance @ table[:, 1:].T @ table[:, 0]
        return float(scales[0] * mean[first]), float(scales[0] * np.sqrt(covariance[first, first]))

    (alone, sigma), (with_it, wider) = posterior(None), posterior(candidate.free)
    assert wider > 2.0 * sigma
    assert friction["mu_t"].value == pytest.approx(0.06 + 0.3 * (with_it - alone), rel=1e-9)
    expected = Mixture(
        np.array([0.3, 0.7]),
        np.array([0.06 + with_it - alone, 0.06]),
        INTERVAL_90 / HALF * 0.002 * np.array([wider / sigma, 1.0]),
    )
    assert friction["mu_t"].high == pytest.approx(expected.quantile(0.95), rel=1e-4)  # 1.6449 for the quantile


def test_a_finding_whose_form_is_wrong_moves_friction_by_as_much_as_that_is_probable() -> None:
    final: Any = Fit(0.06, 0.55, 0.002)
    wrong = {NumberRef("friction.mu_t"): (0.08, 0.004), NumberRef("friction.mu_n"): (0.55, 0.002)}
    gust = replace(
        explanation("gust", 1.0, final), other_form=OtherForm(0.25, wrong, Freedom(np.zeros((0, 0)), np.zeros(0)))
    )
    last = of_round(explanation("nothing", 1.0, final))
    friction = averaged_friction(last, [(of_round(gust), gust)], final)
    assert friction["mu_t"].value == pytest.approx(0.75 * 0.06 + 0.25 * 0.08)
    # of what is above, a fifth of the fourth part is 5 %
    assert friction["mu_t"].high == pytest.approx(0.08 + norm.ppf(0.8) * THRESHOLDS.spread * 0.004, abs=1e-4)
    assert friction["mu_n"].value == pytest.approx(0.55)
