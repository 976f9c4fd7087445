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
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from formulas import latex, mathml

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
    make_gallery()
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
            if value is not None and not silent:
                html = getattr(value, "_repr_html_", None)
                parts.append(f'<div class="output">{html()}</div>' if html else f"```text\n{value!r}\n```")
            for number in plt.get_fignums():
                picture = f"{name}_{count}_{number}.png"
                plt.figure(number).savefig(MADE / picture, dpi=110, bbox_inches="tight")
                parts.append(f"![What the cell draws]({picture})")
            plt.close("all")
    shutil.rmtree(work)
    where = "this page was made from it by executing it"
    return "\n\n".join([*parts, f"The notebook is `examples/{name}.ipynb`; {where}."]) + "\n"


def draw_panel(block: Any, axes: Any) -> None:
    """Draw the first panel of a figure of the report with its title and legend, which the report shows around it."""
    from sssi_exudyn.reports.plots import COLOURS

    block.panels[0].draw(axes)
    axes.set_title(block.panels[0].title)
    for key in block.keys:
        colour = "black" if key.colour is None else COLOURS[key.colour]
        axes.plot([], [], key.style, color=colour, label=key.meaning)
    axes.legend(fontsize="small")


def make_gallery() -> None:
    """Make the pictures of the gallery, from a fit of the whole run of the beginner; it takes a minute."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    import sssi_exudyn
    from sssi_exudyn import commands
    from sssi_exudyn.reports import figures, plots
    from sssi_exudyn.reports.section import Panels
    from sssi_exudyn.reports.sections.curve_figures import figure_5, figure_8
    from sssi_exudyn.reports.sections.track_figures import figure_6

    example = ROOT / "examples" / "beginner"
    recording = sssi_exudyn.read_recording(example)
    run = sssi_exudyn.fit(recording)
    short = replace(recording, stop=recording.start + 6.0)

    def save(name: str, draw: Callable[[Any], object], size: tuple[float, float] = (7.0, 3.6)) -> None:
        figure, axes = plt.subplots(figsize=size, layout="constrained")
        draw(axes)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(frameon=False)
        figure.savefig(MADE / f"{name}.png", dpi=110)
        plt.close(figure)

    sssi_exudyn.inspect(example, MADE / "inspect.png")
    commands.terrain(example, None, MADE / "terrain.png")
    save("track", partial(figures.draw_track, run.stored))
    save("loads", partial(figures.draw_loads, run.stored))
    for name, section in (("from_above", figure_6), ("angles", figure_5), ("moments", figure_8)):
        (block,) = [block for block in section([run.stored]).blocks if isinstance(block, Panels)]
        save(name, partial(draw_panel, block), (5.0, 6.0) if name == "from_above" else (7.0, 3.6))

    def speeds(axes: Any) -> None:
        for colour, mu_t in zip(plots.COLOURS, (0.04, 0.08, 0.12), strict=False):
            other = sssi_exudyn.simulate(short, model=run.model.with_values({"friction.mu_t": mu_t})).series
            speed = (other[[f"com_velocity_{axis}_mps" for axis in ("east", "north", "up")]] ** 2).sum(axis=1) ** 0.5
            axes.plot(other["time_s"], speed, color=colour, label=f"μ_t = {mu_t:.2f}")
        axes.set(xlabel="time (s)", ylabel="speed (m/s)", title="the same movement on faster and slower snow")
        axes.legend()

    save("speeds", speeds)
    save("budget", partial(draw_budget, run))
    save("radii", draw_radii)


def draw_budget(run: Any, axes: Any) -> None:
    """Draw the largest shares of the variance of friction along the ski."""
    shares = sorted(run.uncertainty.shares["mu_t"].items(), key=lambda part: part[1])[-8:]
    axes.barh([name for name, _ in shares], [100.0 * share for _, share in shares])
    axes.set(xlabel="share of the variance of μ_t (%)", title="beginner: where the uncertainty comes from")


def draw_radii(axes: Any) -> None:
    """Draw the radius of two skis over the edge angle, with the bars of snow and posture."""
    import sssi_exudyn

    skis = ("slalom_165", "volkl_kendo_184")
    rows = sssi_exudyn.turn(skis, "30:60:15")
    for ski in skis:
        edge, radius, low, high = (
            [row[key] for row in rows if row["ski"] == ski]
            for key in ("edge_deg", "radius_m", "radius_low_m", "radius_high_m")
        )
        axes.plot(edge, radius, marker="o", label=ski)
        axes.fill_between(edge, low, high, alpha=0.2)
    axes.set(xlabel="edge angle (°)", ylabel="radius (m)", title="steady turns at 700 N and 10 m/s")
    axes.legend()


if __name__ == "__main__":
    make_all()
