"""What evidence is worth: a roll that may be the slope's own is no finding."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from explanations import refitted
from scipy.stats import norm

from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.terrain.from_heights import AMPLITUDE, STEEPNESS, WAVES
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import log_natural
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

WEIGHTS = np.array([BY_NAME[name].weight for name in ("terrain_bump", "gust")])


def test_what_may_be_the_slopes_own_counts_for_nothing_missing() -> None:
    evidence = np.array([10.0, 2.0])
    plain = probabilities(0.0, evidence, WEIGHTS)
    own = probabilities(0.0, evidence, WEIGHTS, log_natural=np.array([0.0, -np.inf]))
    assert plain[1] > 0.9
    # of the same density either way it is the slope's own as often as slopes have one
    prior = THRESHOLDS.nothing
    share = (1.0 - prior) * WEIGHTS[0] / WEIGHTS.sum()
    without = (1.0 - THRESHOLDS.natural) * plain[0] * own[1] / plain[1]
    of_slope = (own[0] - without) / own[1]
    assert of_slope == pytest.approx(THRESHOLDS.natural * prior / share)
    # the others keep their odds
    assert own[2] / own[1] == pytest.approx(plain[2] / plain[1])


@pytest.mark.parametrize("log_natural", [(0.0, 0.0), (0.0, -np.inf)])
def test_measurements_that_tell_nothing_leave_the_prior(log_natural: tuple[float, float]) -> None:
    after = probabilities(0.0, np.zeros(2), WEIGHTS, log_natural=np.array(log_natural))
    assert after[0] == pytest.approx(THRESHOLDS.nothing)


def test_without_such_it_is_as_it_was() -> None:
    evidence = np.array([10.0, 2.0])
    np.testing.assert_array_equal(
        probabilities(0.0, evidence, WEIGHTS),
        probabilities(0.0, evidence, WEIGHTS, log_natural=np.full(2, -np.inf)),
    )


def natural(rise: float, waves: float) -> float:
    """Log density ratio of a roll of ``rise`` m on a slope whose waves are ``waves`` m, of usual rolls of 0.25 m."""
    levels: Any = SimpleNamespace(surface=waves / AMPLITUDE[0])
    fit: Any = SimpleNamespace(model=SimpleNamespace(value=lambda _name: rise))
    candidate: Any = SimpleNamespace(
        amplitudes=(("terrain_bump.rise",),), free=Freedom(np.zeros((1, 1)), np.array([0.25]))
    )
    return log_natural(AMPLITUDE[0], refitted("terrain_bump", fit=fit, candidate=candidate, levels=levels))


def test_a_roll_is_the_slopes_own_where_waves_are_as_high() -> None:
    assert natural(0.1, 0.05) == pytest.approx(norm.logpdf(0.1, scale=0.1) - norm.logpdf(0.1, scale=0.25))
    assert natural(0.1, 0.05) > 0.0
    assert natural(0.5, 0.05) < -9.0
    assert natural(0.1, 0.005) < -40.0  # on snow as even as a laboratory's


def test_steepness_is_that_of_the_waves_together() -> None:
    x = np.array([0.0, 0.01])
    rises = []
    for share, length in WAVES:
        gap = np.abs(x[:, None] - x) * np.sqrt(5.0) / length
        covariance = share**2 * (1.0 + gap + gap**2 / 3.0) * np.exp(-gap)
        rises.append(np.array([1.0, -1.0]) @ covariance @ np.array([1.0, -1.0]) / 0.01**2)
    # a hundredth of a metre is short next to six: the curvature's share is below 1e-4
    assert np.sqrt(sum(rises)) == pytest.approx(STEEPNESS, rel=1e-3)
