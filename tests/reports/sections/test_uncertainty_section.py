"""The report's section of uncertainty: interval, budget, corrections, and a warning where one is not believable."""

from __future__ import annotations

import re
from html import unescape

import pytest
from a_run import a_run

from sssi_exudyn.io.typed import convert
from sssi_exudyn.reports.report import render
from sssi_exudyn.results.summary import UncertaintyFigures

pytestmark = pytest.mark.usefixtures("words_only")


def figures(largest: float, times: float | None = None) -> dict[str, object]:
    return {
        "interval_90": {"mu_t": {"low": 0.051, "high": 0.072}, "mu_n": {"low": 0.5, "high": 0.6}},
        "shares": {"mu_t": {"feet's yaw": 0.7, "drag": 0.3}, "mu_n": {"antenna": 0.996, "drag": 0.004}},
        "posture_rms_deg": {"knee_angle_l": 1.234},
        "largest": [{"what": "trunk forward", "sigmas": largest}],
        "noise": {"fixes": {"sigma": 0.0212, "correlation_s": 2.0, "times_usual": times}},
        "fits_priors": abs(largest) <= 3.0,
    }


def words(largest: float, times: float | None = None) -> str:
    page = render([a_run(6.0, uncertainty=figures(largest, times))])
    return re.sub(r"\s+", " ", unescape(re.sub("<[^>]+>", " ", page)))


def test_interval_budget_and_corrections() -> None:
    text = words(1.5)
    assert "μ_t is 0.061, with 90 % probability between 0.051 and 0.072" in text.replace("\u00a0", " ")
    assert "feet's yaw (70 %) and drag (30 %)" in text.replace("\u00a0", " ")
    for part in ("Uncertainty", "0.0510 to 0.0720", "feet's yaw 70 % 0 %", "knee angle l 1.23", "+1.5", "0.0212"):
        assert part in text, part
    assert "within three standard deviations" in text


@pytest.mark.parametrize("largest", [-4.2, 4.2])
def test_a_correction_too_far_is_said(largest: float) -> None:
    text = words(largest)
    assert "But trunk forward had to be corrected by 4.2 of its standard deviations" in text
    assert "beyond three standard deviations" in text


def test_what_is_missed_by_more_than_noise_makes_the_interval_too_narrow() -> None:
    text = words(1.5, 5.2)
    assert "too narrow: the residual of the fixes is 5 times the usual noise" in text
    assert "The residual of the fixes is 5 times the noise of such instruments" in text
    assert "too narrow" not in words(1.5, 1.6)
    page = render([a_run(6.0, uncertainty={**figures(1.5, 5.2), "widened": 2.4})])
    assert "That is widened 2.4 times: the residual of the fixes" in page


WHY = "this recording does not identify friction: the track is missed by 0.92 m"


def test_what_a_misfit_denies_is_not_shown() -> None:
    withheld = {**figures(1.5, 2.9), "interval_90": {}, "shares": {}, "withheld": WHY}
    page = render([a_run(6.0, uncertainty=withheld)])
    assert page.count(f"T{WHY[1:]}") == 2  # in the result's sentence, and before everything among the limits
    assert f"There are no intervals: {WHY}" in page
    assert "with 90" not in page
    assert "Sources of the uncertainty" not in page


def doubts(**changes: object) -> tuple[str, ...]:
    return convert({**figures(1.5, 1.2), **changes}, UncertaintyFigures).doubts


def test_doubts_of_a_fit_are_in_words() -> None:
    assert doubts() == ()
    assert doubts(withheld=WHY) == (WHY,)
    (missed,) = doubts(**figures(1.5, 4.4), widened=4.4)
    assert missed.startswith("residual of the fixes: 4.4 times the usual noise; intervals are 4.4 times as wide for it")
    (corrected,) = doubts(**figures(-8.3))
    assert corrected.startswith("trunk forward had to be corrected by 8.3 standard deviations")
    assert len(doubts(**figures(-8.3, 4.4))) == 2


def test_a_run_without_an_estimate_has_no_section() -> None:
    assert "Uncertainty" not in render([a_run(6.0)])
