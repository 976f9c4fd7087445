"""The paragraph for a coach: right for every verdict, and for every hypothesis."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from a_diagnosis import finding_of
from bundled import bundled
from explanations import NOWHERE

from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.diagnosis_data import (
    Adequacy,
    Change,
    Finding,
    Next,
    Number,
    Outcome,
    Smallest,
    Where,
)
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import HYPOTHESES
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Hypothesis
from sssi_exudyn.validation.diagnosis.search.search_result import Figures
from sssi_exudyn.validation.diagnosis.wording.paragraph import paragraph_of
from sssi_exudyn.validation.diagnosis.wording.sentence import REJECTED

NEAR, FAR = Adequacy(0.05, 0.2), Adequacy(6.0, 0.2)
SMALLEST = {"gust": Smallest("w_f", 2.5, "m/s"), "snow_patch": Smallest("delta_mu_t", 0.0175, "1")}
ANOTHER_PASS = Next("the same slope once more, skied alike", ("gust", "snow_patch"), 0.9)


@pytest.fixture(scope="module")
def model() -> Model:
    return model_of(*bundled("beginner"))


def paragraph(
    model: Model, verdict: Outcome, *findings: Finding, near: Adequacy = NEAR, after: float = 0.05, following: Any = ()
) -> str:
    best = SimpleNamespace(name="gust", probability=0.22)
    nothing = SimpleNamespace(name="nothing", probability=0.45)
    last: Any = SimpleNamespace(hypotheses=[best], nothing=nothing, best=best, noticed=SMALLEST, fitted=NOWHERE)
    figures = [Figures(0.3, 0.4, 9.0, 0.5), Figures(after, after, 1.0, 0.0)]
    return paragraph_of(findings, verdict, last, near, model, figures, following)


def gust(probability: float, *others: tuple[str, float]) -> Finding:
    number = Number(1.0, 0.5, 1.5, "m/s")
    where = Where(2.0, 4.0, (10.0, 20.0), "both", (), (3, 4))
    finding = finding_of("gust", probability, *others)
    return replace(finding, parameters={"w_f": Number(-5.0, -6.0, -4.0, "m/s"), "w_l": number}, where=where)


def test_nothing_missing_tells_what_would_not_have_been_noticed(model: Model) -> None:
    text = paragraph(model, "none")
    assert "Nothing was found: the simulated path is 0.30 m from the recorded one" in text
    assert "ones fewer: a gust of 9 km/h, a stretch of slower or faster snow, as if the slope changed by 1.0°" in text
    assert "not ruled out: a gust of wind (22%)" in text
    assert text.endswith("Next: nothing needs to be measured again for this.")


def test_what_was_found_has_its_turns_time_size_and_probability(model: Model) -> None:
    text = paragraph(model, "explained", gust(0.97, ("snow_patch", 0.02)))
    assert (
        "In turns 3 and 4 (from 2.0 s to 4.0 s, 10 m to 20 m along the path) a gust blows, at its strongest 18 km/h up"
        in text
    )
    assert "This is 97% probable; not ruled out: a stretch of other snow (2%)" in text
    assert "predicted to 0.05 m instead of 0.40 m: that speaks for it" in text
    assert "half would have been noticed, of smaller ones fewer: a stretch of slower or faster snow" in text
    assert text.endswith("Next: ski the slope once more; a gust of wind would be gone.")
    assert "This is more than 99% probable" in paragraph(model, "explained", gust(0.9999))
    assert "that speaks against it" in paragraph(model, "explained", gust(0.97), after=0.5)
    assert "are predicted to 0.40 m with and without it" in paragraph(model, "explained", gust(0.97), after=0.404)


def test_turns_that_were_not_fitted_may_reject_a_name(model: Model) -> None:
    finding = gust(0.97)
    worse = replace(finding, evidence=replace(finding.evidence, held_out_error_m=Change(0.067, 0.076)))
    assert REJECTED in paragraph(model, "ambiguous", worse)
    assert REJECTED not in paragraph(model, "explained", finding)


def test_an_ambiguous_finding_is_not_to_be_relied_on(model: Model) -> None:
    finding = gust(0.5, ("snow_patch", 0.3), ("nothing", 0.1))
    text = paragraph(model, "ambiguous", finding, following=[ANOTHER_PASS])
    assert "50% probable, which is not enough to rely on" in text
    assert "not ruled out: a stretch of other snow (30%), that nothing is missing (10%)" in text
    assert text.endswith("With a probability of 90% it leaves only one of a gust of wind and a stretch of other snow.")
    assert paragraph(model, "ambiguous", finding).endswith("Next: a second run over the same place.")


def test_a_run_that_is_not_described_is_not_explained(model: Model) -> None:
    for findings in ((), (gust(0.97),)):
        text = paragraph(model, "not_adequate", *findings, near=FAR)
        assert "misses the recorded path by 6.00 m where the instruments allow 0.20 m" in text
        assert "Do not trust what was found or fitted, not even friction; no cause is ruled out" in text
        assert "Nothing was found" not in text
        assert "Too small" not in text
        assert "Next: check what the recording states" in text


def test_a_recording_that_cannot_tell(model: Model) -> None:
    text = paragraph(model, "not_adequate")
    assert "This recording cannot tell whether something is missing" in text
    assert "nothing is missing is 45% probable. Not ruled out: a gust of wind (22%) and others" in text
    assert text.endswith("Next: ski the slope again, faster or slower, or with a better receiver.")
    assert "ski the slope again" not in paragraph(model, "not_adequate", following=[ANOTHER_PASS])


@pytest.mark.parametrize("hypothesis", HYPOTHESES, ids=lambda hypothesis: hypothesis.name)
def test_every_hypothesis_has_a_paragraph(hypothesis: Hypothesis, model: Model) -> None:
    numbers = defaultdict(lambda: Number(0.05, 0.04, 0.06, "1"))
    finding = replace(finding_of(hypothesis.name, 0.9), kind=hypothesis.kind, parameters=numbers, where=None)
    text = paragraph(model, "unexplained" if hypothesis.kind == "unexplained" else "explained", finding)
    assert f"All along the run {hypothesis.plain_words(numbers, model)}. " in text
    after = {"sensor": "correct the instrument", "physics": hypothesis.caption, "unexplained": hypothesis.caption}
    assert after[hypothesis.kind] in text.rpartition("Next: ")[2]
