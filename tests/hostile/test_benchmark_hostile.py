"""Folders of the benchmarks from other people: nothing is unpickled, nothing is written outside, work is bounded."""

from __future__ import annotations

import ast
import json
import os
from pathlib import Path

import pytest

import sssi_exudyn
from sssi_exudyn.commands import diagnosis as commands
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.typed import read_json
from sssi_exudyn.validation.benchmark import run
from sssi_exudyn.validation.benchmark.cases import Case, Made, Planned
from sssi_exudyn.validation.benchmark.run import SealedCases
from sssi_exudyn.validation.benchmark.scores import CaseResult

PACKAGE = Path(sssi_exudyn.__file__).parent
UNSAFE = {"pickle", "cPickle", "_pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve"}
CASE = Case(0, "hill", "gust", "physics", 2, (1.5, 2.5), {"w_f": 3.25})
PLANNED = Planned("gust", "physics", 2)


def sources() -> list[Path]:
    return [Path(folder) / name for folder, _, names in os.walk(PACKAGE, followlinks=True) for name in names]


@pytest.mark.long
def test_nothing_in_the_package_unpickles_or_executes_what_it_reads() -> None:
    """Generated force laws are the one text that is run: see ``contact.codegen.compiled`` and its folder."""
    violations = []
    # conformance.py pickles terms that it has made itself, as a sweep sends them to its workers
    files = [path for path in sources() if path.suffix == ".py" and path.name != "conformance.py"]
    assert len(files) > 150  # the model folders behind their links too
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            elif isinstance(node, ast.Call):
                called = node.func
                names = [called.id] if isinstance(called, ast.Name) and called.id in ("eval", "exec", "compile") else []
                names += ["read_pickle"] if isinstance(called, ast.Attribute) and called.attr == "read_pickle" else []
                for argument in node.keywords:
                    allowed = isinstance(argument.value, ast.Constant) and argument.value.value is False
                    names += ["allow_pickle"] if argument.arg == "allow_pickle" and not allowed else []
            bad = [
                name
                for name in names
                if name.split(".")[0] in UNSAFE or name in ("eval", "exec", "compile", "read_pickle", "allow_pickle")
            ]
            violations += [f"{path.name}:{getattr(node, 'lineno', 0)} {name}" for name in bad]
    assert violations == []


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the numbers of the cases that were made; each is made and diagnosed at once."""
    numbers: list[int] = []

    def make(index: int, planned: Planned, _bases: object, _seed: int) -> Made:
        assert planned == PLANNED
        numbers.append(index)
        return Made(CASE, None, None, None, None, 0, None)  # type: ignore[arg-type]

    monkeypatch.setattr(run, "make", make)
    monkeypatch.setattr(run, "diagnose_case", lambda made, full: CaseResult(made.case.index, full=full))
    return numbers


@pytest.fixture
def sealed(tmp_path: Path) -> SealedCases:
    return SealedCases([], 1, 0, tmp_path)


def test_a_made_case_is_kept_as_its_answer_and_made_again(tmp_path: Path, made: list[int], sealed: SealedCases) -> None:
    assert sealed.make(0, PLANNED) == CASE
    assert sealed.make(0, PLANNED) == CASE
    assert made == [0]  # the second time its answer was there
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["000.json"]
    sealed.diagnose(CASE, PLANNED)
    sealed.diagnose(CASE, PLANNED)
    assert made == [0, 0]
    assert read_json(tmp_path / "case_000.json", CaseResult) == CaseResult(0)


class Shell:
    """A pickle that runs a command."""

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, ("pwned",)


def test_a_pickle_in_the_folder_is_not_read(
    tmp_path: Path, made: list[int], sealed: SealedCases, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    import pickle

    (tmp_path / "made").mkdir()
    for name in ("000.pickle", "000.json"):
        (tmp_path / "made" / name).write_bytes(pickle.dumps(Shell()))
    with pytest.raises(InputError, match="not JSON"):
        sealed.make(0, PLANNED)
    assert not (tmp_path / "pwned").exists()
    assert made == []


@pytest.mark.usefixtures("made")
@pytest.mark.parametrize("key", ["index", "name", "strength"])
def test_the_answer_of_another_plan_is_refused(tmp_path: Path, sealed: SealedCases, key: str) -> None:
    sealed.make(0, PLANNED)
    path = tmp_path / "made" / "000.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: "none" if key == "name" else 7}))
    with pytest.raises(InputError, match="the answer of another benchmark"):
        sealed.make(0, PLANNED)


@pytest.mark.usefixtures("made")
def test_a_truth_that_its_seed_does_not_make_is_refused(sealed: SealedCases) -> None:
    other = Case(**{**CASE.__dict__, "truth": {"w_f": 9.0}})
    with pytest.raises(InputError, match="its seed makes another case"):
        sealed.diagnose(other, PLANNED)


@pytest.mark.usefixtures("made")
def test_a_case_made_again_from_an_estimate_that_differs_by_rounding_is_the_same(sealed: SealedCases) -> None:
    assert CASE.truth, "a case without numbers would show nothing"
    rounded = {name: value * (1.0 + 1e-12) for name, value in CASE.truth.items()}
    sealed.diagnose(Case(**{**CASE.__dict__, "truth": rounded}), PLANNED)
    assert sealed.result_file(CASE.index).exists()


NAMES = ("../stray", "/stray", "..", ".", "", "a/../..", "a\0b", "a\x1b[31m", "x" * 5000, ".hidden", "link", "a/b")


@pytest.mark.parametrize("name", NAMES)
def test_names_of_known_answers_are_folders_next_to_them(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commands, "make_diagnosis", lambda *_, **__: pytest.fail("nothing may be diagnosed"))
    folder = tmp_path / "in" / "deep"
    for good in ("good", "a/b", ".hidden"):
        (folder / good).mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path)
    (folder / "truth.json").write_text(json.dumps({"good": {"name": "none"}, name: {"name": "none"}}))
    with pytest.raises(InputError, match="no recording of that name") as info:
        commands.diagnose_known([folder], tmp_path / "out")
    assert str(info.value).isprintable()
    assert len(str(info.value)) < 3000
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"[]", "no table"),
        (b'{"good": 1}', "not a table of recordings"),
        (b'{"good": {"name": ["a"]}}', "not a table of recordings"),
        (b"[" * 1_000_000, "not JSON"),
        (b'{"good": {"name": "none", "x": ' + b"[" * 50 + b"]" * 50 + b"}}", "tables within tables"),
        (b'{"good": {"name": "none", "x": ' + b"1" * 5000 + b"}}", "larger than any"),
        (b'{"good": "' + b"x" * 6_000_000 + b'"}', "more than 5 MB"),
        (b"\xff", "not JSON"),
    ],
    ids=["list", "number", "name is a list", "brackets", "nested", "digits", "large", "no text"],
)
def test_known_answers_are_bounded(tmp_path: Path, content: bytes, problem: str) -> None:
    (tmp_path / "good").mkdir()
    (tmp_path / "truth.json").write_bytes(content)
    with pytest.raises(InputError, match=problem):
        commands.diagnose_known([tmp_path], tmp_path / "out")


def test_a_pipe_in_place_of_the_answers_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "truth.json")
    with pytest.raises(InputError, match="this is not a file"):
        commands.diagnose_known([tmp_path], tmp_path / "out")
