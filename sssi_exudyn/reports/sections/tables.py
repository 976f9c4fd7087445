"""The figures of one result, or of several side by side, as tables: a row a figure, a column a recording."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from sssi_exudyn.core.text import plus_minus
from sssi_exudyn.reports.section import Runs, Section, say_of_each, table_section
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Estimate, SegmentRoundTrip, Summary

Entry = tuple[str, Callable[[Summary], str]]
"""Name of a row, and its figure in a summary as text."""
Table = list[list[str]]
"""Rows of text, the headline first."""


def table_1(runs: Runs) -> Section:
    """Show the paper's Table 1: friction, the track's error and the slope's inclination, a row a recording."""
    head = ["", "μ_t", "μ_n (largest lateral load ratio)", "percentage trajectory error", "piste inclination angle (°)"]
    rows = [
        [
            run.name,
            *(friction(run.summary, name) for name in ("mu_t", "mu_n")),
            number(run.summary.trajectory.percent_of_length, 2, " %"),
            f"{np.degrees(run.model.inclination):.1f}",
        ]
        for run in runs
    ]
    return table_section("Friction and error of the track", [head, *rows], say_of_each(runs, _coefficients))


def _coefficients(run: StoredRun) -> str:
    """State both friction coefficients."""
    along, across = (friction(run.summary, name) for name in ("mu_t", "mu_n"))
    return f"μ_t is {along} along the skis, and μ_n {across} across them"


def friction(summary: Summary, name: str) -> str:
    """Return a friction coefficient, ± its standard error where it was fitted, or the equivalent of edges that cut."""
    cut = summary.carving
    if cut is not None:
        return f"{number(cut.equivalent_mu_t if name == 'mu_t' else cut.equivalent_mu_n)} (edges that cut)"
    return estimate_text(getattr(summary.friction, name))


def estimate_text(estimate: Estimate) -> str:
    """Return a number, ± its standard error where it has one; a dash where there is none."""
    if estimate.value is None:
        return "–"
    return f"{estimate.value:.3f}" if estimate.se is None else with_spread(estimate.value, estimate.se)


def agreement(runs: Runs) -> Section:
    """Show the differences between simulation and instruments."""
    rows = sheet(
        runs,
        [
            ("mean distance of antenna and GPS fix (m)", lambda s: number(s.trajectory.mean_error_m)),
            ("the largest (m)", lambda s: number(s.trajectory.max_error_m)),
            ("the mean over the path's length (%)", lambda s: number(s.trajectory.percent_of_length)),
            ("length of the path (m)", lambda s: number(s.trajectory.length_m, 4)),
            ("left foot's share of load, correlation", lambda s: number(s.pressure_ratio.correlation)),
            ("its root mean squared difference", lambda s: number(s.pressure_ratio.rmsd)),
        ],
    )
    return table_section("Simulation against instruments", rows, say_of_each(runs, _track_error))


def _track_error(run: StoredRun) -> str:
    """State the track's error over its length."""
    trajectory = run.summary.trajectory
    if trajectory.percent_of_length is None:
        return "there is no GPS track to compare the run with"
    length = number(trajectory.length_m)
    return f"the mean error of the track is {trajectory.percent_of_length:.2g}\u00a0% of its {length} m"


_KEPT = {"energy_kinetic_J": "kinetic energy", "energy_elastic_J": "elastic energy of the skis"}
"""Columns of a series that are energies kept; all others are works done."""


def energy(runs: Runs) -> Section:
    """Return the balance of the works done over the run and of the energies gained, and the balance's largest gap.

    In each column the works add up to their sum, and that to what the energies gained and what is left over, as
    printed: figures are rounded before they are added.
    """
    columns = _union(run.series.columns for run in runs)
    terms = [name for name in columns if name.startswith("energy_") and name != "energy_closure_J"]
    works = [name for name in terms if name not in _KEPT]

    def change(run: StoredRun, names: Sequence[str]) -> float:
        known = [run.series[name] for name in names if name in run.series]
        parts = [round(float(values.iloc[-1] - values.iloc[0]), 1) for values in known]
        return sum(parts) if known else math.nan

    def row(title: str, changes: Sequence[float]) -> list[str]:
        # a zero without the sign that rounding leaves
        return [f"{title} (J)", *(f"{round(value, 1) + 0.0:.1f}" if math.isfinite(value) else "–" for value in changes)]

    gained = {name: [change(run, [name]) for run in runs] for name in _KEPT if name in terms}
    done = [change(run, works) for run in runs]
    left = np.array(done) - np.nansum([*gained.values(), [0.0] * len(runs)], axis=0)
    rows = [
        *(row(f"work of {name[len('energy_') : -len('_J')]}", [change(run, [name]) for run in runs]) for name in works),
        row("sum of the works", done),
        *(row(f"{_KEPT[name]} gained", changes) for name, changes in gained.items()),
        row("left over", left.tolist()),
    ]
    gap = sheet(runs, [("largest gap (% of the turnover)", lambda s: number(s.energy.closure_percent))])
    return table_section("Energy from start to end", [*gap, *(rows if terms else [])], say_of_each(runs, _gap))


def _gap(run: StoredRun) -> str:
    """State by how much the balance does not close."""
    gap = run.summary.energy.closure_percent
    return "" if gap is None else f"the energy balance closes to {gap:.2g}\u00a0% of the energy that is turned over"


def capture(runs: Runs) -> Section:
    """Compare the skeleton's 28 angles with the capture, segment by segment.

    The columns are the difference in orientation, root mean square (largest), and in the place of the joint.
    """
    known = [{row.segment: row for row in run.summary.capture.round_trip} for run in runs]

    def cell(row: SegmentRoundTrip | None) -> str:
        if row is None:
            return "–"
        figures = (row.filtered_rms_deg, row.filtered_max_deg, row.place_rms_mm)
        if any(figure is None for figure in figures):
            return "–"
        return "{:.2f}° ({:.2f}°), {:.1f} mm".format(*figures)

    rows = [
        [segment.replace("_r", ", right").replace("_l", ", left"), *(cell(rows.get(segment)) for rows in known)]
        for segment in _union(known)
    ]
    title = "Skeleton against capture: orientation, rms (largest), and place of the joint"
    return table_section(title, [*sheet(runs, []), *rows], say_of_each(runs, _worst_segment))


def _worst_segment(run: StoredRun) -> str:
    """State the segment whose orientation differs most."""
    known = [
        (row.filtered_rms_deg, row.segment)
        for row in run.summary.capture.round_trip
        if row.filtered_rms_deg is not None
    ]
    if not known:
        return "no segment was compared"
    degrees, segment = max(known)
    name = segment.replace("_r", ", right").replace("_l", ", left")
    return f"the largest difference in orientation is {degrees:.1f}° (rms), of the segment {name}"


def notices(runs: Runs) -> Section:
    """Show remarks on a recording for the reader, such as quantities that had to be estimated: a row a notice."""
    rows = [[run.name, notice] for run in runs for notice in run.summary.notices]
    sentence = "There is one remark on the recording." if len(rows) == 1 else f"There are {len(rows)} remarks on it."
    return table_section("Remarks on the recording", [["", "remark"], *rows], sentence)


def health(runs: Runs) -> Section:
    """Show how solver and fit ended."""
    units = {"simulated_s": "simulated time (s)", "wall_s": "computing time (s)"}
    rows: list[Entry] = []
    for group in ("solver", "fit"):
        for name in [entry.name for entry in dataclasses.fields(getattr(Summary(), group))]:
            values = [getattr(getattr(run.summary, group), name) for run in runs]
            if all(value is None or isinstance(value, bool | int | float | str) for value in values) and any(
                value is not None for value in values
            ):
                what = units.get(name, name.replace("_", " "))
                rows += [(f"{group}: {what}", _figure(group, name))]
    rows.append(("energy balance, largest gap (% of the turnover)", lambda s: number(s.energy.closure_percent)))
    rows.append(("stopped early", lambda s: s.diverged or "no"))
    return table_section("Health of the solver", sheet(runs, rows), say_of_each(runs, _ending))


def _ending(run: StoredRun) -> str:
    """State how simulation and fit ended."""
    simulation = "reached the end of the run" if run.summary.diverged is None else "stopped before the end of the run"
    fit = {None: "", True: ", and the fit converged", False: ", and the fit did not converge"}
    return f"the simulation {simulation}{fit[run.summary.fit.converged]}"


def provenance(runs: Runs) -> Section:
    """Show the inputs, the versions of the programs, and the settings."""
    rows: list[Entry] = []
    for group, word in (("inputs", "input"), ("versions", "version of"), ("settings", "setting")):
        names = _union(getattr(run.summary.provenance, group) for run in runs)
        rows += [(f"{word} {name}", _origin(group, name)) for name in names]
    rows.append(("SHA-256 of the program's sources", lambda s: s.provenance.sources or "–"))
    rows.append(("seed", lambda s: number(s.provenance.seed)))
    return table_section("Where this result comes from", sheet(runs, rows), say_of_each(runs, _inputs))


def _inputs(run: StoredRun) -> str:
    """State how many files the result was made from."""
    count = len(run.summary.provenance.inputs)
    return f"the result was made from {count} input {'file' if count == 1 else 'files'}"


def number(value: object, digits: int = 3, unit: str = "") -> str:
    """Return a figure with its significant digits; a dash where there is none."""
    match value:
        case None:
            return "–"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.{digits}g}{unit}"
        case _:
            return f"{value}{unit}"


def unit_text(unit: str) -> str:
    """Return a unit as it is printed: that of a plain number is not."""
    return "" if unit == "1" else unit


def in_reading_units(value: float, unit: str) -> str:
    """Return a value with its unit as a reader takes it in: angles are degrees."""
    if unit.startswith("rad"):
        value, unit = float(np.degrees(value)), "°" + unit.removeprefix("rad")
    return f"{value:.3g} {unit_text(unit)}".rstrip()


def with_spread(value: float, spread: float) -> str:
    """Return ``value ± spread``, both to the spread's first significant digit."""
    return plus_minus(value, spread) if spread > 0.0 else number(value)


def _figure(group: str, name: str) -> Callable[[Summary], str]:
    return lambda summary: number(getattr(getattr(summary, group), name))


def _origin(group: str, name: str) -> Callable[[Summary], str]:
    def text(summary: Summary) -> str:
        entries: Mapping[str, Any] = getattr(summary.provenance, group)
        value = entries.get(name)
        return "–" if value is None else value if isinstance(value, str) else json.dumps(value)

    return text


def _union(names: Iterable[Iterable[str]]) -> list[str]:
    """Return every name once, in the order of first occurrence."""
    return list(dict.fromkeys(name for group in names for name in group))


def sheet(runs: Runs, entries: Sequence[Entry]) -> Table:
    """Return the runs' names, then a row for each of ``entries`` with its figure in every run's summary."""
    rows = [[what, *(figure(run.summary) for run in runs)] for what, figure in entries]
    return [["", *(run.name for run in runs)], *rows]
