"""The bounds of everything that is read.  They leave room to spare for a run of some minutes.

Files are untrusted.  Whatever grows with a file (text, numbers, gaps that are filled) is counted before memory is taken
for it.  So the worst file costs less than a gigabyte and some seconds of computing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sssi_exudyn.core.errors import InputError

MAX_BYTES: Final = 50_000_000
"""Size of the largest file that is read, bytes: 150 s of capture at 100 Hz, 59 joints with all channels."""
MAX_XML: Final = 250_000_000
"""Maximum size of an XML file, bytes; Xsens writes 7 kB per frame, and a run at 240 Hz has thirty thousand frames."""
MAX_TOML: Final = 1_000_000
"""Maximum size of a TOML file, bytes; a recording's notes have a thousand."""
MAX_FIT: Final = 10_000_000
"""Maximum size of a FIT file, bytes; a watch writes 2 MB a day."""

MAX_LINES: Final = 600_000
"""Maximum number of lines of a text: fifty minutes at 200 Hz."""
MAX_LINE: Final = 100_000
"""Maximum length of a line, bytes: two thousand columns of fifty digits."""
MAX_LOG: Final = 300_000_000
"""Maximum size of a day's log of one sensor, bytes: seven hours at 100 Hz, 120 bytes a line."""
MAX_LOG_LINES: Final = 2_500_000
"""Maximum number of lines of such a log: seven hours at 100 Hz."""
MAX_COLUMNS: Final = 2000
MAX_NUMBERS: Final = 6_000_000
"""Maximum count of numbers in a table, filled gaps included: 33 channels for half an hour at 100 Hz."""
MAX_JOINTS: Final = 500
MAX_FIXES: Final = 36_000
"""Maximum number of fixes of one receiver, filled gaps included: an hour at 10 Hz, ten hours at 1 Hz."""
MAX_RATE: Final = 250
"""Maximum number of fixes in one second; the fastest receivers give a hundred."""
MAX_SENSOR: Final = 200_000
"""Maximum number of samples of an inertial sensor or barometer, filled gaps included: half an hour at 100 Hz."""
MOST_FILLED: Final = 10
"""Maximum number of samples that fill gaps, for each measured sample."""
MAX_NAME: Final = 200
"""Maximum number of characters of a name: of a column, a joint, a key, a recording."""

MAX_DEPTH: Final = 16
"""Maximum depth of nested tables and lists, and of parts of a dotted key; files of this program have four."""
MAX_VALUES: Final = 100_000
"""Maximum number of values in one TOML file."""

MAX_JSON: Final = 5_000_000
"""Maximum size of a result's figures, bytes; a diagnosis with the curves of its plots has some hundred thousand."""
MAX_TEXT: Final = 2000
"""Maximum number of characters of a sentence in a result."""
MAX_NUMBER: Final = 1e50
"""Largest magnitude of any figure of a result in its unit; squares and sums of such numbers are finite."""

MAX_ROWS: Final = 2_000_000
"""Maximum number of rows of a result's table: five hours at 100 Hz."""
MAX_TABLE: Final = 30_000_000
"""Maximum count of numbers in a result's table: six minutes at 100 Hz with all muscles' forces, thirty without."""
MAX_DURATION: Final = 36_000.0
"""Longest time series of a result, s."""

MAX_ELEMENTS: Final = 600_000
"""Maximum number of elements of an XML file, with their attributes: thirty thousand frames of twenty."""
MAX_NESTING: Final = 24
"""Maximum depth of nested elements; formats of tracks and captures nest less than ten."""
MAX_MARKUP: Final = 200_000
"""Maximum number of bytes from one tag to the next, comments included."""


def check_samples(path: Path, place: str, count: float, width: int = 1, limit: int = MAX_NUMBERS) -> None:
    """Raise InputError for more than ``limit`` numbers: ``count`` samples of ``width`` each, or a count that is NaN."""
    if not count * width <= limit:
        raise InputError(
            path,
            place,
            f"{count:.3g} samples of {width} numbers are more than any run has",
            "check that time is in seconds, and cut the file to the run",
        )
