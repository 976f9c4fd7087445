"""Sections of blocks, the parts of a report; a page and a printed document show them alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from matplotlib.axes import Axes

from sssi_exudyn.results.stored import StoredRun


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Heading:
    """A headline within a section."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list of lines."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Grid:
    """A table of figures, the headline first: each row's first cell names it, the others are values."""

    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Facts:
    """A table of three columns without a headline: name, value, meaning."""

    rows: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Drawing:
    """One pair of axes over the whole width with its own legend; ``height`` in inches."""

    caption: str
    draw: Callable[[Axes], None]
    height: float = 2.9


@dataclass(frozen=True)
class Panel:
    """One pair of axes of several: ``title`` stands above it, ``alt`` describes it for screen readers."""

    title: str
    alt: str
    draw: Callable[[Axes], None]


@dataclass(frozen=True)
class Key:
    """Meaning of a line's colour (an index into ``plots.COLOURS``; None for the text's) and style."""

    colour: int | None
    style: Literal["-", "--", ":", "."]
    meaning: str


@dataclass(frozen=True)
class Panels:
    """A figure of several panels with one legend; sizes of a panel in inches."""

    caption: str
    panels: tuple[Panel, ...]
    keys: tuple[Key, ...]
    width: float
    height: float


@dataclass(frozen=True)
class Markup:
    """HTML that only a page shows, such as a replay."""

    html: str


Block: TypeAlias = Text | Heading | Items | Grid | Facts | Drawing | Panels | Markup


@dataclass(frozen=True)
class Section:
    """A part of a report under its title; without blocks it is left out."""

    title: str
    blocks: tuple[Block, ...]


Runs: TypeAlias = Sequence[StoredRun]
"""The results that a report shows side by side."""


def table_section(title: str, rows: Sequence[Sequence[str]]) -> Section:
    """Return a section of one table, the headline first; empty where there is only the headline."""
    return Section(title, (Grid(rows),) if len(rows) > 1 else ())


def figure_section(
    title: str, caption: str, panels: tuple[Panel, ...], keys: tuple[Key, ...], width: float, height: float
) -> Section:
    """Return a section of one figure; empty where it has no panel."""
    return Section(title, (Panels(caption, panels, keys, width, height),) if panels else ())


def section_of_each(title: str, runs: Runs, blocks_of: Callable[[StoredRun], tuple[Block, ...]]) -> Section:
    """Return the blocks of every run, below its name where there are several."""
    blocks: list[Block] = []
    for run in runs:
        own = blocks_of(run)
        if own and len(runs) > 1:
            blocks.append(Heading(run.name))
        blocks += own
    return Section(title, tuple(blocks))
