"""The check of the prose notices what it is for, and lets good sentences pass."""

import pytest
from docs_script import docs_script

GOOD = """# A result

The skis follow the path, and the fall line is straight. Open the page. It acts along the edge with the term `friction`.

| what | unit |
|---|---|
| largest load of a ski | N |
"""
CODE = "The term `frictoin` has the number $\\mu_t$, and the command is short.\n\n```sh\nsssi the the\n```\n"
BAD = {
    "ThePathWord": "The model follows the way of the skis.",
    "UniformSnowWord": "The model assumes snow of one kind.",
    "NoVerb": "The figures of the result.",
    "LongSentence": f"The skis glide {'and the snow brakes them ' * 6}.",
    "RepeatedWords": "The skis glide on the the snow.",
    "SpellCheck": "The skis glide on the snwo.",
}


@pytest.fixture(scope="module")
def rules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Rules that every text breaks, by its name.  The linter reads all of them at once: it takes a second to start."""
    folder = tmp_path_factory.mktemp("prose")
    texts = {"good": GOOD, "code": CODE} | BAD
    pages = [folder / f"{name}.md" for name in texts]
    for page, text in zip(pages, texts.values(), strict=True):
        page.write_text(text, encoding="utf-8")
    prose = docs_script("prose")
    broken: dict[str, set[str]] = {name: set() for name in texts}
    for place, rule, _ in prose.broken(list(prose.passages_of_pages(pages))):
        broken[place.rpartition("/")[2].partition(".md:")[0]].add(rule)
    return broken


def test_good_sentences_pass(rules: dict[str, set[str]]) -> None:
    assert rules["good"] == set()


@pytest.mark.parametrize("rule", BAD)
def test_what_stops_a_reader_is_noticed(rules: dict[str, set[str]], rule: str) -> None:
    assert rule in rules[rule]


def test_code_and_formulas_are_no_words(rules: dict[str, set[str]]) -> None:
    assert rules["code"] == set()
