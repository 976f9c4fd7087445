"""Figures that set skis side by side, and curves along their length: width, bending and torsional stiffness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.bodies.ski.ski import Ski
from sssi_exudyn.core.frames import Array
from sssi_exudyn.reports.plots import COLOURS
from sssi_exudyn.reports.section import Key, Panel, Panels

_STYLES: Final[tuple[Literal["-", "--"], ...]] = ("-", "--")
"""Styles of the lines: five skis, and five more."""


def line_of(index: int) -> dict[str, Any]:
    """Return colour and style of the line of the ski of that index."""
    count = len(COLOURS)
    return {"color": COLOURS[index % count], "linestyle": _STYLES[index // count % len(_STYLES)]}


def side_by_side(names: Sequence[str], panels: Sequence[Panel], caption: str) -> Panels:
    """Return a figure of panels in which each ski of ``names`` has the line of ``line_of``."""
    count = len(COLOURS)
    keys = [Key(index % count, _STYLES[index // count % len(_STYLES)], name) for index, name in enumerate(names)]
    return Panels(caption, tuple(panels), tuple(keys), 4.6, 2.5)


def ski_curves(skis: Sequence[Ski]) -> Panels:
    """Return width, EI and GJ along skis; a band is the stiffness' standard error where it is known."""
    panels = (
        _panel(skis, "width (mm)", lambda ski, s: 1e3 * ski.width(s), lambda ski: 0.0),
        _panel(skis, "bending stiffness EI (N m²)", Ski.bending_stiffness, lambda ski: _error(ski, "bending")),
        _panel(skis, "torsional stiffness GJ (N m²)", Ski.torsional_stiffness, lambda ski: _error(ski, "torsion")),
    )
    return side_by_side([ski.name for ski in skis], panels, "Width and stiffness along the ski")


def _error(ski: Ski, what: str) -> float:
    return 0.0 if ski.uncertainty is None else float(getattr(ski.uncertainty, what))


def _panel(
    skis: Sequence[Ski], label: str, curve: Callable[[Ski, Array], Array], error: Callable[[Ski], float]
) -> Panel:
    def draw(axes: Axes) -> None:
        s = np.linspace(0.0, 1.0, 201)
        for index, ski in enumerate(skis):
            place, values, share = 1e3 * ski.x_of_s(s), curve(ski, s), error(ski)
            axes.plot(place, values, **line_of(index))
            if share > 0.0:
                low, high = (1.0 - share) * values, (1.0 + share) * values
                axes.fill_between(place, low, high, color=line_of(index)["color"], alpha=0.2, linewidth=0)
        axes.set_ylim(bottom=0.0)
        axes.set(xlabel="ahead of the boot centre (mm)")

    return Panel(label, "along the ski", draw)
