"""The boots of a run: their places on the skis, and their cuffs' part in the ankles' moments."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes

from sssi_exudyn.analysis.boots import AnkleFigures, BootFigures, cuff_column
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.section import Block, Drawing, Grid, Runs, Section, Text, say_of_each, section_of_each
from sssi_exudyn.reports.sections.tables import number
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.simulation.result import SIDES

_ABOUT = (
    "Cuff and muscles together make the ankle's moment; up (dorsiflexion) is positive. Where the"
    " recording states no cuff, its stiffness is estimated with a prior from usual boots so that the muscles' part is"
    " least. That part is therefore a lower bound."
)


def boots(runs: Runs) -> Section:
    """Show facts of every run's boots."""
    return section_of_each("Boots", runs, _blocks, say_of_each(runs, _shares))


def _shares(run: StoredRun) -> str:
    """State the largest moments of the ankles and of their cuffs, which need not act at the same time."""
    figures = run.summary.boots
    if figures is None or figures.ankles is None:
        return ""
    largest = [
        f"{number(ankle.moment_peak_Nm)} N m on the {side} (its cuff {number(ankle.cuff_peak_Nm)} N m)"
        for side in SIDES
        if (ankle := figures.ankles.get(side)) is not None
    ]
    return f"the ankle's moment reaches {' and '.join(largest)}"


def _blocks(run: StoredRun) -> tuple[Block, ...]:
    figures = run.summary.boots
    if figures is None or figures.ankles is None:
        return ()
    rows = [
        (name, *(number(getattr(figures.ankles.get(side, AnkleFigures()), key)) for side in SIDES))
        for name, key in (
            ("neutral angle of the cuff, as captured (°)", "lean_deg"),
            ("ankle's moment, rms (N m)", "moment_rms_Nm"),
            ("ankle's moment, largest (N m)", "moment_peak_Nm"),
            ("the cuff's part, rms (N m)", "cuff_rms_Nm"),
            ("the cuff's part, largest (N m)", "cuff_peak_Nm"),
            ("the muscles' part, rms (N m)", "muscles_rms_Nm"),
            ("the cuff's moment in edging, rms (N m)", "edging_rms_Nm"),
            ("the cuff's moment in edging, largest (N m)", "edging_peak_Nm"),
            ("deflection of boot and ankle in edging, rms (°)", "edging_give_rms_deg"),
        )
    ]
    blocks: tuple[Block, ...] = (Text(_sentence(figures)), Text(_ABOUT), Grid([["", *SIDES], *map(list, rows)]))
    if not {name for side in SIDES for name in _columns(side)} <= set(run.series.columns):
        return blocks
    return (*blocks, Drawing("Moments of the ankles and their cuffs", lambda axes: _draw(axes, run.series), 3.0))


def _columns(side: str) -> tuple[str, str]:
    """Return the columns of the ankle's moment and of its cuff's."""
    return f"ankle_angle_{side[0]}_moment_Nm", cuff_column(side, "flexion")


def _draw(axes: Axes, series: pd.DataFrame) -> None:
    for side, colour in zip(SIDES, COLOURS, strict=False):
        ankle, cuff = _columns(side)
        axes.plot(series["time_s"], series[ankle], color=colour, label=f"{side} ankle")
        axes.plot(series["time_s"], series[cuff], "--", color=colour, label=f"{side} cuff")
    axes.set(xlabel="time (s)", ylabel="moment, up positive (N m)")


def _sentence(figures: BootFigures) -> str:
    place = f"The ski's mark is {100.0 * (figures.centre_m or 0.0):.1f} cm ahead of the ankle"
    if figures.ramp_angle_deg:
        place += f", on a ramp of {figures.ramp_angle_deg:.1f}°"
    stiffness = f"{number(figures.flexion_Nm_per_deg)} N m/° in flexion"
    if figures.flexion_se_Nm_per_deg is None:
        stiffness += ", as stated"
    else:
        stiffness += f" (± {number(figures.flexion_se_Nm_per_deg, 2)}, estimated from the run)"
    return f"{place}. The cuffs' stiffness is {stiffness}, and {number(figures.edging_Nm_per_deg)} N m/° in edging."
