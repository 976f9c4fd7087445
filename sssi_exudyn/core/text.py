"""Text from files and file names, cleaned for a terminal, a page or a plot: printable, one line, of bounded length."""

from __future__ import annotations

import csv
import difflib
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any, Final

LONGEST: Final = 200
"""Maximum number of characters of a name that is shown."""
_JOINERS: Final = frozenset("\u200c\u200d")
"""Invisible characters that words of some scripts and emoji contain; no other invisible character passes."""
_CUT: Final = " … "
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r", "＝", "＋", "－", "＠")
"""Beginnings of a cell that spreadsheets take for a formula, also in the wide forms."""


def one_line(text: object, longest: int = LONGEST) -> str:
    """Return ``text`` on one line, cut in the middle to ``longest`` characters.

    Line breaks and tabs become spaces.  Control characters (terminals take them for commands), marks that reverse the
    direction of writing and bytes that are no text become ``\\x1b``, ``\\u202e`` and so on.
    """
    whole = str(text)
    if len(whole) > longest:
        head = (longest - len(_CUT)) * 2 // 3
        whole = whole[:head] + _CUT + whole[head + len(_CUT) - longest :]
    return "".join(_clean(letter) for letter in whole)


def plot_text(text: object, longest: int = LONGEST) -> str:
    """Return ``text`` as ``one_line`` gives it, for Matplotlib: a dollar sign begins no formula."""
    return one_line(text, longest).replace("$", r"\$")


def csv_cell(value: object) -> object:
    """Return a cell of a table as a spreadsheet shows it: text that would be a formula there gets an apostrophe.

    Source: OWASP, CSV Injection.
    """
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def plus_minus(value: float, spread: float) -> str:
    """Return ``value ± spread``, both to the first significant digit of a positive spread."""
    digits = max(0, -math.floor(math.log10(spread)))
    return f"{value:.{digits}f} ± {spread:.{digits}f}"


def metres(value: float) -> str:
    """Return a length in m, to the millimetre below a metre and to three digits above."""
    return f"{value:.3f}" if value < 1.0 else f"{value:.2f}" if value < 10.0 else f"{value:.1f}"


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return the fix for an unknown name: the nearest known name, or else all known names."""
    names = sorted(known)
    near = difflib.get_close_matches(str(name), names, 1)
    return f"did you mean {near[0]!r}?" if near else f"use one of: {', '.join(names)}"


def _clean(letter: str) -> str:
    if letter.isprintable() or letter in _JOINERS:
        return letter
    return " " if letter.isspace() else letter.encode("unicode_escape").decode("ascii")


def csv_of(rows: Sequence[object], kind: type[Any]) -> str:
    """Return the CSV of rows that are dataclasses of that kind: its fields as header, ``csv_cell`` of each value."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = [entry.name for entry in fields(kind)]
    writer.writerow(names)
    for row in rows:
        values = vars(row)
        writer.writerow(["" if values[name] is None else csv_cell(values[name]) for name in names])
    return text.getvalue()
