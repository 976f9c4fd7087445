"""Angles in figures: continuous, and with the sign of the series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from a_run import a_run
from matplotlib.figure import Figure

from sssi_exudyn.reports.section import Panels
from sssi_exudyn.reports.sections.curve_figures import figure_5
from sssi_exudyn.results.stored import StoredRun


def curve(run: StoredRun, title: str) -> np.ndarray:
    """Return the first curve of the panel of that title."""
    (block,) = figure_5([run]).blocks
    assert isinstance(block, Panels)
    axes = Figure().add_subplot()
    next(panel for panel in block.panels if panel.title == title).draw(axes)
    curves = [np.asarray(line.get_ydata()) for line in axes.lines if len(np.asarray(line.get_ydata())) > 2]
    return curves[0]


def test_knees_flex_positive_as_in_the_series() -> None:
    run = a_run(6.0)
    bent = replace(run, series=run.series.assign(knee_angle_r_deg=40.0))
    np.testing.assert_allclose(curve(bent, "knee flexion (°)"), 40.0)


def test_a_turn_past_half_a_circle_does_not_jump() -> None:
    run = a_run(6.0)
    turned = np.linspace(150.0, 250.0, len(run.series))
    series = run.series.assign(pelvis_rotation_deg=(turned + 180.0) % 360.0 - 180.0)
    steps = np.abs(np.diff(curve(replace(run, series=series), "pelvis left rotation (°)")))
    assert np.max(steps) < 5.0
