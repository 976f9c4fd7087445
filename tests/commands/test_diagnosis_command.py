"""`sssi diagnose`: what its result says of how it was made; the search itself is tested where it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_diagnosis import diagnosis_of
from bundled import bundled

from sssi_exudyn.commands import diagnosis as command
from sssi_exudyn.model.model import Model
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.simulation.full import simulate

pytestmark = pytest.mark.usefixtures("words_only")


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether each search was to be confirmed by the full model; the search finds nothing."""
    asked = []

    def find(_recording: Any, motion: Any, model: Model, *, full: bool, **_: Any) -> SimpleNamespace:
        asked.append(full)
        fit = SimpleNamespace(parameters=(), values=np.zeros(0), covariance=np.zeros((0, 0)))
        result = simulate(model, motion) if full else None
        return SimpleNamespace(diagnosis=diagnosis_of(), posterior=None, fit=fit, model=model, result=result)

    monkeypatch.setattr(command, "find_missing", find)
    return asked


@pytest.mark.parametrize("reduced", [True, False])
def test_a_result_says_by_which_model_it_was_found(reduced: bool, full: list[bool], tmp_path: Path) -> None:
    recording, _ = bundled("beginner")
    short = replace(recording, stop=recording.start + 1.0)
    command.make_diagnosis(short, tmp_path / "out", reduced=reduced)
    assert full == [not reduced]
    stored = read_run(tmp_path / "out")
    assert stored.diagnosis is not None
    assert stored.diagnosis.tier == ("reduced" if reduced else "full")
    assert any("reduced model alone" in notice for notice in stored.summary.notices) == reduced
    assert ("reduced" in stored.summary.provenance.settings) == reduced
    assert len(stored.series) > 100  # the run shown is one of the full model all the same
