"""The page of the blind benchmark: its script makes it from the stored answers."""

from types import ModuleType

import pytest
from docs_script import DOCS, docs_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return docs_script("make_benchmark")


def test_the_page_is_of_the_answers(script: ModuleType) -> None:
    assert script.page() == (DOCS / "notebook" / "diagnosis-benchmark.md").read_text(encoding="utf-8")


def test_the_readme_is_of_the_answers(script: ModuleType) -> None:
    rows = script.readme_rows()
    lines = (DOCS.parent / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 3
    assert set(rows) <= set(lines)


@pytest.mark.long
def test_every_case_is_kept(script: ModuleType) -> None:
    scores, commit = script.kept_scores(script.KEPT)
    assert f"--cases {scores.cases} " in script.TEXT.read_text(encoding="utf-8")
    assert len(commit) >= 7
    assert scores.seal in script.page()
    for kind, alone in script.ALONE.items():
        kept, _ = script.kept_scores(alone.kept(kind))
        kinds = {case.kind for case, _ in script.kept_answers(alone.kept(kind))}
        assert kinds <= {"listed": {"physics", "sensor"}, "whole_runs": {"none", "physics", "sensor"}}.get(kind, {kind})
        assert kept.seal in script.page()


def test_failures_are_the_worst_of_their_kinds_and_have_pictures(script: ModuleType) -> None:
    failures = script.failures()
    for _, case, result in failures:
        assert result.first_name not in case.name.split("+") or case.kind == "none"
    invented = [
        r.findings[0].probability for c, r in script.kept_answers(script.ALONE["none"].kept("none")) if r.findings
    ]
    assert failures[0][2].findings[0].probability >= max(invented)
    pictures = sorted(path.name for path in (DOCS / "images").glob("benchmark_*.png"))
    assert pictures == [f"benchmark_{number}.png" for number in range(1, len(failures) + 1)]
