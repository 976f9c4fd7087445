"""Known answers against what was found."""

import json
from pathlib import Path

import pytest
from a_diagnosis import diagnosis_of, finding_of

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.validation.benchmark.known_answers import compare, read_truth
from sssi_exudyn.validation.diagnosis.result import Diagnosis


def diagnosis_with(name: str, probability: float = 0.9, *others: str) -> Diagnosis:
    return diagnosis_of(finding_of(name, probability, *((other, 0.05) for other in others)))


def test_what_was_found_against_what_is_hidden() -> None:
    truth = {
        "a": {"name": "none"},
        "b": {"name": "gust"},
        "c": {"name": "wind"},
        "d": {"name": "external_push", "kind": "unexplained"},
        "e": {"name": "gust"},
    }
    rows = compare(
        truth,
        {
            "a": diagnosis_of(),
            "b": diagnosis_with("gust"),
            "c": diagnosis_with("drag_area", 0.5, "wind"),
            "d": diagnosis_with("unexplained_force"),
            "e": diagnosis_of(),
        },
    )
    assert [row.answer for row in rows] == ["right", "right", "in the set", "right", "wrong"]


def test_a_folder_without_answers_gets_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"truth\.json: the file does not exist"):
        read_truth(tmp_path)
    (tmp_path / "truth.json").write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        read_truth(tmp_path)
    (tmp_path / "truth.json").write_text(json.dumps({"a": 1}))
    with pytest.raises(InputError, match="not a table of recordings"):
        read_truth(tmp_path)
