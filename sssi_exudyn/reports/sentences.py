"""Results in sentences, with their figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal

from sssi_exudyn.analysis.biomechanics import Spread
from sssi_exudyn.reports.section import Runs
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary

WEDGE_DEG: Final = 5.0
"""Angle between the skis from which they make a wedge: between the paper's beginner (9°) and intermediate (2°)."""
SKIDDED_DEG: Final = 12.0
"""Mean steering angle from which a turn is skidded: between the paper's beginner (25°) and intermediate (6°)."""


Group = Literal["each", "control"]
"""Figures of whole turns, or of their control phase."""


def sentences(runs: Runs) -> list[str]:
    """The result in words: the skiing and the agreement of each recording, what was missing, and how two differ."""
    found = [
        f"{run.name}: {_early_stop(run.summary)}{_skiing(run.summary)}{_agreement(run.summary)}"
        f"{_friction(run.summary)}{_missing(run.summary)}"
        for run in runs
    ]
    if len(runs) == 2:
        found += _difference(*runs)
    return found


def spread_of(summary: Summary, name: str, group: Group = "each") -> Spread:
    """A figure of the turns, over complete ones; empty where there is none."""
    figures: Mapping[str, Spread] = getattr(summary.turns, group) or {}
    return figures.get(name, Spread())


def mean_of(summary: Summary, name: str, group: Group = "each") -> float | None:
    """The mean of a turns' figure over complete turns; None where there is none."""
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
    if apart is not None and steering is not None:
        skis = f"in a wedge of {apart:.0f}°" if apart >= WEDGE_DEG else f"parallel to {apart:.0f}°"
        edge = "skidded" if steering >= SKIDDED_DEG else "almost carved"
        words += f" Skis {skis}, turns {edge}: the skis point {steering:.0f}° off the way they go"
        words += (
            "." if share is None else f", and the outside one bears {100.0 * share:.0f}\u00a0% of the load in mid-turn."
        )
    return words + " "


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
    correlation = summary.pressure_ratio.correlation
    if correlation is not None:
        words += f"; the load's shift between the feet correlates {correlation:.3f} with the insoles"
    return words + "."


def _friction(summary: Summary) -> str:
    """The interval of friction along the ski, where it comes from, and whether the corrections are believable."""
    found, value = summary.uncertainty, summary.friction.mu_t.value
    if found is None or value is None:
        return ""
    interval = found.interval_90["mu_t"]
    parts = sorted(found.shares["mu_t"].items(), key=lambda part: -part[1])[:2]
    sources = " and ".join(f"{group} ({100.0 * share:.0f}\u00a0%)" for group, share in parts)
    words = (
        f" μ_t is {value:.3f}, with 90\u00a0% probability between {interval.low:.3f} and {interval.high:.3f}; most of"
        f" that uncertainty comes from {sources}."
    )
    if found.fits_priors:
        return words
    worst = found.largest[0]
    return f"{words} But {worst.what} had to be corrected by {abs(worst.sigmas):.1f} of its standard deviations."


def _difference(first: StoredRun, second: StoredRun) -> list[str]:
    """How the second run differs from the first; nothing where either has no complete turns."""
    pairs = {
        name: (mean_of(first.summary, name), mean_of(second.summary, name))
        for name in ("mean_speed_mps", "turn_radius_m", "steering_angle_mean_deg")
    }
    if any(a is None or b is None for a, b in pairs.values()):
        return []
    speed, radius, steering = ((float(a or 0.0), float(b or 0.0)) for a, b in pairs.values())
    return [
        f"Against {first.name}, {second.name} goes {abs(speed[1] - speed[0]):.1f} m/s "
        f"{'faster' if speed[1] >= speed[0] else 'slower'}, on a radius {radius[1] / radius[0]:.1f} times as large, "
        f"with the skis {abs(steering[1] - steering[0]):.0f}° "
        f"{'farther off' if steering[1] >= steering[0] else 'closer to'} the way they go."
    ]
