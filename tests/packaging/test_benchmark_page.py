"""The page of the blind benchmark is what its script makes of the answers that are kept."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_benchmark", DOCS / "make_benchmark.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_of_the_answers(script: ModuleType) -> None:
    assert script.page() == (DOCS / "diagnosis-benchmark.md").read_text(encoding="utf-8")


def test_every_case_is_kept(script: ModuleType) -> None:
    scores, commit = script.kept_scores()
    assert f"--cases {scores.cases} " in script.TEXT.read_text(encoding="utf-8")
    assert len(commit) >= 7
    assert scores.seal in script.page()
