"""The result in words: bad news is included, and a difference within its uncertainty is not stated."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from a_run import a_run

from sssi_exudyn.analysis.biomechanics import ResidualMoment, Spread
from sssi_exudyn.reports.sections.few_sensors import few_sensors as few_sensors_section
from sssi_exudyn.reports.sections.limits import limits
from sssi_exudyn.reports.sections.track_figures import figure_4
from sssi_exudyn.reports.sections.turn_tables import turns
from sssi_exudyn.reports.sentences import sentences
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import (
    Correction,
    Estimate,
    Fit,
    Friction,
    FrictionShares,
    Interval,
    Noise,
    Posture,
    PostureSigma,
    Prediction,
    UncertaintyFigures,
)


@pytest.fixture(scope="module")
def run() -> StoredRun:
    return a_run()


def with_figures(run: StoredRun, **figures: Any) -> StoredRun:
    return replace(run, summary=replace(run.summary, **figures))


def lines_of(run: StoredRun) -> str:
    return " ".join(str(block) for block in limits([run]).blocks)


def test_the_bad_news_is_said_too(run: StoredRun) -> None:
    shown = with_figures(
        run,
        residual_moment=ResidualMoment(210.0, 93.0, 75.0, 50.0, "bad"),
        notices=("assumed, as it was not stated: skier.mass_kg = 75.0",),
    )
    (text,) = sentences([shown])
    rmsd = shown.summary.pressure_ratio.rmsd
    assert rmsd is not None
    assert f"and differs from them by {100.0 * rmsd:.0f}\u00a0% of the load" in text
    words = "the peak (210 N\u00a0m) and the rms (93 N\u00a0m) exceed OpenSim's limits of 75 N\u00a0m and 50 N\u00a0m"
    assert words in text
    assert "was assumed" in text
    assert "was assumed" not in sentences([run])[0]


def few_sensors(assumed: tuple[str, ...], predicted: float) -> Posture:
    return Posture(
        measured=("speed and course: fixes",),
        assumed=assumed,
        sigma=PostureSigma(edge_deg=13.0, pitch_deg=2.0, heading_deg=12.0, height_m=0.006),
        gps_lag_s=None,
        unbalanced_rms_m=8e-14,
        mu_t_se=FrictionShares(0.012, 0.003, 0.009, 0.022),
        effective_friction=Estimate(0.137, 0.015),
        second_half=Prediction(0.131, predicted, 0.61, 107.5),
    )


def test_of_few_sensors_nothing_that_was_assumed_is_a_result(run: StoredRun) -> None:
    figures = {"ski_angle_mean_deg": Spread(8e-7, 3e-7, 4), "steering_angle_mean_deg": Spread(1.0, 0.1, 4)}
    run = with_figures(run, turns=replace(run.summary.turns, each=figures))
    assumed = with_figures(run, posture=few_sensors(("steering angle: skis point along the course",), 3.2))
    (text,) = sentences([assumed])
    assert "the skis point" not in text
    assert "Effective friction, skidding included, is 0.137 ± 0.015." in text
    assert "is 3.2 m/s off (rms); the first half's mean speed is 0.6 m/s off: the model does not tell" in text
    measured = with_figures(run, posture=few_sensors(("arms: held in front",), 0.4))
    (text,) = sentences([measured])
    assert "Turns almost carved: the skis point 1° off their direction of travel." in text
    assert "parallel" not in text
    assert "the model does not tell" not in text
    assert "skid angle" not in sentences([assumed, measured])[2]
    assert "skid angle" in sentences([measured, measured])[2]
    shown = str(few_sensors_section([assumed]).blocks) + str(turns([assumed]).blocks)
    assert "e-" not in shown


def test_insoles_are_named_where_there_are_some(run: StoredRun) -> None:
    assert "insoles" in str(figure_4([run]).blocks)
    assert run.measured is not None
    bare = replace(run, measured=run.measured.drop(columns=["left_insole_N", "right_insole_N"]))
    assert "insoles" not in str(figure_4([bare]).blocks)


def friction(value: float, se: float | None) -> Friction:
    return Friction(Estimate(value, se), Estimate(0.5, 0.01))


def turns_of(run: StoredRun, speed: float, sd: float, turns: int = 9) -> StoredRun:
    figures = {"mean_speed_mps": Spread(speed, sd, turns)}
    return with_figures(run, turns=replace(run.summary.turns, each=figures))


def test_a_difference_is_said_with_its_uncertainty(run: StoredRun) -> None:
    first = with_figures(turns_of(run, 8.0, 0.3), friction=friction(0.06, 0.003))
    second = with_figures(turns_of(run, 9.0, 0.3), friction=friction(0.062, 0.004), recording="other")
    text = sentences([first, second])[2]
    # 0.3 m/s over the root of 9 turns, in both: 0.14 m/s
    assert "of other the mean speed is higher by 1.0 ± 0.1 m/s" in text
    assert "no difference beyond its uncertainty in μ_t" in text
    assert "radius" not in text  # unknown in one of them
    apart = sentences([first, with_figures(second, friction=friction(0.09, 0.004))])[2]
    assert "μ_t is higher by 0.030 ± 0.005" in apart


def test_without_uncertainties_no_difference_is_said(run: StoredRun) -> None:
    first = with_figures(turns_of(run, 8.0, 0.3, turns=1), friction=friction(0.06, None))
    second = with_figures(turns_of(run, 9.0, 0.3, turns=1), friction=friction(0.19, None))
    assert len(sentences([first, second])) == 2


def test_what_every_run_assumes_and_what_holds_of_this_one(run: StoredRun) -> None:
    assert "The movement is prescribed" in lines_of(run)
    assert "Nothing was fitted" in lines_of(run)
    fitted = with_figures(run, fit=Fit(method="paper", converged=False, reason="no progress"))
    assert "did not converge: no progress" in lines_of(fitted)
    assert "Standard errors count the track's residual alone" in lines_of(fitted)
    figures = UncertaintyFigures(
        interval_90={"mu_t": Interval(0.05, 0.07)},
        shares={"mu_t": {"posture": 1.0}},
        posture_rms_deg={},
        largest=(Correction("skier's mass", -4.2),),
        noise={"x": Noise(1.0, 1.0)},
        fits_priors=False,
    )
    sure = with_figures(run, fit=Fit(method="joint", converged=True), uncertainty=figures)
    assert "Skier's mass had to be corrected by 4.2 standard deviations" in lines_of(sure)
    assert "residual alone" not in lines_of(sure)
    assumed = with_figures(run, notices=("assumed, as it was not stated: a", "another notice"))
    assert "assumed, as it was not stated: a" in lines_of(assumed)
    assert "another notice" not in lines_of(assumed)
    bad = with_figures(run, residual_moment=ResidualMoment(210.0, 40.0, 75.0, 50.0, "bad"))
    words = lines_of(bad).replace("\\xa0", " ")
    assert "The peak (210 N m) exceeds OpenSim's limit of 75 N m; the rms (40 N m) is within its limit" in words
