"""``[uncertainty]`` of ``recording.toml``: usual values where it is silent, and one clear line for each fault."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from bundled import EXAMPLES

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.recording.read import read_recording
from sssi_exudyn.recording.uncertainty import Uncertainty


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(EXAMPLES / "beginner", tmp_path / "run"))


def add(folder: Path, table: str) -> None:
    with (folder / "recording.toml").open("a", encoding="utf-8") as file:
        file.write(f"\n[uncertainty]\n{table}\n")


def test_the_usual_where_nothing_is_given(folder: Path) -> None:
    assert read_recording(folder).uncertainty == Uncertainty()


def test_others_are_taken_in_their_units(folder: Path) -> None:
    add(folder, "foot_deg = 0.5\nmass_kg = 0.0\ndrag_share = 0.3\nresidual_moment_Nm = 35.0\ninsole_zero_N = 40.0")
    uncertainty = read_recording(folder).uncertainty
    assert uncertainty.foot == pytest.approx(np.radians(0.5))
    assert (uncertainty.mass, uncertainty.drag, uncertainty.residual_moment) == (0.0, 0.3, 35.0)
    assert (uncertainty.insole_zero, uncertainty.insole_clock) == (40.0, Uncertainty().insole_clock)
    assert uncertainty.trunk == Uncertainty().trunk


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("foot_degrees = 1.0", "did you mean 'foot_deg'"),
        ("mass_kg = -1.0", "mass_kg"),
        ("mass_kg = 'two'", "mass_kg"),
        ("drag_share = 15.0", "drag_share"),
    ],
)
def test_what_is_wrong_gets_one_line(folder: Path, table: str, message: str) -> None:
    add(folder, table)
    with pytest.raises(InputError, match=message) as caught:
        read_recording(folder)
    assert "[uncertainty]" in str(caught.value)
