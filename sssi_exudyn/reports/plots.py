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
from matplotlib.figure import Figure

COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00")
"""Okabe and Ito's vermillion, blue, green, purple and orange; the page's ``--c1`` to ``--c5``."""
MEASURED, SIMULATED, OTHER = COLOURS[:3]
INK = "#010203"
"""Stands for the text's colour until the SVG is written; no plot uses it for anything else."""
WIDE = 4.0
"""Inches from which a panel shares its line with at most one other, narrower ones with two."""
_INCHES_A_LETTER = 0.078
"""Width of a letter of the page's font in its size, on average and a little more."""
_INCHES_A_FIGURE = 0.088
"""Width of a digit; a point has half of it, a minus sign 1.4 times as much."""
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


def svg(name: str, draw: Callable[[Axes], None], height: float = 2.9, width: float = 7.2) -> str:
    """Return the drawing of ``draw`` as SVG text; ``name`` is this plot's own on its page, its size in inches."""
    with mpl.rc_context(STYLE | {"svg.hashsalt": name}):  # a salt of its own: identical runs give identical bytes
        figure = Figure(figsize=(width, height))
        figure.patch.set_alpha(0.0)
        axes = figure.add_subplot()
        axes.patch.set_alpha(0.0)
        draw(axes)
        above = 0.08
        if axes.get_legend_handles_labels()[0]:
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderpad=0.0)  # above, where no data are
            above = 0.3
        # fixed margins (inches), so that plots below each other align, as long as what stands at the axis fits
        left = max(0.72 if axes.get_ylabel() else 0.54, _for_ticks(axes))
        figure.subplots_adjust(left / width, 0.48 / height, 1.0 - 0.08 / width, 1.0 - above / height)
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


def _for_ticks(axes: Axes) -> float:
    """Return the inches needed along the left axis for names or numbers."""
    words = [label.get_text() for label in axes.get_yticklabels()]
    if any(re.search("[A-Za-z]", word) for word in words):
        return _INCHES_A_LETTER * max(map(len, words)) + (0.35 if axes.get_ylabel() else 0.15)
    figures = max(
        (len(word) - 0.5 * word.count(".") + 0.4 * word.count("\N{MINUS SIGN}") for word in words), default=0.0
    )
    return _INCHES_A_FIGURE * figures + (0.33 if axes.get_ylabel() else 0.15)


def with_label(drawn: str, text: str) -> str:
    """Return the picture with its text for screen readers."""
    return drawn.replace("<svg ", f'<svg role="img" aria-label="{escape(text)}" ', 1)


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
