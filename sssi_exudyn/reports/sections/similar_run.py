"""The simulated run that looks most like the recording, next to it."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import Drawing
from sssi_exudyn.validation.diagnosis.diagnosis_data import SimilarRun
from sssi_exudyn.validation.diagnosis.search.missing_force import DIRECTIONS

_DRAWN: Final = 2
"""Directions that are drawn, along and across: a third pair of lines hides the others."""


def similar_run(similar: SimilarRun) -> Drawing:
    """Return the force that does what the model lacks, in the recording and in that run."""
    caption = (
        f"The most similar of the simulated runs, which had {similar.name.replace('_', ' ')}: the force that would do "
        "what the model lacks, solid in the recording, dashed in that run"
    )
    return Drawing(caption, lambda axes: _draw(axes, similar))


def _draw(axes: Axes, similar: SimilarRun) -> None:
    edges = np.array(similar.edges_s)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for k, direction in enumerate(DIRECTIONS[:_DRAWN]):
        colour = plots.OF_DIRECTIONS[k]
        axes.plot(middles, np.array(similar.recorded_N)[:, k], color=colour, label=f"{direction}, recording")
        axes.plot(middles, np.array(similar.simulated_N)[:, k], "--", color=colour, label=f"{direction}, simulated")
    axes.axhline(0.0, color=plots.INK, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="force (N)")
