"""Separators of tables, and gaps, which are counted before they are filled."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_NUMBERS
from sssi_exudyn.io.table import bridge_gaps, read_table

FILE = Path("any.csv")


def test_a_short_gap_gets_the_samples_that_are_missing() -> None:
    time = np.delete(np.arange(100) * 0.05, slice(40, 45))
    clock = bridge_gaps(FILE, time)
    np.testing.assert_allclose(clock.time, np.arange(100) * 0.05, atol=1e-12)
    assert np.flatnonzero(clock.bridged).tolist() == [40, 41, 42, 43, 44]


@pytest.mark.parametrize(
    ("time", "problem"),
    [
        (np.r_[np.arange(100) * 1e-8, 0.9 + np.arange(100) * 1e-8, 1.8], "more than any run has"),
        (np.r_[np.arange(60) * 5e-324, 0.5, 1.0], "more than any run has"),
        (np.cumsum(np.where(np.arange(900) % 20, 1e-4, 0.9)), "missing between them"),
    ],
)
def test_gaps_without_measure_are_refused(time: Array, problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        bridge_gaps(FILE, time)


def test_wide_samples_count_for_more() -> None:
    time = np.delete(np.arange(2000) * 0.01, slice(500, 520))
    assert len(bridge_gaps(FILE, time, MAX_NUMBERS // 2000).time) == 2000
    with pytest.raises(InputError, match="more than any run has"):
        bridge_gaps(FILE, time, MAX_NUMBERS // 1999)


@pytest.mark.parametrize(
    "text",
    [
        "time_s,a\n0,1.5\n0.5,-2e1\n",
        "sep=,\n\ntime_s,a\n0,1.5\n0.5,-2e1\n",
        '"time_s";"a"\n0;1.5\n0.5;-2e1\n',
        "SEP=;\r\ntime_s;a\r\n0;1,5\r\n0,5;-2e1\r\n",
        "time_s\ta\n0\t1,5\n0,5\t-2e1\n",
    ],
)
def test_cells_are_separated_by_commas_semicolons_or_tabs(text: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8", newline="")
    columns = read_table(path).columns
    assert list(columns) == ["time_s", "a"]
    assert columns["time_s"].tolist() == [0.0, 0.5]
    assert columns["a"].tolist() == [1.5, -20.0]


def test_lines_of_a_marked_table_keep_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("sep=;\ntime_s;a\n0;1\n1;one\n2;1\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 4, column 2: 'one' is not a number"):
        read_table(path)
    path.write_text("sep=;\n", encoding="utf-8")
    with pytest.raises(InputError, match="the table is empty"):
        read_table(path)
