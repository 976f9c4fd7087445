"""Results in sentences, with their figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final, Literal

from sssi_exudyn.analysis.biomechanics import WEDGE_DEG, Spread
from sssi_exudyn.reports.section import Runs
from sssi_exudyn.reports.verdict import moment_sentence
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate, Summary

SKIDDED_DEG: Final = 12.0
"""Mean steering angle above which a turn is skidded: between the paper's beginner (25°) and intermediate (6°)."""


Known = tuple[float, float]
"""A number and its standard error."""
_NOTICEABLE: Final = 2.0
"""Standard errors above which two numbers are reported to differ."""
_LEAST_TURNS: Final = 2
"""Least number of turns from which their spread is known."""
Group = Literal["each", "control"]
"""Figures of whole turns, or of their control phase."""


def sentences(runs: Runs) -> list[str]:
    """State the result in words: skiing and agreement of each recording, what was missing, and how two differ."""
    stated = [
        f"{run.name}: {_early_stop(run.summary)}{_skiing(run.summary)}{_agreement(run.summary)}"
        f"{_friction(run.summary)}{_of_few_sensors(run.summary)}{_cutting(run.summary)}{_residual(run.summary)}"
        f"{_assumed(run.summary)}{_missing(run.summary)}"
        for run in runs
    ]
    return stated + differences(runs)


def differences(runs: Runs) -> list[str]:
    """State how the second of two runs differs from the first; nothing for one run or for more than two."""
    return _difference(*runs) if len(runs) == 2 else []


def spread_of(summary: Summary, name: str, group: Group = "each") -> Spread:
    """Return a figure of the turns, over complete ones; empty where there is none."""
    figures: Mapping[str, Spread] = getattr(summary.turns, group) or {}
    return figures.get(name, Spread())


def mean_of(summary: Summary, name: str, group: Group = "each") -> float | None:
    """Return the mean of a turns' figure over complete turns; None where there is none."""
    return spread_of(summary, name, group).mean


def _skiing(summary: Summary) -> str:
    count = summary.turns.count
    speed, radius = mean_of(summary, "mean_speed_mps"), mean_of(summary, "turn_radius_m")
    apart, steering = mean_of(summary, "ski_angle_mean_deg"), mean_of(summary, "steering_angle_mean_deg")
    share = mean_of(summary, "outside_force_share", "control")
    seconds = summary.solver.simulated_s
    if count is None or seconds is None:
        return ""
    words = f"{count} {'turn' if count == 1 else 'turns'} in {seconds:.0f} s"
    if speed is not None and radius is not None:
        words += f", at {speed:.1f} m/s on a radius of {radius:.1f} m"
    words += "."
    if apart is None or steering is None or steering_is_assumed(summary):
        return words + " "
    edge = "skidded" if steering >= SKIDDED_DEG else "almost carved"
    point = f"{edge}: the skis point {steering:.0f}° off their direction of travel"
    if summary.posture is not None:  # which sets them parallel, and the load on them
        return f"{words} Turns {point}. "
    skis = f"in a wedge of {apart:.0f}°" if apart >= WEDGE_DEG else f"parallel to {apart:.0f}°"
    words += f" Skis {skis}, turns {point}"
    words += (
        "." if share is None else f", and the outside one bears {100.0 * share:.0f}\u00a0% of the load in mid-turn."
    )
    return words + " "


def steering_is_assumed(summary: Summary) -> bool:
    """Tell whether few sensors leave the skis' direction open: an assumed direction is no result."""
    return summary.posture is not None and any(
        assumption.startswith("steering") for assumption in summary.posture.assumed
    )


def _early_stop(summary: Summary) -> str:
    reason = summary.diverged
    return f"The simulation stopped before the end ({reason}); this is the part until then. " if reason else ""


def _missing(summary: Summary) -> str:
    return "" if summary.diagnosis is None else f" {summary.diagnosis.sentence}"


def _agreement(summary: Summary) -> str:
    error, percent = summary.trajectory.mean_error_m, summary.trajectory.percent_of_length
    if error is None or percent is None:
        return "The run was simulated; there is no GPS track to compare it with."
    words = f"The simulated track misses the GPS by {error:.3f} m on average, {percent:.2f}\u00a0% of its length"
    correlation, rmsd = summary.pressure_ratio.correlation, summary.pressure_ratio.rmsd
    if correlation is not None:
        off = "" if rmsd is None else f" and differs from them by {100.0 * rmsd:.0f}\u00a0% of the load (rms)"
        words += f"; the left foot's share of the load correlates {correlation:.3f} with the insoles{off}"
    return words + "."


def _residual(summary: Summary) -> str:
    """State the moment at the pelvis that nothing explains, compared with OpenSim's limits."""
    sentence = moment_sentence(summary)
    return f" {sentence}" if sentence else ""


def _assumed(summary: Summary) -> str:
    """State that something was assumed because it was not stated."""
    some = any(notice.startswith("assumed") for notice in summary.notices)
    return " Part of the data of skier and equipment was assumed." if some else ""


def _friction(summary: Summary) -> str:
    """State the interval of friction along the ski, its sources, and whether the corrections are believable."""
    uncertainty, value = summary.uncertainty, summary.friction.mu_t.value
    if uncertainty is None or value is None:
        return ""
    if uncertainty.withheld is not None:
        return f" {uncertainty.withheld[:1].upper()}{uncertainty.withheld[1:]}."
    interval = uncertainty.interval_90["mu_t"]
    parts = sorted(uncertainty.shares["mu_t"].items(), key=lambda part: -part[1])[:2]
    sources = " and ".join(f"{group} ({100.0 * share:.0f}\u00a0%)" for group, share in parts)
    words = (
        f" μ_t is {value:.3f}, with 90\u00a0% probability between {interval.low:.3f} and {interval.high:.3f}; most of"
        f" that uncertainty comes from {sources}."
    )
    if uncertainty.missed is not None:
        what, times = uncertainty.missed
        wide = uncertainty.widened or 1.0
        widened = f"That is widened {wide:.1f} times" if wide > 1.0 else "That is too narrow"
        words += f" {widened}: the residual of the {what} is {times:.0f} times the usual noise."
    if uncertainty.fits_priors:
        return words
    worst = uncertainty.largest[0]
    return f"{words} But {worst.what} had to be corrected by {abs(worst.sigmas):.1f} of its standard deviations."


def _of_few_sensors(summary: Summary) -> str:
    """State effective friction, and whether the model predicts the changes of speed of a run of few sensors."""
    if summary.posture is None:
        return ""
    effective, half = summary.posture.effective_friction, summary.posture.second_half
    words = ""
    if effective.value is not None and effective.se is not None:
        words += f" Effective friction, skidding included, is {effective.value:.3f} ± {effective.se:.3f}."
    predicted, constant = half.speed_rms_mps, half.constant_speed_rms_mps
    if predicted is not None and constant is not None:
        words += (
            f" The second half's speed, predicted from the first, is {predicted:.1f} m/s off (rms); the first half's"
            f" mean speed is {constant:.1f} m/s off"
        )
        words += "." if predicted < constant else ": the model does not tell how the speed of this run changes."
    return words


def _cutting(summary: Summary) -> str:
    """State the friction of edges that cut, next to the paper's coefficients."""
    carving = summary.carving
    if (
        carving is None
        or carving.mu.value is None
        or carving.equivalent_mu_t is None
        or carving.equivalent_mu_n is None
    ):
        return ""
    return (
        f" Its edges cut the snow: friction along them ({carving.mu.value:.3f} of the resultant) comes to a μ_t of"
        f" {carving.equivalent_mu_t:.3f}, the grooves' walls to a μ_n of {carving.equivalent_mu_n:.2f}."
    )


def _difference(first: StoredRun, second: StoredRun) -> list[str]:
    """State how the second run differs from the first, each difference with its standard error.

    Differences within two standard errors are not reported.
    """
    stated, same = [], []
    for what, (a, b), unit, more, less in _compared(first.summary, second.summary):
        if a is None or b is None:
            continue
        difference, error = b[0] - a[0], math.hypot(a[1], b[1])
        if abs(difference) <= _NOTICEABLE * error:
            same.append(what)
        else:
            word = more if difference > 0.0 else less
            digits = max(0, min(4, -math.floor(math.log10(max(error, 1e-4)))))
            stated.append(f"{what} is {word} by {abs(difference):.{digits}f} ± {error:.{digits}f}{unit}")
    if not stated and not same:
        return []
    words = f"Against {first.name}, of {second.name} {', '.join(stated)}" if stated else ""
    alike = f"no difference beyond its uncertainty in {', '.join(same)}"
    if not same:
        return [f"{words}."]
    return [f"{words}; {alike}." if stated else f"Between {first.name} and {second.name} there is {alike}."]


def _compared(first: Summary, second: Summary) -> list[tuple[str, tuple[Known | None, Known | None], str, str, str]]:
    """Return the compared quantities: name, number with standard error in both runs, unit, words for more and less."""
    speed, radius, skid = (
        (_over_turns(first, name), _over_turns(second, name))
        for name in ("mean_speed_mps", "turn_radius_m", "steering_angle_mean_deg")
    )
    assumed = steering_is_assumed(first) or steering_is_assumed(second)
    mu_t = _with_error(first.friction.mu_t), _with_error(second.friction.mu_t)
    return [
        ("the mean speed", speed, " m/s", "higher", "lower"),
        ("the turn radius", radius, " m", "larger", "smaller"),
        ("the skid angle", (None, None) if assumed else skid, "°", "larger", "smaller"),
        ("μ_t", mu_t, "", "higher", "lower"),
    ]


def _over_turns(summary: Summary, name: str) -> Known | None:
    """Return a figure's mean over the turns, and the standard error from their spread; None for fewer than two."""
    spread = spread_of(summary, name)
    if spread.mean is None or spread.sd is None or spread.turns is None or spread.turns < _LEAST_TURNS:
        return None
    return spread.mean, spread.sd / math.sqrt(spread.turns)


def _with_error(estimate: Estimate) -> Known | None:
    return None if estimate.value is None or estimate.se is None else (estimate.value, estimate.se)
