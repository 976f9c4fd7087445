"""`sssi diagnose`: what its result says of how it was made; the search itself is tested where it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_diagnosis import diagnosis_of
from a_law import law_as_found
from bundled import bundled

from sssi_exudyn.commands import diagnosis as command
from sssi_exudyn.commands.recordings import SILENT
from sssi_exudyn.contact.terms.friction_law import FrictionLaw
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import read_model
from sssi_exudyn.results.day import Day
from sssi_exudyn.results.stored import read_run
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.several_runs.joint_fit import DayExplanation
from sssi_exudyn.validation.diagnosis.several_runs.second_pass import Pass, SamePlace

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


@pytest.mark.long
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


def test_a_day_says_what_other_runs_of_a_place_settled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    friction = {f"friction.{name}": Number(0.1, 0.09, 0.11, "1") for name in ("mu_t", "mu_n")}
    passed = (Pass("noon", 14.0, {"snow_patch": -9.0}),)
    settled = SamePlace("morning", "gust", {"gust": 0.5, "snow_patch": 0.5}, {"gust": 1.0}, passed, "A gust it was.")
    open_still = replace(settled, run="noon", after={"gust": 0.7, "snow_patch": 0.3}, sentence="It stays open.")
    asked: list[list[str]] = []

    def ask(ends: dict[str, str], _progress: Any) -> tuple[SamePlace, ...]:
        asked.append([f"{name} {end}" for name, end in ends.items()])
        return settled, open_still

    def search(folder: Path, out: Path, *_: Any) -> tuple[Any, Any]:
        made = SimpleNamespace(run=SimpleNamespace(summary=SimpleNamespace(provenance=SimpleNamespace(inputs={}))))
        model = model_of(*bundled("beginner"))
        return made, SimpleNamespace(separate_fit=lambda: None, end=f"end of {folder.name}", model=model)

    monkeypatch.setattr(command, "search_into", search)
    monkeypatch.setattr(command, "compare_for_day", lambda *_: [DayExplanation("nothing", 1.0, 0.0, friction)])
    monkeypatch.setattr(command, "find_law", lambda *_: (None, ()))
    monkeypatch.setattr(command, "ask_other_runs", ask)
    day = command.diagnose_day([Path("morning"), Path("noon")], tmp_path / "out")
    assert asked == [["morning end of morning", "noon end of noon"]]
    assert day.sentence.endswith(" A gust it was.")
    assert day.same_place == (settled, open_still)
    assert read_json(tmp_path / "out" / "day.json", Day) == day
    assert "It stays open." in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_day_keeps_the_law_that_it_offers(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """In a folder of each run, as a model that a simulation takes; one of an earlier answer goes away."""
    recording, motion = bundled("beginner")
    plain = model_of(recording, motion)
    with_law = replace(plain, terms=(*plain.terms, FrictionLaw(c_slip=0.02)))
    law = law_as_found(offered=True)
    run = SimpleNamespace(summary=SimpleNamespace(provenance=SimpleNamespace(inputs={"gps.csv": "0a"})))
    answers = {"offered": (law, ("a fit", "another")), "none": (replace(law, offered=False), ())}

    def search(_folder: Path, out: Path, *_: Any) -> tuple[SimpleNamespace, SimpleNamespace]:
        out.mkdir(exist_ok=True)
        return SimpleNamespace(run=run), SimpleNamespace(separate_fit=lambda: None, end=None, model=plain)

    monkeypatch.setattr(command, "search_into", search)
    monkeypatch.setattr(command, "compare_for_day", lambda *_: [DayExplanation("nothing", 1.0, 0.0, law.numbers)])
    monkeypatch.setattr(command, "ask_other_runs", lambda *_: ())
    monkeypatch.setattr(command, "model_with_law", lambda _fit: with_law)
    for answer, offered in (("offered", True), ("none", False)):
        monkeypatch.setattr(command, "find_law", lambda *_, answer=answer: answers[answer])
        day = command.diagnose_day([Path("a"), Path("b")], tmp_path)
        assert read_json(tmp_path / "day.json", Day).found_law == answers[answer][0]
        assert (law.formula in day.sentence) == offered
        for name in ("a", "b"):
            kept = tmp_path / name / "law" / "model.toml"
            assert kept.exists() == offered
            if offered:
                assert read_model(kept) == with_law


def test_a_recording_too_short_for_a_benchmark_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    recording, motion = bundled("beginner")
    short = replace(motion, stop=motion.start + 4.9)
    monkeypatch.setattr(command, "read_folder", lambda *_: (recording, short))
    with pytest.raises(InputError, match=r"the run has 4\.9 s, and 5 s are needed; leave this recording out"):
        command.bases_of([Path("short")], SILENT)
