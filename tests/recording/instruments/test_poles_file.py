"""Load cells in poles: the plants that they show, and the faults of their files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tiny import TOML, Columns, Tiny, csv

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.from_recording import model_of, planted_poles
from sssi_exudyn.motion.from_recording import motion_from_recording
from sssi_exudyn.recording.instruments.poles import MOST_PLANTS, plants_of, read_poles
from sssi_exudyn.recording.read import read_recording

TIME = np.arange(0.0, 8.0, 0.01)


def push(start: float, stop: float, most: float) -> Array:
    """Return the force, N, of a push up and down as ½(1 − cos)."""
    share = np.clip((TIME - start) / (stop - start), 0.0, 1.0)
    return 0.5 * most * (1.0 - np.cos(2.0 * np.pi * share))


def cells() -> Columns:
    """Return columns of a left pole that is planted twice, and a right one once, whose cell rests at −8 N."""
    return {
        "time_s": TIME.copy(),
        "left_N": push(1.0, 1.3, 90.0) + push(5.0, 5.2, 60.0),
        "right_N": push(3.0, 3.4, 120.0) - 8.0,
    }


def write(folder: Path, columns: Columns) -> Path:
    path = folder / "poles.csv"
    path.write_text(csv(columns), encoding="utf-8")
    return path


def test_plants_as_they_were(tmp_path: Path) -> None:
    poles = read_poles(write(tmp_path, cells()), time_offset=0.5)
    assert poles.time[0] == 0.5
    assert [note for note in poles.notes if "right_N shows -8 N at rest" in note]
    plants = plants_of(poles)
    assert [plant.side for plant in plants] == [1, -1, 1]
    for plant, (start, stop, most) in zip(plants, [(1.0, 1.3, 90.0), (3.0, 3.4, 120.0), (5.0, 5.2, 60.0)], strict=True):
        # to a sample of 10 ms
        assert (plant.start, plant.stop) == pytest.approx((start + 0.5, stop + 0.5), abs=0.0101)
        assert plant.impulse == pytest.approx(0.5 * most * (stop - start), rel=1e-3)


def test_poles_that_only_swing_were_not_planted(tmp_path: Path) -> None:
    columns = cells()
    columns["left_N"] = 6.0 * np.sin(9.0 * TIME) + 2.0 * np.maximum(np.sin(9.0 * TIME), 0.0)
    plants = plants_of(read_poles(write(tmp_path, columns)))
    assert [plant.side for plant in plants] == [-1]


def test_of_many_plants_the_strongest(tmp_path: Path) -> None:
    columns = cells()
    columns["left_N"] = np.sum([push(0.1 * k, 0.1 * k + 0.06, 50.0 + k) for k in range(75)], axis=0)
    plants = plants_of(read_poles(write(tmp_path, columns)))
    assert len(plants) == MOST_PLANTS
    assert min(plant.impulse for plant in plants) > 0.5 * 0.06 * 60.0
    assert [plant.start for plant in plants] == sorted(plant.start for plant in plants)


def no_column(columns: Columns) -> None:
    del columns["right_N"]


def huge(columns: Columns) -> None:
    columns["left_N"][100] = 4000.0


def constant(columns: Columns) -> None:
    columns["left_N"][:] = 3.0


def pulled(columns: Columns) -> None:
    columns["left_N"] *= -1.0


def back(columns: Columns) -> None:
    columns["time_s"] = columns["time_s"][::-1].copy()


@pytest.mark.parametrize(
    ("spoil", "place", "problem"),
    [
        (no_column, "header", "column right_N is missing"),
        (huge, "line 102, left_N", "4000 N is no force along a pole"),
        (constant, "column left_N", "the cell shows one value"),
        (pulled, "column left_N", "pulled more than pressed"),
        (back, "line 2", "runs back"),
    ],
)
def test_broken_files(tmp_path: Path, spoil: Callable[[Columns], None], place: str, problem: str) -> None:
    columns = cells()
    spoil(columns)
    with pytest.raises(InputError) as info:
        read_poles(write(tmp_path, columns))
    assert info.value.place == place
    assert problem in info.value.problem
    assert info.value.fix


@pytest.mark.parametrize("text", ["", "time_s,left_N,right_N\n", "time_s,left_N,right_N\n0,a,1\n", "\x00" * 64])
def test_files_that_are_none(tmp_path: Path, text: str) -> None:
    path = tmp_path / "poles.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError):
        read_poles(path)


def test_the_model_has_what_was_felt(tmp_path: Path) -> None:
    toml = TOML.replace("boot_centre_m = 0.0", "boot_centre_m = 0.0\npole_length_m = 1.1")
    folder = Tiny(toml=f'{toml}\n[poles]\nfile = "poles.csv"\n').write(tmp_path)
    write(folder, cells())
    recording = read_recording(folder)
    assert "poles.csv" in recording.hashes
    assert [notice for notice in recording.notices if "planted 3 times" in notice]
    motion = motion_from_recording(recording)
    poles = planted_poles(recording, motion)
    assert [term.side for term in poles] == [1.0, -1.0, 1.0]
    assert [term.press for term in poles] == pytest.approx([90.0, 120.0, 60.0], rel=0.08)  # ends to a sample
    for term, impulse in zip(poles, (13.5, 24.0, 6.0), strict=True):
        assert 0.5 * term.press * (term.t1 - term.t0) == pytest.approx(impulse, rel=1e-3)
        assert term.length == 1.1
        assert 0.0 <= term.ahead <= 1.0
    names = [term.name for term in model_of(recording, motion).terms]
    assert names.count("planted_pole") == 3


def test_an_unknown_key(tmp_path: Path) -> None:
    folder = Tiny(toml=f'{TOML}\n[poles]\nfile = "poles.csv"\nside = "left"\n').write(tmp_path)
    write(folder, cells())
    with pytest.raises(InputError, match="unknown key"):
        read_recording(folder)
