"""Explanations that are hard to distinguish, weighed about their own estimates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_linear_model import LEVELS
from bundled import bundled, steady
from explanations import explained, ranked

from sssi_exudyn.core.advance import Advance, silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.validation.diagnosis.context import diagnosis_problem, no_nuisances
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import compare_hypotheses
from sssi_exudyn.validation.diagnosis.search.explanation import Nothing, Refitted, Round
from sssi_exudyn.validation.diagnosis.search.reestimate_rivals import estimate_rivals, weigh_about
from sssi_exudyn.validation.diagnosis.search.second_law import count_second_law
from sssi_exudyn.validation.diagnosis.state import Reestimate, State, first_fit
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS


@dataclass(frozen=True)
class Problem:
    """Stands for a problem without hypotheses, of which progress alone is asked."""

    hypotheses: tuple[Hypothesis, ...] = ()
    progress: Advance = silent

    def reporting(self, _begin: float, _end: float) -> Problem:
        return replace(self)


PROBLEM: Any = Problem()
FIT: Any = SimpleNamespace()


def a_round(**log_evidence: float) -> Round:
    """With explanations that have been fitted, and nothing missing."""
    every = [explained(name, value, fit=FIT, levels=LEVELS) for name, value in log_evidence.items()]
    return ranked(*every, base=FIT)


class Weighing:
    """Stands for the estimates, with the evidence that each explanation has about its own; none for those that cannot
    be simulated.
    """

    def __init__(self, **about_its_own: float) -> None:
        self.evidence = about_its_own
        self.asked: list[str] = []

    def estimate_with(
        self, problem: Any, state: State, latest: Round, explanation: Nothing | Refitted, *, full: bool
    ) -> tuple[Nothing | Refitted, Reestimate]:
        self.asked.append(explanation.name)
        if explanation.name not in self.evidence:
            raise SimulationDiverged(3.0, "the run")
        weighed = replace(explanation, log_evidence=self.evidence[explanation.name])
        return weighed, Reestimate(problem, state, explanation.fit)

    def estimate(self, latest: Round) -> tuple[dict[str, float], str, set[str]]:
        """Log evidence by name, the best explanation, and whose estimates there are."""
        state = State(LEVELS, no_nuisances(1), np.zeros(1))
        again, estimates = estimate_rivals(PROBLEM, state, latest, full=False, estimate=self.estimate_with)
        return (
            {explanation.name: explanation.log_evidence for explanation in again.explanations},
            again.best.name,
            set(estimates),
        )


LATEST = {"nothing": -100.0, "snow_patch": 1.0, "gust": 0.0, "wind": -30.0}


def test_rivals_are_ranked_by_the_evidence_about_their_own_estimates() -> None:
    weighing = Weighing(snow_patch=40.0, gust=44.0)
    evidence, best, reestimated = weighing.estimate(a_round(**LATEST))
    assert weighing.asked == ["snow_patch", "gust"]
    assert (best, reestimated) == ("gust", {"snow_patch", "gust"})
    # what was not estimated again gains 39, as the patch does
    assert evidence == {"gust": 44.0, "snow_patch": 40.0, "wind": 9.0, "nothing": -61.0}


def test_that_nothing_is_missing_is_a_rival_like_any_other() -> None:
    weighing = Weighing(snow_patch=40.0, nothing=50.0)
    evidence, best, reestimated = weighing.estimate(a_round(nothing=-1.0, snow_patch=1.0, gust=-30.0))
    assert weighing.asked == ["snow_patch", "nothing"]
    assert (best, reestimated) == ("snow_patch", {"snow_patch", "nothing"})
    assert evidence == {"nothing": 50.0, "snow_patch": 40.0, "gust": 9.0}


def test_what_has_become_impossible_says_nothing_of_the_others() -> None:
    weighing = Weighing(snow_patch=-np.inf, gust=44.0)
    evidence, best, reestimated = weighing.estimate(a_round(**LATEST))
    assert (best, reestimated) == ("gust", {"snow_patch", "gust"})
    assert evidence == {"gust": 44.0, "wind": 14.0, "nothing": -56.0, "snow_patch": -np.inf}
    alone = Weighing(snow_patch=-np.inf).estimate(a_round(nothing=-100.0, snow_patch=1.0, gust=-30.0))
    assert alone == ({"gust": -30.0, "nothing": -100.0, "snow_patch": -np.inf}, "gust", {"snow_patch"})


def test_a_rival_that_cannot_be_simulated_is_none() -> None:
    evidence, best, reestimated = Weighing(snow_patch=40.0).estimate(a_round(**LATEST))
    assert (best, reestimated) == ("snow_patch", {"snow_patch"})
    assert evidence["gust"] == 39.0


def test_a_best_explanation_that_cannot_be_simulated_is_no_finding() -> None:
    with pytest.raises(SimulationDiverged):
        Weighing(gust=44.0).estimate(a_round(**LATEST))


def test_a_law_begins_near_the_first_laws_estimate_and_nothing_where_the_search_was() -> None:
    recording, motion = bundled("beginner")
    searched = model_of(recording, motion)
    light = replace(searched, skier=replace(searched.skier, mass=0.9 * searched.skier.mass))
    about: dict[str, Any] = {"search": SimpleNamespace(model=searched), "first": SimpleNamespace(model=light)}
    fit = Refit(searched, (), np.zeros(0), np.zeros(1), np.zeros((1, 0)), 0.0, np.zeros((0, 0)))
    every = [explained(name, value, fit=fit, levels=LEVELS) for name, value in {"snow_patch": 1.0, "gust": 0.0}.items()]
    latest = ranked(explained("nothing", 0.5, fit=fit, levels=LEVELS), *every, base=fit)
    begun: dict[str, tuple[Any, float]] = {}

    def estimate(
        problem: Any, state: State, _latest: Round, explanation: Nothing | Refitted, *, full: bool
    ) -> tuple[Nothing | Refitted, Reestimate]:
        begun[explanation.name] = state.estimate, explanation.fit.model.skier.mass
        return explanation, Reestimate(problem, replace(state, estimate=about["first"]), explanation.fit)

    state = State(LEVELS, no_nuisances(1), np.zeros(1), about["search"])
    estimate_rivals(PROBLEM, state, latest, full=False, estimate=estimate)
    assert begun == {
        "snow_patch": (about["search"], searched.skier.mass),
        "gust": (about["first"], light.skier.mass),
        "nothing": (about["search"], searched.skier.mass),
    }


@pytest.mark.long(seconds=30)
@pytest.mark.usefixtures("coarse_skis")
def test_about_the_same_estimate_the_evidence_is_the_same() -> None:
    recording, motion = bundled("beginner")
    assert recording.gps is not None
    motion = replace(motion, stop=motion.start + 4.0)
    displaced = (recording.gps.time > motion.start + 1.5) & (recording.gps.time < motion.start + 2.5)
    enu = recording.gps.enu + np.where(displaced[:, None], [[0.1, -0.1, 0.0]], 0.0)
    recording = steady(replace(recording, gps=replace(recording.gps, enu=enu)))
    everyone = replace(THRESHOLDS, rival=0.0)
    hypotheses = [BY_NAME["gps_jump"], BY_NAME["unexplained_force"]]
    model = model_of(recording, motion)
    problem, state, base = first_fit(
        diagnosis_problem(recording, motion, model, hypotheses=hypotheses, thresholds=everyone)
    )
    latest = compare_hypotheses(problem, state, base)

    def as_it_is(
        problem: Any, state: State, latest: Round, explanation: Nothing | Refitted, *, full: bool
    ) -> tuple[Nothing | Refitted, Reestimate]:
        about = Reestimate(problem, replace(state, levels=explanation.levels), explanation.fit)
        return weigh_about(about, latest.base, explanation), about

    again, estimates = estimate_rivals(problem, state, latest, full=False, estimate=as_it_is)
    assert set(estimates) == {"nothing", *(explanation.name for explanation in latest.refitted)}
    before = {explanation.name: explanation.log_evidence for explanation in latest.explanations}
    for explanation in again.explanations:
        # noise levels are sought from other places: for a force that says next to nothing they end 0.14 higher
        assert explanation.log_evidence == pytest.approx(before[explanation.name], abs=0.2)


def test_the_best_law_is_estimated_next_to_a_force_that_has_none() -> None:
    weighing = Weighing(unexplained_force=60.0, gust=30.0)
    _, best, reestimated = weighing.estimate(a_round(nothing=-100.0, unexplained_force=40.0, gust=0.0, wind=-3.0))
    assert best == "unexplained_force"
    assert reestimated == {"unexplained_force", "gust"}


@dataclass(frozen=True)
class Pair:
    """A round whose best explanation is a force without a law, the best law about whose estimate a second one is found
    that brings ``gain``; ``nothing`` is the probability that it is none.
    """

    second: str
    gain: float
    nothing: float = 0.0

    def counted(self) -> tuple[Round, Round | None]:
        """The round as it was, and with the second law counted."""
        latest = a_round(nothing=-100.0, unexplained_force=50.0, gust=20.0)
        following = a_round(nothing=20.0, **{self.second: 20.0 + self.gain})
        if self.nothing:
            odds = {"nothing": self.nothing, self.second: 1.0 - self.nothing}
            following = replace(
                following,
                explanations=tuple(
                    replace(explanation, probability=odds[explanation.name]) for explanation in following.explanations
                ),
            )
        law = next(explanation for explanation in latest.refitted if explanation.name == "gust")
        return latest, count_second_law(latest, law, following)


def test_two_laws_that_explain_more_than_a_force_without_one_stand_in_its_place() -> None:
    _, counted = Pair("slope_change", 40.0).counted()
    assert counted is not None
    assert counted.best.name == "gust"
    assert counted.best.probability > 0.9


def test_a_law_counts_as_much_more_as_a_second_is_probable() -> None:
    latest, counted = Pair("slope_change", 40.0, 0.2).counted()
    assert counted is not None
    odds = [
        {explanation.name: explanation.probability for explanation in searched.explanations}
        for searched in (latest, counted)
    ]
    before, after = (by_name["gust"] / by_name["unexplained_force"] for by_name in odds)
    assert after == pytest.approx(2.5 * before)  # a half to a fifth
    assert sum(odds[1].values()) == pytest.approx(1.0)
    assert counted.best.name == "unexplained_force"  # 30 of log evidence are more than that


@pytest.mark.parametrize("pair", [Pair("slope_change", 20.0), Pair("unexplained_force", 40.0)], ids=["less", "a force"])
def test_two_laws_that_explain_less_or_a_law_and_a_force_are_no_rival(pair: Pair) -> None:
    _, counted = pair.counted()
    assert counted is None


def test_where_there_may_be_no_second_law_the_best_one_is_as_probable_as_alone() -> None:
    latest, counted = Pair("slope_change", 40.0, 0.6).counted()
    assert counted is not None
    assert [explanation.probability for explanation in counted.explanations] == pytest.approx(
        [explanation.probability for explanation in latest.explanations]
    )
