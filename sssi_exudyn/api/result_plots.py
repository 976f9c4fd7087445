"""Figures of a result, as the report shows them and over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.reports import figures
from sssi_exudyn.results.stored import StoredRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class ResultPlots:
    """Methods that draw a stored run and return the Matplotlib figure.

    ``on`` is a figure of the same method of another result, which this one is drawn over.
    """

    stored: StoredRun

    def plot_track(self, on: Figure | None = None) -> Figure:
        """Draw the simulated track of the antenna in the slope's plane (m), with the GPS fixes where there are some."""
        return figures.curves(lambda axes: figures.draw_track(self.stored, axes), self.stored.name, on)

    def plot_from_above(self) -> Figure:
        """Draw two linked turns from above (m): path, skis, hips and shoulders.

        Raises InputError for a result without a skeleton.
        """
        from sssi_exudyn.reports.sections.track_figures import figure_6

        return figures.figure_of(figure_6([self.stored]), "a skeleton")

    def plot_agreement(self) -> Figure:
        """Draw track (m), distance to the GPS (m) and the left foot's share of the load against measurements.

        Raises InputError for a run without measurements.
        """
        from sssi_exudyn.reports.sections.track_figures import figure_4

        return figures.figure_of(figure_4([self.stored]), "GPS fixes or insoles")

    def plot_speed(self, on: Figure | None = None) -> Figure:
        """Draw the speed of the centre of mass over time (m/s)."""
        return figures.over_time(self.stored, figures.draw_speed, on)

    def plot_loads(self, on: Figure | None = None) -> Figure:
        """Draw the force square to each sole over time (N), with the insoles' where there are some."""
        return figures.over_time(self.stored, figures.draw_loads, on)

    def plot_friction(self, on: Figure | None = None) -> Figure:
        """Draw the snow's force along its surface on each ski over time (N), skidding included."""
        return figures.over_time(self.stored, figures.draw_friction, on)

    def plot_edge_angles(self, on: Figure | None = None) -> Figure:
        """Draw each ski's edge angle over time (degrees)."""
        draw = figures.draw_of_sides("edge_angle_deg", "edge angle (°)")
        return figures.over_time(self.stored, draw, on)

    def plot_penetration(self, on: Figure | None = None) -> Figure:
        """Draw the depth of each ski's deepest contact point over time (m)."""
        draw = figures.draw_of_sides("penetration_m", "penetration (m)")
        return figures.over_time(self.stored, draw, on)

    def plot_angles(self) -> Figure:
        """Draw joint angles over two linked turns (degrees), the mean of all pairs and their standard deviation."""
        from sssi_exudyn.reports.sections.curve_figures import figure_5

        return figures.figure_of(figure_5([self.stored]), "a series")

    def plot_forces(self) -> Figure:
        """Draw the normal force on each ski over two linked turns (body weights), as ``plot_angles`` does."""
        from sssi_exudyn.reports.sections.curve_figures import figure_7

        return figures.figure_of(figure_7([self.stored]), "a series")

    def plot_moments(self) -> Figure:
        """Draw joint moments over two linked turns (N m/kg), as ``plot_angles`` does."""
        from sssi_exudyn.reports.sections.curve_figures import figure_8

        return figures.figure_of(figure_8([self.stored]), "a series")

    def plot_energy(self, on: Figure | None = None) -> Figure:
        """Draw works since the start, kinetic and elastic energy over time (kJ)."""
        return figures.over_time(self.stored, figures.draw_energy, on)

    def plot_snow(self) -> Figure:
        """Draw contour lines of the snow surface and its profile along the path (m).

        Raises InputError for a model whose snow is a plane.
        """
        from sssi_exudyn.reports.sections.snow_surface import snow_surface

        return figures.figure_of(snow_surface([self.stored]), "a model with a snow surface, which a fit estimates")

    def plot(self, *columns: str) -> Figure:
        """Draw columns of ``series`` over time, in their own units.

        Raises InputError for a column that the series does not have.

        Examples
        --------
        >>> result.plot("left_tip_deflection_m", "right_tip_deflection_m")
        """
        from sssi_exudyn.core.text import did_you_mean

        names = [str(name) for name in self.stored.series]
        for column in columns or ("",):
            if column not in names:
                raise InputError("plot", column, "the series has no such column", did_you_mean(column, names))

        def draw(run: StoredRun, axes: Axes) -> None:
            for column in columns:
                axes.plot(run.time, run.series[column], label=column)
            axes.set(xlabel="time (s)")

        return figures.over_time(self.stored, draw)
