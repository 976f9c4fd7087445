"""The report of a result, or of several side by side, made from the contents of their folders.

The answer comes first (``first_screen``), then the result's basis.  The paper's tables and figures follow in its order
(Table 1, Figures 4 to 8), then further results, the solver's health and the provenance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from sssi_exudyn.bodies.skier.chain import geometry_to_dict
from sssi_exudyn.model.toml import model_files, model_to_dict
from sssi_exudyn.reports.first_screen import answer_blocks, first_screen
from sssi_exudyn.reports.html import document
from sssi_exudyn.reports.section import Runs, Section
from sssi_exudyn.reports.sections import (
    boots,
    carving,
    diagnosis,
    few_sensors,
    limits,
    losses,
    muscles,
    replay,
    tables,
    terms,
    turn_tables,
)
from sssi_exudyn.reports.sections.curve_figures import figure_5, figure_7, figure_8
from sssi_exudyn.reports.sections.overlay import overlay
from sssi_exudyn.reports.sections.snow_surface import snow_surface
from sssi_exudyn.reports.sections.track_figures import figure_4, figure_6
from sssi_exudyn.reports.sections.uncertainty import uncertainty
from sssi_exudyn.reports.sentences import sentences
from sssi_exudyn.results.folder import ResultContent, write_result
from sssi_exudyn.results.stored import StoredRun, read_run

ASSUMED: Final = "This rests on a posture that was assumed: few sensors measured the skier."


def of_posture(section: Callable[[Runs], Section]) -> Callable[[Runs], Section]:
    """Return a section that is marked as assumed where a run's posture was not measured."""

    def marked(runs: Runs) -> Section:
        few = any(run.summary.posture is not None for run in runs)
        return replace(section(runs), assumed=ASSUMED if few else "")

    return marked


def of_capture(section: Callable[[Runs], Section]) -> Callable[[Runs], Section]:
    """Return a section about the runs whose posture was captured: curves of an assumed one would look measured."""

    def captured(runs: Runs) -> Section:
        known = [run for run in runs if run.summary.posture is None]
        return section(known) if known else Section("", ())

    return captured


SECTIONS: Final[tuple[Callable[[Runs], Section], ...]] = (
    limits.limits,
    diagnosis.diagnosis,
    few_sensors.few_sensors,
    replay.the_runs,
    overlay,
    tables.table_1,
    carving.carving,
    uncertainty,
    figure_4,
    of_capture(figure_5),
    of_posture(figure_6),
    snow_surface,
    of_capture(figure_7),
    of_capture(figure_8),
    of_posture(turn_tables.turns),
    of_posture(turn_tables.each_turn),
    losses.losses,
    of_posture(boots.boots),
    of_posture(muscles.muscles),
    tables.agreement,
    tables.energy,
    terms.terms,
    tables.capture,
    tables.notices,
    tables.health,
    tables.provenance,
)
"""Every section, in the report's order; empty ones are left out."""


def render(runs: Runs) -> str:
    """Return the report as a page of HTML."""
    return document(_title(runs), first_screen(runs), [section(runs) for section in SECTIONS])


def render_pdf(runs: Runs) -> bytes:
    """Return the report as a document to print, without the replay."""
    from sssi_exudyn.reports.pdf import pdf_bytes  # here: the fonts take half a second to load

    answer = Section("The answer", answer_blocks(runs))
    return pdf_bytes(_title(runs), sentences(runs), [answer, *(section(runs) for section in SECTIONS)])


def render_folder(folder: Path) -> str:
    """Return the page of the result in a folder.  Raises InputError where there is none or it cannot be read."""
    return render([read_run(folder)])


def write_run(folder: Path, run: StoredRun, opensim: Mapping[str, str] | None = None) -> None:
    """Write a whole result folder with its report; ``opensim`` holds the texts of its files by name.

    Raises InputError where it cannot be written.
    """
    content = ResultContent(
        summary=run.summary,
        series=run.series,
        model=model_to_dict(run.model),
        model_files=model_files(run.model),
        measured=run.measured,
        skeleton=None if run.geometry is None else geometry_to_dict(run.geometry),
        diagnosis=run.diagnosis,
        turns=run.turn_table,
        second_half=run.second_half,
        draws=run.draws,
        opensim=opensim or {},
    )
    write_result(folder, content, render_folder)


def _title(runs: Runs) -> str:
    *names, last = [run.name for run in runs]
    return f"{', '.join(names)} and {last}: skier, ski and snow" if names else f"{last}: skier, ski and snow"
