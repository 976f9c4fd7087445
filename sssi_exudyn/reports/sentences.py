"""Results in plain words, with their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from sssi_exudyn.results.stored import Run

WEDGE_DEG: Final = 5.0
"""Angle between the skis from which they make a wedge: between the paper's beginner (9°) and intermediate (2°)."""
SKIDDED_DEG: Final = 12.0
"""Mean steering angle from which a turn is skidded: between the paper's beginner (25°) and intermediate (6°)."""


def in_words(runs: Sequence[Run]) -> list[str]:
    """What came out: the skiing and the agreement of each recording, what was found missing, and how two differ."""
    said = [
        f"{run.name}: {_stopped(run.summary)}{_skiing(run.summary)}{_agreement(run.summary)}{_missing(run.summary)}"
        for run in runs
    ]
    if len(runs) == 2:
        said += _difference(*runs)
    return said


def mean_of(summary: Mapping[str, Any], name: str, group: str = "each") -> float | None:
    """The mean of a turns' figure over complete turns; None where there is none."""
    figure = ((summary.get("turns") or {}).get(group) or {}).get(name) or {}
    value = figure.get("mean")
    return None if value is None else float(value)


def _skiing(summary: Mapping[str, Any]) -> str:
    count = (summary.get("turns") or {}).get("count")
    speed, radius = mean_of(summary, "mean_speed_mps"), mean_of(summary, "turn_radius_m")
    apart, steering = mean_of(summary, "ski_angle_mean_deg"), mean_of(summary, "steering_angle_mean_deg")
    share = mean_of(summary, "outside_force_share", "control")
    seconds = summary["solver"]["simulated_s"]
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


def _stopped(summary: Mapping[str, Any]) -> str:
    reason = summary.get("diverged")
    return f"The simulation gave up before the end ({reason}); this is the part until then. " if reason else ""


def _missing(summary: Mapping[str, Any]) -> str:
    sentence = (summary.get("diagnosis") or {}).get("sentence")
    return f" {sentence}" if sentence else ""


def _agreement(summary: Mapping[str, Any]) -> str:
    error, percent = summary["trajectory"]["mean_error_m"], summary["trajectory"]["percent_of_length"]
    if error is None:
        return "The run was simulated; there is no GPS track to hold it against."
    words = f"The simulated track misses the GPS by {error:.3f} m on average, {percent:.2f}\u00a0% of its length"
    correlation = summary["pressure_ratio"]["correlation"]
    if correlation is not None:
        words += f"; the load's shift between the feet correlates {correlation:.3f} with the insoles"
    return words + "."


def _difference(first: Run, second: Run) -> list[str]:
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
