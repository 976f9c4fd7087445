"""The report as a PDF: the page's sentences, tables and figures on paper; the replay is left to the page."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Sequence
from typing import Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D

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
    Tiles,
)

A4: Final = (8.27, 11.69)
"""inches"""
_LINE: Final = 0.017
"""Height of a line of text, as a share of the page's."""
_TOP, _BOTTOM, _LEFT, _RIGHT = 0.93, 0.05, 0.08, 0.95
_FACTS: Final = (0.0, 0.45, 0.48)
"""Left edges of the columns of a table of facts, as shares of its width; the second one ends there."""
_MANY: Final = 6
"""Columns beyond which a table is set smaller."""
_TITLES: Final = 80
"""Letters of panels' titles that fit side by side."""
_LETTERS: Final = 880.0
"""Number of letters of one point that fill a table's width."""


def pdf_bytes(title: str, sentences: Sequence[str], sections: Iterable[Section]) -> bytes:
    """Return a document in A4: title and sentences, then the sections.

    The same input gives the same bytes: no date is written.
    """
    content = io.BytesIO()
    with (
        mpl.rc_context(plots.STYLE | {"pdf.fonttype": 42}),
        PdfPages(content, metadata={"CreationDate": None}) as document,
    ):
        paper = _Paper(document)
        paper.text(title, 55, size=17.0, weight="bold")
        for sentence in sentences:
            paper.skip(0.5)
            paper.text(sentence, 88, size=11.0)
        for section in sections:
            if any(not isinstance(block, Markup) for block in section.blocks):
                _add_section(paper, section)
        paper.finish()
    return content.getvalue()


class _Paper:
    """The page that is being filled from its top; full pages go into the document."""

    def __init__(self, document: PdfPages) -> None:
        self._document = document
        self._page, self._y = Figure(figsize=A4), _TOP

    def finish(self) -> None:
        """Close the page."""
        self._document.savefig(self._page)  # type: ignore[no-untyped-call]

    def need(self, lines: float) -> bool:
        """Begin a new page where fewer than so many lines are left, and return whether it did."""
        if self._y - lines * _LINE >= _BOTTOM:
            return False
        self.finish()
        self._page, self._y = Figure(figsize=A4), _TOP
        return True

    def skip(self, lines: float) -> None:
        """Leave so many lines empty, but not at a page's top."""
        if self._y < _TOP:
            self._y -= lines * _LINE

    def text(self, text: str, width: int, *, size: float = 9.0, weight: str = "normal", indent: float = 0.0) -> None:
        """Add a paragraph of lines of ``width`` letters."""
        step = size / 10.0
        for line in textwrap.wrap(text, width):
            self.need(step)
            self._page.text(_LEFT + indent, self._y, line, fontsize=size, weight=weight, va="top")
            self._y -= step * _LINE

    def row(self, cells: Sequence[tuple[str, float, float, str]], *, size: float = 8.0, weight: str = "normal") -> None:
        """Add one row of a table, long cells over several lines.

        A cell is its text, its begin and end (as shares of the table's width), and "left" or "right".
        """
        lines = _wrap(cells, size)
        for (_, begin, end, side), cell in zip(cells, lines, strict=True):
            x = _LEFT + (_RIGHT - _LEFT) * (begin if side == "left" else end)
            for index, words in enumerate(cell):
                y = self._y - index * 0.8 * _LINE
                self._page.text(x, y, words, fontsize=size, va="top", ha=side, weight=weight)
        self._y -= _height(lines) * _LINE
        rule = Line2D([_LEFT, _RIGHT], [self._y + 0.12 * _LINE] * 2, color="0.8", linewidth=0.5)
        self._page.add_artist(rule)
        self._y -= 0.05 * _LINE

    def axes(self, height: float) -> Axes:
        """Add axes of ``height`` inches over the whole width, with room for a legend above and labels below."""
        self.need((height + 0.9) / A4[1] / _LINE)
        bottom = self._y - (height + 0.3) / A4[1]
        self._y = bottom - 0.55 / A4[1]
        return self._page.add_axes((_LEFT + 0.04, bottom, _RIGHT - _LEFT - 0.04, height / A4[1]))

    def panels(self, block: Panels) -> None:
        """Add a figure of panels, with its keys and caption below."""
        columns = 3 if block.width < plots.WIDE else min(2, len(block.panels))
        rows = -(-len(block.panels) // columns)
        height = min(_TOP - _BOTTOM - 8.0 * _LINE, rows * (block.height + 0.45) / A4[1])
        self.need(height / _LINE + 6.0)
        top, bottom = self._y - 1.5 * _LINE, self._y - height
        area = self._page.add_gridspec(
            rows, columns, left=_LEFT + 0.02, right=_RIGHT, top=top, bottom=bottom, hspace=0.6, wspace=0.35
        )
        first = len(self._page.axes)
        for index, panel in enumerate(block.panels):
            axes = self._page.add_subplot(area[index // columns, index % columns])
            axes.set_title(textwrap.fill(panel.title, _TITLES // columns), fontsize=9.0, loc="left")
            panel.draw(axes)
        self._fit_right(area, first)
        names = [key.meaning for key in block.keys]
        place = (_LEFT, bottom - 2.0 * _LINE)
        self._page.legend([_handle(key) for key in block.keys], names, loc="upper left", bbox_to_anchor=place, ncols=4)
        self._y = bottom - (2.5 + 1.3 * -(-len(names) // 4)) * _LINE

    def _fit_right(self, area: GridSpec, first: int) -> None:
        """Make the panels from the axes ``first`` on narrower where an axis on their right leaves the page's width."""
        drawn = self._page.axes[first:]
        boxes = [axes.get_tightbbox() for axes in drawn]
        beyond = max((box.x1 / self._page.bbox.width for box in boxes if box is not None), default=0.0) - _RIGHT
        if beyond <= 0.0:
            return
        area.update(right=_RIGHT - beyond, wspace=0.35 + 4.0 * beyond)  # of figures of pyplot it moves the axes too
        for axes in drawn:
            place = axes.get_subplotspec()
            if place is not None:
                axes.set_position(place.get_position(self._page))


def _add_section(paper: _Paper, section: Section) -> None:
    paper.skip(1.5)
    paper.need(_least(section.blocks[0]))
    paper.text(section.title, 80, size=12.0, weight="bold")
    paper.skip(0.3)
    blocks = tuple(Text(text) for text in (section.sentence, section.assumed) if text) + section.blocks
    with mpl.rc_context({"font.size": 8.0}):
        for block in blocks:
            _add_block(paper, block)


def _least(block: Block) -> float:
    """Return the number of lines that a headline needs below it so that it does not stand alone."""
    match block:
        case Panels():
            columns = 3 if block.width < plots.WIDE else min(2, len(block.panels))
            return -(-len(block.panels) // columns) * (block.height + 0.45) / A4[1] / _LINE + 9.0
        case Drawing():
            return (block.height + 0.9) / A4[1] / _LINE + 4.0
        case _:
            return 6.0


def _add_block(paper: _Paper, block: Block) -> None:
    match block:
        case Text(text):
            paper.text(text, 105)
            paper.skip(0.5)
        case Heading(text):
            paper.skip(0.5)
            paper.need(5.0)
            paper.text(text, 90, size=9.5, weight="bold")
            paper.skip(0.2)
        case Items(lines):
            for line in lines:
                paper.text(f"– {line}", 105, size=8.0)
        case Grid(rows):
            _add_grid(paper, rows)
        case Facts(rows):
            for what, value, meaning in rows:
                _, middle, last = _FACTS
                cells = [(what, 0.0, 0.28, "left"), (value, 0.28, middle, "right"), (meaning, last, 1.0, "left")]
                paper.need(_height(_wrap(cells, 8.0)))
                paper.row(cells)
        case Drawing():
            axes = paper.axes(0.75 * block.height)
            block.draw(axes)
            if axes.get_legend_handles_labels()[0]:
                axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderpad=0.0)
            _fit_width(axes)
            _add_caption(paper, block.caption)
        case Panels():
            paper.panels(block)
            _add_caption(paper, block.caption)
        case Tiles(tiles):
            _add_block(paper, Facts([(tile.name, tile.value, tile.note) for tile in tiles]))
        case Markup():
            pass


def _fit_width(axes: Axes) -> None:
    """Make axes narrower where names at their left or an axis at their right leave the text's width."""
    figure, box = axes.get_figure(root=True), axes.get_tightbbox()
    if figure is None or box is None:
        return
    place = axes.get_position()
    left = max(0.0, _LEFT - box.x0 / figure.bbox.width)
    right = max(0.0, box.x1 / figure.bbox.width - _RIGHT)
    axes.set_position((place.x0 + left, place.y0, place.width - left - right, place.height))


def _add_caption(paper: _Paper, caption: str) -> None:
    paper.text(f"{caption}.", 115, size=8.0)
    paper.skip(0.5)


def _add_grid(paper: _Paper, rows: Sequence[Sequence[str]]) -> None:
    """Add a table; its headline is repeated where it continues on the next page."""
    if len(rows) < 2:
        return
    size = 8.0 if len(rows[0]) <= _MANY else 7.0
    edges = _column_edges(rows, size)

    def cells(row: Sequence[str]) -> list[tuple[str, float, float, str]]:
        return [(cell, edges[k], edges[k + 1], "right" if k > 0 else "left") for k, cell in enumerate(row)]

    head = cells(rows[0])
    paper.row(head, size=size, weight="bold")
    for row in rows[1:]:
        if paper.need(_height(_wrap(cells(row), size))):
            paper.row(head, size=size, weight="bold")
        paper.row(cells(row), size=size)


def _column_edges(rows: Sequence[Sequence[str]], size: float) -> list[float]:
    """Return the edges of the columns as shares of the table's width, each column as wide as its longest cell.

    Spare width goes to the first column; missing width is taken from the widest one.
    """
    letters = int(_LETTERS / size)
    widths = [max(len(row[k]) for row in rows) + 3 for k in range(len(rows[0]))]
    while sum(widths) > letters:
        widths[widths.index(max(widths))] -= 1
    widths[0] += letters - sum(widths)
    return [sum(widths[:k]) / letters for k in range(len(widths) + 1)]


def _wrap(cells: Sequence[tuple[str, float, float, str]], size: float) -> list[list[str]]:
    letters = _LETTERS / size
    return [textwrap.wrap(text, max(8, int(letters * (end - begin)) - 1)) for text, begin, end, _ in cells]


def _height(lines: Sequence[Sequence[str]]) -> float:
    """Return the height of a row, in lines of text."""
    return 0.8 * max(1, *(len(cell) for cell in lines)) + 0.2


def _handle(key: Key) -> Line2D:
    colour = plots.INK if key.colour is None else plots.COLOURS[key.colour]
    if key.style == ".":
        return Line2D([], [], color=colour, marker=".", linestyle="none")
    return Line2D([], [], color=colour, linestyle=key.style)
