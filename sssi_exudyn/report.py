"""The report of a result, or of several side by side: one page for whoever was there and whoever was not.

A sentence of result comes first, then the run itself in 3D, then what the paper shows of its runs in the paper's order
(Table 1, Figures 4 to 8), then what else is known, the solver's health and where it all comes from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from sssi_exudyn.chain import geometry_to_dict
from sssi_exudyn.model import model_to_dict
from sssi_exudyn.result_folder import write_result
from sssi_exudyn.validation import tables
from sssi_exudyn.validation.page import Section, document, grid
from sssi_exudyn.validation.replay import packed, player, scene_of
from sssi_exudyn.validation.run import Run
from sssi_exudyn.validation.sentences import in_words


def render(runs: Sequence[Run], sections: Sequence[Section] = ()) -> str:
    """The page as HTML text; ``sections`` stand before all others."""
    names = " and ".join(run.name for run in runs) if len(runs) < 3 else ", ".join(run.name for run in runs)
    lead = "".join(f'<p class="result">{escape(sentence)}</p>\n' for sentence in in_words(runs))
    first, *rows = tables.table_1(runs)
    return document(
        f"{names}: skier, ski and snow",
        lead,
        [
            *sections,
            Section("The run", _replays(runs)),
            Section("Friction and agreement", grid(first, rows)),
            Section("Simulation against instruments", tables.agreement(runs)),
            Section("Energy", tables.energy(runs)),
            Section("Skeleton against capture", tables.capture(runs)),
            Section("Health of the solver", tables.health(runs)),
            Section("Where this comes from", tables.provenance(runs)),
        ],
    )


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


def _replays(runs: Sequence[Run]) -> str:
    players = [
        player(packed(scene_of(run.series, run.geometry, run.model), run.name, run.model))
        for run in runs
        if run.geometry is not None and len(run.time) > 1
    ]
    return f'<div class="beside">\n{"".join(players)}</div>\n' if players else ""
