"""Rows and summaries as plain text for a terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

from sssi_exudyn.core.text import csv_cell

_ONLY_IN_FILES = (
    *("provenance", "each", "control", "peak_moments", "reserve"),
    *("shares", "posture_rms_deg", "noise", "withheld"),
)
"""Groups of a summary too long for a terminal."""


def format_summary(summary: Mapping[str, Any]) -> str:
    """Write the figures of a summary, one a line, without null ones, lists, origins and those of single turns.

    Its notices stand behind them.
    """
    lines = [str(summary["recording"])]
    for group, figures in summary.items():
        if group not in _ONLY_IN_FILES and isinstance(figures, Mapping):
            own = {name: figure for name, figure in figures.items() if name not in _ONLY_IN_FILES}
            lines += [f"  {name:<36} {value}" for name, value in _figures(group, own)]
    lines += [f"  note: {notice}" for notice in summary.get("notices", ())]
    return "\n".join(lines) + "\n"


def format_table(rows: Sequence[Mapping[str, object]]) -> str:
    """Write rows of one set of names as columns under a headline; the text is empty where there is no row."""
    if not rows:
        return ""
    table = [[str(name) for name in rows[0]], *([_text(value) for value in row.values()] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in table]
    return "\n".join(lines) + "\n"


def format_csv(rows: Sequence[Mapping[str, object]]) -> str:
    """Write rows of one set of names as comma-separated values under a headline; without a row the text is empty."""
    if not rows:
        return ""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: csv_cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _figures(name: str, figure: object) -> list[tuple[str, str]]:
    """Return a figure, or those of a group, each with its path of names; a value with its standard error is one."""
    match figure:
        case None | {"value": None} | list():
            return []
        case {"value": value, "se": float(se)}:
            return [(name, f"{_text(value)} ± {_text(se)}")]
        case {"value": value}:
            return [(name, _text(value))]
        case Mapping():
            return [entry for key, value in figure.items() for entry in _figures(f"{name} {key}", value)]
        case _:
            return [(name, _text(figure))]


def _text(value: object) -> str:
    match value:
        case None:
            return ""
        case float():
            return f"{value:.4g}"
        case list():
            return ", ".join(_text(entry) for entry in value)
        case _:
            return str(value)
