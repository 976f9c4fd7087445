"""Generated pages of the site: the terms, the changelog, executed notebooks, pictures, formulas.

MkDocs calls this in ``make docs`` before it reads the pages; all of it is written into ``docs/generated``.
"""

from __future__ import annotations

import ast
import contextlib
import html
import io
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from formulas import latex, mathml
from guide_pictures import make_pictures

ROOT: Final = Path(__file__).parents[1]
MADE: Final = ROOT / "docs" / "generated"
NOTEBOOKS: Final = ("first_run", "own_law")
_KINDS: Final = {
    "point": "The snow's push on a point of the edge",
    "foot": "Friction on a foot",
    "segment": "The air on a body segment",
    "wind": "Motion of the air",
    "terrain": "Shape of the snow",
    "body": "Forces on the whole skier",
    "edge": "The snow under an edge that carves",
}


def on_pre_build(**_: Any) -> None:
    """Make the pages when MkDocs begins a build."""
    make_all()


def make_all() -> None:
    """Write all generated pages and pictures."""
    shutil.rmtree(MADE, ignore_errors=True)
    MADE.mkdir()
    (MADE / "terms.md").write_text(terms_page(), encoding="utf-8")
    (MADE / "changelog.md").write_text((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), encoding="utf-8")
    make_pictures(MADE)
    for name in NOTEBOOKS:
        (MADE / f"{name}.md").write_text(notebook_page(name), encoding="utf-8")


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the terms and the columns where a page requests them."""
    mark = "<!-- every force term -->"
    if mark in markdown:
        return markdown.replace(mark, (MADE / "terms.md").read_text(encoding="utf-8"))
    return markdown.replace("<!-- every column -->", columns_text())


def on_page_content(content: str, **_: Any) -> str:
    """Set the formulas of a page as MathML."""
    content = re.sub(r'<span class="arithmatex">\\\((.*?)\\\)</span>', _set_in_line, content, flags=re.DOTALL)
    return re.sub(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', _set_apart, content, flags=re.DOTALL)


def _set_in_line(source: re.Match[str]) -> str:
    return mathml(html.unescape(source[1]), block=False)


def _set_apart(source: re.Match[str]) -> str:
    return f'<div class="formula">{mathml(html.unescape(source[1]), block=True)}</div>'


def on_files(files: Any, **_: Any) -> Any:
    """Remove the terms' own page, as they are part of another page."""
    from mkdocs.structure.files import Files

    return Files([file for file in files if file.src_uri != "generated/terms.md"])


def columns_text() -> str:
    """Return a table of every column of a result's tables, a file each."""
    from sssi_exudyn.results.data_dictionary import data_dictionary

    columns = data_dictionary()
    lines: list[str] = []
    for file in dict.fromkeys(column.file for column in columns):
        lines += [f"### {file}", "", "| column | unit | frame | meaning |", "|---|---|---|---|"]
        own = (column for column in columns if column.file == file)
        lines += [f"| `{column.name}` | {column.unit} | {column.frame} | {column.meaning} |" for column in own]
        lines.append("")
    return "\n".join(lines)


def terms_page() -> str:
    """Describe every force term: its first line, its formula, its numbers with units, bounds and sources."""
    from sssi_exudyn.contact.registry import TERMS
    from sssi_exudyn.contact.term import formula
    from sssi_exudyn.core.quantity import quantities

    lines: list[str] = []
    for kind, title in _KINDS.items():
        terms = [cls for cls in TERMS if cls.kind == kind]
        if terms:
            lines += [f"### {title}", ""]
        for cls in terms:
            about = (cls.__doc__ or "").strip().split("\n")[0]
            lines += [f"#### `{cls.name}`", "", about, "", "$$", latex(formula(cls)), "$$", ""]
            lines += [f"Sources: {'; '.join(cls.sources)}", ""]
            lines += ["| number | default | bounds | meaning; source |", "|---|---|---|---|"]
            for number in quantities(cls).values():
                values = f"{number.default:g} {number.unit} | {number.low:g} … {number.high:g}"
                lines.append(f"| `{number.name}` | {values} | {_cell(number.meaning)}; {_cell(number.source)} |")
            lines.append("")
    return "\n".join(lines)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


@contextlib.contextmanager
def _in_folder(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def notebook_page(name: str) -> str:
    """Execute a notebook of ``examples`` and return a page of its words, its code, and the output of each cell."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure

    work = MADE / "work"
    shutil.copytree(ROOT / "examples", work, dirs_exist_ok=True)
    module = ModuleType(name)
    sys.modules[name] = module
    parts: list[str] = []
    with _in_folder(work):
        for count, cell in enumerate(json.loads((work / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]):
            source = "".join(cell["source"])
            if cell["cell_type"] == "markdown":
                parts.append(source)
                continue
            parts.append(f"```python\n{source}\n```")
            tree = ast.parse(source)
            silent = source.rstrip().endswith(";")
            last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(compile(tree, name, "exec"), vars(module))
                value = None if last is None else eval(compile(ast.Expression(last.value), name, "eval"), vars(module))
            if output.getvalue():
                parts.append(f"```text\n{output.getvalue().rstrip()}\n```")
            if value is not None and not silent and not isinstance(value, Figure):
                html = getattr(value, "_repr_html_", None)
                parts.append(f'<div class="output">{html()}</div>' if html else f"```text\n{value!r}\n```")
            drawn = [plt.figure(number) for number in plt.get_fignums()]
            drawn += [value] if isinstance(value, Figure) else []
            for number, figure in enumerate(drawn, 1):
                picture = f"{name}_{count}_{number}.png"
                figure.savefig(MADE / picture, dpi=110, bbox_inches="tight")
                parts.append(f"![What the cell draws]({picture})")
            plt.close("all")
    shutil.rmtree(work)
    where = "this page was made from it by executing it"
    return "\n\n".join([*parts, f"The notebook is `examples/{name}.ipynb`; {where}."]) + "\n"


if __name__ == "__main__":
    make_all()
