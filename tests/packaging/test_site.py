"""The site: every page is in its navigation, every link leads somewhere, every public name and every term is on it."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest
from docs_script import DOCS, docs_script

import sssi_exudyn
from sssi_exudyn.cli import read_arguments
from sssi_exudyn.contact.registry import TERMS
from sssi_exudyn.contact.term import formula
from sssi_exudyn.core.quantity import quantities

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for path in DOCS.rglob("*.md") if "generated" not in path.parts)
NAVIGATION = re.findall(r"([\w/-]+\.md)", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def site_pages() -> ModuleType:
    """Load the module that makes the generated pages."""
    return docs_script("site_pages")


def generated(site_pages: ModuleType) -> set[str]:
    """Return what the build makes, by the names in the code that draws, and of the notebooks."""
    source = (DOCS / "guide_pictures.py").read_text(encoding="utf-8")
    pictures = {f"{name}.png" for name in re.findall(r'"([a-z_]+)"', source)} | set(
        re.findall(r'"([a-z_]+\.png)"', source)
    )
    return pictures | {f"{name}.md" for name in site_pages.NOTEBOOKS} | {"changelog.md"}


def test_every_page_is_in_the_navigation_once() -> None:
    written = {page.relative_to(DOCS).as_posix() for page in PAGES}
    shown = [page for page in NAVIGATION if not page.startswith("generated/")]
    assert sorted(shown) == sorted(written)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path, site_pages: ModuleType) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        linked = (page.parent / file).resolve() if file else page
        if linked.parent == DOCS / "generated":
            assert linked.name in generated(site_pages), target
            continue
        assert linked.exists(), target
        if anchor:
            titles = re.findall(r"^#+ (.*)$", linked.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w -]", "", title.lower()).strip().replace(" ", "-") for title in titles}, (
                target
            )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_that_are_named_exist(page: Path) -> None:
    for name in re.findall(r"`docs/([\w/-]+\.md)`", page.read_text(encoding="utf-8")):
        assert (DOCS / name).exists(), name


def test_every_public_name_has_its_place_and_no_other() -> None:
    pages = [page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.md")]
    shown = re.findall(r"^::: sssi_exudyn\.(\w+)$", "\n".join(pages), re.MULTILINE)
    assert sorted(shown) == sorted(sssi_exudyn.__all__)


@pytest.mark.parametrize("page", sorted((DOCS / "guide").glob("*.md")), ids=lambda page: page.stem)
def test_guide_pages_are_short(page: Path) -> None:
    # what takes longer than five minutes to read is theory, or belongs into the notebook
    assert len(page.read_text(encoding="utf-8").split()) < 900


def test_every_term_is_there_with_its_formula_and_its_numbers(site_pages: ModuleType) -> None:
    page = site_pages.terms_page()
    for cls in TERMS:
        assert f"#### `{cls.name}`" in page
        assert site_pages.latex(formula(cls)) in page
        for about in quantities(cls).values():
            assert f"| `{about.name}` | {about.default:g} {about.unit} |" in page


def commands_on(page: Path) -> list[str]:
    """List the lines of a page's blocks of code that begin with ``sssi``, without comments, continued ones joined."""
    blocks = re.findall(r"```(?:sh|console)?\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    lines = "\n".join(blocks).replace("\\\n", " ").split("\n")
    return [re.split(r"\s#", line)[0] for line in lines if line.startswith("sssi ")]


@pytest.mark.parametrize(
    ("page", "line"),
    [(page.name, line) for page in (*PAGES, ROOT / "README.md") for line in commands_on(page)],
)
def test_commands_on_the_pages_are_taken(page: str, line: str) -> None:
    # optional parts in brackets are left out, and … stands for more of the same
    words = shlex.split(re.sub(r"\[[^\]]*\]", "", line).replace("…", ""))[1:]
    if "{" in line or "$" in line:  # alternatives, and variables of a shell
        return
    read_arguments(words)
