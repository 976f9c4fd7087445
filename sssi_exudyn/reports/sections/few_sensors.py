"""A recording of few sensors: what was measured and what was assumed, and the uncertainty from it."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import (
    Block,
    Drawing,
    Facts,
    Heading,
    Items,
    Runs,
    Section,
    Text,
    say_of_each,
    section_of_each,
)
from sssi_exudyn.reports.sections.tables import estimate_text, number
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Posture


def few_sensors(runs: Runs) -> Section:
    """Show what a reader has to know before believing anything of such a result."""
    return section_of_each("Few sensors: measured and assumed", runs, _blocks, say_of_each(runs, _counts))


def _counts(run: StoredRun) -> str:
    """State how much was measured and how much assumed."""
    posture = run.summary.posture
    if posture is None:
        return ""
    return f"{_things(posture.measured)} measured and {_things(posture.assumed)} assumed: most of the posture"


def _things(names: tuple[str, ...]) -> str:
    return "one thing was" if len(names) == 1 else f"{len(names)} things were"


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    posture = run.summary.posture
    if posture is None:
        return ()
    blocks: tuple[Block, ...] = (
        Text(
            "Most of this posture was not measured. Joint angles, moments and the load's share between the feet are"
            " those of the assumptions; speed, path and effective friction follow from the sensors."
        ),
        Heading("Measured"),
        Items(posture.measured),
        Heading("Assumed"),
        Items(posture.assumed),
        Heading("Uncertainty of the feet, and what it does to friction"),
        Facts(_rows(run, posture)),
    )
    if run.second_half is None:
        return blocks
    half = posture.second_half
    caption = (
        f"Speed over ground: predicted from the first half of the fixes (μ_t {number(half.mu_t)}), and measured."
        f" Nothing was fitted beyond the line; the root mean square error there is {number(half.speed_rms_mps, 2)} m/s"
    )
    table, split = run.second_half, half.split_s
    return (*blocks, Drawing(caption, lambda axes: _draw_speed(axes, table, split)))


def _rows(run: StoredRun, posture: Posture) -> list[tuple[str, str, str]]:
    sigma, effective, shares = posture.sigma, posture.effective_friction, posture.mu_t_se
    rows = [
        ("edge angle (°)", f"± {sigma.edge_deg:.1f}", "each foot's roll, one standard deviation"),
        ("heading (°)", f"± {sigma.heading_deg:.1f}", "of the skis"),
        ("pitch (°)", f"± {sigma.pitch_deg:.1f}", "of the skis against the slope"),
        ("height (m)", f"± {sigma.height_m:.3f}", "of one foot against the other"),
        ("balance (m)", _metres(posture.unbalanced_rms_m), "by which the posture fails to balance in roll"),
        (
            "effective friction",
            estimate_text(effective) + _interval(posture),
            "along the path: along and across the skis together, which only a measured steering angle distinguishes",
        ),
    ]
    if posture.effective_friction_of_run is not None:
        same = "of the simulated run, which confirms it where the simulated path is the skied one"
        rows.append(("effective friction", number(posture.effective_friction_of_run), same))
    if posture.speed_return_1_s is not None:
        rows.append(
            ("return of speed (1/s)", estimate_text(posture.speed_return_1_s), "to the skier's own, by braking")
        )
    style = run.summary.technique
    if style is not None:
        likely = f"carving {style.carving:.2f}, skidding {style.skidding:.2f}, wedge {style.wedge:.2f}"
        rows.append(("technique", likely, "probabilities from friction, slope and speed of telephones' runs"))
    return rows + [
        ("share in μ_t's standard error", number(value, 2), f"from the {name}")
        for name, value in (
            ("track", shares.track),
            ("posture, by its drag", shares.posture),
            ("slope", shares.slope),
            ("steering", shares.steering),
        )
    ]


def _interval(posture: Posture) -> str:
    interval = posture.effective_friction_90
    return "" if interval is None else f" (90\u00a0% interval {interval.low:.3f} to {interval.high:.3f})"


def _metres(value: float | None) -> str:
    return number(value) if value is None else f"{value:.3f}"


def _draw_speed(axes: Axes, table: pd.DataFrame, split: float | None) -> None:
    time = table["time_s"]
    axes.plot(time, table["measured_mps"], ".-", color=plots.COLOURS[0], label="measured", markersize=3)
    axes.plot(time, table["predicted_mps"], color=plots.COLOURS[1], label="predicted")
    if "estimated_mps" in table:
        axes.plot(time, table["estimated_mps"], color=plots.COLOURS[2], label="estimated from all", linewidth=0.8)
    if split is not None:
        axes.axvline(split, color=plots.INK, linewidth=0.6, linestyle="--")
    axes.set(xlabel="time (s)", ylabel="speed (m/s)")
