"""A page of HTML that holds all it shows and asks nothing of a network: its style, its plots, its script, its data."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources

from sssi_exudyn.reports.plots import labelled

Row = tuple[str, str, str]
"""What it is, its value, what it means."""
_LONG = 24
"""Characters from which a cell of a table is no figure."""


@dataclass(frozen=True)
class Section:
    """A part of a page under a headline: ``title`` is text, ``html`` is markup."""

    title: str
    html: str


def document(title: str, lead: str, sections: Sequence[Section]) -> str:
    """The whole page: ``title`` is text, ``lead`` the markup that stands before the sections; empty ones are left out.

    The script that plays replays comes along where a section has one; nothing else may run.
    """
    shown = [section for section in sections if section.html]
    body = "".join(
        f'<section>\n<h2 id="part-{index}">{escape(section.title)}</h2>\n{section.html}</section>\n'
        for index, section in enumerate(shown)
    )
    links = "".join(
        f'<a href="#part-{index}">{escape(section.title.partition(":")[0])}</a>\n'
        for index, section in enumerate(shown)
    )
    script = _packaged("replay.js") if 'class="replay"' in body else ""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    allowed = f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{allowed}">\n'
        f"<title>{escape(title)}</title>\n<style>\n{_packaged('page.css')}</style>\n</head>\n<body>\n"
        f"<h1>{escape(title)}</h1>\n{lead}<nav>{links}</nav>\n{body}"
        + (f"<script>{script}</script>\n" if script else "")
        + "</body>\n</html>\n"
    )


def added(page: str, section: Section) -> str:
    """A page that ``document`` has made, with one more section at its end; an older one of that title goes away."""
    name = section.title.lower().replace(" ", "-")
    headline, link = f'<h2 id="{name}">', f'<a href="#{name}">{escape(section.title)}</a>\n'
    if headline in page:
        begin = page.index(f"<section>\n{headline}")
        end = page.index("</section>\n", begin) + len("</section>\n")
        page = (page[:begin] + page[end:]).replace(link, "")
    made = f"<section>\n{headline}{escape(section.title)}</h2>\n{section.html}</section>\n"
    last = page.rindex("</section>\n") + len("</section>\n")
    return (page[:last] + made + page[last:]).replace("</nav>", f"{link}</nav>", 1)


def _packaged(name: str) -> str:
    return (resources.files(__package__) / name).read_text(encoding="utf-8")


def table(title: str, rows: Sequence[Row]) -> str:
    """A table under its headline; nothing where there is no row."""
    if not rows:
        return ""
    body = "".join(
        f'<tr><th scope="row">{escape(what)}</th><td class="number">{escape(value)}</td>'
        f'<td class="soft">{escape(meaning)}</td></tr>\n'
        for what, value, meaning in rows
    )
    return f'<h3>{escape(title)}</h3>\n<div class="scroll"><table>\n<tbody>\n{body}</tbody>\n</table></div>\n'


def grid(rows: Sequence[Sequence[str]]) -> str:
    """A table of figures, the headline first: each row's first cell says what it is, the others are values; nothing
    without rows.  What is longer than a figure, such as a hash, may run over several lines.
    """
    if len(rows) < 2:
        return ""
    top = "".join(f'<th scope="col" class="number">{escape(cell)}</th>' if cell else "<td></td>" for cell in rows[0])
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>'
        + "".join(f'<td class="{"number" if len(cell) < _LONG else "long"}">{escape(cell)}</td>' for cell in row[1:])
        + "</tr>\n"
        for row in rows[1:]
    )
    return f'<div class="scroll"><table>\n<thead><tr>{top}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n'


def figure(svg: str, caption: str) -> str:
    """A plot with its caption, which is its text for whoever does not see it too."""
    picture = labelled(svg, caption)
    return f"<figure>\n{picture}\n<figcaption>{escape(caption)}.</figcaption>\n</figure>\n"
