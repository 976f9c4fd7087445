"""The report as a PDF: the page's sentences, tables and figures on paper; what moves stays on the page."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Sequence
from typing import Final

import matplotlib as mpl
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssi_exudyn.reports import plots
from sssi_exudyn.reports.panels import Plot, panels_page

A4: Final = (8.27, 11.69)
"""in"""
_LINE: Final = 0.017
"""Height of a line of text, of the page's."""
_TOP, _BOTTOM, _LEFT, _RIGHT = 0.93, 0.05, 0.08, 0.95
_FIRST_COLUMN: Final = 0.42
"""Share of a table's width that says what a row is."""

Sheet = tuple[str, Sequence[Sequence[str]]]
"""A table: its title, and its rows, the headline first."""


def pdf_bytes(title: str, sentences: Sequence[str], sheets: Sequence[Sheet], figures: Sequence[Plot]) -> bytes:
    """A document in A4: title and sentences, the first table, the figures, then the other tables.

    The same input gives the same bytes: no date is written.
    """
    made = io.BytesIO()
    with mpl.rc_context(plots.STYLE | {"pdf.fonttype": 42}), PdfPages(made, metadata={"CreationDate": None}) as pages:
        for page in _first_page(title, sentences, sheets[:1]):
            pages.savefig(page)
        for figure in figures:
            pages.savefig(panels_page(figure, A4))
        for page in _tables(sheets[1:]):
            pages.savefig(page)
    return made.getvalue()


def _first_page(title: str, sentences: Sequence[str], sheets: Sequence[Sheet]) -> Iterator[Figure]:
    page = Figure(figsize=A4)
    y = _text(page, _TOP, textwrap.wrap(title, 55), size=17.0, weight="bold")
    for sentence in sentences:
        y = _text(page, y - 0.5 * _LINE, textwrap.wrap(sentence, 88), size=11.0)
    for name, rows in sheets:
        y = _headline(page, y, name)
        for index, row in enumerate(rows):
            y = _row(page, y, row, head=index == 0)
    yield page


def _tables(sheets: Sequence[Sheet]) -> Iterator[Figure]:
    """Pages of tables, one after the other; a table that does not fit goes on on the next page."""
    page, y = Figure(figsize=A4), _TOP
    for name, rows in sheets:
        if len(rows) < 2:
            continue
        if y - 6 * _LINE < _BOTTOM:
            yield page
            page, y = Figure(figsize=A4), _TOP
        y = _headline(page, y, name)
        for index, row in enumerate(rows):
            if y - 2 * _LINE < _BOTTOM:
                yield page
                page, y = Figure(figsize=A4), _TOP
                y = _row(page, y, rows[0], head=True)
            y = _row(page, y, row, head=index == 0)
    yield page


def _headline(page: Figure, y: float, name: str) -> float:
    return _text(page, y - 1.5 * _LINE, [name], size=12.0, weight="bold") - 0.3 * _LINE


def _text(page: Figure, y: float, lines: Sequence[str], *, size: float, weight: str = "normal") -> float:
    """Lines from ``y`` downwards; where the next ones begin."""
    step = _LINE * size / 10.0
    for index, line in enumerate(lines):
        page.text(_LEFT, y - index * step, _literal(line), fontsize=size, weight=weight, va="top")
    return y - len(lines) * step


def _row(page: Figure, y: float, row: Sequence[str], *, head: bool) -> float:
    """One row of a table, long cells over several lines; where the next one begins."""
    columns = len(row) - 1
    first = _FIRST_COLUMN if columns < 4 else 0.2
    width = (_RIGHT - _LEFT) * (1.0 - first) / max(1, columns)
    cells = [textwrap.wrap(row[0], int(105 * first))] + [
        textwrap.wrap(cell, max(10, int(105 * width))) for cell in row[1:]
    ]
    lines = max(1, *(len(cell) for cell in cells))
    for index, cell in enumerate(cells):
        x = _LEFT if index == 0 else _LEFT + (_RIGHT - _LEFT) * first + index * width
        for line, words in enumerate(cell):
            page.text(
                x,
                y - line * 0.8 * _LINE,
                _literal(words),
                fontsize=8.0 if columns < 6 else 7.0,
                va="top",
                ha="left" if index == 0 else "right",
                weight="bold" if head else "normal",
            )
    y -= lines * 0.8 * _LINE + 0.2 * _LINE
    rule = Line2D([_LEFT, _RIGHT], [y + 0.12 * _LINE] * 2, color="0.8", linewidth=0.5)
    page.add_artist(rule)
    return y - 0.05 * _LINE


def _literal(text: str) -> str:
    """Text in which no dollar sign starts a formula."""
    return text.replace("$", r"\$")
