"""The snow surface of a run: contour lines over the slope's plane, and its profile along the path."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Key, Panel, Panels, Runs, Section, figure_section, say_of_each
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.terrain.profile import profile_along
from sssi_exudyn.terrain.surface import Surface

_LINES = 12
"""Number of contour lines."""


def snow_surface(runs: Runs) -> Section:
    panels: list[Panel] = []
    for run in runs:
        surface = run.model.surface
        if surface is not None:
            path = 0.5 * (run.slope("left_foot", "m") + run.slope("right_foot", "m"))
            panels += surface_panels(run.name, surface, path, run.model.inclination)
    return figure_section(
        "Snow surface",
        Panels(
            "Heights of the snow over the slope's plane with the path of the skis, and the profile along it with one "
            "standard deviation of the heights' uncertainty",
            tuple(panels),
            (Key(1, "-", "path"), Key(0, "-", "snow"), Key(None, "--", "inclination of the snow")),
            4.6,
            2.3,
        ),
        say_of_each(runs, _extent),
    )


def _extent(run: StoredRun) -> str:
    """State how uneven and how steep the snow is; nothing where it is a plane."""
    figures = run.summary.surface
    if figures is None:
        return ""
    return (
        f"along the path the snow lies {figures.lowest_m:+z.2f} to {figures.highest_m:+z.2f} m about the slope's plane,"
        f" and is {figures.inclination_least_deg:.1f} to {figures.inclination_most_deg:.1f}° steep"
    )


def surface_panels(name: str, surface: Surface, path: Array, inclination: float) -> tuple[Panel, Panel]:
    """Return contour lines and profile of a surface along a path (n, ≥ 2) m in the slope frame."""
    profile = profile_along(surface, path, inclination)

    def contours(axes: Axes) -> None:
        low, high = path[:, :2].min(axis=0) - 5.0, path[:, :2].max(axis=0) + 5.0
        f, l = np.linspace(low[0], high[0], 120), np.linspace(low[1], high[1], 40)  # noqa: E741
        places = np.stack(np.meshgrid(f, l, indexing="ij"), axis=-1).reshape(-1, 2)
        height = surface.at(places)[:, 0].reshape(len(f), len(l)).T
        if np.ptp(height) > 0.0:
            lines = axes.contour(f, l, height, levels=_LINES, cmap="viridis", linewidths=0.7)
            axes.clabel(lines, fontsize=9, fmt="%.2g", colors=plots.INK)
        axes.plot(path[:, 0], path[:, 1], color=plots.COLOURS[1], linewidth=1.0)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(xlabel="down the fall line (m)", ylabel="to the left (m)")

    def along(axes: Axes) -> None:
        axes.fill_between(
            profile.distance, profile.height - profile.band, profile.height + profile.band,
            color=plots.COLOURS[0], alpha=0.25, linewidth=0,
        )  # fmt: skip
        axes.plot(profile.distance, profile.height, color=plots.COLOURS[0])
        axes.set(xlabel="along the path (m)", ylabel="height over the plane (m)")
        steep = axes.twinx()
        steep.plot(profile.distance, np.degrees(profile.inclination), "--", color=plots.INK, linewidth=0.8)
        steep.set_ylabel("inclination (deg)")

    low, high = profile.height.min(), profile.height.max()
    least, most = np.degrees([profile.inclination.min(), profile.inclination.max()])
    return (
        Panel(f"{name}: contour lines (m)", f"snow from {low:.2f} to {high:.2f} m about the plane", contours),
        Panel(f"{name}: profile", f"the snow is {least:.1f} to {most:.1f} degrees steep along the path", along),
    )
