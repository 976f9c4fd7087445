"""What to measure next: how probably a measurement settles what a run leaves open."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from explanations import explained, refitted, round_of
from gliding import model

from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.terms.friction_corrections import SnowPatch
from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.wording.next_measurement import next_measurements, on_another_pass, settled


def test_what_both_predict_alike_settles_nothing() -> None:
    assert settled(0.5, 0.4, 0.0) < 1e-6
    assert settled(0.5, 0.5, 1e4) == pytest.approx(1.0)


def test_settling_is_as_frequent_as_in_draws() -> None:
    """The evidence of either is drawn as it would be were one of them right, and counted where one stands alone."""
    first, second, square = 0.5, 0.3, 9.0
    rng = np.random.default_rng(4)
    right = rng.uniform(size=400_000) < first / (first + second)
    gain = 0.5 * square + np.sqrt(square) * rng.normal(size=right.size)
    logs = np.log(first / second) + THRESHOLDS.temper * np.where(right, gain, -gain)
    alone = np.where(right, logs, -logs) > np.log(THRESHOLDS.sure / (1.0 - THRESHOLDS.sure))
    # a share of so many draws is known to 0.0008
    assert settled(first, second, square) == pytest.approx(np.mean(alone), abs=4e-3)


@pytest.mark.parametrize(
    ("term", "name", "number", "stays"),
    [
        (SnowPatch(0.05, 10.0, 20.0), "snow_patch", "snow_patch.delta_mu_t", True),
        (Gust(3.0, 0.0), "gust", "gust.w_f", False),
    ],
)
def test_a_patch_is_there_again_and_a_gust_is_not(term: Term, name: str, number: str, stays: bool) -> None:
    with_it = model((*PAPER_TERMS, term))
    candidate = Candidate(with_it, Freedom(np.zeros((1, 1)), np.ones(1)), ((NumberRef(number),),))
    fit: Any = SimpleNamespace(model=with_it)
    again = on_another_pass(refitted(name, candidate=candidate, fit=fit))
    assert (term in again.terms) is stays


def test_where_one_is_certain_nothing_is_to_be_measured() -> None:
    levels: Any = None
    fit: Any = object()
    sure, other = refitted("gust", probability=0.9, fit=fit), explained("nothing", probability=0.1, fit=fit)
    assert next_measurements(round_of(sure, other), sure, levels) == ()
    unsure = refitted("gust", probability=0.6, fit=fit)
    assert next_measurements(round_of(unsure, explained("wind", probability=0.4)), unsure, levels) == ()
