"""Explanations that are hard to distinguish, weighed about their own estimates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from a_linear_model import LEVELS
from bundled import bundled

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.diagnosis import diagnose
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem, no_nuisances
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search import compare_hypotheses as search_module
from sssi_exudyn.validation.diagnosis.search import reestimate_rivals
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import (
    Explanation,
    Round,
    compare_hypotheses,
    rank_by_probability,
)
from sssi_exudyn.validation.diagnosis.search.reestimate_rivals import estimate_rivals
from sssi_exudyn.validation.diagnosis.state import State, first_fit

PROBLEM: Any = SimpleNamespace(progress=lambda _share, _detail: None)


def a_round(**log_evidence: float) -> Round:
    """With explanations that have been fitted; ``nothing`` is the name of none."""
    fit: Any = SimpleNamespace()
    found = [
        Explanation("" if name == "nothing" else name, value, 0.0, cast(Any, None), fit, LEVELS)
        for name, value in log_evidence.items()
    ]
    return Round(rank_by_probability(found, 0.0), cast(Any, None), fit, cast(Any, None), {}, {})


def as_it_is(problem: Any, state: State, fit: Any, *, full: bool) -> tuple[Any, State, Any]:
    """Stands for an estimate that changes nothing."""
    return problem, state, fit


class Weighing:
    """Stands for the estimates, with the evidence that each explanation has about its own; none for those that cannot
    be simulated.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **about_its_own: float) -> None:
        self.evidence = about_its_own
        self.asked: list[str] = []
        monkeypatch.setattr(reestimate_rivals, "estimate_again", as_it_is)
        monkeypatch.setattr(reestimate_rivals, "_weigh", self.weigh)

    def weigh(self, _anew: Any, _base: Any, explanation: Explanation) -> Explanation:
        name = explanation.name or "nothing"
        self.asked.append(name)
        if name not in self.evidence:
            raise SimulationDiverged(3.0, "the run")
        return replace(explanation, log_evidence=self.evidence[name])

    def estimate(self, latest: Round) -> tuple[dict[str, float], str, set[str]]:
        """Log evidence by name, the best explanation, and whose estimates there are."""
        state = State(LEVELS, no_nuisances(1), np.zeros(1))
        found, anew = estimate_rivals(PROBLEM, state, latest, full=False)
        return {each.name: each.log_evidence for each in found.explanations}, found.best.name, set(anew)


LATEST = {"nothing": -100.0, "snow_patch": 1.0, "gust": 0.0, "wind": -30.0}


def test_rivals_are_ranked_by_the_evidence_about_their_own_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    weighing = Weighing(monkeypatch, snow_patch=40.0, gust=44.0)
    evidence, best, anew = weighing.estimate(a_round(**LATEST))
    assert weighing.asked == ["snow_patch", "gust"]
    assert (best, anew) == ("gust", {"snow_patch", "gust"})
    # what was not estimated anew gains 39, as the patch does
    assert evidence == {"gust": 44.0, "snow_patch": 40.0, "wind": 9.0, "": -61.0}


def test_that_nothing_is_missing_is_a_rival_like_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    weighing = Weighing(monkeypatch, snow_patch=40.0, nothing=50.0)
    evidence, best, anew = weighing.estimate(a_round(nothing=-1.0, snow_patch=1.0, gust=-30.0))
    assert weighing.asked == ["snow_patch", "nothing"]
    assert (best, anew) == ("snow_patch", {"snow_patch", ""})
    assert evidence == {"": 50.0, "snow_patch": 40.0, "gust": 9.0}


def test_what_has_become_impossible_says_nothing_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    weighing = Weighing(monkeypatch, snow_patch=-np.inf, gust=44.0)
    evidence, best, anew = weighing.estimate(a_round(**LATEST))
    assert (best, anew) == ("gust", {"snow_patch", "gust"})
    assert evidence == {"gust": 44.0, "wind": 14.0, "": -56.0, "snow_patch": -np.inf}
    alone = Weighing(monkeypatch, snow_patch=-np.inf).estimate(a_round(nothing=-100.0, snow_patch=1.0, gust=-30.0))
    assert alone == ({"gust": -30.0, "": -100.0, "snow_patch": -np.inf}, "gust", {"snow_patch"})


def test_a_rival_that_cannot_be_simulated_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    evidence, best, anew = Weighing(monkeypatch, snow_patch=40.0).estimate(a_round(**LATEST))
    assert (best, anew) == ("snow_patch", {"snow_patch"})
    assert evidence["gust"] == 39.0


def test_a_best_explanation_that_cannot_be_simulated_is_no_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SimulationDiverged):
        Weighing(monkeypatch, gust=44.0).estimate(a_round(**LATEST))


@pytest.mark.long(seconds=30)
def test_about_the_same_estimate_the_evidence_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    motion = replace(motion, stop=motion.start + 4.0)
    displaced = (recording.gps.time > motion.start + 1.5) & (recording.gps.time < motion.start + 2.5)
    enu = recording.gps.enu + np.where(displaced[:, None], [[0.1, -0.1, 0.0]], 0.0)
    recording = replace(recording, gps=replace(recording.gps, enu=enu))
    monkeypatch.setattr(search_module, "HYPOTHESES", (BY_NAME["gps_jump"], BY_NAME["unexplained_force"]))
    monkeypatch.setattr(reestimate_rivals, "RIVAL", 0.0)
    monkeypatch.setattr(reestimate_rivals, "estimate_again", as_it_is)
    problem, state, base = first_fit(diagnosis_problem(recording, motion, model_of(recording, motion)))
    latest = compare_hypotheses(problem, state, base)
    again, anew = estimate_rivals(problem, state, latest, full=False)
    assert set(anew) == {each.name for each in latest.explanations if each.fit is not None}
    before = {each.name: each.log_evidence for each in latest.explanations}
    for each in again.explanations:
        # noise levels are sought until the evidence changes by 1e-7 of itself, from other places
        assert each.log_evidence == pytest.approx(before[each.name], abs=0.05)


def test_the_best_law_is_estimated_beside_a_force_that_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    weighing = Weighing(monkeypatch, unexplained_force=60.0, gust=30.0)
    _, best, anew = weighing.estimate(a_round(nothing=-100.0, unexplained_force=40.0, gust=0.0, wind=-3.0))
    assert best == "unexplained_force"
    assert anew == {"unexplained_force", "gust"}


@dataclass(frozen=True)
class Pair:
    """A round whose best explanation is a force without a law, the best law about whose estimate a second one is found
    that brings ``gain``; ``nothing`` is the probability that it is none.
    """

    second: str
    gain: float
    nothing: float = 0.0

    def tried(self, monkeypatch: pytest.MonkeyPatch) -> tuple[Round, Any]:
        law: Any = SimpleNamespace()
        latest = a_round(nothing=-100.0, unexplained_force=50.0, gust=20.0)
        latest = replace(latest, explanations=tuple(replace(each, candidate=law) for each in latest.explanations))
        following = a_round(nothing=20.0, **{self.second: 20.0 + self.gain})
        if self.nothing:
            odds = {"": self.nothing, self.second: 1.0 - self.nothing}
            following = replace(
                following,
                explanations=tuple(replace(each, probability=odds[each.name]) for each in following.explanations),
            )
        monkeypatch.setattr(diagnose, "_next_round", lambda *_: (None, following))
        about: Any = SimpleNamespace()
        return diagnose._try_pair(latest, {"unexplained_force": about, "gust": about}, [])


def test_two_laws_that_explain_more_than_a_force_without_one_stand_in_its_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, pair = Pair("slope_change", 40.0).tried(monkeypatch)
    assert pair is not None
    assert found.best.name == "gust"
    assert found.best.probability > 0.9


def test_a_law_counts_as_much_more_as_a_second_is_probable(monkeypatch: pytest.MonkeyPatch) -> None:
    alone, none = Pair("slope_change", 20.0).tried(monkeypatch)
    found, pair = Pair("slope_change", 40.0, 0.2).tried(monkeypatch)
    assert none is pair is None
    odds = [{each.name: each.probability for each in latest.explanations} for latest in (alone, found)]
    before, after = (each["gust"] / each["unexplained_force"] for each in odds)
    assert after == pytest.approx(2.5 * before)  # a half to a fifth
    assert sum(odds[1].values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    "pair",
    [Pair("slope_change", 20.0), Pair("unexplained_force", 40.0), Pair("slope_change", 40.0, 0.6)],
    ids=["explain less", "a force beside a law", "there may be no second"],
)
def test_else_the_force_without_a_law_stays(monkeypatch: pytest.MonkeyPatch, pair: Pair) -> None:
    found, tried = pair.tried(monkeypatch)
    assert tried is None
    assert found.best.name == "unexplained_force"
