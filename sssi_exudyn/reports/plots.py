"""Plots of a result as SVG text that a page can hold inline.

Frames and words take the colour of the text around them and the data the page's own colours (``page.css``), so that a
plot reads on light and on dark; what differs in colour differs in lightness or line style too.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from html import escape
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00")
"""Okabe and Ito's vermillion, blue, green, purple and orange; the page's ``--c1`` to ``--c5``."""
MEASURED, SIMULATED, OTHER = COLOURS[:3]
OF_DIRECTIONS = (SIMULATED, MEASURED, OTHER)
"""Colours of a force along the path, across it and away from the snow."""
INK = "#010203"
"""Stands for the text's colour until the SVG is written; no plot uses it for anything else."""
_DESK, _PHONE = 7.2, 4.0
"""Inches of a figure over the whole width of a page, on a wide screen and on a narrow one."""
WIDE = 4.0
"""Inches from which a panel shares its line with at most one other, narrower ones with two."""
_LEAST_LEFT = 0.54
"""Inches left of axes without a label."""
_PADDING = 0.04
"""Inches between what stands at the axes and the figure's edge."""
_MOST_COLUMNS = 4
"""Columns of a legend."""
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # words stay words: searchable, and in the page's own font
    "text.parse_math": False,  # names come from files: a dollar sign begins no formula
    "font.size": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.2,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
} | dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color", "grid.color"), INK)


def whole_width(name: str, draw: Callable[[Axes], None], height: float = 2.9) -> str:
    """Return a figure over the whole width of a page as two pictures, of which ``page.css`` shows one.

    A wide picture on a narrow screen would have words too small to read.
    """
    pictures = {"desk": svg(name, draw, height, _DESK), "phone": svg(f"{name}-phone", draw, height, _PHONE)}
    return "\n".join(
        picture.replace("<svg ", f'<svg class="{screen}" ', 1).rstrip() for screen, picture in pictures.items()
    )


def svg(name: str, draw: Callable[[Axes], None], height: float, width: float) -> str:
    """Return the drawing of ``draw`` as SVG text; ``name`` is this plot's own on its page, its size in inches."""
    with mpl.rc_context(STYLE | {"svg.hashsalt": name}):  # a salt of its own: identical runs give identical bytes
        figure = Figure(figsize=(width, height))
        FigureCanvasAgg(figure)  # measures words
        figure.patch.set_alpha(0.0)
        axes = figure.add_subplot()
        axes.patch.set_alpha(0.0)
        draw(axes)
        _place_legend(axes, width)
        _fit_margins(figure, axes)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    drawn = text.getvalue()
    drawn = drawn[drawn.index("<svg") :].replace(INK, "currentColor")
    for index, colour in enumerate(COLOURS, 1):
        drawn = drawn.replace(colour, f"var(--c{index})")
    drawn = _lighter(drawn)
    # Several plots share one page, and identifiers have to be one plot's own there.
    drawn = re.sub(r'\bid="', f'id="{name}-', drawn)
    drawn = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", drawn)
    return re.sub(r' (width|height)="[\d.]+pt"', "", drawn, count=2)


def _place_legend(axes: Axes, width: float) -> None:
    """Put the legend above the axes, where no data are, in as many columns as fit ``width`` (inches).

    The figure grows by all rows but the first.
    """
    count = len(axes.get_legend_handles_labels()[0])
    figure = axes.get_figure(root=True)
    if not count or figure is None:
        return
    for columns in range(min(count, _MOST_COLUMNS), 0, -1):
        legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderpad=0.0)
        needed = legend.get_window_extent().width / figure.dpi
        if needed < width - _LEAST_LEFT - 2.0 * _PADDING:
            break
    rows = -(-count // columns)
    tall = legend.get_window_extent().height / figure.dpi
    figure.set_figheight(figure.get_figheight() + tall * (1.0 - 1.0 / rows))  # more rows do not make the axes lower


def _fit_margins(figure: Figure, axes: Axes) -> None:
    """Leave room around the axes for all that stands there: ticks, labels, a legend, a second axis, a colour bar.

    Sizes are those of matplotlib's own font, which is wider than the fonts of browsers.  Margins have least sizes, so
    that plots below each other align.
    """
    width, height = figure.get_size_inches()
    left, bottom, right, top = _LEAST_LEFT + 0.18 * bool(axes.get_ylabel()), 0.48, 0.08, 0.08
    for _ in range(2):  # ticks may change with the size of the axes
        figure.subplots_adjust(left / width, bottom / height, 1.0 - right / width, 1.0 - top / height)
        box, before = figure.get_tightbbox(), (left, bottom, right, top)  # inches
        left, bottom = max(left, left - box.x0 + _PADDING), max(bottom, bottom - box.y0 + _PADDING)
        right, top = max(right, right + box.x1 - width + _PADDING), max(top, top + box.y1 - height + _PADDING)
        if (left, bottom, right, top) == before:
            return
    figure.subplots_adjust(left / width, bottom / height, 1.0 - right / width, 1.0 - top / height)


def with_label(drawn: str, text: str) -> str:
    """Return the pictures of a figure with its text for screen readers."""
    return drawn.replace("<svg ", f'<svg role="img" aria-label="{escape(text)}" ')


def _lighter(drawn: str) -> str:
    """Return the same picture in half the bytes: places to 0.1 pt, no names of groups, the page's font and style."""
    drawn = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", drawn, flags=re.DOTALL)
    drawn = re.sub(r'<g id="[^"]*">', "<g>", drawn)
    drawn = re.sub(r"font-family: [^;]*; ", "", drawn)
    drawn = re.sub(r' transform="rotate\(-0 [\d. ]*\)"', "", drawn)

    def shorter(attribute: re.Match[str]) -> str:
        return re.sub(r"(\d+\.\d)\d+", r"\1", " ".join(attribute[0].split()))

    drawn = re.sub(r'\b(?:d|x|y|points)="[^"]*"', shorter, drawn)
    return re.sub(r"\n\s*", "\n", drawn)
