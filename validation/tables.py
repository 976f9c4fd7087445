"""The figures of one result, or of several side by side, as tables of a page: a row a figure, a column a recording."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from sssi_exudyn.validation.page import grid
from sssi_exudyn.validation.run import Run

Summary = Mapping[str, Any]
Entry = tuple[str, Callable[[Summary], str]]
"""What a row says, and its figure in a summary as text."""


def table_1(runs: Sequence[Run]) -> list[list[str]]:
    """The paper's Table 1, headline first: friction, the track's error, the slope's inclination, a row a recording."""
    head = ["", "μ_t", "μ_n", "percentage trajectory error", "piste inclination angle (°)"]
    return [head] + [
        [
            run.name,
            *(friction(run.summary, name) for name in ("mu_t", "mu_n")),
            number(run.summary["trajectory"]["percent_of_length"], 2, " %"),
            f"{np.degrees(run.model.inclination):.1f}",
        ]
        for run in runs
    ]


def friction(summary: Summary, name: str) -> str:
    """A friction coefficient, ± its standard error where it was fitted."""
    figure = summary["friction"].get(name) or {}
    value, se = figure.get("value"), figure.get("se")
    if value is None:
        return "–"
    return f"{value:.3f}" if se is None else f"{value:.3f} ± {number(se, 1)}"


def agreement(runs: Sequence[Run]) -> str:
    """How far simulation and instruments are apart."""
    return _sheet(
        runs,
        [
            ("mean distance of antenna and GPS fix (m)", lambda s: number(s["trajectory"]["mean_error_m"])),
            ("the largest (m)", lambda s: number(s["trajectory"].get("max_error_m"))),
            ("the mean over the path's length (%)", lambda s: number(s["trajectory"]["percent_of_length"])),
            ("length of the path (m)", lambda s: number(s["trajectory"]["length_m"], 4)),
            ("left foot's share of load, correlation", lambda s: number(s["pressure_ratio"]["correlation"])),
            ("its root mean squared difference", lambda s: number(s["pressure_ratio"]["rmsd"])),
        ],
    )  # fmt: skip


def energy(runs: Sequence[Run]) -> str:
    """What each term of the energy balance did from the start to the end of the run, and what the balance leaves."""
    columns = _union(run.series.columns for run in runs)
    terms = [name for name in columns if name.startswith("energy_") and name != "energy_closure_J"]

    def last(run: Run, column: str) -> str:
        return f"{run.series[column].iloc[-1]:.0f}" if column in run.series else "–"

    rows = [
        [f"{name.removeprefix('energy_').removesuffix('_J')} (J)", *(last(run, name) for run in runs)] for name in terms
    ]
    return _sheet(runs, [("largest gap (% of the turnover)", lambda s: number(s["energy"]["closure_percent"]))], rows)


def capture(runs: Sequence[Run]) -> str:
    """How far the skeleton's 28 angles are from what was captured, segment by segment; nothing where unknown."""
    known = [{row["segment"]: row for row in run.summary.get("capture", {}).get("round_trip", [])} for run in runs]

    def cell(row: Mapping[str, Any] | None) -> str:
        if row is None:
            return "–"
        return f"{row['filtered_rms_deg']:.2f}° ({row['filtered_max_deg']:.2f}°), {row['place_rms_mm']:.1f} mm"

    rows = [
        [segment.replace("_r", ", right").replace("_l", ", left"), *(cell(rows.get(segment)) for rows in known)]
        for segment in _union(known)
    ]
    if not rows:
        return ""
    return "<p>Root mean square (largest) of the difference in orientation, and the place of the joint.</p>\n" + _sheet(
        runs, [], rows
    )


def health(runs: Sequence[Run]) -> str:
    """What solver and fit say of themselves."""
    units = {"simulated_s": "simulated time (s)", "wall_s": "computing time (s)"}
    rows: list[Entry] = []
    for group in ("solver", "fit"):
        for name in _union(run.summary[group] for run in runs):
            if not any(isinstance(run.summary[group].get(name), Mapping | list) for run in runs):
                what = units.get(name, name.replace("_", " "))
                rows += [(f"{group}: {what}", _figure(group, name))]
    rows.append(("energy balance, largest gap (% of the turnover)", lambda s: number(s["energy"]["closure_percent"])))
    rows.append(("stopped early", lambda s: str(s.get("diverged") or "no")))
    return _sheet(runs, rows)


def provenance(runs: Sequence[Run]) -> str:
    """What was read, what read it, and what was asked for."""
    rows: list[Entry] = []
    for group, word in (("inputs", "input"), ("versions", "version of"), ("settings", "setting")):
        names = _union(run.summary["provenance"][group] for run in runs)
        rows += [(f"{word} {name}", _origin(group, name)) for name in names]
    rows.append(("seed", lambda s: number(s["provenance"]["seed"])))
    return _sheet(runs, rows, wrap=True)


def number(value: object, digits: int = 3, unit: str = "") -> str:
    """A figure with the digits that count; a dash where there is none."""
    match value:
        case None:
            return "–"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.{digits}g}{unit}"
        case _:
            return f"{value}{unit}"


def _figure(group: str, name: str) -> Callable[[Summary], str]:
    return lambda summary: number(summary[group].get(name))


def _origin(group: str, name: str) -> Callable[[Summary], str]:
    def told(summary: Summary) -> str:
        value = summary["provenance"][group].get(name)
        return "–" if value is None else value if isinstance(value, str) else json.dumps(value)

    return told


def _union(names: Iterable[Iterable[str]]) -> list[str]:
    """Every name once, in the order of their first coming."""
    return list(dict.fromkeys(name for each in names for name in each))


def _sheet(
    runs: Sequence[Run], entries: Sequence[Entry], further: Sequence[Sequence[str]] = (), wrap: bool = False
) -> str:
    rows = [[what, *(figure(run.summary) for run in runs)] for what, figure in entries]
    return grid(["", *(run.name for run in runs)], [*rows, *further], wrap=wrap)
