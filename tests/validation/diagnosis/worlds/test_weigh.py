"""Probabilities by the fits and by simulated runs together."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from explanations import NOWHERE, explained, refitted, round_of

from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.core.number_ref import MU_T, NumberRef
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.fitting.parameters import Parameter
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.judgement import Judgement, SimilarWorld
from sssi_exudyn.validation.diagnosis.search.explanation import Round
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.worlds import weigh as weigh_module
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE
from sssi_exudyn.validation.diagnosis.worlds.weigh import fit_without, weigh_by_both, weigh_finding

FIT: Any = SimpleNamespace()
BY_FITS = {"gust": 0.5, "snow_patch": 0.2, "unexplained_force": 0.15, "unexplained_drag": 0.05, NOTHING_MISSING: 0.1}


def judged(outside: float = 0.4, **probabilities: float) -> Judgement:
    none = np.zeros((1, 3))
    return Judgement(10_000, probabilities, outside, {}, SimilarWorld("gust", none, none), "gust", np.arange(2.0))


def a_round() -> Round:
    return round_of(*(explained(name, probability=p, fit=FIT) for name, p in BY_FITS.items()))


def probabilities(searched: Round) -> dict[str, float]:
    return {explanation.name: explanation.probability for explanation in searched.explanations}


def test_both_count_alike() -> None:
    by_worlds = {"gust": 0.1, "snow_patch": 0.6, NOT_IN_THE_LIST: 0.2, NOTHING_MISSING: 0.1}
    weighed = weigh_by_both(a_round(), judged(**by_worlds))
    means = {"gust": 0.3, "snow_patch": 0.4, NOTHING_MISSING: 0.1}
    means |= {"unexplained_force": 0.15, "unexplained_drag": 0.05}  # of 0.2, as the fits share it
    assert probabilities(weighed) == pytest.approx(means)
    assert weighed.best.name == "snow_patch"
    assert {explanation.name: explanation.by_fits for explanation in weighed.explanations} == BY_FITS
    assert weighed.judgement is not None


def test_two_at_once_speak_for_each_law_as_one_of_them() -> None:
    by_worlds = {"gust": 0.5, "snow_patch": 0.1, NOT_IN_THE_LIST: 0.01, TWO_AT_ONCE: 0.35, NOTHING_MISSING: 0.04}
    weighed = probabilities(weigh_by_both(a_round(), judged(**by_worlds)))
    assert weighed["gust"] == pytest.approx(0.5 * (0.5 + 0.5 + 0.35 * 0.5 / 0.7))
    assert weighed["snow_patch"] == pytest.approx(0.5 * (0.2 + 0.1 + 0.35 * 0.2 / 0.7))


def test_a_cause_that_was_not_tried_leaves_its_share_to_the_others() -> None:
    weighed = probabilities(weigh_by_both(a_round(), judged(gust=0.4, insole_gain=0.6)))
    assert weighed["gust"] == pytest.approx(0.5 * (0.5 + 1.0))
    assert sum(weighed.values()) == pytest.approx(1.0)


def test_a_recording_unlike_all_simulated_runs_may_have_a_cause_that_is_in_no_list() -> None:
    weighed = weigh_by_both(a_round(), judged(0.001, snow_patch=1.0))
    trusted = THRESHOLDS.named_outside
    fits = {name: trusted * probability for name, probability in BY_FITS.items()}
    fits["unexplained_force"] += (1.0 - trusted) * 0.75  # as the fits share it
    fits["unexplained_drag"] += (1.0 - trusted) * 0.25
    assert probabilities(weighed) == pytest.approx(fits)
    assert weighed.judgement is not None  # that they are unlike is said


def test_no_name_is_sure_of_a_recording_unlike_all_simulated_runs() -> None:
    by_fits = {"gust": 1.0, "unexplained_force": 0.0, NOTHING_MISSING: 0.0}
    searched = round_of(*(explained(name, probability=p, fit=FIT) for name, p in by_fits.items()))
    best = weigh_by_both(searched, judged(0.001, gust=1.0)).best
    assert best.name == "gust"
    assert best.probability < THRESHOLDS.sure


def test_where_no_cause_without_a_law_was_tried_the_fits_alone_count() -> None:
    by_fits = {"gust": 0.9, NOTHING_MISSING: 0.1}
    searched = round_of(*(explained(name, probability=p, fit=FIT) for name, p in by_fits.items()))
    assert probabilities(weigh_by_both(searched, judged(0.001, gust=1.0))) == pytest.approx(by_fits)


def test_a_name_is_sure_only_where_both_are() -> None:
    by_fits = {"gust": 0.999, "snow_patch": 0.001, NOTHING_MISSING: 0.0}
    searched = round_of(*(explained(name, probability=p, fit=FIT) for name, p in by_fits.items()))
    assert weigh_by_both(searched, judged(snow_patch=1.0)).best.probability < THRESHOLDS.sure


def test_the_best_name_is_one_that_was_estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    """A name that simulated runs prefer has to have an estimate of its own to be a finding."""
    monkeypatch.setattr(weigh_module, "fit_without", lambda _searched, _finding, fit: fit)
    monkeypatch.setattr(weigh_module, "linear_without", lambda *_: None)
    said = judged(snow_patch=0.9, gust=0.1)
    monkeypatch.setattr(weigh_module, "geometry_of", lambda *_: None)
    monkeypatch.setattr(weigh_module, "train", lambda *_: None)
    monkeypatch.setattr(weigh_module, "judge", lambda *_: said)
    latest, gust = a_round(), refitted("gust", fit=FIT, probability=0.5)
    problem: Any = SimpleNamespace(progress=lambda *_: None, ground=None, hypotheses=(), thresholds=NOWHERE.thresholds)
    about: Any = SimpleNamespace(problem=problem, state=SimpleNamespace(levels=None), fit=FIT)
    weighed, best = weigh_finding(latest, gust, {"gust": about, "snow_patch": about}, latest)
    assert best.name == weighed.best.name == "snow_patch"
    weighed, best = weigh_finding(latest, gust, {"gust": about}, latest)
    assert (best.name, weighed.best.name) == ("gust", "snow_patch")


@pytest.mark.parametrize(("name", "taken"), [("gust", ["drag_area", "wind"]), ("snow_patch", [])])
def test_a_wind_s_force_is_lent_to_no_other_law(monkeypatch: pytest.MonkeyPatch, name: str, taken: list[str]) -> None:
    """About a gust a larger drag area does what the gust does: its response is from before the gust was found."""
    names = ["drag_area", "gust", "snow_patch", "wind"]
    before, after = ({other: np.full((1, 1), value) for other in names} for value in (0.0, 1.0))
    seen: dict[str, Any] = {}

    def geometry_of(*arguments: Any) -> None:
        seen.update(arguments[4])

    monkeypatch.setattr(weigh_module, "fit_without", lambda _searched, _finding, fit: fit)
    monkeypatch.setattr(weigh_module, "linear_without", lambda *_: None)
    monkeypatch.setattr(weigh_module, "geometry_of", geometry_of)
    monkeypatch.setattr(weigh_module, "train", lambda *_: None)
    monkeypatch.setattr(weigh_module, "judge", lambda *_: judged(gust=1.0))
    names_in_round = [*names, NOTHING_MISSING]
    latest = round_of(*(explained(other, probability=0.2, fit=FIT) for other in names_in_round), responses=before)
    problem: Any = SimpleNamespace(progress=lambda *_: None, ground=None, hypotheses=(), thresholds=NOWHERE.thresholds)
    about: Any = SimpleNamespace(problem=problem, state=SimpleNamespace(levels=None), fit=FIT)
    weigh_finding(latest, refitted(name, fit=FIT), {name: about}, replace(latest, responses=after))
    assert sorted(other for other, response in seen.items() if response[0, 0] == 0.0) == taken


@pytest.mark.parametrize(("name", "lent"), [("gust", False), ("snow_patch", True)])
def test_a_wind_s_force_is_not_lent_to_the_drag_coefficient(name: str, lent: bool) -> None:
    """About a gust more drag does what the gust does, and nothing would be missing without it."""
    priors = [(MU_T, 0.1), (NumberRef("air.c_d"), 0.15)]
    parameters = tuple(Parameter((number,), Prior(0.5, sigma)) for number, sigma in priors)
    model: Any = SimpleNamespace(terms=(AirDrag(),))

    def fit_of(response: float, places: tuple[int, ...]) -> Refit:
        some = tuple(parameters[i] for i in places)
        zeros = np.zeros(len(some))
        return Refit(model, some, zeros, np.zeros(3), np.full((3, len(some)), response), 0.0, np.diag(zeros))

    searched = round_of(explained(name, fit=FIT), fitted=SimpleNamespace(model=model), base=fit_of(1.0, (1, 0)))
    fit = fit_of(2.0, (0, 1))
    without = fit_without(searched, refitted(name, fit=FIT), fit)
    np.testing.assert_array_equal(without.sensitivity, [[2.0, 2.0 if lent else 1.0]] * 3)
    np.testing.assert_array_equal(fit.sensitivity, 2.0)
    others = fit_of(2.0, (0,))  # drag is known
    assert fit_without(searched, refitted(name, fit=FIT), others) is others
