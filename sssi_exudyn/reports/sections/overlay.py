"""Two runs over each other: their tracks from the start, and which one leads by how much time."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Key, Panel, Panels, Runs, Section, figure_section
from sssi_exudyn.results.stored import StoredRun

_STEP: Final = 0.25
"""m down the fall line between the compared places."""


def overlay(runs: Runs) -> Section:
    """Show tracks, time gap and speeds of two runs; nothing for one or for more."""
    title = "The two runs over each other"
    if len(runs) != 2:
        return Section(title, ())
    first, second = runs
    down = [_down(run) for run in runs]
    reach = min(float(distance[-1]) for distance in down)
    if reach <= _STEP:
        return Section(title, ())
    places = np.arange(0.0, reach, _STEP)
    since, speeds = zip(*(_at(run, distance, places) for run, distance in zip(runs, down, strict=True)), strict=True)
    gap = since[1] - since[0]

    def tracks(axes: Axes) -> None:
        for index, run in enumerate(runs):
            track = run.com[:, :2] - run.com[0, :2]
            axes.plot(track[:, 0], track[:, 1], color=plots.COLOURS[index])
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xlabel="down the fall line (m)", ylabel="to the left (m)")

    def gaps(axes: Axes) -> None:
        axes.axhline(0.0, color=plots.INK, linewidth=0.8)
        axes.plot(places, gap, color=plots.COLOURS[1])
        axes.set(xlabel="down the fall line (m)", ylabel="time gap (s)")

    def speed(axes: Axes) -> None:
        for index, values in enumerate(speeds):
            axes.plot(places, values, color=plots.COLOURS[index])
        axes.set(xlabel="down the fall line (m)", ylabel="speed (m/s)")

    ahead = first.name if gap[-1] > 0.0 else second.name
    words = f"{ahead} is {abs(float(gap[-1])):.2f} s ahead after {reach:.0f} m"
    return figure_section(
        title,
        Panels(
            "Both from their own start, the centre of mass in each slope's plane; the time gap is how much later"
            f" {second.name} passes the same distance down the fall line",
            (
                Panel("tracks", f"{first.name} and {second.name} from their starts", tracks),
                Panel("time gap", words, gaps),
                Panel("speed", "of both centres of mass", speed),
            ),
            (Key(0, "-", first.name), Key(1, "-", second.name)),
            4.6,
            2.6,
        ),
        f"{words}.",
        opened=True,
    )


def _down(run: StoredRun) -> Array:
    """Return the distance (n,) m down the fall line from the start, never back."""
    return np.asarray(np.maximum.accumulate(run.com[:, 0] - run.com[0, 0]))


def _at(run: StoredRun, down: Array, places: Array) -> tuple[Array, Array]:
    """Return the time (s) since the start at which the run passes each place, and its speed there (m/s)."""
    rising = np.concatenate([[True], np.diff(down) > 0.0])
    time = np.interp(places, down[rising], run.time[rising])
    speed = np.linalg.norm(np.gradient(run.com, run.time, axis=0), axis=1)
    return time - run.time[0], np.interp(time, run.time, speed)
