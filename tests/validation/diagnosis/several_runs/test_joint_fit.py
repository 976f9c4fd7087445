"""Runs weighed together against the same by definition."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from a_day import fits_of_two_runs
from a_linear_model import LEVELS, covariance, linear_model
from bundled import bundled
from scipy.stats import norm

from sssi_exudyn.contact.terms.friction_corrections import SpeedDependentFriction
from sssi_exudyn.fitting.evidence import Freedom, log_evidence
from sssi_exudyn.fitting.objective import Prior
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.io.writing import to_json
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.reports.day_page import day_page, sentence_of_day
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.summary import Provenance
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, STEADY_LAWS
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities
from sssi_exudyn.validation.diagnosis.several_runs import joint_fit
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import (
    DayExplanation,
    DayRun,
    compare_for_day,
    day_run,
    joint_evidence,
    on_one_snow,
)
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import Pass, SamePlace
from sssi_exudyn.validation.diagnosis.state import fitted_run
from sssi_exudyn.validation.diagnosis.state import linear_model as linear_of_run
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS


def test_runs_that_share_nothing_have_separate_evidence() -> None:
    models = [linear_model(seed) for seed in (2, 3)]
    evidence, _, _ = joint_evidence([DayRun(linear, LEVELS, ()) for linear in models])
    assert evidence == pytest.approx(sum(log_evidence(linear, LEVELS) for linear in models), rel=1e-9)  # rounding


def test_what_is_shared_is_one_number() -> None:
    models = [linear_model(seed) for seed in (2, 3)]
    scales = models[0].free.scales
    runs = [DayRun(linear, LEVELS, (0, 2)) for linear in models]
    evidence, values, errors = joint_evidence(runs)
    alone, _, _ = joint_evidence([replace(run, shared=()) for run in runs])
    size = [len(linear.residual) for linear in models]
    whole = np.zeros((sum(size), sum(size)))
    apart = np.zeros_like(whole)
    columns = []
    for i, linear in enumerate(models):
        at = slice(i * size[0], i * size[0] + size[i])
        own = linear.free.columns * scales
        whole[at, at] = covariance(linear) + np.outer(own[:, 1], own[:, 1])
        apart[at, at] = covariance(linear) + own @ own.T
        columns.append(own[:, [0, 2]])
    shared = np.vstack(columns)
    y = np.concatenate([linear.residual for linear in models])

    def density(cov: np.ndarray) -> float:
        return float(-0.5 * np.linalg.slogdet(cov)[1] - 0.5 * y @ np.linalg.solve(cov, y))

    expected = density(whole + shared @ shared.T) - density(apart)
    assert evidence - alone == pytest.approx(expected, rel=1e-6, abs=1e-6)  # rounding of covariances
    gram = np.eye(2) + shared.T @ np.linalg.solve(whole, shared)
    best = np.linalg.solve(gram, shared.T @ np.linalg.solve(whole, y))
    np.testing.assert_allclose(values, scales[[0, 2]] * best, rtol=1e-6)
    np.testing.assert_allclose(errors, scales[[0, 2]] * np.sqrt(np.diag(np.linalg.inv(gram))), rtol=1e-6)


def test_a_common_effect_is_estimated_better_by_two_runs() -> None:
    rng = np.random.default_rng(8)
    models = [linear_model(seed) for seed in (2, 3)]
    extra = [Freedom(rng.normal(size=(len(linear.residual), 1)) * 0.05, np.array([1.0])) for linear in models]
    models = [replace(a, residual=a.residual + 2.0 * e.columns[:, 0]) for a, e in zip(models, extra, strict=True)]
    runs = [DayRun(linear, LEVELS, ()) for linear in models]
    _, _, both = joint_evidence(runs, extra)
    alone = [joint_evidence([run], [e])[2] for run, e in zip(runs, extra, strict=True)]
    assert both[0] < min(a[0] for a in alone)


@pytest.mark.long(seconds=45)
@pytest.mark.usefixtures("coarse_skis")
def test_two_runs_find_what_the_first_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Friction that rises with speed, as the benchmark's world records it on two stretches at different speeds."""
    law = SpeedDependentFriction(0.009, 10.0)
    own = fits_of_two_runs(law)
    alone = [{explanation.name: explanation for explanation in compare_for_day([one])} for one in own]
    best = compare_for_day(own)[0]
    assert best.name == "speed_dependent_friction"
    assert best.probability > 0.6
    assert alone[0]["nothing"].probability > THRESHOLDS.stands_out
    slope = best.numbers["speed_dependent_friction.b"]
    half = slope.high - slope.value
    for by_name in alone:
        less = by_name["speed_dependent_friction"].numbers["speed_dependent_friction.b"]
        assert half < less.high - less.value
    assert abs(slope.value - law.b) < 2.0 * half  # of one draw: 3.3 standard deviations
    # drag differs with the square of the speed, and changes within turns: 0.0038 for 0.009
    assert half < 0.5 * law.b
    assert slope.unit == "s/m"
    assert best.fitted
    # a second run whose snow was stated otherwise has the same numbers beforehand in the comparison
    stated = tuple(
        replace(p, prior=Prior(0.5 * p.prior.mean, 0.5 * p.prior.sigma)) if p.names[0] in joint_fit.SHARED else p
        for p in own[1].fit.parameters
    )
    otherwise = [own[0], replace(own[1], fit=replace(own[1].fit, parameters=stated))]
    one, other = (
        joint_evidence(
            [day_run(r, linear_of_run(r.problem, r.state, r.fit), r.state.levels) for r in on_one_snow(runs)]
        )
        for runs in (own, otherwise)
    )
    assert other[0] == pytest.approx(one[0], rel=1e-9)
    np.testing.assert_allclose(other[1], one[1], rtol=1e-9)
    # shared numbers and the runs' own are fitted in turns: from a standard deviation away they come back
    hypothesis = next(steady for steady in STEADY_LAWS if steady.name == best.name)
    fitted_first = fitted_run(own[0].problem, own[0].state, own[0].fit)
    shared_law = joint_fit.named_law(hypothesis, fitted_first, len(own))
    prior = [p.prior.mean for p in own[0].fit.parameters if p.names[0] in joint_fit.SHARED]
    values = np.array([number.value for number in best.numbers.values()]) - np.array([*prior, 0.0])
    errors = np.array([(number.high - number.value) / THRESHOLDS.interval_90 for number in best.numbers.values()])
    again = joint_fit.fit_to_all(shared_law, own, values + errors * [1.0, -1.0, 1.0])
    np.testing.assert_array_less(np.abs(again.values - values), 0.2 * errors)  # twice what ends the turns
    assert again.evidence == pytest.approx(best.log_evidence, abs=0.3)
    # of one that is possible above its best value only, half is left, and a part of what was possible beforehand
    middle = again.values[-1]
    cut = replace(shared_law, possible=lambda model: bool(model.value("speed_dependent_friction.b") > middle))
    beforehand = norm.sf(middle / (again.size * float(hypothesis.scales[0])))
    less = joint_fit.fit_to_all(cut, own, values + errors * [1.0, -1.0, 1.0]).evidence - again.evidence
    # 400 draws: shares of 0.5 and of 0.2 to 0.5 are known to 5 to 10 %
    assert less == pytest.approx(np.log(0.5 / beforehand), abs=0.3)
    # one that would be physically impossible is none
    monkeypatch.setattr(type(hypothesis), "possible", lambda _self, _model: False)
    two_laws = replace(own[0], problem=replace(own[0].problem, hypotheses=[hypothesis, BY_NAME["drag_area"]]))
    left = {explanation.name: explanation for explanation in compare_for_day([two_laws])}
    assert left.keys() == {"nothing", "drag_area"}
    assert sum(explanation.probability for explanation in left.values()) == pytest.approx(1.0)


def test_probabilities_of_explanations() -> None:
    weights = np.array([BY_NAME[name].weight for name in ("wind", "gust")])
    odds = probabilities(0.0, np.zeros(2), weights)
    assert odds == pytest.approx([0.5, 0.25, 0.25])
    more_certain = probabilities(0.0, np.array([10.0, 0.0]), weights)
    assert more_certain.sum() == pytest.approx(1.0)
    assert more_certain[1] > 0.95


def test_a_day_in_words_as_a_page_and_as_a_file(tmp_path: Path) -> None:
    def number(value: float) -> Number:
        return Number(value, value - 0.002, value + 0.002, "1")

    friction = {"friction.mu_t": number(0.1), "friction.mu_n": number(0.8)}
    law = {**friction, "speed_dependent_friction.b": Number(0.012, 0.008, 0.016, "s/m")}
    speed = DayExplanation("speed_dependent_friction", 0.7, 12.0, law)
    nothing = DayExplanation("nothing", 0.1, 4.0, friction, fitted=False)
    drag = DayExplanation("drag_area", 0.2, 9.0, {**friction, "drag_area.share": number(0.5)})
    model = model_of(*bundled("intermediate"))
    sentence = sentence_of_day([speed, drag, nothing], 3, model)
    assert sentence.startswith("In 3 runs together μ_t changes by +0.0120 for each m/s of speed (70% probable; it may")
    assert "the same skier at another speed or posture on the same snow would distinguish them" in sentence
    assert sentence.endswith("μ_t is 0.100 ± 0.002 and μ_n, the largest lateral load ratio, 0.800 ± 0.002.")
    assert "nothing is missing that acts on all alike (90% probable)" in sentence_of_day(
        [replace(nothing, probability=0.9)], 2, model
    )
    unsure = sentence_of_day([replace(drag, probability=0.45), replace(nothing, probability=0.43)], 2, model)
    assert "nothing is missing that acts on all alike (43% probable)" in unsure
    origin = Provenance(inputs={"morning/gps.csv": "0a"}, seed=0)
    day = Day(1, ("morning", "a & b"), sentence, (speed, drag, nothing), origin)
    page = day_page(day)
    assert 'href="a%20%26%20b/report.html"' in page
    tiles = page[page.index('<dl class="tiles">') : page.index("</dl>")]
    for words in ("speed dependent friction", "70%", "else drag area 20%, nothing 10%", "0.098 to 0.102"):
        assert words in tiles
    assert "0.012 (0.008 to 0.016) s/m" in page
    assert page.count("(by its linear response)") == 1
    (tmp_path / "day.json").write_text(to_json(day), encoding="utf-8")
    assert read_json(tmp_path / "day.json", Day) == day
    written = json.loads((tmp_path / "day.json").read_text(encoding="utf-8"))
    assert written.keys() == {
        "format", "recordings", "sentence", "explanations", "provenance", "same_place", "found_law",
    }  # fmt: skip
    names = [explanation["name"] for explanation in written["explanations"]]
    assert names == ["speed_dependent_friction", "drag_area", "nothing"]
    assert written["explanations"][0]["numbers"]["speed_dependent_friction.b"]["unit"] == "s/m"


def test_findings_that_other_runs_were_asked_about_are_in_the_page_and_the_file(tmp_path: Path) -> None:
    passed = Pass("noon <2>", 14.6, {"snow_patch": -9.25, "slope_change": None})
    before, after = {"snow_patch": 0.6, "gust": 0.35}, {"gust": 0.97, "snow_patch": 0.01}
    place = SamePlace("morning", "snow_patch", before, after, (passed,), "noon <2> passed & met nothing of it.")
    assert place.settled
    assert not replace(place, after=before).settled
    assert not replace(place, before={"gust": 0.9}).settled  # it was sure already
    friction = {"friction.mu_t": Number(0.1, 0.09, 0.11, "1"), "friction.mu_n": Number(0.8, 0.7, 0.9, "1")}
    nothing = DayExplanation("nothing", 1.0, 4.0, friction)
    day = Day(1, ("morning", "noon <2>"), "Nothing.", (nothing,), Provenance(), (place,))
    page = day_page(day)
    assert "The same place in other runs" in page
    assert '<th scope="row">morning</th>' in page
    for cell in ("noon &lt;2&gt; (15 m)", "35.0%", "97.0%", "-9.2", "met nothing of it"):
        assert cell in page
    assert "The same place" not in day_page(replace(day, same_place=()))
    (tmp_path / "day.json").write_text(to_json(day), encoding="utf-8")
    assert read_json(tmp_path / "day.json", Day) == day
    older = json.loads((tmp_path / "day.json").read_text(encoding="utf-8"))
    del older["same_place"]
    (tmp_path / "older.json").write_text(json.dumps(older), encoding="utf-8")
    assert read_json(tmp_path / "older.json", Day) == replace(day, same_place=())
