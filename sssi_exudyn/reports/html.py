"""A page of HTML that is complete without a network: its style, its plots, its script, its data."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from html import escape
from importlib import resources

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.section import (
    Block,
    Drawing,
    Facts,
    Grid,
    Heading,
    Items,
    Key,
    Markup,
    Panels,
    Section,
    Text,
    Tile,
    Tiles,
)

_LONG = 24
"""Characters from which a cell of a table is not a figure."""


def document(title: str, lead: str, sections: Sequence[Section]) -> str:
    """Return the whole page: ``title`` is text, ``lead`` the markup before the sections; empty sections are left out.

    The page's own script opens and closes all sections, and plays replays where there are some; nothing else may run.
    """
    shown = [(section, section_html(section, f"part-{index}")) for index, section in enumerate(sections)]
    shown = [(section, content) for section, content in shown if content]
    body = "".join(_section(section, content, index) for index, (section, content) in enumerate(shown))
    script = _read_packaged("page.js") + (_read_packaged("replay.js") if 'class="replay"' in lead + body else "")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    allowed = f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{allowed}">\n'
        f"<title>{escape(title)}</title>\n<style>\n{_read_packaged('page.css')}</style>\n</head>\n<body>\n"
        f"<h1>{escape(title)}</h1>\n{lead}{_contents([section.title for section, _ in shown])}{body}"
        f"<script>{script}</script>\n</body>\n</html>\n"
    )


def _contents(headlines: Sequence[str]) -> str:
    """Return the folded list of sections."""
    links = "".join(
        f'<a href="#part-{index}">{escape(_short(headline))}</a>\n' for index, headline in enumerate(headlines)
    )
    return (
        f'<details class="contents">\n<summary>Contents ({len(headlines)} sections)</summary>\n<nav>{links}</nav>\n'
        '</details>\n<p class="all" hidden><button type="button">Open all details</button></p>\n'
    )


def _section(section: Section, content: str, index: int) -> str:
    """Return a section: its sentence, and the rest folded below it; without a sentence all of it is shown."""
    kind = ' class="assumed"' if section.assumed else ""
    said = f'<p class="because">{escape(section.assumed)}</p>\n' if section.assumed else ""
    if section.sentence:
        opened = " open" if section.opened else ""
        content = (
            f'<p class="say">{escape(section.sentence)}</p>\n<details{opened}>\n'
            f"<summary>{_what_is_folded(section.blocks)}</summary>\n{content}</details>\n"
        )
    return f'<section{kind}>\n<h2 id="part-{index}">{escape(section.title)}</h2>\n{said}{content}</section>\n'


def _what_is_folded(blocks: Sequence[Block]) -> str:
    """Name what a reader finds below a section's sentence."""
    figures = sum(isinstance(block, Drawing | Panels) for block in blocks)
    tables = sum(isinstance(block, Grid | Facts) for block in blocks)
    counted = [(figures, "figure"), (tables, "table")]
    words = [name if count == 1 else f"{count} {name}s" for count, name in counted if count]
    return escape(" and ".join(words).capitalize() or "Details")


def _short(headline: str) -> str:
    """Return a headline without the part after a colon or in brackets."""
    return headline.partition(":")[0].partition(" (")[0]


def _read_packaged(name: str) -> str:
    return (resources.files(__package__) / name).read_text(encoding="utf-8")


def section_html(section: Section, name: str) -> str:
    """Return the content of a section; ``name`` is its own on its page."""
    return "".join(_block_html(block, f"{name}-{index}") for index, block in enumerate(section.blocks))


def _block_html(block: Block, name: str) -> str:
    match block:
        case Text(text):
            return f"<p>{escape(text)}</p>\n"
        case Heading(text):
            return f"<h3>{escape(text)}</h3>\n"
        case Items(lines):
            return "<ul>\n" + "".join(f"<li>{escape(line)}</li>\n" for line in lines) + "</ul>\n"
        case Grid(rows):
            return grid(rows)
        case Facts(rows):
            return facts(rows)
        case Drawing():
            return figure(plots.whole_width(name, block.draw, block.height), block.caption)
        case Tiles(tiles):
            return tiles_html(tiles)
        case Panels():
            return panels(block, name)
        case Markup(html):
            return html


def tiles_html(tiles: Sequence[Tile]) -> str:
    """Return figures side by side, each in a box: name, value and what qualifies it."""
    boxes = "".join(
        f'<div class="tile{" assumed" if tile.assumed else ""}"><dt>{escape(tile.name)}'
        f"{' (assumed)' if tile.assumed else ''}</dt>"
        f'<dd class="value">{escape(tile.value)}</dd><dd class="soft">{escape(tile.note)}</dd></div>\n'
        for tile in tiles
    )
    return f'<dl class="tiles">\n{boxes}</dl>\n'


def facts(rows: Sequence[tuple[str, str, str]]) -> str:
    """Return a table of name, value and meaning; nothing where there is no row."""
    if not rows:
        return ""
    body = "".join(
        f'<tr><th scope="row">{escape(what)}</th><td class="number">{escape(value)}</td>'
        f'<td class="soft">{escape(meaning)}</td></tr>\n'
        for what, value, meaning in rows
    )
    return f'<div class="scroll"><table>\n<tbody>\n{body}</tbody>\n</table></div>\n'


def table(title: str, rows: Sequence[tuple[str, str, str]]) -> str:
    """Return ``facts`` under a headline; nothing where there is no row."""
    return f"<h3>{escape(title)}</h3>\n{facts(rows)}" if rows else ""


def grid(rows: Sequence[Sequence[str]]) -> str:
    """Return a table of figures, the headline first; nothing without rows.

    Each row's first cell names it, the others are values.  A cell longer than a figure, such as a hash, may run over
    several lines.
    """
    if len(rows) < 2:
        return ""
    first, *others = rows[0]
    top = f'<th scope="col">{escape(first)}</th>' if first else "<td></td>"
    top += "".join(f'<th scope="col" class="number">{escape(cell)}</th>' if cell else "<td></td>" for cell in others)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>' + "".join(_value(cell) for cell in row[1:]) + "</tr>\n"
        for row in rows[1:]
    )
    return f'<div class="scroll"><table>\n<thead><tr>{top}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n'


def _value(cell: str) -> str:
    """Return a cell of a table; a figure with its interval in brackets may take two lines on a narrow screen."""
    figure, bracket, interval = cell.partition(" (")
    if bracket and len(cell) <= 2 * _LONG and figure[-1:] in set("0123456789%"):
        return f'<td class="number split">{escape(figure)} <span>({escape(interval)}</span></td>'
    return f'<td class="{"number" if len(cell) < _LONG else "long"}">{escape(cell)}</td>'


def figure(pictures: str, caption: str) -> str:
    """Return a plot, drawn by ``whole_width``, with its caption, which is also its text for screen readers."""
    picture = plots.with_label(pictures, caption)
    return f"<figure>\n{picture}\n<figcaption>{escape(caption)}.</figcaption>\n</figure>\n"


def panels(block: Panels, name: str) -> str:
    """Return a figure of panels: each a plot of its own, so that they flow on a narrow screen."""
    drawn = []
    for index, panel in enumerate(block.panels):
        svg = plots.svg(f"{name}-{index}", panel.draw, block.height, block.width)
        picture = plots.with_label(svg, f"{panel.title}: {panel.alt}")
        drawn.append(f"<div><h3>{escape(panel.title)}</h3>\n{picture}</div>\n")
    lines = {"-": "line", "--": "line dashed", ":": "line dotted", ".": "dot"}
    keys = "".join(
        f'<span><i class="{lines[key.style]}" style="{_ink(key)}"></i>{escape(key.meaning)}</span> '
        for key in block.keys
    )
    legend = f'<p class="key">{keys}</p>\n' if keys else ""
    wide = " wide" if block.width >= plots.WIDE else ""
    return (
        f'<figure>\n{legend}<div class="panels{wide}">\n{"".join(drawn)}</div>\n'
        f"<figcaption>{escape(block.caption)}.</figcaption>\n</figure>\n"
    )


def _ink(key: Key) -> str:
    colour = "var(--ink)" if key.colour is None else f"var(--c{key.colour + 1})"
    return f"background:{colour}" if key.style == "." else f"border-color:{colour}"
