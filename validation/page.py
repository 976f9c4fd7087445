"""A result as one page: plain HTML that holds its own plots and asks nothing of a network."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sssi_exudyn.gps import Gps
from sssi_exudyn.insoles import Insoles
from sssi_exudyn.result_folder import complete_summary, write_atomically
from sssi_exudyn.validation import plots
from sssi_exudyn.validation.metrics import pressure_ratio

_STYLE = """
:root { color-scheme: light dark; --ink: #1c2126; --soft: #5b6670; --rule: #d5dade; --paper: #ffffff; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e8eb; --soft: #9aa5ae; --rule: #3a4249; --paper: #15191d; }
}
body { margin: 2rem auto; padding: 0 1rem; max-width: 50rem; color: var(--ink); background: var(--paper);
  font: 1rem/1.5 system-ui, sans-serif; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
p.soft, figcaption, td.soft { color: var(--soft); }
table { border-collapse: collapse; width: 100%; }
th, td { padding: .3rem .6rem .3rem 0; border-bottom: 1px solid var(--rule); text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.soft { overflow-wrap: anywhere; }
figure { margin: 1rem 0; } svg { width: 100%; height: auto; }
"""

Row = tuple[str, str, str]
"""What it is, its value, what it means."""


def write_page(
    summary: Mapping[str, Any], series: pd.DataFrame, gps: Gps | None, insoles: Insoles | None, path: Path
) -> None:
    """Write the page of a result; arguments as for ``render_page``.  Raises InputError where it cannot be written."""
    write_atomically(path, render_page(summary, series, gps, insoles))


def render_page(
    summary: Mapping[str, Any],
    series: pd.DataFrame,
    gps: Gps | None,
    insoles: Insoles | None,
    sections: Sequence[str] = (),
) -> str:
    """The page as text.

    Parameters
    ----------
    summary : figures by group, as in ``summary.json``; those that are missing or null are shown as a dash
    series : the time series, as in ``series.parquet``
    gps, insoles : what was measured, where it was
    sections : HTML that stands before all else
    """
    whole = complete_summary(summary)
    sections = [
        *sections,
        table("Friction between ski and snow", _friction_rows(whole["friction"])),
        table("Agreement with what was measured", _agreement_rows(whole)),
        _trajectory_plots(series, gps),
        _load_plots(series, insoles),
        table("Energy", _energy_rows(whole["energy"], series)),
        table("Skeleton against capture", _capture_rows(whole)),
        table("Solver and fit", _health_rows(whole)),
        table("Where this result comes from", _provenance_rows(whole["provenance"])),
    ]
    name = escape(str(whole["recording"] or "a recording"))
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        f"<title>{name}: skier, ski and snow</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{name}</h1>\n{_abstract(whole)}\n{''.join(sections)}</body>\n</html>\n"
    )


def _abstract(summary: Mapping[str, Any]) -> str:
    error, percent = summary["trajectory"]["mean_error_m"], summary["trajectory"]["percent_of_length"]
    if error is None:
        return '<p class="soft">The run was simulated; there is no GPS track to hold it against.</p>'
    correlation = summary["pressure_ratio"]["correlation"]
    words = f"The simulated track misses the GPS by {error:.3f} m on average, {percent:.2f} % of its length"
    if correlation is not None:
        words += f"; the load's shift between the feet correlates {correlation:.3f} with the insoles"
    return f"<p>{words}.</p>"


def _friction_rows(friction: Mapping[str, Any]) -> list[Row]:
    meanings = {"mu_t": "along the ski", "mu_n": "across the ski"}
    rows = []
    for name, figure in friction.items():
        value, se = (figure or {}).get("value"), (figure or {}).get("se")
        shown = _number(value, 4) if se is None else f"{_number(value, 4)} ± {_number(se, 1)}"
        rows.append((name, shown, meanings.get(name, "") + (" (± standard error)" if se is not None else "")))
    return rows


def _agreement_rows(summary: Mapping[str, Any]) -> list[Row]:
    trajectory, ratio = summary["trajectory"], summary["pressure_ratio"]
    return [
        ("mean trajectory error (m)", _number(trajectory["mean_error_m"]), "antenna to GPS fix"),
        ("share of the path (%)", _number(trajectory["percent_of_length"]), "mean error over the path's length"),
        ("path length (m)", _number(trajectory["length_m"], 4), ""),
        ("pressure ratio, correlation", _number(ratio["correlation"]), "left over both feet, with the insoles"),
        ("pressure ratio, RMSD", _number(ratio["rmsd"]), "root mean squared difference"),
    ]


def _energy_rows(energy: Mapping[str, Any], series: pd.DataFrame) -> list[Row]:
    rows = [
        ("closure (%)", _number(energy["closure_percent"]), "largest gap of the balance, of the energy turned over")
    ]
    for column in series.columns:
        if column.startswith("energy_") and column != "energy_closure_J":
            term = column.removeprefix("energy_").removesuffix("_J")
            rows.append((f"{term} (J)", f"{series[column].iloc[-1]:.1f}", "from the start to the end of the run"))
    return rows


def _capture_rows(summary: Mapping[str, Any]) -> list[Row]:
    """How far the skeleton's 28 angles are from what was captured, segment by segment."""
    return [
        (
            str(row["segment"]).replace("_r", ", right").replace("_l", ", left"),
            f"{row['filtered_rms_deg']:.2f}° ({row['filtered_max_deg']:.2f}°)",
            f"{row['joint']}: orientation, root mean square (largest); its place {row['place_rms_mm']:.1f} mm "
            f"({row['place_max_mm']:.1f} mm)",
        )
        for row in summary.get("capture", {}).get("round_trip", [])
    ]


def _health_rows(summary: Mapping[str, Any]) -> list[Row]:
    units = {"simulated_s": "simulated time (s)", "wall_s": "computing time (s)"}
    rows = []
    for group in ("solver", "fit"):
        for name, value in summary[group].items():
            if not isinstance(value, Mapping | list):
                rows.append((f"{group}: {units.get(name, name.replace('_', ' '))}", _number(value), ""))
    return rows


def _provenance_rows(provenance: Mapping[str, Any]) -> list[Row]:
    rows = [(f"input {name}", "", str(digest)) for name, digest in provenance["inputs"].items()]
    rows += [(f"version of {name}", str(version), "") for name, version in provenance["versions"].items()]
    rows += [(f"setting {name}", "", json.dumps(value)) for name, value in provenance["settings"].items()]
    return [*rows, ("seed", _number(provenance["seed"]), "")]


def _trajectory_plots(series: pd.DataFrame, gps: Gps | None) -> str:
    antenna = plots.antenna_of(series)
    if not np.all(np.isfinite(antenna)):
        return ""
    fixes = None
    if gps is not None:
        run = (gps.time >= series["time_s"].iloc[0]) & (gps.time <= series["time_s"].iloc[-1])
        fixes = gps.enu[run]
    shown = figure(
        plots.trajectory_svg(antenna, fixes),
        "Track seen from above: simulated antenna" + (" and GPS fixes" if fixes is not None else ""),
    )
    if gps is not None and fixes is not None and len(fixes):
        error = plots.distances(series, gps.time[run], fixes)
        svg = plots.error_svg(gps.time[run], error, gps.sigma[run])
        shown += figure(svg, f"Distance between simulated antenna and GPS over time, at most {np.max(error):.3f} m")
    return shown


def _load_plots(series: pd.DataFrame, insoles: Insoles | None) -> str:
    time, left, right = (series[name].to_numpy(dtype=float) for name in ("time_s", "left_load_N", "right_load_N"))
    measured_time = measured = None
    if insoles is not None:
        run = (insoles.time >= time[0]) & (insoles.time <= time[-1])
        measured_time = insoles.time[run]
        measured = plots.filtered_ratio(insoles.time, insoles.left, insoles.right)[run]
    soles = (series[f"{side}_sole_N"].to_numpy(dtype=float) for side in ("left", "right"))
    caption = "Left foot's share of what presses on the soles: simulated" + (
        " and insoles" if insoles is not None else ""
    )
    return figure(plots.load_svg(time, left, right), "Normal force of the snow on each ski over time") + figure(
        plots.ratio_svg(time, pressure_ratio(*soles), measured_time, measured), caption
    )


def table(title: str, rows: list[Row]) -> str:
    """A table under its headline; nothing where there is no row."""
    if not rows:
        return ""
    body = "".join(
        f'<tr><th scope="row">{escape(what)}</th><td class="number">{escape(value)}</td>'
        f'<td class="soft">{escape(meaning)}</td></tr>\n'
        for what, value, meaning in rows
    )
    return f"<h2>{escape(title)}</h2>\n<table>\n{body}</table>\n"


def figure(svg: str, caption: str) -> str:
    """A plot with its caption, which is its text for whoever does not see it too."""
    labelled = svg.replace("<svg ", f'<svg role="img" aria-label="{escape(caption)}" ', 1)
    return f"<figure>\n{labelled}\n<figcaption>{escape(caption)}.</figcaption>\n</figure>\n"


def _number(value: object, digits: int = 3) -> str:
    match value:
        case None:
            return "–"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.{digits}g}"
        case _:
            return str(value)
