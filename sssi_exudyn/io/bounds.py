"""The bounds of everything that is read, and where they come from: a run of some minutes, with room to spare.

Files are untrusted.  Whatever grows with a file (text, numbers, gaps that are filled) is counted before memory is taken
for it, so that the worst file costs less than a gigabyte and some seconds of computing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError

MAX_BYTES: Final = 50_000_000
"""The largest file that is read, bytes: two and a half minutes of capture at 100 Hz, 59 joints with all channels."""
MAX_XML: Final = 250_000_000
"""bytes; Xsens writes 7 kB a frame, and a run at 240 Hz has thirty thousand."""
MAX_TOML: Final = 1_000_000
"""bytes; a recording's notes have a thousand."""
MAX_FIT: Final = 10_000_000
"""bytes; a watch writes 2 MB a day."""

MAX_LINES: Final = 600_000
"""Of a text: fifty minutes at 200 Hz."""
MAX_LINE: Final = 100_000
"""bytes; two thousand columns of fifty digits."""
MAX_COLUMNS: Final = 2000
MAX_NUMBERS: Final = 6_000_000
"""In one table, and in what becomes of it when its gaps are filled: 33 channels for half an hour at 100 Hz."""
MAX_JOINTS: Final = 500
MAX_FIXES: Final = 36_000
"""Of one receiver, filled gaps included: an hour at 10 Hz, ten at 1 Hz."""
MAX_RATE: Final = 250
"""Fixes in one second; the fastest receivers give a hundred."""
MAX_SENSOR: Final = 200_000
"""Samples of one inertial sensor or barometer, filled gaps included: half an hour at 100 Hz."""
MOST_FILLED: Final = 10
"""Samples that gaps are filled with, for each that was measured."""
MAX_NAME: Final = 200
"""Characters of a name: of a column, a joint, a key, a recording."""

MAX_DEPTH: Final = 16
"""Tables and lists within each other, and parts of a dotted key; files of this program have four."""
MAX_VALUES: Final = 100_000
"""In one TOML file."""

MAX_JSON: Final = 5_000_000
"""bytes of a result's figures; a diagnosis with the curves of its plots has some hundred thousand."""
MAX_TEXT: Final = 2000
"""Characters of a sentence in a result."""
MAX_NUMBER: Final = 1e50
"""Of any figure of a result in its unit; squares and sums of such numbers are finite."""

MAX_ROWS: Final = 2_000_000
"""Of a table of a result: five hours at 100 Hz."""
MAX_TABLE: Final = 30_000_000
"""Numbers in a table of a result: six minutes at 100 Hz with every muscle's force, or half an hour without."""
MAX_DURATION: Final = 36_000.0
"""s of a result's time series."""

MAX_ELEMENTS: Final = 600_000
"""Of an XML file, with its attributes: thirty thousand frames of twenty."""
MAX_NESTING: Final = 24
"""Elements within each other; formats of tracks and captures nest less than ten."""
MAX_MARKUP: Final = 200_000
"""bytes from one tag to the next, comments included."""


def check_samples(path: Path, place: str, count: float, width: int = 1, limit: int = MAX_NUMBERS) -> None:
    """Raise InputError where ``count`` samples of ``width`` numbers are more than ``limit`` numbers, or no number."""
    if not count * width <= limit:
        raise InputError(
            path,
            place,
            f"{count:.3g} samples of {width} numbers are more than any run has",
            "check that time is in seconds, and cut the file to the run",
        )
