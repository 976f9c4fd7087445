"""Figures of a result for the season's table: what is there is taken, what is not stays empty."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.results.data_dictionary import season_columns
from sssi_exudyn.season.figures import result_figures

WHOLE: dict[str, Any] = {
    "friction": {"mu_t": {"value": 0.08, "se": 0.01}},
    "posture": {"effective_friction": {"value": 0.1, "se": 0.01}, "effective_friction_90": {"low": 0.07, "high": 0.14}},
    "losses": {"effective_friction": 0.3, "air_share": 0.2, "energy_lost_J_per_kg_m": {"turn": 8.0, "control": 9.0}},
    "turns": {"complete": 12},
    "technique": {"carving": 0.7, "skidding": 0.2, "wedge": 0.1, "most_likely": "carving"},
}


def written(folder: Path, summary: dict[str, Any]) -> Path:
    (folder / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
    return folder


def test_a_whole_result_gives_all_figures(tmp_path: Path) -> None:
    turns = {"side": "left", "phase": ["turn", "control", "turn", "turn"], "complete": [True, True, True, False]}
    pd.DataFrame({**turns, "energy_lost_J_per_kg": [20.0, 5.0, 30.0, 90.0]}).to_parquet(tmp_path / "turns.parquet")
    figures = result_figures(written(tmp_path, WHOLE))
    assert set(figures) <= {column.name for column in season_columns()}
    assert figures["energy_lost_a_turn_J_per_kg"] == 25.0  # of the whole turns that are complete
    # the interval that the result states goes before one from the standard error
    assert (figures["effective_friction_low"], figures["effective_friction_high"]) == (0.07, 0.14)
    assert figures["effective_friction"] == 0.1
    # 1.645 standard errors on both sides hold 90 % of a normal distribution
    assert figures["mu_t_low"] == pytest.approx(0.08 - 0.01645, abs=1e-5)
    assert (figures["technique"], figures["technique_wedge"]) == ("carving", 0.1)


@pytest.mark.parametrize("left_out", [*WHOLE, "everything"])
def test_what_a_result_lacks_is_empty(tmp_path: Path, left_out: str) -> None:
    summary = {} if left_out == "everything" else {name: WHOLE[name] for name in WHOLE if name != left_out}
    figures = result_figures(written(tmp_path, summary))
    assert set(figures) == set(result_figures(written(tmp_path, WHOLE)))
    if left_out in ("technique", "everything"):
        assert (figures["technique"], figures["technique_carving"]) == ("", None)
    if left_out == "posture":
        assert (figures["effective_friction"], figures["effective_friction_low"]) == (0.3, None)


def test_a_damaged_result_is_refused(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="not JSON"):
        result_figures(tmp_path)
