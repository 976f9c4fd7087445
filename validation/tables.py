"""The figures of one result, or of several side by side, as tables: a row a figure, a column a recording.

A table is a list of rows of text, the headline first.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from sssi_exudyn.validation.run import Run

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


_TURNS: Final = (
    ("duration of a turn (s)", "each", "duration_s", 1.0),
    ("mean speed (m/s)", "each", "mean_speed_mps", 1.0),
    ("mean turn radius of the centre of mass (m)", "each", "turn_radius_m", 1.0),
    ("angle between the skis (°)", "each", "ski_angle_mean_deg", 1.0),
    ("steering angle, mean (°)", "each", "steering_angle_mean_deg", 1.0),
    ("steering angle, peak (°)", "each", "steering_angle_peak_deg", 1.0),
    ("edge angle of the outside ski, peak (°)", "each", "edge_angle_outside_peak_deg", 1.0),
    ("inclination, peak (°)", "each", "inclination_peak_deg", 1.0),
    ("centre of mass inside both skis (% of the turn)", "each", "com_inside_both_share", 100.0),
    ("hip flexion of the outside leg, largest (°)", "each", "hip_flexion_outside_max_deg", 1.0),
    ("postural shift after the transition (s)", "each", "postural_shift_s", 1.0),
    ("postural shift after the transition (% of the turn)", "each", "postural_shift_percent", 1.0),
    ("load shift after the transition (s)", "each", "load_shift_s", 1.0),
    ("load shift after the transition (% of the turn)", "each", "load_shift_percent", 1.0),
    ("outside ski's share of the load, control phase (%)", "control", "outside_force_share", 100.0),
    ("load on both skis, control phase (body weights)", "control", "total_force_bodyweights", 1.0),
    ("whole force of the snow, control phase (body weights)", "control", "snow_force_bodyweights", 1.0),
)
"""What a row says, its group and name in a summary's ``turns``, and the factor to its unit."""
PEAK_MOMENTS: Final = (
    ("hip flexion moment, peak (N m/kg)", "hip_flexion", "max"),
    ("hip extension moment, peak (N m/kg)", "hip_flexion", "min"),
    ("knee extension moment, peak (N m/kg)", "knee_angle", "min"),
)


def turns(runs: Sequence[Run]) -> Table:
    """Technique and forces, mean ± standard deviation over complete turns; peaks are the largest of all of them."""
    rows: list[Entry] = [
        ("turns (complete ones)", lambda s: _counts(s.get("turns") or {})),
        *((what, _of_turns(group, name, factor)) for what, group, name, factor in _TURNS),
        *((what, _peak(joint, end)) for what, joint, end in PEAK_MOMENTS),
        (
            "residual moment at the pelvis, peak (N m)",
            lambda s: number((s.get("residual_moment") or {}).get("peak_Nm")),
        ),
        ("its root mean square (N m)", lambda s: number((s.get("residual_moment") or {}).get("rms_Nm"))),
    ]
    return _sheet(runs, rows)


def peak_moment(summary: Summary, joint: str, end: str) -> float | None:
    """The largest moment (N m/kg) over both legs and all complete turns, of its opposite with ``min``; None where there
    is none.
    """
    peaks = (summary.get("turns") or {}).get("peak_moments") or {}
    found = [peaks.get(f"{joint}_{leg}_moment_{end}_Nm_per_kg") for leg in ("outside", "inside")]
    known = [value for value in found if value is not None]
    if not known:
        return None
    return float(max(known) if end == "max" else -min(known))


def _counts(figures: Summary) -> str:
    return f"{figures['count']} ({figures['complete']})" if "count" in figures else "–"


def _of_turns(group: str, name: str, factor: float) -> Callable[[Summary], str]:
    def shown(summary: Summary) -> str:
        figure = ((summary.get("turns") or {}).get(group) or {}).get(name) or {}
        mean, spread = figure.get("mean"), figure.get("sd")
        if mean is None:
            return "–"
        return number(factor * mean) if spread is None else with_spread(factor * mean, factor * spread)

    return shown


def _peak(joint: str, end: str) -> Callable[[Summary], str]:
    return lambda summary: number(peak_moment(summary, joint, end))


def _residual(name: str) -> Callable[[Summary], str]:
    return lambda summary: number((summary.get("residual_moment") or {}).get(name))


def with_spread(value: float, spread: float) -> str:
    """``value ± spread``, both to the spread's first digit that counts."""
    if not spread > 0.0:
        return number(value)
    digits = max(0, -math.floor(math.log10(spread)))
    return f"{value:.{digits}f} ± {spread:.{digits}f}"


def energy(runs: Sequence[Run]) -> Table:
    """What each term of the energy balance did from the start to the end of the run, and what the balance leaves."""
    columns = _union(run.series.columns for run in runs)
    terms = [name for name in columns if name.startswith("energy_") and name != "energy_closure_J"]

    def last(run: Run, column: str) -> str:
        return str(round(run.series[column].iloc[-1])) if column in run.series else "–"

    rows = [
        [f"{name.removeprefix('energy_').removesuffix('_J')} (J)", *(last(run, name) for run in runs)] for name in terms
    ]
    return _sheet(runs, [("largest gap (% of the turnover)", lambda s: number(s["energy"]["closure_percent"]))], rows)


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
    return _sheet(runs, [], rows)


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
    return _sheet(runs, rows)


def provenance(runs: Sequence[Run]) -> Table:
    """What was read, what read it, and what was asked for."""
    rows: list[Entry] = []
    for group, word in (("inputs", "input"), ("versions", "version of"), ("settings", "setting")):
        names = _union(run.summary["provenance"][group] for run in runs)
        rows += [(f"{word} {name}", _origin(group, name)) for name in names]
    rows.append(("seed", lambda s: number(s["provenance"]["seed"])))
    return _sheet(runs, rows)


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


def _sheet(runs: Sequence[Run], entries: Sequence[Entry], further: Sequence[list[str]] = ()) -> Table:
    rows = [[what, *(figure(run.summary) for run in runs)] for what, figure in entries]
    return [["", *(run.name for run in runs)], *rows, *further]
