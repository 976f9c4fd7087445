"""The figures of one result, or of several side by side, as tables: a row a figure, a column a recording.

A table is a list of rows of text, the headline first.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from sssi_exudyn.results.stored import Run

Summary = Mapping[str, Any]
Entry = tuple[str, Callable[[Summary], str]]
"""What a row says, and its figure in a summary as text."""
Table = list[list[str]]


def table_1(runs: Sequence[Run]) -> Table:
    """The paper's Table 1: friction, the track's error and the slope's inclination, a row a recording."""
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
    return f"{value:.3f}" if se is None else with_spread(value, se)


def agreement(runs: Sequence[Run]) -> Table:
    """How far simulation and instruments are apart."""
    return sheet(
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


def energy(runs: Sequence[Run]) -> Table:
    """What each term of the energy balance did from the start to the end of the run, and what the balance leaves."""
    columns = _union(run.series.columns for run in runs)
    terms = [name for name in columns if name.startswith("energy_") and name != "energy_closure_J"]

    def last(run: Run, column: str) -> str:
        return str(round(run.series[column].iloc[-1])) if column in run.series else "–"

    rows = [
        [f"{name.removeprefix('energy_').removesuffix('_J')} (J)", *(last(run, name) for run in runs)] for name in terms
    ]
    return sheet(runs, [("largest gap (% of the turnover)", lambda s: number(s["energy"]["closure_percent"]))], rows)


def capture(runs: Sequence[Run]) -> Table:
    """How far the skeleton's 28 angles are from what was captured, segment by segment: the difference in orientation,
    root mean square (largest), and in the place of the joint.  Only a headline where that is not known.
    """
    known = [{row["segment"]: row for row in run.summary.get("capture", {}).get("round_trip", [])} for run in runs]

    def cell(row: Mapping[str, Any] | None) -> str:
        if row is None:
            return "–"
        return f"{row['filtered_rms_deg']:.2f}° ({row['filtered_max_deg']:.2f}°), {row['place_rms_mm']:.1f} mm"

    rows = [
        [segment.replace("_r", ", right").replace("_l", ", left"), *(cell(rows.get(segment)) for rows in known)]
        for segment in _union(known)
    ]
    return sheet(runs, [], rows)


def notices(runs: Sequence[Run]) -> Table:
    """What the reader should know of a recording, such as what had to be estimated: a row a notice."""
    return [["", "notice"], *([run.name, str(notice)] for run in runs for notice in run.summary.get("notices") or ())]


def health(runs: Sequence[Run]) -> Table:
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
    return sheet(runs, rows)


def provenance(runs: Sequence[Run]) -> Table:
    """What was read, what read it, and what was asked for."""
    rows: list[Entry] = []
    for group, word in (("inputs", "input"), ("versions", "version of"), ("settings", "setting")):
        names = _union(run.summary["provenance"][group] for run in runs)
        rows += [(f"{word} {name}", _origin(group, name)) for name in names]
    rows.append(("seed", lambda s: number(s["provenance"]["seed"])))
    return sheet(runs, rows)


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


def with_spread(value: float, spread: float) -> str:
    """``value ± spread``, both to the spread's first digit that counts."""
    if not spread > 0.0:
        return number(value)
    digits = max(0, -math.floor(math.log10(spread)))
    return f"{value:.{digits}f} ± {spread:.{digits}f}"


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


def sheet(runs: Sequence[Run], entries: Sequence[Entry], further: Sequence[list[str]] = ()) -> Table:
    """A row for each of ``entries`` with its figure in every run's summary, then the ``further`` rows."""
    rows = [[what, *(figure(run.summary) for run in runs)] for what, figure in entries]
    return [["", *(run.name for run in runs)], *rows, *further]
