"""Losses of the runs, the lateral force that their turns needed, and what μ_n is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sssi_exudyn.analysis.biomechanics import WHOLE
from sssi_exudyn.analysis.losses import LossFigures
from sssi_exudyn.analysis.turns import PHASES
from sssi_exudyn.reports.section import Grid, Runs, Section, Text, say_of_each
from sssi_exudyn.reports.sections.tables import Entry, number, sheet
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary

MU_N: Final = (
    "μ_n is a skier's largest lateral load ratio, not a property of the snow. By the friction law of Gao et al., the"
    " force across a slipping ski is μ_n times its load, whatever the snow could bear."
)
"""What the coefficient across the ski means, said wherever it is printed."""
_ABOUT: Final = (
    "What the turns needed is the force across the path over the load. Effective friction is the energy that the snow"
    " took over the load times the path, skidding included. These compare between skiers."
    " Energy lost is that of the centre of mass for each kilogram and metre of drop: 9.81 where speed does not rise."
)


def losses(runs: Runs) -> Section:
    """Show what turns needed across the path, what snow and air took, and the energy lost on the way down."""
    rows: list[Entry] = [
        ("force across the path over the load, 90th percentile", _figure("lateral_ratio_p90", 1.0)),
        ("load with over 90 % of μ_n across the ski (%)", _figure("lateral_at_limit_share", 100.0)),
        ("effective friction, skidding included", _figure("effective_friction", 1.0)),
        ("the air's share of the losses (%)", _figure("air_share", 100.0)),
        *((f"energy lost, {phase} (J/kg a metre of drop)", _lost(phase)) for phase in (WHOLE, *PHASES)),
    ]
    if all(_of(run.summary) == LossFigures() for run in runs):  # a run that stopped at once, or of an older version
        return Section("", ())
    law = () if all(run.summary.carving is not None for run in runs) else (Text(MU_N),)
    return Section(
        "Losses, and the lateral force that turns need",
        (*law, Text(_ABOUT), Grid(sheet(runs, rows))),
        say_of_each(runs, _loss),
    )


def _loss(run: StoredRun) -> str:
    """State effective friction and the lateral force of nine tenths of the time."""
    figures, words = _of(run.summary), []
    if figures.effective_friction is not None:
        words.append(f"effective friction, skidding included, is {figures.effective_friction:.3f}")
    if figures.lateral_ratio_p90 is not None:
        words.append(f"turns need a lateral force of {figures.lateral_ratio_p90:.2f} of the load (90th percentile)")
    return " and ".join(words)


def _figure(name: str, factor: float) -> Callable[[Summary], str]:
    def text(summary: Summary) -> str:
        value: float | None = getattr(_of(summary), name)
        return number(None if value is None else factor * value)

    return text


def _lost(phase: str) -> Callable[[Summary], str]:
    return lambda summary: number((_of(summary).energy_lost_J_per_kg_m or {}).get(phase))


def _of(summary: Summary) -> LossFigures:
    return summary.losses or LossFigures()
