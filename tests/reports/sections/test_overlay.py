"""Two runs over each other: the runner ahead, and the time gap at the same place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_run import a_run
from matplotlib.figure import Figure

from sssi_exudyn.reports.section import Panels
from sssi_exudyn.reports.sections.overlay import overlay
from sssi_exudyn.reports.sections.replay import the_runs
from sssi_exudyn.results.stored import StoredRun


@pytest.fixture(scope="module")
def run() -> StoredRun:
    return a_run(8.0)


def slower(run: StoredRun, factor: float) -> StoredRun:
    """Return the same path in ``factor`` times the time."""
    series = run.series.assign(time_s=run.series["time_s"] * factor)
    return replace(run, series=series, summary=replace(run.summary, recording="slower"))


def test_the_time_gap_is_that_of_the_clocks(run: StoredRun) -> None:
    section = overlay([run, slower(run, 1.5)])
    (block,) = section.blocks
    assert isinstance(block, Panels)
    assert [panel.title for panel in block.panels] == ["tracks", "time gap", "speed"]
    axes = Figure().add_subplot()
    block.panels[1].draw(axes)
    places, gap = axes.lines[1].get_data()
    first = np.interp(places, run.com[:, 0] - run.com[0, 0], run.time)
    np.testing.assert_allclose(gap, 0.5 * first, atol=1e-9)
    # at the last place that is compared, less than a step before the end
    assert f"{run.name} is {float(np.asarray(gap)[-1]):.2f} s ahead" in section.sentence


def test_speeds_are_at_the_same_place(run: StoredRun) -> None:
    (block,) = overlay([run, slower(run, 2.0)]).blocks
    assert isinstance(block, Panels)
    axes = Figure().add_subplot()
    block.panels[2].draw(axes)
    fast, slow = (np.asarray(line.get_ydata()) for line in axes.lines)
    np.testing.assert_allclose(slow, 0.5 * fast, rtol=1e-9)


@pytest.mark.parametrize("count", [1, 3])
def test_one_run_or_three_have_none(run: StoredRun, count: int) -> None:
    assert overlay([run] * count).blocks == ()


def test_several_replays_are_played_together(run: StoredRun) -> None:
    assert "together" in str(the_runs([run, run]).blocks)
    assert "together" not in str(the_runs([run]).blocks)
