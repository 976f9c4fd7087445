"""Repairs of a file with a count: which of its records are left out, how many, where, and never beyond a share.

One bad record costs one record.  A file of which more is bad than the stated share is refused in one line.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array

Mask = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

WRONG: Final = 0.25
"""Largest share of records that contradict the others; beyond it, it is unclear which of them are wrong."""
UNKNOWN: Final = 0.95
"""Largest share of records in which the instrument itself marks a value as unknown, as a watch does indoors."""

REPEATED: Final = 0.6
"""Largest share of records whose time stands still or runs back: loggers may write every sample twice."""


class Repairs:
    """The records of one file that a reader left out or bridged, in words.

    Parameters
    ----------
    path : the file

    Examples
    --------
    >>> repairs = Repairs(path)
    >>> repairs.add("fix(es) without a height", ["line 7"], 900)
    >>> repairs.notes
    ('run.csv: 1 of 900 fix(es) without a height left out (first: line 7)',)
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._notes: list[str] = []
        self._lost: list[str] = []

    def add(
        self,
        what: str,
        places: Sequence[str],
        total: int,
        *,
        done: str = "left out",
        most: float = WRONG,
        fix: str = "export the file again",
    ) -> None:
        """Note a repair of the records at ``places``; nothing is noted where there are none.

        Parameters
        ----------
        what : the records, in words
        places : each record's place in the file, in order
        total : number of records in the file
        done : what is done with them
        most : largest share of ``total`` that may be repaired
        fix : what the user can do beyond that share

        Raises InputError, at the first place, where the share is larger than ``most``.
        """
        if not places:
            return
        if len(places) > most * total:
            problem = f"{len(places)} of {total} {what}, more than the {100.0 * most:.0f} % that are repaired"
            raise InputError(self.path, places[0], problem, fix)
        self._lost.append(f"{len(places)} of {total} {what}")
        self._notes.append(f"{self.path.name}: {self._lost[-1]} {done} (first: {places[0]})")

    def add_at(
        self,
        what: str,
        bad: Mask,
        places: Sequence[str],
        *,
        done: str = "left out",
        most: float = WRONG,
        fix: str = "export the file again",
    ) -> None:
        """Note a repair of the records that are ``bad`` (n,); ``places`` (n) and the rest are as in ``add``."""
        self.add(what, [places[row] for row in np.flatnonzero(bad).tolist()], len(bad), done=done, most=most, fix=fix)

    def check_rest(self, count: int, fix: str) -> None:
        """Raise InputError where repairs, each within its share, together left less than three records, ``count``.

        fix : what the user can do
        """
        if self._lost and count < 3:
            raise InputError(self.path, "", f"{'; '.join(self._lost)}: the {count} others are no recording", fix)

    def add_all(self, words: str) -> None:
        """Note a repair of the whole file."""
        self._notes.append(f"{self.path.name}: {words}")

    def add_end(self, problem: str, place: str, count: int) -> None:
        """Note that the file is faulty behind ``count`` records, which are read."""
        self._notes.append(f"{self.path.name}: {problem} at {place}; the {count} records before it are read")

    @property
    def notes(self) -> tuple[str, ...]:
        """Return one note for each kind of repair."""
        return tuple(self._notes)


def rising_records(time: Array) -> Mask:
    """Return a mask (n,) of the most records whose times (n,) rise; of repeated times the first is kept.

    The others stand still or run back.  One record whose time is far ahead costs itself and not all that follow.
    """
    if np.all(np.diff(time) > 0.0):
        return np.ones(len(time), bool)
    tails: list[float] = []  # the least last time of a rising sequence of each length, and its record
    rows: list[int] = []
    before = np.full(len(time), -1)
    for row, moment in enumerate(time.tolist()):
        length = bisect_left(tails, moment)
        if length < len(tails) and tails[length] == moment:
            continue
        before[row] = rows[length - 1] if length else -1
        tails[length : length + 1], rows[length : length + 1] = [moment], [row]
    kept = np.zeros(len(time), bool)
    row = rows[-1]
    while row >= 0:
        kept[row] = True
        row = int(before[row])
    return kept


def reachable_records(time: Array, values: Array, fastest: float, allowance: Array) -> Mask:
    """Return a mask (n,) of the records that can follow each other at up to ``fastest``.

    The longest stretch without an impossible step is trusted.  From its ends outwards a record is kept where it can be
    reached from the last kept one.

    Parameters
    ----------
    time : (n,) s, rising;  values : (n, d) of each record
    fastest : largest distance of two values, per second;  allowance : (n,) part of it for each record's noise
    """
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    broken = steps > fastest * np.diff(time) + allowance[1:] + allowance[:-1]
    if not np.any(broken):
        return np.ones(len(time), bool)
    cuts = np.flatnonzero(broken) + 1
    starts, stops = np.r_[0, cuts], np.r_[cuts, len(time)]
    kept = np.zeros(len(time), bool)
    trusted = int(np.argmax(stops - starts))
    kept[starts[trusted] : stops[trusted]] = True

    def reached(row: int, last: int) -> bool:
        limit = fastest * abs(float(time[row] - time[last])) + float(allowance[row] + allowance[last])
        return float(np.linalg.norm(values[row] - values[last])) <= limit

    last = int(stops[trusted]) - 1
    for row in range(last + 1, len(time)):
        if reached(row, last):
            kept[row], last = True, row
    last = int(starts[trusted])
    for row in range(last - 1, -1, -1):
        if reached(row, last):
            kept[row], last = True, row
    return kept
