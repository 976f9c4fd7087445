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
class Tile:
    """One figure of an answer.

    name, value, note : what it is, the figure with its unit, and what qualifies it
    short : its name in a line of text; None for the same name
    assumed : whether it rests on what was assumed and not measured
    """

    name: str
    value: str
    note: str = ""
    short: str | None = None
    assumed: bool = False


@dataclass(frozen=True)
class Tiles:
    """Figures side by side, each in a box."""

    tiles: tuple[Tile, ...]


@dataclass(frozen=True)
class Markup:
    """HTML that only a page shows, such as a replay."""

    html: str


Block: TypeAlias = Text | Heading | Items | Grid | Facts | Drawing | Panels | Tiles | Markup


@dataclass(frozen=True)
class Section:
    """A part of a report under its title; without blocks it is left out.

    sentence : the section in one sentence, with the blocks folded below it; without one the blocks are shown
    opened : whether the blocks are shown from the start all the same
    assumed : why the section rests on what was assumed; "" where it rests on measurements
    """

    title: str
    blocks: tuple[Block, ...]
    sentence: str = ""
    opened: bool = False
    assumed: str = ""


Runs: TypeAlias = Sequence[StoredRun]
"""The results that a report shows side by side."""


def table_section(title: str, rows: Sequence[Sequence[str]], sentence: str) -> Section:
    """Return a section of one table, the headline first; empty where there is only the headline."""
    return Section(title, (Grid(rows),) if len(rows) > 1 else (), sentence)


def figure_section(title: str, figure: Panels, sentence: str, *, opened: bool = False) -> Section:
    """Return a section of one figure; empty where it has no panel."""
    return Section(title, (figure,) if figure.panels else (), sentence, opened)


def section_of_each(
    title: str, runs: Runs, blocks_of: Callable[[StoredRun], tuple[Block, ...]], sentence: str = ""
) -> Section:
    """Return the blocks of every run, below its name where there are several."""
    blocks: list[Block] = []
    for run in runs:
        own = blocks_of(run)
        if own and len(runs) > 1:
            blocks.append(Heading(run.name))
        blocks += own
    return Section(title, tuple(blocks), sentence)


def say_of_each(runs: Runs, say: Callable[[StoredRun], str]) -> str:
    """Return one sentence about every run of which there is something to say.

    ``say`` returns a clause without a full stop; the runs' names stand before theirs where there are several.
    """
    clauses = [(run.name, clause) for run in runs if (clause := say(run))]
    if not clauses:
        return ""
    if len(runs) == 1:
        (clause,) = (clause for _, clause in clauses)
        # a coefficient's Greek letter stays small
        return f"{clause[:1].upper() if clause[:1].isascii() else clause[:1]}{clause[1:]}."
    return "; ".join(f"{name}: {clause}" for name, clause in clauses) + "."
