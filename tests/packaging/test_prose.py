"""The check of the prose notices what it is for, and lets good sentences pass."""

from pathlib import Path
from types import ModuleType

import pytest
from docs_script import docs_script

GOOD = """# A result

The skis follow the path, and the fall line is straight. Open the page. It acts along the edge with the term `friction`.

| what | unit |
|---|---|
| largest load of a ski | N |
"""


@pytest.fixture(scope="module")
def prose() -> ModuleType:
    return docs_script("prose")


def rules(prose: ModuleType, folder: Path, text: str) -> set[str]:
    page = folder / "page.md"
    page.write_text(text, encoding="utf-8")
    return {rule for _, rule, _ in prose.broken(list(prose.passages_of_pages([page])))}


def test_good_sentences_pass(prose: ModuleType, tmp_path: Path) -> None:
    assert rules(prose, tmp_path, GOOD) == set()


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        ("ThePathWord", "The model follows the way of the skis."),
        ("UniformSnowWord", "The model assumes snow of one kind."),
        ("NoVerb", "The figures of the result."),
        ("LongSentence", f"The skis glide {'and the snow brakes them ' * 6}."),
        ("RepeatedWords", "The skis glide on the the snow."),
        ("SpellCheck", "The skis glide on the snwo."),
    ],
)
def test_what_stops_a_reader_is_noticed(prose: ModuleType, tmp_path: Path, rule: str, text: str) -> None:
    assert rule in rules(prose, tmp_path, text)


def test_code_and_formulas_are_no_words(prose: ModuleType, tmp_path: Path) -> None:
    text = "The term `frictoin` has the number $\\mu_t$, and the command is short.\n\n```sh\nsssi the the\n```\n"
    assert rules(prose, tmp_path, text) == set()
