"""The verdict: the worst figure decides, and the sentence says which and why."""

from __future__ import annotations

from typing import Any

import pytest

from sssi_exudyn.analysis.biomechanics import RESIDUAL_MOMENT
from sssi_exudyn.reports.verdict import CHECKS, SYMBOLS, WORDS, verdict_of
from sssi_exudyn.results.summary import Summary, summary_from_dict

FITTED: dict[str, Any] = {"recording": "hill", "fit": {"converged": True, "method": "joint"}}
GOOD = {"peak_Nm": 70.0, "rms_Nm": 20.0}
UNCERTAIN: dict[str, Any] = {
    "interval_90": {},
    "shares": {},
    "posture_rms_deg": {},
    "largest": [{"what": "trunk forward", "sigmas": -4.2}],
    "noise": {"track": {"sigma": 0.1, "correlation_s": 1.0, "times_usual": 6.0}},
    "fits_priors": True,
}
POSTURE = {
    "measured": ["pocket"],
    "assumed": ["arms"],
    "sigma": {"edge_deg": 5.0, "pitch_deg": 3.0, "heading_deg": 6.0, "height_m": 0.05},
    "mu_t_se": {"track": 0.001, "posture": 0.004, "slope": 0.01, "steering": 0.02},
    "effective_friction": {"value": 0.2, "se": 0.01},
    "second_half": {"mu_t": 0.05, "speed_rms_mps": 0.4, "constant_speed_rms_mps": 0.9},
    "gps_lag_s": None,
    "unbalanced_rms_m": 0.02,
}


def a_summary(**figures: Any) -> Summary:
    return summary_from_dict({**FITTED, "residual_moment": GOOD, **figures})


def quiet(**changes: Any) -> dict[str, Any]:
    return {**UNCERTAIN, "noise": {}, **changes}


OBJECTIONS = {
    "diverged": ({"diverged": "no step at 3 s"}, "bad", "The simulation", "no step at 3 s"),
    "not converged": ({"fit": {"converged": False, "reason": "too steep"}}, "bad", "The fit", "too steep"),
    "withheld": ({"uncertainty": quiet(withheld="clocks differ")}, "bad", "The interval", "clocks differ"),
    "too narrow": ({"uncertainty": UNCERTAIN}, "bad", "The residual of the track", "6.0 times the usual"),
    "widened": (
        {"uncertainty": {**UNCERTAIN, "widened": 2.0}},
        "care",
        "The residual of the track",
        "2.0 times as wide",
    ),
    "priors": ({"uncertainty": quiet(fits_priors=False)}, "care", "The correction of trunk forward", "4.2 standard"),
    "ambiguous": ({"diagnosis": {"verdict": "ambiguous", "sentence": ""}}, "care", "The diagnosis", "several"),
    "peak": ({"residual_moment": {**GOOD, "peak_Nm": 82.0}}, "care", "The peak of the residual moment", "82 N\u00a0m"),
    "both": ({"residual_moment": {"peak_Nm": 90.0, "rms_Nm": 60.0}}, "bad", "The residual moment", "exceed"),
    "energy": ({"energy": {"closure_percent": 3.0}}, "care", "The energy balance", "3.0\u00a0%"),
    "posture": ({"posture": POSTURE}, "care", "The posture", "assumed"),
    "path of few sensors": (
        {"posture": POSTURE, "trajectory": {"mean_error_m": 72.1, "percent_of_length": 6.7}},
        "care",
        "The simulated path",
        "by 72.1 m on average, 6.7\u00a0% of the path",
    ),
    "moment of an assumed posture": (
        {"posture": POSTURE, "residual_moment": {"peak_Nm": 430.0, "rms_Nm": 190.0}},
        "care",
        "The posture",
        "moments",
    ),
    "speed": (
        {"posture": {**POSTURE, "second_half": {**POSTURE["second_half"], "speed_rms_mps": 1.4}}},  # type: ignore[dict-item]
        "care",
        "The predicted speed",
        "1.4 m/s",
    ),
    "friction not identified": (
        {"posture": {**POSTURE, "second_half": {**POSTURE["second_half"], "speed_rms_mps": 9.0}}},  # type: ignore[dict-item]
        "bad",
        "The predicted speed",
        "does not identify friction",
    ),
    "not fitted": ({"fit": {"method": None}}, "care", "Friction", "not fitted"),
}


@pytest.mark.parametrize("name", OBJECTIONS)
def test_every_check_says_which_figure_decides(name: str) -> None:
    figures, level, figure, reason = OBJECTIONS[name]
    verdict = verdict_of(a_summary(**figures))
    assert (verdict.level, verdict.figure) == (level, figure)
    assert verdict.sentence.startswith(f"{figure} decides. ")
    assert reason in verdict.reason
    assert verdict.reason.endswith(".")


def test_every_check_has_a_case_of_its_own() -> None:
    objecting = {check for figures, *_ in OBJECTIONS.values() for check in CHECKS if check(a_summary(**figures))}
    assert objecting == set(CHECKS)


def test_without_objection_the_light_is_good() -> None:
    verdict = verdict_of(a_summary(diagnosis={"verdict": "explained", "sentence": ""}))
    assert verdict.level == "good"
    assert verdict.figure == ""
    assert "within OpenSim's limits of 75 N\u00a0m and 50 N\u00a0m" in verdict.sentence


def test_the_worst_decides_and_of_equal_ones_the_first_check() -> None:
    peak = {**GOOD, "peak_Nm": 82.0}
    assert verdict_of(a_summary(residual_moment=peak, diverged="no step")).figure == "The simulation"
    both = verdict_of(a_summary(residual_moment=peak, energy={"closure_percent": 3.0}))
    assert both.figure == "The peak of the residual moment"


def test_a_peak_that_fails_does_not_condemn_an_rms_that_passes() -> None:
    moment = {"peak_Nm": 82.0, "rms_Nm": 20.0, "verdict": "bad", "peak_at_s": 9.51}
    verdict = verdict_of(a_summary(residual_moment=moment))
    assert verdict.reason == (
        "The peak (82 N\u00a0m at 9.5\u00a0s) exceeds OpenSim's limit of 75 N\u00a0m;"
        " the rms (20 N\u00a0m) is within its limit of 50 N\u00a0m."
    )
    assert verdict.level == "care"
    assert RESIDUAL_MOMENT["peak"][1] == 75.0


def test_a_light_is_told_apart_without_colour() -> None:
    assert len(set(WORDS.values())) == len(set(SYMBOLS.values())) == len(WORDS) == 3
