"""The insole reader: any number of cells, dead cells, gaps, and broken files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiny import Columns, csv, loads

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.instruments.insoles import read_insoles


def write(folder: Path, columns: Columns) -> Path:
    path = folder / "insoles.csv"
    path.write_text(csv(columns), encoding="utf-8")
    return path


@pytest.mark.parametrize("cells", [1, 4, 16])
def test_totals_are_the_sums_of_any_number_of_cells(tmp_path: Path, cells: int) -> None:
    columns = loads(cells)
    insoles = read_insoles(write(tmp_path, columns), time_offset=-1.0)
    expected = sum(columns[f"right_{cell}_N"] for cell in range(1, cells + 1))
    np.testing.assert_allclose(insoles.right, expected, atol=1e-4 * cells)  # four digits a cell in the file
    assert insoles.left_cells.shape == (len(columns["time_s"]), cells)
    assert insoles.time[0] == -1.0
    assert insoles.dead_cells == ()
    assert insoles.notes == ()


def test_cells_are_ordered_by_number_not_by_column(tmp_path: Path) -> None:
    columns = loads(16)
    names = sorted(columns, key=lambda name: (name != "time_s", name))  # left_1, left_10, left_11, …
    insoles = read_insoles(write(tmp_path, {name: columns[name] for name in names}))
    np.testing.assert_allclose(insoles.left_cells[:, 9], columns["left_10_N"], atol=1e-4)


def test_totals_alone(tmp_path: Path) -> None:
    columns = loads(4)
    left = sum(columns[f"left_{cell}_N"] for cell in range(1, 5))
    right = sum(columns[f"right_{cell}_N"] for cell in range(1, 5))
    insoles = read_insoles(write(tmp_path, {"time_s": columns["time_s"], "left_N": left, "right_N": right}))
    np.testing.assert_allclose(insoles.left, left, atol=1e-4)
    assert insoles.left_cells.shape[1] == 1


@pytest.mark.parametrize("value", [0.0, 123.0])
def test_dead_cell_is_listed_and_left_out(tmp_path: Path, value: float) -> None:
    columns = loads(4)
    columns["left_3_N"][:] = value
    insoles = read_insoles(write(tmp_path, columns))
    assert insoles.dead_cells == ("left_3_N",)
    np.testing.assert_allclose(insoles.left, sum(columns[f"left_{cell}_N"] for cell in (1, 2, 4)), atol=1e-3)
    assert any("left_3_N" in note for note in insoles.notes)


def test_cell_that_dies_during_the_run_is_dead(tmp_path: Path) -> None:
    columns = loads(4)
    columns["right_2_N"][150:] = 0.0
    assert read_insoles(write(tmp_path, columns)).dead_cells == ("right_2_N",)


def test_cells_of_a_lifted_foot_are_alive(tmp_path: Path) -> None:
    columns = loads(4)
    for cell in range(1, 5):
        columns[f"right_{cell}_N"][100:250] = 0.0
    assert read_insoles(write(tmp_path, columns)).dead_cells == ()


def test_short_gap_is_interpolated_and_long_one_splits(tmp_path: Path) -> None:
    columns = {name: np.delete(column, slice(20, 30)) for name, column in loads(4).items()}
    insoles = read_insoles(write(tmp_path, columns))
    assert len(insoles.time) == len(loads(4)["time_s"])
    assert np.allclose(np.diff(insoles.time), 0.02)
    assert any("interpolated" in note for note in insoles.notes)
    columns = {name: np.delete(column, slice(20, 120)) for name, column in loads(4).items()}
    insoles = read_insoles(write(tmp_path, columns))
    assert insoles.time[0] == pytest.approx(2.4)
    assert any("split" in note for note in insoles.notes)


def dead_foot(columns: Columns) -> Columns:
    return columns | {f"left_{cell}_N": np.zeros_like(columns["time_s"]) for cell in range(1, 5)}


def back(columns: Columns) -> Columns:
    return columns | {"time_s": columns["time_s"][::-1].copy()}


FAULTS: dict[str, tuple[Callable[[Columns], Columns], str, str]] = {
    "dead foot": (dead_foot, "column left_1_N", "no living cell"),
    "time runs back": (back, "line 2", "runs back"),
    "a force of tonnes": (lambda c: c | {"left_1_N": c["left_1_N"] * 1e4}, "left_1_N", "no force of a foot"),
    "no time": (lambda c: {n: v for n, v in c.items() if n != "time_s"}, "header", "time_s"),
    "a cell missing": (lambda c: {n: v for n, v in c.items() if n != "left_2_N"}, "header", "3 cells"),
    "no cells": (lambda c: {n.replace("_N", "_kPa"): v for n, v in c.items()}, "header", "0 cells"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_files_are_named_with_place_and_fix(tmp_path: Path, fault: str) -> None:
    change, place, problem = FAULTS[fault]
    path = write(tmp_path, change(loads(4)))
    with pytest.raises(InputError) as caught:
        read_insoles(path)
    assert str(path) in str(caught.value)
    assert place in caught.value.place
    assert problem in caught.value.problem
    assert caught.value.fix
