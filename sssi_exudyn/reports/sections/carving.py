"""Runs on snow that edges cut: the snow's numbers, their equivalents in the paper's law, and the skis' movement."""

from __future__ import annotations

from sssi_exudyn.reports.section import Block, Grid, Runs, Section, Text, say_of_each, section_of_each
from sssi_exudyn.reports.sections.tables import number
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate

_ABOUT = (
    "Each point of an edge presses into the snow, is held by the groove's wall until that yields, and slides along its"
    " own tangent. The skis yaw, roll, heave and pitch against the feet."
)
_HEADINGS = {
    "replay": "the captured one",
    "track": "held to the captured one by a spring and a damper",
    "free": "free, moved by snow and air",
}


def carving(runs: Runs) -> Section:
    """Show facts of every run whose edges cut the snow."""
    return section_of_each("Edges that cut the snow", runs, _blocks, say_of_each(runs, _reserve))


def _reserve(run: StoredRun) -> str:
    """State how much of the wall's strength is left."""
    figures = run.summary.carving
    if figures is None:
        return ""
    if figures.side_reserve_mean is None:
        return "edges cut the snow"
    return f"on average {100.0 * figures.side_reserve_mean:.0f}\u00a0% of the groove wall's strength is not used"


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    figures = run.summary.carving
    if figures is None:
        return ()
    rows = (
        ("model", f"the {figures.tier} one"),
        ("μ, friction along the edges", _with_error(figures.mu)),
        ("H, hardness (N/m³)", _with_error(figures.hardness_N_m3)),
        ("S_f, strength (Pa)", _with_error(figures.strength_Pa)),
        ("friction along the edges against the load, as μ_t", number(figures.equivalent_mu_t)),
        ("force of the grooves' walls against the load, as μ_n (lateral load ratio)", number(figures.equivalent_mu_n)),
        ("side reserve of the outside ski, mean", number(figures.side_reserve_mean)),
        ("less for a twentieth of the run than", number(figures.side_reserve_least)),
        ("yaw of the skis against the feet, rms (°)", number(figures.ski_yaw_rms_deg)),
        ("roll of the skis against the feet, rms (°)", number(figures.ski_roll_rms_deg)),
        ("heave of the skis against the feet, rms (m)", number(figures.ski_heave_rms_m)),
        ("pitch of the skis against the feet, rms (°)", number(figures.ski_pitch_rms_deg)),
        ("the skier's heading", _HEADINGS[figures.heading]),
        ("heading against the captured one, rms (°)", number(figures.heading_rms_deg)),
        ("residual moment about gravity, rms (N m)", number(figures.yaw_residual_rms_Nm)),
        ("residual moment in roll, about the direction of travel, rms (N m)", number(figures.roll_residual_rms_Nm)),
    )
    return Text(_ABOUT), Grid([["", "value"], *map(list, rows)])


def _with_error(estimate: Estimate) -> str:
    return number(estimate.value) if estimate.se is None else f"{number(estimate.value)} ± {number(estimate.se, 2)}"
