"""Figures for scripts and notebooks: the report's own, and the series over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.text import plot_text
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Drawing, Key, Panels, Section
from sssi_exudyn.reports.sections.track_figures import measured_loads, measured_track
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.simulation.result import SIDES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE: Final = (8.0, 3.2)
"""Inches of a figure of one pair of axes."""
_COLOURS: Final = {"left": plots.COLOURS[1], "right": plots.COLOURS[0]}
_LEGEND: Final = 0.4
"""Inches below panels for their legend."""
_MOST_COLUMNS: Final = 4
"""Columns of a legend."""
_FILES_ONLY: Final = frozenset({"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"})
"""Matplotlib's back ends that show nothing."""
Draw = Callable[[Axes], None]


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that Matplotlib's ``show`` and notebooks know.

    Where nothing can be shown, as on a server, pyplot does not keep the figure, so that many can be made and saved.
    """
    import matplotlib.pyplot as plt  # here: it chooses how to show figures, which a server may not be able to

    if plt.get_backend().lower() in _FILES_ONLY:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)  # measures words
        return figure
    with plt.rc_context({"figure.max_open_warning": 0}):  # windows are opened by show alone, notebooks close theirs
        return plt.figure(figsize=(width, height), layout="constrained")


def figure_of(section: Section, needed: str) -> Figure:
    """Return the figure of a report's section.

    Raises InputError for a section without one, which says what is ``needed``.
    """
    for block in section.blocks:
        if isinstance(block, Panels):
            return _of_panels(block)
        if isinstance(block, Drawing):
            return curves(block.draw, block.caption)
    raise InputError("plot", section.title, "the result has nothing to draw", f"it needs {needed}")


def curves(draw: Draw, title: str, on: Figure | None = None) -> Figure:
    """Return a figure of one pair of axes with a legend below; ``on`` is one to draw on instead of a new one."""
    figure = on or new_figure(*SIZE)
    axes = figure.axes[0] if on else figure.add_subplot()
    draw(axes)
    axes.set_title(plot_text(title), loc="left", fontsize=10.0)
    for legend in tuple(figure.legends):  # of what was drawn before
        legend.remove()
    handles, names = axes.get_legend_handles_labels()
    if handles:
        _place_legend(figure, handles, names)
    return figure


def _of_panels(block: Panels) -> Figure:
    columns = min(3 if block.width < plots.WIDE else 2, len(block.panels))
    rows = -(-len(block.panels) // columns)
    figure = new_figure(columns * block.width, rows * (block.height + 0.3) + _LEGEND)
    grid = figure.subplots(rows, columns, squeeze=False)
    for axes, panel in zip(grid.flat, block.panels, strict=False):
        panel.draw(axes)
        axes.set_title(plot_text(panel.title), loc="left", fontsize=10.0)
    for axes in grid.flat[len(block.panels) :]:
        axes.set_axis_off()
    handles = [_handle(key) for key in block.keys]
    names = [plot_text(key.meaning) for key in block.keys]
    _place_legend(figure, handles, names)
    return figure


def _place_legend(figure: Figure, handles: Sequence[Artist], names: Sequence[str]) -> None:
    """Put the legend below the axes, where no data are, in as many columns as fit the figure's width."""
    for columns in range(_MOST_COLUMNS, 0, -1):
        legend = figure.legend(handles, names, loc="outside lower left", ncols=columns, frameon=False)
        if columns == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def _handle(key: Key) -> Line2D:
    colour = plots.INK if key.colour is None else plots.COLOURS[key.colour]
    if key.style == ".":
        return Line2D([], [], color=colour, marker=".", linestyle="none")
    return Line2D([], [], color=colour, linestyle=key.style)


def draw_track(run: StoredRun, axes: Axes) -> None:
    """Draw the simulated track of the antenna in the slope's plane, with the GPS fixes where there are some."""
    path, label = run.slope("antenna", "m"), "antenna, simulated"
    if not np.all(np.isfinite(path)):
        path, label = run.com, "centre of mass, simulated"
    fixes = measured_track(run)
    if fixes is not None:
        axes.plot(*fixes.places[:, :2].T, ".", color=plots.MEASURED, label="GPS")
    axes.plot(*path[:, :2].T, color=plots.SIMULATED, label=label)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="down the fall line (m)", ylabel="to the left (m)")


def draw_speed(run: StoredRun, axes: Axes) -> None:
    """Draw the speed of the centre of mass, and its part down the fall line."""
    velocity = run.slope("com_velocity", "mps")
    axes.plot(run.time, np.linalg.norm(velocity, axis=1), color=plots.COLOURS[1], label="speed")
    axes.plot(run.time, velocity[:, 0], "--", color=plots.COLOURS[1], label="down the fall line")
    axes.set(xlabel="time (s)", ylabel="speed (m/s)")


def draw_loads(run: StoredRun, axes: Axes) -> None:
    """Draw the force square to each sole, with the insoles' over the same time where there are some."""
    insoles = measured_loads(run)
    if insoles is not None:
        insoles = insoles[insoles["time_s"].between(run.time[0], run.time[-1])]
    for side, colour in _COLOURS.items():
        axes.plot(run.time, run.series[f"{side}_sole_N"], color=colour, label=f"{side}, simulated")
        if insoles is not None:
            axes.plot(insoles["time_s"], insoles[f"{side}_insole_N"], ":", color=colour, label=f"{side}, insole")
    axes.set(xlabel="time (s)", ylabel="force square to the sole (N)")


def draw_friction(run: StoredRun, axes: Axes) -> None:
    """Draw the size of the snow's force along the snow's surface on each ski, skidding included."""
    for side, colour in _COLOURS.items():
        force = run.snow_force(side)
        name = f"{side}_snow_normal_up_1"
        normal = run.slope(f"{side}_snow_normal", "1") if name in run.series else np.array([[0.0, 0.0, 1.0]])
        along = force - np.sum(force * normal, axis=1, keepdims=True) * normal
        axes.plot(run.time, np.linalg.norm(along, axis=1), color=colour, label=side)
    axes.set(xlabel="time (s)", ylabel="force along the snow (N)")


def draw_energy(run: StoredRun, axes: Axes) -> None:
    """Draw works since the start, and kinetic and elastic energy as they are."""
    names = [name for name in run.series if str(name).startswith("energy_")]
    for index, name in enumerate(names):
        values = run.series[name].to_numpy(dtype=float)
        style = ("-", "--", ":")[index // len(plots.COLOURS) % 3]
        words = str(name).removeprefix("energy_").removesuffix("_J")
        axes.plot(run.time, values / 1e3, style, color=plots.COLOURS[index % len(plots.COLOURS)], label=words)
    axes.set(xlabel="time (s)", ylabel="energy (kJ)")


def draw_of_sides(column: str, label: str) -> Callable[[StoredRun, Axes], None]:
    """Return what draws a column of both sides, such as ``edge_angle_deg``, over time."""

    def draw(run: StoredRun, axes: Axes) -> None:
        for side in SIDES:
            axes.plot(run.time, run.series[f"{side}_{column}"], color=_COLOURS[side], label=side)
        axes.set(xlabel="time (s)", ylabel=label)

    return draw


def over_time(run: StoredRun, draw: Callable[[StoredRun, Axes], None], on: Figure | None = None) -> Figure:
    """Return a figure of series over time in which every second turn is shaded; ``on`` as for ``curves``."""

    def all_of_it(axes: Axes) -> None:
        draw(run, axes)
        if on is None:
            for turn in run.turns.turns[::2]:
                axes.axvspan(turn.start, turn.end, color="0.5", alpha=0.1, linewidth=0)

    return curves(all_of_it, run.name, on)
