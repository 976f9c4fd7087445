"""Smallest effects that would have been noticed, and whether a track is met as well as its instruments allow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_linear_model import LEVELS, instruments, linear_model

from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom, log_factors, overlaps, uncertain
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate
from sssi_exudyn.validation.diagnosis.search.detectability import adequacy, smallest_noticed
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS


def test_an_effect_of_the_smallest_size_is_found_as_often_as_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise left out, an effect of that size has the odds from which something is found."""
    given = replace(linear_model(), residual=np.zeros(len(linear_model().residual)))
    rng = np.random.default_rng(3)
    freedom = Freedom(
        given.measurements.scale.total[:, None] * rng.normal(size=(len(given.residual), 1)), np.array([0.2])
    )
    hypothesis = BY_NAME["gust"]
    monkeypatch.setattr(Model, "about", lambda _self, _name: type("About", (), {"unit": "m/s", "meaning": "gust"}))
    candidate = Candidate(Model.__new__(Model), freedom, ((NumberRef("gust.w_f"),),))
    information, _ = overlaps(given, LEVELS, uncertain(given, LEVELS), [freedom])
    smallest = smallest_noticed(hypothesis, [candidate], information, HYPOTHESES, THRESHOLDS.cell)
    assert (smallest.number, smallest.unit, smallest.meaning) == ("w_f", "m/s", "gust")
    shown = replace(given, residual=freedom.columns[:, 0] * smallest.value)
    known = overlaps(shown, LEVELS, uncertain(shown, LEVELS), [freedom])
    share = (1.0 - THRESHOLDS.nothing) * hypothesis.weight / sum(other.weight for other in HYPOTHESES)
    odds = share / THRESHOLDS.nothing * np.exp(THRESHOLDS.temper * float(log_factors(*known)[0, 0, 0]))
    assert 1.0 < odds < 4.5  # the prior of the amplitude draws by 1/(1 + g), a part of what it would be without one


def test_places_that_begin_and_end_in_the_same_cells_count_once(monkeypatch: pytest.MonkeyPatch) -> None:
    given = linear_model()
    monkeypatch.setattr(Model, "about", lambda _self, _name: type("About", (), {"unit": "m/s", "meaning": "gust"}))
    freedom = Freedom(np.ones((len(given.residual), 1)), np.array([0.2]))
    one, near, far = (
        Candidate(Model.__new__(Model), freedom, ((NumberRef("gust.w_f"),),), window=window)
        for window in ((0.5, 2.1), (0.7, 2.3), (4.1, 6.1))
    )

    def smallest(*candidates: Candidate) -> float:
        information = np.full((len(candidates), 1, 1), 9.0)
        return smallest_noticed(BY_NAME["gust"], candidates, information, HYPOTHESES, THRESHOLDS.cell).value

    assert smallest(one, near) == smallest(one)
    assert smallest(one, near, far) == smallest(one, far) > smallest(one)


@pytest.mark.parametrize(("missed", "adequate"), [(1.0, True), (6.0, False)])
def test_a_track_missed_by_more_than_instruments_allow_is_not_adequate(missed: float, adequate: bool) -> None:
    measurements = replace(instruments(fixes=150), counts=np.ones(150))
    residual = np.zeros(len(measurements.measured))
    residual[: measurements.blocks["y"].stop] = missed * measurements.gps_sigma
    near = adequacy(residual, measurements)
    assert near.missed_m == pytest.approx(np.sqrt(2.0) * missed * measurements.gps_sigma)
    assert near.adequate == adequate
    # 15 s of an error that lasts 2.5 s are four samples of two axes: with one chance in a thousand their squares sum up
    # to 26, and instruments may be twice as bad as they say
    assert near.allowed_m == pytest.approx(2.0 * np.sqrt(2.0 * 26.0 / 8.0) * measurements.gps_sigma, rel=0.05)


def test_single_fixes_that_do_not_count_do_not_make_a_track_inadequate() -> None:
    measurements = replace(instruments(fixes=150), counts=np.where(np.arange(150) % 20 == 0, 1e-3, 1.0))
    residual = np.zeros(len(measurements.measured))
    residual[:150] = np.where(np.arange(150) % 20 == 0, 0.5, 0.01)
    assert adequacy(residual, measurements).adequate
