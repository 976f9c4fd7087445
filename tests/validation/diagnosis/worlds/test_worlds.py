"""Simulated runs with known causes: what they are drawn from, and that what a classifier says of them holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, whiten_columns
from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.air.wind import SteadyWind
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Hypothesis, Probe, responses_of
from sssi_exudyn.validation.diagnosis.judgement import Judgement, SimilarWorld
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.wording.likeness import likeness_sentence
from sssi_exudyn.validation.diagnosis.worlds.best_possible import BestPossible
from sssi_exudyn.validation.diagnosis.worlds.catalogue import NOT_IN_THE_LIST, TWO_AT_ONCE, UNLISTED, Answer, answers_of
from sssi_exudyn.validation.diagnosis.worlds.classifier import Classifier, learn
from sssi_exudyn.validation.diagnosis.worlds.drawn_worlds import Wanted, draw_worlds, known_of, observe
from sssi_exudyn.validation.diagnosis.worlds.family import Unlisted
from sssi_exudyn.validation.diagnosis.worlds.features import Features
from sssi_exudyn.validation.diagnosis.worlds.geometry import Geometry, geometry_of, is_possible, limits_of
from sssi_exudyn.validation.diagnosis.worlds.judge import judge, train

FEWER = replace(THRESHOLDS, worlds=3000)
FREE = ("friction.mu_t", "friction.mu_n", "start.velocity_f", "start.velocity_l")
SCALES = np.array([0.1, 0.4, 2.0, 2.0])


class ValleyBreeze(SteadyWind):
    """A hypothesis as a plug-in may bring it: a wind by another name."""

    name = "valley_breeze"


def geometry_with(fitted: FittedRun, hypotheses: list[Hypothesis]) -> Geometry:
    """Return the geometry of five seconds in which friction, start and heading are free."""
    responses = {h.name: responses_of(h.probes(fitted), fitted.prepared, fitted.measurements) for h in hypotheses}
    free = responses_of([Probe(fitted.model, name) for name in FREE], fitted.prepared, fitted.measurements)
    none = np.zeros((len(fitted.prediction), 0))
    linear = LinearModel(fitted.measurements, np.zeros(len(none)), Freedom(free, SCALES))
    return geometry_of(linear, fitted.measurements.usual, fitted, hypotheses, responses, waves=0.05)


@pytest.fixture(scope="module")
def geometry(fitted: FittedRun) -> Geometry:
    return geometry_with(fitted, [*HYPOTHESES[:-1], ValleyBreeze(), HYPOTHESES[-1]])


def test_limits_are_those_of_each_place_by_itself(geometry: Geometry) -> None:
    for name in ("snow_patch", "gust"):
        candidates, limits = geometry.candidates[name], geometry.limits[name]
        assert np.any(np.isfinite(limits))
        for k in range(0, len(candidates), 50):
            own = limits_of(BY_NAME[name], candidates[k])
            np.testing.assert_array_equal(limits[k, : len(own)], own)
            assert np.all(np.isinf(limits[k, len(own) :]))


@pytest.fixture(scope="module")
def answers(geometry: Geometry) -> list[Answer]:
    return answers_of(geometry, HYPOTHESES, FEWER)


@pytest.fixture(scope="module")
def learned(geometry: Geometry, answers: list[Answer]) -> tuple[Features, Classifier]:
    """Features, and a classifier for worlds as frequent as they are drawn."""
    known = known_of(geometry)
    features = Features(geometry, known, FEWER)
    worlds = draw_worlds(geometry, known, answers, 4000, np.random.default_rng(1), Wanted(features, FEWER.world_same))
    shares = np.array([answer.share for answer in answers])
    return features, learn(features(worlds.rest), worlds.labels, shares, 1)


def moved_by(answer: Answer, geometry: Geometry, seed: int, count: int) -> Array:
    rng = np.random.default_rng(seed)
    families = answer.families
    return np.stack([families[k % len(families)].draw(rng, geometry) for k in range(count)], axis=1)


def test_there_is_an_answer_for_nothing_each_law_two_and_what_is_in_no_list(
    geometry: Geometry, answers: list[Answer]
) -> None:
    names = [answer.name for answer in answers]
    listed = [h.name for h in HYPOTHESES if h.kind != "unexplained" and h.name in geometry.candidates]
    assert names == [NOTHING_MISSING, *listed, NOT_IN_THE_LIST, TWO_AT_ONCE]
    assert sum(answer.prior for answer in answers) == pytest.approx(1.0)
    assert answers[0].prior == THRESHOLDS.nothing
    assert sum(answer.share for answer in answers) == pytest.approx(1.0)
    unlisted = next(answer for answer in answers if answer.name == NOT_IN_THE_LIST)
    assert set(UNLISTED) < set(unlisted.families)  # with those of hypotheses without a cause


def test_every_family_draws_what_its_generator_says(geometry: Geometry, answers: list[Answer]) -> None:
    for answer in answers:
        for family in answer.families:
            one, same, other = (family.draw(np.random.default_rng(seed), geometry) for seed in (3, 3, 4))
            np.testing.assert_array_equal(one, same)
            assert one.shape == geometry.linear.residual.shape
            assert np.all(np.isfinite(one))
            if answer.name != NOTHING_MISSING:
                assert np.any(one != 0.0)
                assert np.any(one != other)


def test_the_slopes_of_some_worlds_without_anything_hidden_have_a_roll(
    geometry: Geometry, answers: list[Answer]
) -> None:
    moved = moved_by(answers[0], geometry, 5, 400)
    rolls = np.count_nonzero(np.any(moved != 0.0, axis=0))
    expected = 400 * THRESHOLDS.natural
    assert abs(rolls - expected) < 4.0 * np.sqrt(expected * (1.0 - THRESHOLDS.natural))  # binomial


def test_poles_of_worlds_push_away_from_the_snow() -> None:
    rng = np.random.default_rng(6)
    assert all(BY_NAME["pole_plant"].draw_amplitudes(rng, 2)[1] >= 0.0 for _ in range(50))


def test_the_strength_of_a_world_is_what_its_measurements_say_of_it(geometry: Geometry) -> None:
    known = known_of(geometry)
    jump = geometry.candidates["gps_jump"][0].free.columns
    worlds = observe(geometry, known, np.zeros(2, dtype=int), jump, np.random.default_rng(7))
    white = whiten_columns(geometry.linear, geometry.levels, jump)
    for k in range(2):
        # a generalised least-squares amplitude next to all that is free, of normal noise
        table = np.column_stack([white[:, k], np.vstack([known.columns])])
        precision = table.T @ table + np.diag([0.0, *np.ones(known.columns.shape[1])])
        assert worlds.strength[k] == pytest.approx(np.linalg.inv(precision)[0, 0] ** -0.5, rel=1e-6)


@pytest.mark.long(seconds=15)
def test_probabilities_are_as_often_right_as_they_say(
    geometry: Geometry, answers: list[Answer], learned: tuple[Features, Classifier]
) -> None:
    features, classifier = learned
    fresh = draw_worlds(
        geometry, known_of(geometry), answers, 2000, np.random.default_rng(2), Wanted(features, FEWER.world_same)
    )
    probabilities = classifier.probabilities(features(fresh.rest))
    np.testing.assert_allclose(probabilities.sum(axis=1), 1.0, rtol=1e-9)
    best, sure = probabilities.argmax(axis=1), probabilities.max(axis=1)
    right = best == fresh.labels
    assert np.mean(right) > 2.0 * max(answer.share for answer in answers)
    for low, high in ((0.0, 0.5), (0.5, 0.8), (0.8, 1.0)):
        some = (sure >= low) & (sure <= high)
        expected, spread = np.sum(sure[some]), np.sqrt(np.sum(sure[some] * (1.0 - sure[some])))
        # four standard deviations of so many draws, and 5 % of them for what 4000 worlds do not teach
        assert abs(np.count_nonzero(right[some]) - expected) < 4.0 * spread + 0.05 * np.count_nonzero(some)
    # those that it learned the cloud's edge from are like these
    unlike = np.count_nonzero(classifier.outside(features(fresh.rest)) < 0.05)
    assert unlike < 0.05 * 2000 + 4.0 * np.sqrt(0.05 * 0.95 * 2000) + 0.03 * 2000


@pytest.mark.long
def test_priors_move_probabilities_by_their_odds(geometry: Geometry, answers: list[Answer]) -> None:
    known = known_of(geometry)
    features = Features(geometry, known, FEWER)
    worlds = draw_worlds(geometry, known, answers, 1200, np.random.default_rng(8), Wanted(features, FEWER.world_same))
    table = features(worlds.rest)
    shares = np.array([answer.share for answer in answers])
    doubled = np.where(np.arange(len(shares)) == 1, 2.0 * shares, shares)
    one, other = (learn(table, worlds.labels, priors, 3).probabilities(table[:50]) for priors in (shares, doubled))
    np.testing.assert_allclose(other[:, 1] / other[:, 2], 2.0 * one[:, 1] / one[:, 2], rtol=1e-6)


def test_what_no_world_looks_like_is_outside(geometry: Geometry, learned: tuple[Features, Classifier]) -> None:
    features, classifier = learned
    load = geometry.linear.measurements.blocks["load"]
    moved = np.zeros((len(geometry.linear.residual), 3))
    moved[load] = (300.0 * (-1.0) ** np.arange(load.stop - load.start))[:, None]  # soles that shake by 300 N
    shaken = observe(geometry, known_of(geometry), np.zeros(3, dtype=int), moved, np.random.default_rng(9))
    assert np.all(classifier.outside(features(shaken.rest)) < THRESHOLDS.world_outside)


@pytest.mark.long(seconds=12)
def test_a_plug_in_s_law_has_its_own_worlds_and_the_same_recording_the_same_answer(
    fitted: FittedRun, geometry: Geometry
) -> None:
    hypotheses = [BY_NAME["gps_jump"], BY_NAME["gps_delay"], ValleyBreeze(), HYPOTHESES[-1]]
    few = geometry_with(fitted, hypotheses)
    hidden = 5.0 * few.candidates["gps_jump"][40].free.columns[:, 0]
    few = replace(few, linear=replace(few.linear, residual=hidden))
    fewest = replace(FEWER, worlds=1500)
    judged = judge(train(few, fewest, hypotheses), few, "gps_jump")
    assert set(judged.probabilities) == {
        NOTHING_MISSING, "gps_jump", "gps_delay", "valley_breeze", NOT_IN_THE_LIST, TWO_AT_ONCE
    }  # fmt: skip
    assert sum(judged.probabilities.values()) == pytest.approx(1.0)
    assert max(judged.probabilities, key=lambda name: judged.probabilities[name]) == "gps_jump"
    assert judged.similar.recorded.shape == judged.similar.simulated.shape == few.shape[::-1]
    assert judged.similar.name in judged.probabilities
    assert judged.runs >= 1500  # those that were too weak or too strong are counted, too
    same = judge(train(few, fewest, hypotheses), few, "gps_jump")
    assert (same.probabilities, same.outside, same.best_possible) == (
        judged.probabilities, judged.outside, judged.best_possible
    )  # fmt: skip


def test_a_displaced_fix_is_named(
    geometry: Geometry, answers: list[Answer], learned: tuple[Features, Classifier]
) -> None:
    features, classifier = learned
    candidates = geometry.candidates["gps_jump"]
    moved = np.stack([0.5 * candidates[k].free.columns[:, 0] for k in range(0, len(candidates), 60)], axis=1)
    count = moved.shape[1]
    seen = observe(geometry, known_of(geometry), np.zeros(count, dtype=int), moved, np.random.default_rng(10))
    names = [answer.name for answer in answers]
    # as probable beforehand as in a diagnosis: here two causes at once would be four times as frequent as one fault
    priors = np.log([answer.prior / answer.share for answer in answers])
    odds = classifier.log_probabilities(features(seen.rest)) + priors
    named = odds.argmax(axis=1) == names.index("gps_jump")
    assert np.mean(named) > 0.8  # half a metre of a receiver of 2 cm; the shortest last three fixes


class Hidden(Unlisted):
    """What some candidate of a hypothesis does, under the name of no hypothesis."""

    def __init__(self, name: str) -> None:
        self.hypothesis = name

    def draw(self, rng: np.random.Generator, geometry: Geometry) -> Array:
        candidates = geometry.candidates[self.hypothesis]
        return np.asarray(8.0 * candidates[int(rng.integers(len(candidates)))].free.columns[:, 0])


def test_what_no_law_describes_but_does_what_a_law_does_is_not_unlisted(geometry: Geometry) -> None:
    known = known_of(geometry)
    wanted = Wanted(Features(geometry, known, FEWER), FEWER.world_same)
    answers = [Answer(name, (Hidden("gust"),), 0.5, 0.5) for name in ("gust", NOT_IN_THE_LIST)]
    worlds = draw_worlds(geometry, known, answers, 20, np.random.default_rng(11), wanted)
    assert np.bincount(worlds.labels, minlength=2).tolist() == [10, 0]
    assert worlds.tried.tolist() == [10, 100]  # ten for one that is wanted, and then no more


def test_all_of_a_law_is_explained_by_that_law_and_less_by_others(geometry: Geometry) -> None:
    known = known_of(geometry)
    features = Features(geometry, known, FEWER)
    for name, share in (("gust", 1.0), ("gps_delay", 0.5)):  # a late clock is like no other law; a gust is like others
        moved = geometry.candidates[name][-1].free.columns[:, :1]
        left = known.remove_from(whiten_columns(geometry.linear, geometry.levels, moved))
        strength = float(np.sum(whiten_columns(geometry.linear, geometry.levels, moved) * left))
        assert features.explained(left)[0] == pytest.approx(strength, rel=1e-6)
        assert 0.0 < features.explained(left, name)[0] < share * strength


def test_worlds_are_as_strong_as_is_wanted(geometry: Geometry, answers: list[Answer]) -> None:
    known = known_of(geometry)
    wanted = Wanted(Features(geometry, known, FEWER), FEWER.world_same, (6.0, 12.0))
    worlds = draw_worlds(geometry, known, answers, 300, np.random.default_rng(12), wanted)
    assert worlds.strength.min() >= 6.0
    assert worlds.strength.max() <= 12.0
    # of ten runs with nothing hidden at most two have a roll, and rolls may be weaker
    assert np.count_nonzero(worlds.labels == 0) < worlds.tried[0] * THRESHOLDS.natural


@pytest.mark.long(seconds=10)
def test_what_is_stronger_than_all_worlds_is_like_none(fitted: FittedRun) -> None:
    hypotheses = [BY_NAME["gps_jump"], BY_NAME["gps_delay"], HYPOTHESES[-1]]
    few, fewest = geometry_with(fitted, hypotheses), replace(FEWER, worlds=600)
    far = 2e4 * few.candidates["gps_jump"][40].free.columns[:, 0]
    few = replace(few, linear=replace(few.linear, residual=far))
    assert judge(train(few, fewest, hypotheses), few, "gps_jump").outside < THRESHOLDS.world_outside


def test_candidates_of_worlds_are_physically_possible(geometry: Geometry) -> None:
    windows = [candidate.window for candidate in geometry.candidates["unexplained_drag"]]
    assert windows
    assert all(window is not None and window[1] - window[0] <= 1.0 for window in windows)  # s; longer it is a patch
    gust = geometry.candidates["gust"][0]
    assert is_possible(BY_NAME["gust"], gust, np.array([6.0, 0.0]))
    assert not is_possible(BY_NAME["gust"], gust, np.array([60.0, 0.0]))  # m/s, in which no lift runs


@pytest.mark.parametrize(("other", "least", "most"), [("gust", 0.4, 0.6), ("gps_jump", 0.95, 1.0)])
def test_the_best_possible_name_is_even_odds_of_one_cause_with_two_names(
    geometry: Geometry, other: str, least: float, most: float
) -> None:
    known, rng = known_of(geometry), np.random.default_rng(13)
    answers = [Answer(name, (Hidden(hidden),), 0.5, 0.5) for name, hidden in (("one", "gust"), ("two", other))]
    best = BestPossible(known, 2, 14)
    wanted = Wanted(Features(geometry, known, FEWER), FEWER.world_same, (3.0, np.inf))
    for _ in range(2):
        best.add(draw_worlds(geometry, known, answers, 600, rng, wanted))
    # 40 runs, each with odds that depend on which of 1200 shapes are near; displaced fixes are like no wind
    assert np.all((best.expected(np.array([0.5, 0.5])) >= least) & (best.expected(np.array([0.5, 0.5])) <= most))


def test_the_sentence_lists_what_is_worth_naming_or_says_that_nothing_is_alike() -> None:
    probabilities = {"snow_patch": 0.83, "gust": 0.09, NOT_IN_THE_LIST: 0.07, NOTHING_MISSING: 0.01}
    none = np.zeros((1, 3))
    similar = SimilarWorld("gust", none, none)
    judged = Judgement(10_000, probabilities, 0.4, {"snow_patch": 0.71}, similar, "snow_patch", np.arange(2.0))
    words = likeness_sentence(judged, THRESHOLDS)
    assert words == (
        "Of 10,000 simulated runs of this recording with known causes, those that look like it had: "
        "a stretch of other snow 83%, a gust of wind 9%, something that is not in the list 7%. "
        "Where a stretch of other snow is the truth, the best possible method gives it 71% on average."
    )
    unlike = likeness_sentence(replace(judged, outside=0.001), THRESHOLDS)
    assert unlike.startswith("This recording looks like none of 10,000 simulated runs")


def test_a_law_counts_only_as_far_as_it_is_possible(geometry: Geometry) -> None:
    known, share = known_of(geometry), geometry.candidates["drag_area"][0].free
    low, high = geometry.limits["drag_area"][0, 0]
    # the model's bounds, in usual sizes: a drag area from 0.3 to 4 of the assumed one; by halving to 10/256
    np.testing.assert_allclose([low, high], [-0.7 / 0.4, 3.0 / 0.4], atol=10.0 / 256.0)
    moved = share.columns * share.scales * np.array([[-12.0, 4.0]])  # the first is no drag area at all
    rest = known.remove_from(whiten_columns(geometry.linear, geometry.levels, moved))
    less, more = Features(geometry, known, FEWER).evidence(rest)["drag_area"]
    limits = {name: np.broadcast_to([-np.inf, np.inf], of.shape) for name, of in geometry.limits.items()}
    free = replace(geometry, limits=limits)
    less_free, more_free = Features(free, known, FEWER).evidence(rest)["drag_area"]
    assert less_free > more_free > 0.0
    assert more == pytest.approx(more_free)
    assert less < less_free - 3.0
