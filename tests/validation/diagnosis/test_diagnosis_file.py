"""``diagnosis.json``: its JSON Schema, files of the first version, and the section of a report that is made from it."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from a_diagnosis import FIRST_VERSION, whole_version
from schema_check import check_against_schema

from sssi_exudyn.analysis.turns import find_turns
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.typed import json_schema, read_json
from sssi_exudyn.io.writing import to_json, to_plain
from sssi_exudyn.reports.html import section_html
from sssi_exudyn.reports.section import Section
from sssi_exudyn.reports.sections.diagnosis import diagnosis_blocks
from sssi_exudyn.validation.diagnosis.diagnosis_data import Diagnosis
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS
from sssi_exudyn.validation.diagnosis.wording.description import held_out_stretches, where_of

SCHEMA = Path(__file__).parents[3] / "validation" / "diagnosis" / "diagnosis.schema.json"


def shown(diagnosis: Diagnosis) -> str:
    return section_html(Section("", diagnosis_blocks(diagnosis)), "part")


def read(folder: Path, content: dict[str, Any]) -> Diagnosis:
    path = folder / "diagnosis.json"
    path.write_text(json.dumps(content))
    return read_json(path, Diagnosis)


def assert_holds(whole: Any, part: Any) -> None:
    """Every key and value of ``part`` is in ``whole``, which may have more keys."""
    if isinstance(part, dict):
        for key, value in part.items():
            assert_holds(whole[key], value)
    elif isinstance(part, list):
        for held, value in zip(whole, part, strict=True):
            assert_holds(held, value)
    else:
        assert whole == part


def test_the_shipped_schema_is_that_of_the_dataclass() -> None:
    assert json.loads(SCHEMA.read_text(encoding="utf-8")) == to_plain(json_schema(Diagnosis))


def test_a_file_of_the_first_version_is_read_and_shown(tmp_path: Path) -> None:
    check_against_schema(FIRST_VERSION, json.loads(SCHEMA.read_text(encoding="utf-8")))
    diagnosis = read(tmp_path, FIRST_VERSION)
    section = shown(diagnosis)
    assert "snow patch (97%)" in section
    assert "0.030" in section
    assert "<svg" not in section  # it has no data for a figure
    assert "For the coach" not in section
    written = json.loads(to_json(diagnosis))
    assert_holds(written, FIRST_VERSION)


@pytest.mark.long
def test_the_section_shows_what_the_file_holds(tmp_path: Path) -> None:
    section = shown(read(tmp_path, whole_version()))
    # track, force before, on each foot and after, slope from above, probabilities, the most similar simulated run
    assert section.count("<figcaption>") == 8
    assert "The same force on the left foot" in section
    assert "+12.5" in section
    assert "the longest 50 N" in section  # of the arrows
    assert "left out of a fit once" in section
    assert "after, left out" in section
    assert "In turn 1 the snow is slower." in section
    assert "90 % interval 0.084 to 0.118" in section
    assert "3.21 m/s" in section
    assert "log evidence +10.0 against nothing; refitted" in section
    assert "not possible" in section
    assert "0.2%" in section  # of runs with nothing hidden that show as much
    assert "Runs that look like it had: a gust 83%." in section
    assert "37%" in section  # of simulated runs that are as unlike their kind
    assert "64%" in section  # the best that can be said
    assert "The most similar of the simulated runs, which had snow patch" in section
    assert "after with snow patch in the model; shaded while it acts" in section


@pytest.mark.parametrize(
    ("place", "wrong", "message"),
    [
        (("findings", 0, "probability"), "high", r"\$\.findings\[0\]\.probability"),
        (("verdict",), "perhaps", r"\$\.verdict"),
        (("format",), 2, r"\$\.format"),
        (("findings", 0, "impulse_Ns"), [1.0, 2.0], r"\$\.findings\[0\]\.impulse_Ns"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(
    tmp_path: Path, place: tuple[str | int, ...], wrong: object, message: str
) -> None:
    content = copy.deepcopy(FIRST_VERSION)
    inner: Any = content
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = wrong
    with pytest.raises(InputError, match=message):
        read(tmp_path, content)
    with pytest.raises(AssertionError):
        check_against_schema(content, json.loads(SCHEMA.read_text(encoding="utf-8")))


def a_slalom() -> tuple[Array, Array]:
    """Times and path of turns of two seconds at 10 m/s."""
    time = np.arange(0.0, 9.0, 0.02)
    course = 0.6 * np.cos(2.0 * np.pi * time / 4.0)  # extrema, the transitions, every two seconds
    return time, np.cumsum(0.2 * np.stack([np.cos(course), np.sin(course), 0.0 * course], axis=1), axis=0)


def test_a_finding_names_the_phases_of_the_turns_that_it_covers() -> None:
    time, path = a_slalom()
    fitted: Any = SimpleNamespace(run=SimpleNamespace(time=time, com=path), thresholds=THRESHOLDS)
    turn = find_turns(time, path).turns[1]
    begin, end = turn.phases["control"]
    assert where_of((begin, end), fitted).phase == ("control",)
    assert where_of((begin, turn.end), fitted).phase == ("control", "completion")
    assert where_of((begin, turn.end), fitted).turns == (2,)
    assert where_of((begin, turn.end + 0.5), fitted).turns == (2, 3)
    whole = where_of((begin, end), fitted)
    assert whole.distance_m[1] - whole.distance_m[0] == pytest.approx(10.0 * (end - begin), rel=1e-3)  # at 10 m/s


def test_a_stretch_that_was_left_out_stands_for_the_turn_of_which_it_covers_most() -> None:
    time, path = a_slalom()
    fixes = np.arange(0.0, 9.0, 1.0)
    fitted: Any = SimpleNamespace(
        run=SimpleNamespace(time=time, com=path), measurements=SimpleNamespace(fixes=fixes), thresholds=THRESHOLDS
    )
    turn = find_turns(time, path).turns[1]
    folds = [(0.0, 0.5), (0.5, 0.9), (turn.start + 0.3, turn.end + 0.3)]
    first, second = held_out_stretches(fitted, folds, np.full(9, 0.4), fixes)
    assert (first.turn, first.before_m, first.after_m) == (None, 0.4, 0.0)
    inside = fixes[(fixes >= turn.start + 0.3) & (fixes < turn.end + 0.3)]
    assert (second.turn, second.after_m) == (2, np.mean(inside))
