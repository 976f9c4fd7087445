"""The report's tables of figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_run import a_run

from sssi_exudyn.reports.section import Grid, Section
from sssi_exudyn.reports.sections import tables
from sssi_exudyn.results.stored import StoredRun


def energies(run: StoredRun) -> dict[str, float]:
    """The section's column by its titles; its one table."""
    (block,) = tables.energy((run,)).blocks
    assert isinstance(block, Grid)
    return {title: float(value) for title, value in block.rows[2:]}


def test_the_energy_column_adds_up() -> None:
    run = a_run()
    time = run.time
    given = {
        "gravity": 900.0 * time,
        "friction": -700.0 * time + 3.0,
        "air": -100.0 * time,
        "kinetic": 1370.0 + 100.0 * time - 0.2 * time,
        "elastic": 7.0 + 0.1 * time,
    }
    series = run.series[[name for name in run.series if not name.startswith("energy_")]]
    run = replace(run, series=series.assign(**{f"energy_{name}_J": values for name, values in given.items()}))
    column = energies(run)
    span = float(np.ptp(time))
    works = sum(value for title, value in column.items() if title.startswith("work of "))
    # each of four numbers is rounded to 0.1 J
    assert works == pytest.approx(column["sum of the works (J)"], abs=0.2)
    gained = column["kinetic energy gained (J)"] + column["elastic energy of the skis gained (J)"]
    assert gained + column["left over (J)"] == pytest.approx(column["sum of the works (J)"], abs=0.2)
    assert column["left over (J)"] == pytest.approx(0.1 * span, abs=0.06)
    # what was gained, not what there is at the end
    assert column["kinetic energy gained (J)"] == pytest.approx(99.8 * span, abs=0.06)


def test_the_energy_table_adds_up_as_printed() -> None:
    def column(section: Section) -> dict[str, float]:
        (grid,) = section.blocks
        assert isinstance(grid, Grid)
        return {row[0]: float(row[1]) for row in grid.rows[1:] if row[0].endswith("(J)")}

    run = a_run(6.0)
    share = np.linspace(0.0, 1.0, len(run.series))
    # values whose rounding does not add up: 0.04 four times is 0.16
    works = {f"energy_term{i}_J": 0.04 * share for i in range(4)} | {"energy_kinetic_J": 0.12 * share}
    series = run.series.drop(columns=[name for name in run.series if name.startswith("energy_")]).assign(**works)
    for printed in (column(tables.energy([run])), column(tables.energy([replace(run, series=series)]))):
        done = sum(value for name, value in printed.items() if name.startswith("work of"))
        gained = sum(value for name, value in printed.items() if name.endswith("gained (J)"))
        total = printed["sum of the works (J)"]
        assert done == pytest.approx(total, abs=1e-9)
        assert gained + printed["left over (J)"] == pytest.approx(total, abs=1e-9)
