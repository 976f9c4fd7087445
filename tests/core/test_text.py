"""Text from files, as it is shown: one printable line of bounded length, whatever the file held."""

from __future__ import annotations

import pickle

import pytest

from sssi_exudyn.core.errors import InputError, SssiError
from sssi_exudyn.core.text import one_line, plot_text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Hans Müller 滑雪", "Hans Müller 滑雪"),
        ("two\nlines\tand\r\nmore", "two lines and  more"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("\u202egnp.exe\u2066", r"\u202egnp.exe\u2066"),
        ("\udcff", r"\udcff"),
        ("\x00\x7f\x9b", r"\x00\x7f\x9b"),
        ("می‌روم 👩‍🚀", "می‌روم 👩‍🚀"),
        ("no\u00a0break\u2028", "no break "),
    ],
)
def test_what_a_terminal_would_obey_is_written_out(text: str, shown: str) -> None:
    assert one_line(text) == shown
    assert one_line(shown).encode("utf-8")


def test_long_text_keeps_its_beginning_and_its_end() -> None:
    shown = one_line("a" * 10_000_000 + "end", 100)
    assert len(shown) == 100
    assert shown.startswith("aaa")
    assert shown.endswith("aend")


def test_a_dollar_begins_no_formula() -> None:
    assert plot_text("$ \\frac{$") == "\\$ \\frac{\\$"


def test_error_lines_are_clean_and_bounded_and_survive_another_process() -> None:
    error = InputError("a\nb/" + "c" * 10_000_000, "\x1b[2J", "p" * 10_000_000, "fix\u202e")
    line = str(error)
    assert len(line) < 4000
    assert one_line(line, 4000) == line
    assert str(pickle.loads(pickle.dumps(error))) == line
    assert error.file.startswith("a\nb/")  # the path itself stays as it is
    assert str(SssiError("x\n" * 10_000_000)).startswith("x x x")
    assert len(str(SssiError("x\n" * 10_000_000))) <= 4000
