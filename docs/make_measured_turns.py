"""Makes the section of ``docs/notebook/reproduction.md`` that sets the model's figures next to what others measured.

Run it as ``python docs/make_measured_turns.py`` after ``benchmarks/turns/measured_turns.py``: all numbers of the program are
from ``docs/notebook/measured_turns.json``, all others from ``benchmarks/turns/measured_values.py``.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "benchmarks" / "turns"))

from measured_values import MEASURED, NOT_TO_BE_HAD, UNSTATED, Measured  # noqa: E402

FIGURES: Final = ROOT / "docs" / "notebook" / "measured_turns.json"
PAGE: Final = ROOT / "docs" / "notebook" / "reproduction.md"
TITLE: Final = "## Next to what others measured"

_HEAD: Final = """{title}

Made by `python benchmarks/turns/measured_turns.py --json docs/notebook/measured_turns.json` and `python docs/make_measured_turns.py`, the
misses first: {missed} of {total} comparisons. *Ours* is what the program computes: of both bundled recordings, fitted; of
steady turns in the rig (`slalom_165`, 700 N unless it says otherwise); for Gilgien the worse of two fits each to fixes
without insoles. The bundled recordings come from a simulated world, so where a figure is the recording's own (friction,
loads, moments), a hit or a miss is that world's. Full texts were not at hand: every measured value is from the place that is named, most of
them from abstracts. Where a source states no spread, within {unstated:.0f} % counts as met; where it states a direction, the sign
does. `tests/validation/test_measured_turns.py` has one test for each source, which pins the misses too.

"""


def section() -> str:
    """Return the section, as Markdown."""
    figures: dict[str, float] = json.loads(FIGURES.read_text(encoding="utf-8"))
    missed = [row for row in MEASURED if not row.met(figures[row.key])]
    met = [row for row in MEASURED if row.met(figures[row.key])]
    head = _HEAD.format(title=TITLE, missed=len(missed), total=len(MEASURED), unstated=100.0 * UNSTATED)
    lines = ["| | measured | ours | | source | why, or what to know |", "|---|---|---|---|---|---|"]
    lines += [_line(row, row.shown(figures), "**missed**") for row in missed]
    lines += [_line(row, row.shown(figures), "met") for row in met]
    other = [f"- {what}: {why}." for what, why in NOT_TO_BE_HAD.items()]
    return head + "\n".join([*lines, "", "What could not be compared:", "", *other]) + "\n"


def _line(row: Measured, ours: str, verdict: str) -> str:
    return f"| {row.what} | {row.value} | {ours} | {verdict} | {row.cited}: {row.place} | {row.why} |"


def main() -> None:
    """Put the section at the end of the page, in the place of an older one."""
    before = PAGE.read_text(encoding="utf-8").partition(TITLE)[0].rstrip()
    PAGE.write_text(f"{before}\n\n{section()}", encoding="utf-8")


if __name__ == "__main__":
    main()
