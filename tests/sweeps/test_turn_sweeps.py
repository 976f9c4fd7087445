"""Sweeps over skis in steady turns."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import tomli_w
from bundled import EXAMPLES

from sssi_exudyn.bodies.ski.ski import read_ski, ski_to_table
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.simulation.turns.steady_turn import TurnCase, edges_of, start_rolling, steady_turn
from sssi_exudyn.sweeps.file import sweep_from
from sssi_exudyn.sweeps.parameters import reshape
from sssi_exudyn.sweeps.sweep import render_folder, resume, sweep

SLALOM = read_ski("slalom_165", ".")


def _settings(**changed: Any) -> dict[str, Any]:
    parameter = [{"name": "turn.edge_deg", "values": [45.0]}, {"name": "ski.sidecut_scale", "values": [1.0, 1.2]}]
    return {"format": 1, "task": "turn", "skis": ["slalom_165"], "parameter": parameter} | changed


@pytest.mark.long
def test_a_sweep_of_turns_gives_what_the_rig_gives(tmp_path: Path) -> None:
    table = ski_to_table(SLALOM)
    (tmp_path / "mine.toml").write_text(tomli_w.dumps({"mine": table | {"young_modulus_Pa": 9e9}}), encoding="utf-8")
    path = tmp_path / "sweep.toml"
    path.write_text(tomli_w.dumps(_settings(skis=["slalom_165", "mine.toml"])), encoding="utf-8")
    out = tmp_path / "out"
    assert sweep(path, out, in_this_process=True)["done"] == 4
    rows = pd.read_parquet(out / "runs.parquet")
    assert list(rows["recording"]) == ["slalom_165", "slalom_165", "mine.toml", "mine.toml"]
    usual = steady_turn(TurnCase(np.radians(45.0).item()), start_rolling(edges_of(SLALOM)))[0]
    assert rows["radius_m"][0] == pytest.approx(usual.radius, rel=1e-12)
    assert rows["side_reserve"][0] == pytest.approx(usual.side_reserve, rel=1e-12)
    assert rows["radius_m"][1] < rows["radius_m"][0]  # a deeper sidecut
    assert len(set(rows["radius_m"])) == 4
    assert "steady turns of skis" in render_folder(out)
    again = resume(out, workers=1)
    assert (again["done"], again["left"]) == (4, 0)


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"recordings": ["beginner"]}, 'recordings: it means nothing to task = "turn"'),
        ({"tier": "full"}, 'tier: it means nothing to task = "turn"'),
        ({"task": "simulate"}, 'skis: it means nothing to task = "simulate"; write task = "turn"'),
        ({"skis": ["banana"]}, "skis: no ski is called 'banana'; use one of: "),
        ({"skis": ["slalom_165"] * 2}, "skis: two skis have one name"),
        ({"skis": []}, "skis: is no list with something in it"),
        ({"skis": ["missing.toml"]}, "missing.toml"),
    ],
)
def test_a_mistake_is_one_clear_line(changed: dict[str, Any], line: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape(line)):
        sweep_from(_settings(**changed), tmp_path / "sweep.toml")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("friction.mu_t", "begin it with one of: ski, turn, carving"),
        ("turn.edge", "did you mean 'turn.edge_deg'?"),
        ("equipment.skis", "no parameter is called 'equipment.skis'"),
    ],
)
def test_a_parameter_that_no_turn_has(name: str, line: str, tmp_path: Path) -> None:
    settings = _settings(parameter=[{"name": name, "values": [1.0]}])
    with pytest.raises(InputError, match=re.escape(line)):
        sweep(settings, tmp_path / "out", in_this_process=True)


def test_a_deeper_sidecut_keeps_the_waist() -> None:
    deeper = reshape(SLALOM, {"sidecut_scale": 1.5}).width
    assert min(deeper.value) == min(SLALOM.width.value)
    assert max(deeper.value) - min(deeper.value) == pytest.approx(1.5 * (117e-3 - 66e-3), rel=1e-12)


@pytest.mark.long
@pytest.mark.usefixtures("words_only")
def test_two_skis_on_one_recorded_run_on_snow_that_edges_cut(tmp_path: Path) -> None:
    settings = {
        "format": 1,
        "recordings": [str(EXAMPLES / "intermediate")],
        "duration_s": 0.5,
        "term": [{"name": "carving", "mu": 0.1}],
        "parameter": [
            {"name": "equipment.skis", "values": ["slalom_165", "volkl_kendo_184"]},
            {"name": "carving.strength", "values": [3e5, 4e5]},
        ],
    }
    out = tmp_path / "out"
    assert sweep(settings, out, in_this_process=True)["done"] == 4
    rows = pd.read_parquet(out / "runs.parquet")
    assert np.all(rows["distance_m"].between(5.0, 7.0))
    assert len(set(rows["left_m"])) == 4
    assert (rows["gps_mean_error_m"] < 1.0).all()


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (
            {"task": "fit"},
            "[[term]]: a sweep fits the paper's snow alone; fit one recording by sssi fit",
        ),
        ({"term": [{"name": "carving"}] * 2}, "carving stands in the place of all other laws of the snow"),
        (
            {"term": [{"name": "carving"}, {"name": "snow_patch"}]},
            "[[term]] 2: snow_patch: carving stands in the place",
        ),
    ],
)
def test_what_does_not_go_with_snow_that_edges_cut(changed: dict[str, Any], line: str, tmp_path: Path) -> None:
    settings = {"format": 1, "recordings": [str(EXAMPLES / "beginner")], "term": [{"name": "carving"}]} | changed
    with pytest.raises(InputError, match=re.escape(line)):
        sweep_from(settings, tmp_path / "sweep.toml")
