"""A sweep on one page: the runs' outcomes, the effect of each parameter, and response curves of the figures."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Final

import pandas as pd

from sssi_exudyn.reports.html import document, figure, grid, table
from sssi_exudyn.reports.section import Markup, Section
from sssi_exudyn.sweeps.design import Axis
from sssi_exudyn.sweeps.plan import Plan
from sssi_exudyn.sweeps.plots import bars_svg, heat_svg, response_svg
from sssi_exudyn.sweeps.records import DONE, STATUSES
from sssi_exudyn.sweeps.sensitivity_indices import MEANINGS, TOTAL, rank_parameters

PAGE: Final = "summary.html"
_MOST_PARAMETERS: Final = 4
"""Greatest number of parameters with a curve for each output; weaker ones are in the bars and in the table."""
_MOST_ERRORS: Final = 10
_BARS: Final = {"ST": ("ST", "S1"), "mu_star": ("mu_star", "sigma"), "share": ("share",)}
_WORDS: Final = {
    "ST": "alone and with others (ST)",
    "S1": "alone (S1)",
    "mu_star": "mean size of the effect (μ*)",
    "sigma": "its spread (σ)",
    "share": "share of the variance",
}


def render_sweep(plan: Plan, runs: pd.DataFrame, indices: pd.DataFrame, versions: Mapping[str, str]) -> str:
    """Return the page as text.

    Parameters
    ----------
    runs : the sweep's table;  indices : result of ``indices_of``
    versions : versions of the program and its packages in the runs
    """
    done = runs[runs["status"] == DONE]
    varied = [axis for axis in plan.axes if len(set(done[axis.name])) > 1]
    sections = []
    for number, output in enumerate(plan.outputs):
        known = done[done[output].notna()]
        if len(known):
            html = _about(plan, known, indices, varied, output, number)
            sections.append(Section(output, (Markup(html),), _strongest(known, indices, varied, output), opened=True))
    outcome = f"{len(done)} of {len(runs)} runs are complete."
    sections.append(Section("Runs", (Markup(_outcomes(plan, runs)),), outcome, opened=len(done) < len(runs)))
    design = f"The design is {plan.file.design.kind.replace('_', ' ')}, with {len(plan.points)} points a recording."
    sections.append(Section("Origin of this sweep", (Markup(_origin(plan, versions)),), design))
    return document(plan.file.name, _lead(plan, runs), sections)


def _strongest(runs: pd.DataFrame, indices: pd.DataFrame, varied: list[Axis], output: str) -> str:
    """Name the range of an output, and the parameter that matters most for it."""
    span = f"It goes from {runs[output].min():.3g} to {runs[output].max():.3g}"
    ranked = rank_parameters(indices, str(runs["recording"].iloc[0]), output, varied)
    return f"{span}; {ranked[0].name} matters most." if ranked else f"{span}."


def _lead(plan: Plan, runs: pd.DataFrame) -> str:
    names = ", ".join(f"<code>{escape(axis.name)}</code>" for axis in plan.axes) or "only the recording"
    tier = f" with the {plan.job.tier} model"
    what = {
        "fit": f"fits{tier}",
        "simulate": f"simulations{tier}",
        "turn": "steady turns of skis",
        "whatif": f"what-ifs, keeping the {plan.job.keep}",
    }[plan.job.task]
    done = int((runs["status"] == DONE).sum())
    return f"<p>{len(runs)} {what}, {done} of them complete. The sweep varies {names}.</p>\n"


def _outcomes(plan: Plan, runs: pd.DataFrame) -> str:
    counts = runs.groupby(["recording", "status"]).size()
    rows = [
        [folder.name, *(str(counts.get((folder.name, status), 0)) for status in STATUSES)]
        for folder in plan.file.folders
    ]
    errors = runs.loc[runs["status"] != DONE, "error"].value_counts().head(_MOST_ERRORS)
    errors_of = [(str(error)[:200], str(count), "") for error, count in errors.items()]
    return grid([["", *STATUSES], *rows]) + table("Errors", errors_of)


def _about(plan: Plan, runs: pd.DataFrame, indices: pd.DataFrame, varied: list[Axis], output: str, number: int) -> str:
    """Show one output: bars for each recording, curves of the strongest parameters, the two strongest together."""
    unit, meaning = next((column.unit, column.meaning) for column in plan.columns if column.name == output)
    shown = [f'<p class="soft">{escape(meaning[:1].upper() + meaning[1:])}.</p>\n']
    for place, recording in enumerate(runs["recording"].unique()):
        about = indices[(indices["recording"] == recording) & (indices["output"] == output)]
        kind = next((kind for kind in TOTAL if kind in set(about["index"])), None)
        if kind is not None:
            bars = bars_svg(f"bars-{number}-{place}", about, _BARS[kind], tuple(_WORDS[index] for index in _BARS[kind]))
            shown.append(figure(bars, f"{output}, {recording}: {MEANINGS[kind]}"))
    first = str(runs["recording"].iloc[0])
    strongest = rank_parameters(indices, first, output, varied)[:_MOST_PARAMETERS]
    for place, axis in enumerate(strongest):
        curve = response_svg(f"response-{number}-{place}", runs, axis, output, unit)
        shown.append(figure(curve, f"{output} against {axis.name}: runs, and means over all other parameters"))
    if len(strongest) > 1:
        across, up = strongest[:2]
        heat = heat_svg(f"heat-{number}", runs[runs["recording"] == first], across, up, output, unit)
        shown.append(figure(heat, f"{output} by {across.name} and {up.name}, {first}: means of runs"))
    return "".join(shown)


def _origin(plan: Plan, origin_versions: Mapping[str, str]) -> str:
    rows = [[axis.name, axis.parameter.unit, _range(axis), axis.parameter.meaning] for axis in plan.axes]
    design = plan.file.design
    settings = [("design", design.kind.replace("_", " "), f"{len(plan.points)} points for each recording")]
    if design.size:
        settings += [("size", str(design.size), ""), ("seed", str(design.seed), "")]
    versions = [(name, version, "") for name, version in origin_versions.items()]
    files = [[name, digest] for name, digest in plan.files.items()]
    return (
        table("Design", settings)
        + grid([["parameter", "unit", "values", "meaning"], *rows])
        + table("Versions", versions)
        + grid([["file", "hash"], *files])
    )


def _range(axis: Axis) -> str:
    words = [f"{value:.4g}" if isinstance(value, float) else value for value in axis.levels]
    return ", ".join(words) if len(words) <= 5 else f"{words[0]}, {words[1]} … {words[-1]}"
