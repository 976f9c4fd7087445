"""The turns in figures: over all of them, and turn by turn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from sssi_exudyn.analysis.biomechanics import WHOLE
from sssi_exudyn.analysis.turns import PHASES
from sssi_exudyn.reports.section import Runs, Section, say_of_each, table_section
from sssi_exudyn.reports.sections.tables import Entry, number, sheet, with_spread
from sssi_exudyn.reports.sentences import Group, spread_of
from sssi_exudyn.reports.verdict import beyond_limits
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary

_TURNS: Final[tuple[tuple[str, Group, str, float], ...]] = (
    ("duration of a turn (s)", "each", "duration_s", 1.0),
    ("mean speed (m/s)", "each", "mean_speed_mps", 1.0),
    ("mean turn radius of the centre of mass (m)", "each", "turn_radius_m", 1.0),
    ("angle between the skis (°)", "each", "ski_angle_mean_deg", 1.0),
    ("skid angle, mean (°)", "each", "steering_angle_mean_deg", 1.0),
    ("skid angle, peak (°)", "each", "steering_angle_peak_deg", 1.0),
    ("edge angle of the outside ski, peak (°)", "each", "edge_angle_outside_peak_deg", 1.0),
    ("inclination, peak (°)", "each", "inclination_peak_deg", 1.0),
    ("centre of mass inside both skis (% of the turn)", "each", "com_inside_both_share", 100.0),
    ("hip flexion of the outside leg, largest (°)", "each", "hip_flexion_outside_max_deg", 1.0),
    ("postural shift after the transition (s)", "each", "postural_shift_s", 1.0),
    ("postural shift after the transition (% of the turn)", "each", "postural_shift_percent", 1.0),
    ("load shift after the transition (s)", "each", "load_shift_s", 1.0),
    ("load shift after the transition (% of the turn)", "each", "load_shift_percent", 1.0),
    ("outside ski's share of the load, control phase (%)", "control", "outside_force_share", 100.0),
    ("load on both skis, control phase (body weights)", "control", "total_force_bodyweights", 1.0),
    ("whole force of the snow, control phase (body weights)", "control", "snow_force_bodyweights", 1.0),
)
"""Name of a row, its group and name in a summary's ``turns``, and the factor to its unit."""
PEAK_MOMENTS: Final = (
    ("hip flexion moment, peak (N m/kg)", "hip_flexion", "max"),
    ("hip extension moment, peak (N m/kg)", "hip_flexion", "min"),
    ("knee extension moment, peak (N m/kg)", "knee_angle", "min"),
)


def turns(runs: Runs) -> Section:
    """Show technique and forces, mean ± standard deviation over complete turns; peaks are the largest of all turns."""
    rows: list[Entry] = [
        ("turns (complete ones)", _counts),
        *((what, _of_turns(group, name, factor)) for what, group, name, factor in _TURNS),
        *((what, _peak(joint, end)) for what, joint, end in PEAK_MOMENTS),
        ("residual moment at the pelvis, peak (N m)", lambda s: number(s.residual_moment.peak_Nm)),
        ("its root mean square (N m)", lambda s: number(s.residual_moment.rms_Nm)),
        ("beyond OpenSim's limits (peak 75 N m, rms 50 N m)", lambda s: " and ".join(beyond_limits(s)) or "neither"),
    ]
    return table_section("The turns in figures", sheet(runs, rows), say_of_each(runs, _pace))


def _pace(run: StoredRun) -> str:
    """State the number of turns and their duration."""
    figures = run.summary.turns
    if figures.count is None:
        return "turns are not known"
    duration = spread_of(run.summary, "duration_s")
    lasting = "" if duration.mean is None else f" and take {duration.mean:.1f} s on average"
    return f"{figures.complete} of {figures.count} turns are complete{lasting}"


_EACH: Final = (
    ("start (s)", WHOLE, "start_s", "{:.1f}", 1.0),
    ("duration (s)", WHOLE, "duration_s", "{:.2f}", 1.0),
    ("speed (m/s)", WHOLE, "mean_speed_mps", "{:.1f}", 1.0),
    ("radius (m)", WHOLE, "turn_radius_m", "{:.1f}", 1.0),
    ("skid angle (°)", WHOLE, "steering_angle_mean_deg", "{:.0f}", 1.0),
    ("edge angle, peak (°)", WHOLE, "edge_angle_outside_peak_deg", "{:.0f}", 1.0),
    *((f"outside load, {phase} (%)", phase, "outside_force_share", "{:.0f}", 100.0) for phase in PHASES),
)
"""A column's headline, its phase, its name in the table of turns, its format, and the factor to its unit."""


def each_turn(runs: Runs) -> Section:
    """Show a row a turn.  Turns that the run's ends, a stop or a traverse cut off are in brackets."""
    rows = []
    for run in runs:
        before = f"{run.name}: " if len(runs) > 1 else ""
        for phases in _by_phase(run):
            whole_turn = phases[WHOLE]
            name = f"{before}{whole_turn['turn']}, {whole_turn['side']}"
            cells = [
                form.format(factor * phases[phase][column]) if phase in phases else "–"
                for _, phase, column, form, factor in _EACH
            ]
            rows.append([name if whole_turn["complete"] else f"({name})", *cells])
    head = ["", *(entry[0] for entry in _EACH)]
    return table_section("Turn by turn (cut off ones in brackets)", [head, *rows], say_of_each(runs, _range))


def _range(run: StoredRun) -> str:
    """State the shortest and the longest complete turn."""
    table = run.turn_table
    if table is None or not {"duration_s", "phase", "complete"} <= set(table.columns):
        return ""
    whole = table[(table["phase"] == WHOLE) & table["complete"]]["duration_s"]
    if len(whole) == 0:
        return "no turn is complete"
    return f"complete turns take {whole.min():.1f} to {whole.max():.1f} s"


def _by_phase(run: StoredRun) -> list[dict[str, dict[str, Any]]]:
    """Return for each turn its rows in the table of turns, by phase."""
    by_turn: dict[int, dict[str, dict[str, Any]]] = {}
    for row in [] if run.turn_table is None else run.turn_table.to_dict("records"):
        by_turn.setdefault(row["turn"], {})[row["phase"]] = {str(name): value for name, value in row.items()}
    return [phases for phases in by_turn.values() if WHOLE in phases]


def peak_moment(summary: Summary, joint: str, end: str) -> float | None:
    """Return the largest moment (N m/kg) over both legs and all complete turns; None where there is none.

    With ``min`` it is the largest moment in the opposite direction.
    """
    peaks = summary.turns.peak_moments or {}
    peaks_of_legs = [peaks.get(f"{joint}_{leg}_moment_{end}_Nm_per_kg") for leg in ("outside", "inside")]
    known = [value for value in peaks_of_legs if value is not None]
    if not known:
        return None
    return float(max(known) if end == "max" else -min(known))


def _counts(summary: Summary) -> str:
    turns = summary.turns
    return "–" if turns.count is None else f"{turns.count} ({turns.complete})"


def _of_turns(group: Group, name: str, factor: float) -> Callable[[Summary], str]:
    def text(summary: Summary) -> str:
        figure = spread_of(summary, name, group)
        if figure.mean is None:
            return "–"
        if figure.sd is None:
            return number(factor * figure.mean)
        # rounded, as skis that were set parallel are 0° apart and not 1e-7°
        return with_spread(round(factor * figure.mean, 3), round(factor * figure.sd, 3))

    return text


def _peak(joint: str, end: str) -> Callable[[Summary], str]:
    return lambda summary: number(peak_moment(summary, joint, end))
