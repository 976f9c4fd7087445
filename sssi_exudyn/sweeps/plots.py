"""A sweep's plots: a figure against one parameter, against two, and the effect of each parameter."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.plots import COLOURS, INK, whole_width
from sssi_exudyn.sweeps.design import Axis
from sssi_exudyn.sweeps.sensitivity_indices import groups_of

_MOST_POINTS: Final = 400
"""Greatest number of points in a plot; more hide each other and make the page large."""
_MOST_CELLS: Final = 12
"""Distinct values of a parameter that each get a column of a heat map; more are put into groups."""
_MARKS: Final = "osD^v"
_HEAT: Final = "cividis"
"""Colour map that is even in lightness, and readable without distinguishing red from green."""


def response_svg(name: str, table: pd.DataFrame, axis: Axis, output: str, unit: str) -> str:
    """Plot the figure ``output`` of all runs against one parameter, recording by recording.

    A line joins groups' means where the parameter is a number.
    """

    def draw(axes: Axes) -> None:
        recordings = list(table["recording"].unique())
        for number, recording in enumerate(recordings[: len(COLOURS)]):
            runs = table[table["recording"] == recording]
            place, words = _places(runs, axis)
            colour = COLOURS[(number + 1) % len(COLOURS)]
            shown = slice(None, None, -(-len(runs) // _MOST_POINTS))
            axes.plot(
                place[shown], runs[output].to_numpy()[shown], _MARKS[number], color=colour, markersize=3.0, alpha=0.5
            )
            groups = groups_of(runs[axis.name])
            means = pd.DataFrame({"x": place, "y": runs[output].to_numpy()}).groupby(groups.to_numpy()).mean()
            label = recording if len(recordings) > 1 else "mean"
            (drawn,) = axes.plot(means["x"], means["y"], color=colour, label=label)
            if words:  # nothing lies between names
                drawn.set(linestyle="", marker="_", markersize=18.0)
            if words:
                axes.set_xticks(range(len(words)), words)
        axes.set(xlabel=axis_label(axis.name, axis.parameter.unit), ylabel=axis_label(output, unit))

    return whole_width(name, draw)


def heat_svg(name: str, table: pd.DataFrame, across: Axis, up: Axis, output: str, unit: str) -> str:
    """Plot the mean of the figure ``output`` over cells of two parameters; cells without a run are empty."""
    columns, column_words = _cells(table, across)
    rows, row_words = _cells(table, up)
    means = table[output].groupby([rows, columns]).mean().unstack()  # noqa: PD010 - of a series, which cannot pivot
    means = means.reindex(index=range(len(row_words)), columns=range(len(column_words)))

    def draw(axes: Axes) -> None:
        drawn = axes.pcolormesh(np.ma.masked_invalid(means.to_numpy(dtype=float)), cmap=_HEAT, edgecolors="face")
        axes.set_xticks(np.arange(len(column_words)) + 0.5, column_words)
        axes.set_yticks(np.arange(len(row_words)) + 0.5, row_words)
        axes.grid(visible=False)
        axes.set(xlabel=axis_label(across.name, across.parameter.unit), ylabel=axis_label(up.name, up.parameter.unit))
        figure = axes.get_figure()
        assert figure is not None
        bar = figure.colorbar(drawn, ax=axes)
        bar.set_label(axis_label(output, unit), color=INK)
        bar.outline.set_visible(False)
        assert bar.solids is not None
        bar.solids.set(rasterized=False, edgecolor="face")  # a page shows no pictures, only lines and areas

    return whole_width(name, draw, height=3.6)


def bars_svg(name: str, indices: pd.DataFrame, kinds: tuple[str, ...], labels: tuple[str, ...]) -> str:
    """Plot indices of one output and recording, parameter by parameter, strongest on top, with 95 % intervals."""
    order = indices[indices["index"] == kinds[0]].sort_values("value")["parameter"].tolist()

    def draw(axes: Axes) -> None:
        height = 0.8 / len(kinds)
        for number, (kind, label) in enumerate(zip(kinds, labels, strict=True)):
            rows = indices[indices["index"] == kind].set_index("parameter").reindex(order)
            place = np.arange(len(order)) + 0.4 - (number + 0.5) * height
            spread = rows["confidence_95"].to_numpy(dtype=float)
            axes.barh(place, rows["value"], height, color=COLOURS[number + 1], alpha=1.0 - 0.4 * number, label=label)
            if np.all(np.isfinite(spread)):
                axes.errorbar(rows["value"], place, xerr=spread, fmt="none", ecolor=INK, elinewidth=1.0)
        axes.set_yticks(range(len(order)), order)
        axes.grid(visible=False, axis="y")
        axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))

    return whole_width(name, draw, height=0.9 + 0.42 * len(order))


def _places(table: pd.DataFrame, axis: Axis) -> tuple[Array, list[str]]:
    """Return the place of each run along the parameter, and the names where the parameter is not a number."""
    if pd.api.types.is_numeric_dtype(table[axis.name]):
        return table[axis.name].to_numpy(dtype=float), []
    words = sorted(table[axis.name].unique())
    return np.array([words.index(word) for word in table[axis.name]], dtype=float), words


def _cells(table: pd.DataFrame, axis: Axis) -> tuple[pd.Series[int], list[str]]:
    """Return the cell, from 0, of each run along the parameter, and the cells' labels."""
    values = table[axis.name]
    if values.nunique() <= _MOST_CELLS or not pd.api.types.is_numeric_dtype(values):
        known = sorted(values.unique())
        return values.map({value: i for i, value in enumerate(known)}).astype(int), [_word(value) for value in known]
    groups = groups_of(values).rank(method="dense").astype(int) - 1
    return groups, [_word(mean) for mean in values.groupby(groups).mean()]


def _word(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def axis_label(name: str, unit: str) -> str:
    """Return a name with its unit in brackets: ``mean_speed_mps`` is "mean speed (m/s)".

    Parameters keep their files' name.
    """
    bare, _, last = name.rpartition("_")
    written = bare if bare and last in _AS_WRITTEN else name
    shown = _AS_WRITTEN.get(last, unit) if written == bare else _AS_WRITTEN.get(unit, unit)
    words = written if "." in written else written.replace("_", " ")
    return f"{words} ({shown})" if shown else words


_AS_WRITTEN: Final = {
    "deg": "°",
    "m": "m",
    "mps": "m/s",
    "N": "N",
    "J": "J",
    "Nm": "N m",
    "percent": "%",
    "s": "s",
}
"""Units as they end names, and as they are shown."""
