"""The paper's Figures 4 and 6: the run's path against the measured one, and the skier's posture on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from sssi_exudyn.bodies.skier.chain import SEGMENT
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.core.text import metres
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Key, Panel, Panels, Runs, Section, figure_section, say_of_each
from sssi_exudyn.reports.sections.linked_turns import Cycle, cycles_of
from sssi_exudyn.reports.sections.replay import poses_of
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.validation.agreement import distances, filtered_ratio
from sssi_exudyn.validation.metrics import pressure_ratio

_KINDS: Final = ("trajectory", "distance to the GPS", "foot pressure ratio")
_TRACK, _DISTANCE, _RATIO = _KINDS
_INSTANTS: Final = 12
"""Number of instants along a turn at which skis, hips and shoulders are drawn."""


def figure_4(runs: Runs) -> Section:
    by_run = [_panels_of(run) for run in runs]
    panels = [run_panels[kind] for kind in _KINDS for run_panels in by_run if kind in run_panels]
    caption = (
        "Trajectory of the antenna in the slope's plane, and its distance to the GPS fixes with the fixes' standard"
        " deviation as a band"
    )
    keys = [Key(1, "-", "simulated"), Key(0, ".", "GPS")]
    if any(_RATIO in run_panels for run_panels in by_run):
        caption += "; the left foot's share of the load"
        keys.append(Key(0, "--", "insoles"))
    caption += ". Compare Figure 4 of Gao et al"
    return figure_section(
        "Simulated and measured",
        Panels(caption, tuple(panels), tuple(keys), 4.6, 2.3),
        say_of_each(runs, _met),
        opened=True,
    )


def _met(run: StoredRun) -> str:
    """State how well simulation and instruments agree."""
    trajectory, ratio = run.summary.trajectory, run.summary.pressure_ratio
    words = []
    if trajectory.mean_error_m is not None:
        words.append(f"the simulated antenna is {metres(trajectory.mean_error_m)} m from the GPS on average")
    if ratio.rmsd is not None:
        words.append(f"the left foot's share of the load is {100.0 * ratio.rmsd:.0f}\u00a0% off (rms)")
    return " and ".join(words) or "there is no measurement to compare the run with"


@dataclass(frozen=True)
class Fixes:
    """The GPS fixes within a run.

    time, sigma : (k,) s, m;  enu, places : (k, 3) m, east-north-up and in the slope frame
    """

    time: Array
    sigma: Array
    enu: Array
    places: Array


def measured_track(run: StoredRun) -> Fixes | None:
    """Return the GPS fixes within a run; None where it has no antenna or fewer than two fixes."""
    if run.measured is None or "gps_east_m" not in run.measured or not np.all(np.isfinite(run.slope("antenna", "m"))):
        return None
    within = run.measured[run.measured["time_s"].between(run.time[0], run.time[-1])]
    seen = within.dropna(subset=["gps_east_m"])
    if len(seen) < 2:
        return None
    enu = seen[["gps_east_m", "gps_north_m", "gps_up_m"]].to_numpy()
    return Fixes(
        seen["time_s"].to_numpy(),
        seen["gps_sigma_m"].to_numpy(),
        enu,
        enu @ slope_to_enu(run.model.inclination, run.model.fall_line_azimuth),
    )


def measured_loads(run: StoredRun) -> pd.DataFrame | None:
    """Return the insoles' forces, also before and after the run; None without insoles."""
    if run.measured is None or "left_insole_N" not in run.measured:
        return None
    return run.measured.dropna(subset=["left_insole_N"])


def _panels_of(run: StoredRun) -> dict[str, Panel]:
    """Return a panel for each of ``_KINDS`` that has measurements."""
    panels: dict[str, Panel] = {}
    antenna, fixes = run.slope("antenna", "m"), measured_track(run)
    if fixes is not None:
        error = distances(run.series, fixes.time, fixes.enu)

        def track(axes: Axes) -> None:
            axes.plot(fixes.places[:, 0], fixes.places[:, 1], ".", color=plots.COLOURS[0], markersize=6.0)
            axes.plot(antenna[:, 0], antenna[:, 1], color=plots.COLOURS[1], linewidth=1.0)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set(xlabel="down the fall line (m)", ylabel="to the left (m)")

        def distance(axes: Axes) -> None:
            axes.fill_between(fixes.time, fixes.sigma, color=plots.COLOURS[0], alpha=0.25, linewidth=0)
            axes.plot(fixes.time, error, color=plots.COLOURS[1])
            axes.set_ylim(bottom=0.0)
            axes.set(xlabel="time (s)", ylabel="distance (m)")

        mean = f"{np.mean(error):.3f} m on average, {np.max(error):.3f} m at most"
        panels[_TRACK] = Panel(f"{run.name}: {_TRACK}", f"{len(fixes.time)} GPS fixes and the simulated track", track)
        panels[_DISTANCE] = Panel(f"{run.name}: {_DISTANCE}", mean, distance)
    loads = measured_loads(run)
    if loads is not None and loads["time_s"].between(run.time[0], run.time[-1]).any():
        load_time = loads["time_s"].to_numpy()
        measured = filtered_ratio(load_time, loads["left_insole_N"].to_numpy(), loads["right_insole_N"].to_numpy())
        shown = (load_time >= run.time[0]) & (load_time <= run.time[-1])
        ratio = pressure_ratio(*(run.series[f"{side}_sole_N"].to_numpy(dtype=float) for side in ("left", "right")))

        def share(axes: Axes) -> None:
            axes.plot(load_time[shown], measured[shown], color=plots.COLOURS[0], linestyle="--")
            axes.plot(run.time, ratio, color=plots.COLOURS[1])
            axes.set_ylim(-0.02, 1.02)
            axes.set(xlabel="time (s)", ylabel="left foot's share")

        correlation = run.summary.pressure_ratio.correlation
        agreement = "" if correlation is None else f", correlation {correlation:.3f}"
        panels[_RATIO] = Panel(f"{run.name}: {_RATIO}", f"simulated against insoles{agreement}", share)
    return panels


def figure_6(runs: Runs) -> Section:
    cycles = cycles_of(runs)
    panels = [
        Panel(
            run.name,
            "path of the centre of mass seen from above, with skis, hips and shoulders at even times, "
            f"from {cycle.shown[0]:.1f} s to {cycle.shown[1]:.1f} s",
            _draw_from_above(run, cycle),
        )
        for run, cycle in zip(runs, cycles, strict=True)
        if run.geometry is not None
    ]
    return figure_section(
        "The run from above",
        Panels(
            "Seen from above, the fall line downwards: two linked turns from the middle of the run. Compare "
            "Figure 6 of Gao et al",
            tuple(panels),
            (
                Key(3, ":", "centre of mass"),
                Key(0, "-", "right ski"),
                Key(1, "-", "left ski"),
                Key(4, "-", "shoulders"),
                Key(2, "-", "hips"),
            ),
            4.6,
            6.4,
        ),
        say_of_each(runs, _extent),
    )


def _extent(run: StoredRun) -> str:
    """State how far the centre of mass travels down the fall line and across it."""
    down, across = np.ptp(run.com[:, :2], axis=0)
    return f"the centre of mass goes {down:.0f} m down the fall line, within a corridor {across:.1f} m wide"


def _draw_from_above(run: StoredRun, cycle: Cycle) -> Callable[[Axes], None]:
    begin, end = cycle.shown
    turns = max(1, sum(begin <= turn.start and turn.end <= end for turn in cycle.turns.turns))
    times = np.linspace(begin, end, _INSTANTS * turns + 1)
    rows = np.searchsorted(run.time, times).clip(0, len(run.time) - 1)
    path = run.com[(run.time >= begin) & (run.time <= end)]
    com, down = run.com[rows], path[0, 0]
    assert run.geometry is not None
    origin = poses_of(run.series.iloc[rows], run.geometry, run.model.inclination).origin
    ski = run.model.ski
    reach = np.array([-ski.boot_centre, ski.length - ski.boot_centre])

    def of_ski(side: str) -> Array:
        """Return its tail and tip, (k, 2, 3) m."""
        foot, forward = run.slope(f"{side}_foot", "m")[rows], run.slope(f"{side}_foot_forward", "1")[rows]
        return np.asarray(foot[:, None] + reach[:, None] * forward[:, None])

    def through(joint: str, longer: float) -> Array:
        """Return a line through both joints, (k, 2, 3) m, longer at each end by that share of their distance."""
        left, right = origin[:, SEGMENT[f"{joint}_l"]], origin[:, SEGMENT[f"{joint}_r"]]
        return np.stack([left + longer * (left - right), right + longer * (right - left)], axis=1)

    lines = ((of_ski("left"), 1), (of_ski("right"), 0), (through("humerus", 0.4), 4), (through("femur", 0.8), 2))

    def draw(axes: Axes) -> None:
        axes.plot(path[:, 1], path[:, 0] - down, ":", color=plots.COLOURS[3])
        axes.plot(com[:, 1], com[:, 0] - down, "o", color=plots.COLOURS[3], markersize=3.0)
        for ends, colour in lines:
            axes.plot(ends[..., 1].T, ends[..., 0].T - down, color=plots.COLOURS[colour], linewidth=1.4)
        axes.set_aspect("equal", adjustable="datalim")
        axes.invert_yaxis()
        axes.set(xlabel="to the left (m)", ylabel="down the fall line (m)")

    return draw
