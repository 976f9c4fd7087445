"""Plots as SVG: the text at their axes is inside the picture."""

from __future__ import annotations

import re

import pytest
from matplotlib.axes import Axes

from sssi_exudyn.reports.plots import svg


@pytest.mark.parametrize("most", [0.0006, 1.0, -1234.5, 123456.0])
def test_numbers_of_any_length_leave_room_for_the_axis_label(most: float) -> None:
    def draw(axes: Axes) -> None:
        axes.plot([0.0, 1.0], [0.0, most])
        axes.ticklabel_format(style="plain")
        axes.set(ylabel="time gap (s)")

    (place,) = re.findall(r'x="([\d.-]+)"[^>]*rotate\(-90', svg("plot", draw, 2.9, 7.2))
    assert float(place) > 10.0  # letters of 10 points stand to the left of it
