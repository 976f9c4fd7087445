"""The model in Exudyn: names, sensors, what is drawn, and changes made there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bundled import EXAMPLES, bundled

import sssi_exudyn
from sssi_exudyn.core.errors import InputError

SUPPORT = Path(__file__).parents[2] / "support"
SCRIPT = SUPPORT / "models" / "open_model_figures.py"


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = os.pathsep.join([str(SUPPORT), *os.environ.get("PYTHONPATH", "").split(os.pathsep)])
    command = [sys.executable, str(SCRIPT), str(tmp_path_factory.mktemp("exudyn"))]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": path}, check=False)
    assert done.returncode == 0, done.stderr
    table: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return table


@pytest.mark.long(seconds=12)
def test_every_item_has_a_name_of_its_own(figures: dict[str, Any]) -> None:
    assert figures["named"] == figures["numbers"]


@pytest.mark.long(seconds=12)
def test_a_run_in_two_parts_is_the_run(figures: dict[str, Any]) -> None:
    assert figures["between"] == pytest.approx(0.2, abs=0.007)  # the end of a step
    assert figures["end"] == pytest.approx(0.5)
    # m, N and rad; where the solver begins again it takes another Jacobian, and its tolerance is 1e-4
    assert figures["track"] < 1e-5
    assert figures["loads"] < 1.0
    assert figures["edges"] < 1e-4


@pytest.mark.long(seconds=12)
def test_sensors_record_every_step(figures: dict[str, Any]) -> None:
    assert figures["shape"] == [figures["samples"], 52]  # time, and the 51 nodes of a ski of 50 elements


@pytest.mark.long(seconds=12)
def test_markers_are_where_the_segments_are(figures: dict[str, Any]) -> None:
    assert figures["head"] < 1e-9  # m: two ways of the same kinematics


@pytest.mark.long(seconds=12)
def test_a_viewer_has_a_solution_and_shapes(figures: dict[str, Any]) -> None:
    assert figures["rows"] >= 10  # 0.3 s, every 0.02 s or a step later
    assert max(figures["under"]) < 0.08  # m, a drawn ski's corner next to the foot: its half width and step
    assert 1.0 < figures["height"] < 2.0
    assert figures["snow"] > 100


@pytest.mark.long(seconds=12)
def test_a_load_on_the_back_is_felt_by_the_snow(figures: dict[str, Any]) -> None:
    assert figures["gravity"] == pytest.approx(1.0)
    # 100 N along the normal; the skier sinks and swings for the first tenths of a second
    assert figures["pressed"] == pytest.approx(100.0, rel=0.1)


@pytest.mark.long(seconds=12)
def test_the_example_hangs_a_rucksack_on_the_skier(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / "rucksack.py")], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "rucksack" / "solution.txt").is_file()
    words = done.stdout.split()
    assert float(words[3]) > float(words[6]) + 40.0  # N: half the weight of 8 kg at least, whatever the turns do


@pytest.mark.long
def test_what_cannot_be_built_is_said() -> None:
    recording, _ = bundled("beginner")
    with pytest.raises(InputError, match="less than"):
        sssi_exudyn.build(recording, seconds=(100.0, 400.0))
    with pytest.raises(InputError, match="own run's begin"):
        sssi_exudyn.build(recording, sssi_exudyn.model_of(recording), seconds="2:3")
    model = sssi_exudyn.model_of(recording).with_heading("free")
    with pytest.raises(InputError, match="heading"):
        sssi_exudyn.build(recording, model)
