"""Runs on snow that edges cut: the snow's numbers, what they come to as the paper's, and how the skis run."""

from __future__ import annotations

from sssi_exudyn.reports.section import Block, Grid, Runs, Section, Text, section_of_each
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
    "free": "what snow and air make of it",
}


def carving(runs: Runs) -> Section:
    """Facts of every run whose edges cut the snow."""
    return section_of_each("Edges that cut the snow", runs, _blocks)


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    found = run.summary.carving
    if found is None:
        return ()
    rows = (
        ("model", f"the {found.tier} one"),
        ("μ, friction along the edges", _with_error(found.mu)),
        ("H, hardness (N/m³)", _with_error(found.hardness_N_m3)),
        ("S_f, strength (Pa)", _with_error(found.strength_Pa)),
        ("friction along the edges against the load, as μ_t", number(found.equivalent_mu_t)),
        ("force of the grooves' walls against the load, as μ_n", number(found.equivalent_mu_n)),
        ("side reserve of the outer ski, mean", number(found.side_reserve_mean)),
        ("less for a twentieth of the run than", number(found.side_reserve_least)),
        ("yaw of the skis against the feet, rms (°)", number(found.ski_yaw_rms_deg)),
        ("roll of the skis against the feet, rms (°)", number(found.ski_roll_rms_deg)),
        ("heave of the skis against the feet, rms (m)", number(found.ski_heave_rms_m)),
        ("pitch of the skis against the feet, rms (°)", number(found.ski_pitch_rms_deg)),
        ("the skier's heading", _HEADINGS[found.heading]),
        ("heading against the captured one, rms (°)", number(found.heading_rms_deg)),
        ("moment left over about gravity, rms (N m)", number(found.yaw_residual_rms_Nm)),
        ("moment left over in roll, about the way, rms (N m)", number(found.roll_residual_rms_Nm)),
    )
    return Text(_ABOUT), Grid([["", "value"], *map(list, rows)])


def _with_error(found: Estimate) -> str:
    return number(found.value) if found.se is None else f"{number(found.value)} ± {number(found.se, 2)}"
