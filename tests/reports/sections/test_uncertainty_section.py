"""The report's section of uncertainty: interval, budget, corrections, and a warning where one is not believable."""

from __future__ import annotations

import re
from html import unescape

import pytest
from a_run import a_run

from sssi_exudyn.reports.report import render

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
    for part in ("What is uncertain", "0.0510 to 0.0720", "feet's yaw 70 % 0 %", "knee angle l 1.23", "+1.5", "0.0212"):
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


def test_a_run_without_an_estimate_has_no_section() -> None:
    assert "What is uncertain" not in render([a_run(6.0)])
