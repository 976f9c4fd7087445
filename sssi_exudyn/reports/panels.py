"""A figure of several panels, that a page and a printed document draw alike."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from typing import Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssi_exudyn.reports import plots

_WIDE = 4.0
"""Inches from which a panel shares its line with one other at most, narrower ones with two."""


@dataclass(frozen=True)
class Panel:
    """One pair of axes: ``title`` stands above it, ``alt`` says what it shows to whoever does not see it."""

    title: str
    alt: str
    draw: Callable[[Axes], None]


@dataclass(frozen=True)
class Key:
    """What a line's colour (an index into ``plots.COLOURS``; None for the text's) and style mean."""

    colour: int | None
    style: Literal["-", "--", ":", "."]
    meaning: str


@dataclass(frozen=True)
class Plot:
    """One figure of the paper; sizes of a panel in inches."""

    title: str
    caption: str
    panels: tuple[Panel, ...]
    keys: tuple[Key, ...]
    width: float
    height: float


def panels_html(plot: Plot, name: str) -> str:
    """HTML of the figure: each panel a plot of its own, so that they flow on a narrow screen; ``name`` is its own on
    its page.
    """
    drawn = []
    for index, panel in enumerate(plot.panels):
        svg = plots.svg(f"{name}-{index}", panel.draw, plot.height, plot.width)
        picture = plots.labelled(svg, f"{panel.title}: {panel.alt}")
        drawn.append(f"<div><h3>{escape(panel.title)}</h3>\n{picture}</div>\n")
    lines = {"-": "line", "--": "line dashed", ":": "line dotted", ".": "dot"}
    keys = "".join(
        f'<span><i class="{lines[key.style]}" style="{_ink(key)}"></i>{escape(key.meaning)}</span> '
        for key in plot.keys
    )
    wide = " wide" if plot.width >= _WIDE else ""
    return (
        f'<figure>\n<p class="key">{keys}</p>\n<div class="panels{wide}">\n{"".join(drawn)}</div>\n'
        f"<figcaption>{escape(plot.caption)}.</figcaption>\n</figure>\n"
    )


def _ink(key: Key) -> str:
    colour = "var(--ink)" if key.colour is None else f"var(--c{key.colour + 1})"
    return f"background:{colour}" if key.style == "." else f"border-color:{colour}"


def panels_page(plot: Plot, size: tuple[float, float]) -> Figure:
    """The figure on a page of its own of ``size`` inches, keys and caption below."""
    columns = 3 if plot.width < _WIDE else min(2, len(plot.panels))
    rows = -(-len(plot.panels) // columns)
    with mpl.rc_context(plots.STYLE | {"font.size": 8.0}):
        page = Figure(figsize=size)
        page.text(0.08, 0.955, plot.title, fontsize=13.0, weight="bold")
        height = min(0.82, rows * (plot.height + 0.35) / size[1])
        below = 0.93 - height
        area = page.add_gridspec(
            rows, columns, left=0.09, right=0.95, top=0.92, bottom=below + 0.05, hspace=0.6, wspace=0.35
        )
        for index, panel in enumerate(plot.panels):
            axes = page.add_subplot(area[index // columns, index % columns])
            axes.set_title(panel.title, fontsize=9.0, loc="left")
            panel.draw(axes)
        handles = [_handle(key) for key in plot.keys]
        page.legend(
            handles, [key.meaning for key in plot.keys], loc="upper left", bbox_to_anchor=(0.07, below), ncols=4
        )
        page.text(0.08, below - 0.05, textwrap.fill(plot.caption + ".", 110), va="top", fontsize=8.0)
    return page


def _handle(key: Key) -> Line2D:
    colour = plots.INK if key.colour is None else plots.COLOURS[key.colour]
    if key.style == ".":
        return Line2D([], [], color=colour, marker=".", linestyle="none")
    return Line2D([], [], color=colour, linestyle=key.style)
