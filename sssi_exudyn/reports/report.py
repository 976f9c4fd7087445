"""The report of a result, or of several side by side: one page for whoever was there and whoever was not.

A sentence of result comes first, then the run itself in 3D, then what the paper shows of its runs in the paper's order
(Table 1, Figures 4 to 8), then what else is known, the solver's health and where it all comes from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from sssi_exudyn.bodies.skier.chain import geometry_to_dict
from sssi_exudyn.model.toml import model_to_dict
from sssi_exudyn.reports import tables
from sssi_exudyn.reports.curve_figures import figure_5, figure_7, figure_8
from sssi_exudyn.reports.html import Section, document, grid
from sssi_exudyn.reports.linked_turns import cycle_of
from sssi_exudyn.reports.panels import Plot, panels_html
from sssi_exudyn.reports.pdf import pdf_bytes
from sssi_exudyn.reports.replay import packed, player, scene_of
from sssi_exudyn.reports.sentences import in_words
from sssi_exudyn.reports.track_figures import figure_4, figure_6
from sssi_exudyn.reports.turn_tables import each_turn, turns
from sssi_exudyn.results.folder import write_result
from sssi_exudyn.results.stored import Run


def render(runs: Sequence[Run], sections: Sequence[Section] = ()) -> str:
    """The page as HTML text; ``sections`` stand before all others."""
    lead = "".join(f'<p class="result">{escape(sentence)}</p>\n' for sentence in in_words(runs))
    first, *others = _sheets(runs)
    return document(
        _title(runs),
        lead,
        [
            *sections,
            Section("The run", _replays(runs)),
            Section(first[0], grid(first[1])),
            *(Section(plot.title, panels_html(plot, f"figure-{index}")) for index, plot in enumerate(_plots(runs))),
            *(Section(title, grid(rows)) for title, rows in others if len(rows) > 1),
        ],
    )


def render_pdf(runs: Sequence[Run]) -> bytes:
    """The same as a document to print, without what moves."""
    return pdf_bytes(_title(runs), in_words(runs), _sheets(runs), _plots(runs))


def write_run(
    folder: Path,
    run: Run,
    *,
    diagnosis: Mapping[str, Any] | None = None,
    opensim: Mapping[str, str] | None = None,
    sections: Sequence[Section] = (),
) -> None:
    """Write a whole result folder with its page; arguments as for ``write_result`` and ``render``.

    Raises InputError where it cannot be written.
    """
    write_result(
        folder,
        run.summary,
        run.series,
        model_to_dict(run.model),
        measured=run.measured,
        skeleton=None if run.geometry is None else geometry_to_dict(run.geometry),
        diagnosis=diagnosis,
        report=render([run], sections),
        turns=run.turn_table,
        opensim=opensim,
    )


def _title(runs: Sequence[Run]) -> str:
    *names, last = [run.name for run in runs]
    return f"{', '.join(names)} and {last}: skier, ski and snow" if names else f"{last}: skier, ski and snow"


def _sheets(runs: Sequence[Run]) -> list[tuple[str, tables.Table]]:
    """Every table with its title, the paper's first."""
    return [
        ("Table 1: friction and error of the track", tables.table_1(runs)),
        ("The turns in figures", turns(runs)),
        ("Turn by turn (cut off ones in brackets)", each_turn(runs)),
        ("Simulation against instruments", tables.agreement(runs)),
        ("Energy from start to end", tables.energy(runs)),
        ("Skeleton against capture: orientation, rms (largest), and place of the joint", tables.capture(runs)),
        ("What to know of the recording", tables.notices(runs)),
        ("Health of the solver", tables.health(runs)),
        ("Where this comes from", tables.provenance(runs)),
    ]


def _plots(runs: Sequence[Run]) -> list[Plot]:
    """Figures 4 to 8, without those that nothing is known for."""
    cycles = [cycle_of(run.time, run.turns) for run in runs]
    drawn = [figure_4(runs), *(figure(runs, cycles) for figure in (figure_5, figure_6, figure_7, figure_8))]
    return [plot for plot in drawn if plot.panels]


def _replays(runs: Sequence[Run]) -> str:
    players = [
        player(packed(scene_of(run.series, run.geometry, run.model), run.name, run.model))
        for run in runs
        if run.geometry is not None and len(run.time) > 1
    ]
    return f'<div class="beside">\n{"".join(players)}</div>\n' if players else ""
