"""The page of the blind benchmark is what its script makes of the answers that are kept."""

from types import ModuleType

import pytest
from docs_script import DOCS, docs_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return docs_script("make_benchmark")


def test_the_page_is_of_the_answers(script: ModuleType) -> None:
    assert script.page() == (DOCS / "diagnosis-benchmark.md").read_text(encoding="utf-8")


def test_every_case_is_kept(script: ModuleType) -> None:
    scores, commit = script.kept_scores()
    assert f"--cases {scores.cases} " in script.TEXT.read_text(encoding="utf-8")
    assert len(commit) >= 7
    assert scores.seal in script.page()
