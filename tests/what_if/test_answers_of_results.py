"""Answers from a result's folder to files, one by one and in a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from bundled import EXAMPLES
from no_plots import without_plots

import sssi_exudyn
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.sweeps.sweep import resume, sweep
from sssi_exudyn.what_if.answer import WhatIf, lines_of

pytestmark = pytest.mark.long(seconds=20)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a simulation of the beginner's first seconds."""
    out = tmp_path_factory.mktemp("results") / "beginner"
    with without_plots():
        sssi_exudyn.simulate(EXAMPLES / "beginner", out, seconds=":2.5")
    return out


def settings(result: Path, **changed: Any) -> dict[str, Any]:
    parameter = [{"name": "friction.mu_t", "values": [0.09]}, {"name": "skier.mass", "values": [80.0]}]
    return {"format": 1, "task": "whatif", "recordings": [str(result)], "parameter": parameter} | changed


def test_an_answer_and_a_row_of_a_sweep_are_the_same(result: Path, tmp_path: Path) -> None:
    changes = ["friction.mu_t=0.09", "skier.mass=80"]
    answer = sssi_exudyn.whatif(result, tmp_path / "answer", changes=changes, reduced=True)
    assert sweep(settings(result), tmp_path / "swept", in_this_process=True)["done"] == 1
    row = pd.read_parquet(tmp_path / "swept" / "runs.parquet").iloc[0]
    assert row["seconds_lost_s"] == answer.seconds_lost
    assert row["skiable"] == answer.skiable
    # a simulation has no fitted numbers: an interval without width would claim that all is known
    assert answer.seconds_low is None
    assert "no fitted numbers" in str(answer.no_interval)
    assert {row[f"max_{part.name}_{part.unit}"] for part in answer.corrections} == {
        part.largest for part in answer.corrections
    }
    assert answer.stricter is not None
    assert row["strict_seconds_lost_s"] == answer.stricter.seconds_lost
    assert resume(tmp_path / "swept", workers=1)["left"] == 0

    assert read_json(tmp_path / "answer" / "whatif.json", WhatIf) == answer
    runs = pd.read_csv(tmp_path / "answer" / "runs.csv")
    assert set(runs["run"]) == {"recorded", "asked"}
    assert (tmp_path / "answer" / "whatif.png").stat().st_size > 0


def test_an_answer_that_is_refused_has_no_interval(result: Path) -> None:
    answer = sssi_exudyn.whatif(result, changes=["wind.w_f=-20"], keep="movement", reduced=True)
    assert not answer.skiable
    assert (answer.seconds_low, answer.seconds_high) == (None, None)
    lines = lines_of(answer)
    assert "(without an interval)" in lines[0]
    assert f"no interval: {answer.no_interval}" in lines
    assert "beyond a skier's limits" in str(answer.no_interval)


def test_the_movement_alone_need_not_come_to_the_end(result: Path) -> None:
    answer = sssi_exudyn.whatif(result, changes=["friction.mu_t=0.25"], keep="movement", reduced=True)
    assert not answer.comes_to_the_end
    assert answer.compared_until_s < 2.5
    assert answer.seconds_lost > 0.0
    assert answer.seconds_lost == pytest.approx(2.5 - answer.compared_until_s, abs=0.15)  # samples are 0.1 s apart


@pytest.mark.parametrize(
    ("changed", "problem"),
    [
        ({"recordings": [str(EXAMPLES / "beginner")]}, "this folder is none"),
        ({"parameter": [{"name": "posture_air.c_d", "values": [1.0]}]}, "has no number"),
        ({"tier": "full"}, 'tier: it means nothing to task = "whatif"'),
        ({"parameter": [{"name": "gates.offset", "values": [1.1]}], "keep": "rhythm"}, "rhythm keeps none"),
        ({"parameter": [{"name": "gates.offset", "values": [1.1, 2.0]}]}, "outside"),
        ({"keep": "pace"}, "use one of: movement, path, rhythm, speed, line"),
        ({"task": "simulate", "keep": "path"}, 'write task = "whatif"'),
    ],
)
def test_a_mistake_in_a_sweep_is_one_line(result: Path, changed: dict[str, Any], problem: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=problem):
        sweep(settings(result, **changed), tmp_path / "out", in_this_process=True)
