"""Known answers compared with those of diagnoses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from a_diagnosis import diagnosis_of, finding_of

from sssi_exudyn import commands
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.validation.benchmark.known_answers import compare, read_truth
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis, Number


def diagnosis_with(name: str, probability: float = 0.9, *others: str) -> Diagnosis:
    return diagnosis_of(finding_of(name, probability, *((other, 0.05) for other in others)))


def test_what_was_found_against_what_is_hidden() -> None:
    truth = {
        "a": {"name": "none"},
        "b": {"name": "gust"},
        "c": {"name": "wind"},
        "d": {"name": "external_push", "kind": "unexplained"},
        "e": {"name": "gust"},
        "f": {"name": "none", "also": "edge_friction", "mu_t": 0.19, "mu_n": 0.9},
        "g": {"name": "none", "also": "terrain"},
    }
    friction = {"mu_t": Number(0.18, 0.17, 0.2, "1")}
    rows = compare(
        truth,
        {
            "a": diagnosis_of(),
            "b": diagnosis_with("gust"),
            "c": diagnosis_with("drag_area", 0.5, "wind"),
            "d": diagnosis_with("unexplained_force"),
            "e": diagnosis_of(),
            "f": replace(diagnosis_with("edge_friction"), friction_averaged=friction),
            "g": diagnosis_of(),
        },
    )
    assert [row.answer for row in rows] == ["right", "right", "in the set", "right", "wrong", "right", "right"]
    row = rows[5]
    assert (row.hidden, row.mu_t, row.mu_t_low, row.mu_t_high, row.mu_t_true) == (
        "edge_friction",
        0.18,
        0.17,
        0.2,
        0.19,
    )
    assert (row.mu_n, row.mu_n_true) == (None, 0.9)


def test_recordings_of_one_name_are_refused_before_any_is_diagnosed(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder / "run").mkdir(parents=True)
        (tmp_path / folder / "truth.json").write_text(json.dumps({"run": {"name": "none"}}))
    with pytest.raises(InputError, match="two recordings"):
        commands.diagnose_known([tmp_path / "a", tmp_path / "b"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_folder_without_answers_gets_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"truth\.json: the file does not exist"):
        read_truth(tmp_path)
    (tmp_path / "truth.json").write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        read_truth(tmp_path)
    (tmp_path / "truth.json").write_text(json.dumps({"a": 1}))
    with pytest.raises(InputError, match="not a table of recordings"):
        read_truth(tmp_path)
