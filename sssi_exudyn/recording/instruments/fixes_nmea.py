"""Fixes in logs of NMEA 0183 sentences, as receivers send them: GGA, with additions from RMC and GST."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, time, timedelta
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_FIXES, MAX_LINES, check_samples
from sssi_exudyn.io.files import read_bytes, read_text
from sssi_exudyn.io.long_table import pieces_of_lines
from sssi_exudyn.io.repairs import UNKNOWN, Repairs
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_of_rows
from sssi_exudyn.runtime.optional import library

_KNOT: Final = 1852.0 / 3600.0
"""Size of a knot, m/s."""
_KINDS: Final = ("GGA", "RMC", "GST")
_SENTENCE: Final = re.compile(r"\$..(...)[^$*]*(\*[0-9A-Fa-f]{2})?")
"""A sentence to its checksum: loggers put a clock of their own before and after it."""
_AMONG_BYTES: Final = re.compile(rb"\$[ -#%-)+-~]{5,200}\*[0-9A-Fa-f]{2}(?=[\r\n])")
"""A whole sentence among binary messages; bounded, and it holds no second beginning, so that any bytes are searched in
one pass.
"""
_ANY: Final = re.compile(r"\$[A-Z]{2}[A-Z]{3},")
"""Beginning of a sentence of any kind."""
_HEAD: Final = 200
"""Number of lines among which a log has a sentence."""
_LEAP: Final = re.compile(r"([01]\d|2[0-3])([0-5]\d)(60(?:\.\d+)?)")
"""A time of day, hhmmss, whose second is 60; some receivers also round to it."""
_KEPT: Final = 2.0
"""s for which a spread holds; receivers send GST once a second or two."""
_NO_MEASUREMENT: Final = (6, 7, 8)
"""Qualities of a place that was estimated, typed in or simulated."""
_UNKNOWN_DILUTION: Final = 50.0
"""Dilution of precision from which on a fix is useless; receivers write 99 or 99.99 for unknown."""
_UNITS: Final = {"M": 1.0, "F": 0.3048}
"""Metres in a sentence's units of height."""
_TORN: Final = 0.1
"""Share of torn lines above which a log is not that of a receiver."""


@dataclass
class _Log:
    """The sentences of a log by the time of day that they state; a GGA begins a fix."""

    moments: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    speed_course: dict[float, tuple[float, float]] = field(default_factory=dict)
    spread: dict[float, float] = field(default_factory=dict)
    first_day: date | None = None
    days: int = 0
    sentences: int = 0
    torn: list[str] = field(default_factory=list)
    without_fix: list[str] = field(default_factory=list)
    unmeasured: list[str] = field(default_factory=list)
    poor: list[str] = field(default_factory=list)


def fixes_nmea(path: Path) -> Fixes:
    """Read a log of sentences; sentences other than GGA, RMC and GST are ignored.

    Empty fields are unknown.  Torn sentences (by their checksum), those without a fix and those that the receiver
    marks as useless are left out and noted.  Of a log that has a receiver's binary messages too, the sentences are
    read.

    Raises InputError where the library is missing, more than a tenth of the lines is torn, or less than three fixes
    are there.
    """
    pynmea2 = library("pynmea2", path)
    log, repairs = _Log(), Repairs(path)
    for number, line in enumerate(_lines(path, repairs), 1):
        match = _SENTENCE.search(line)
        if match is None or match[1] not in _KINDS:
            continue
        log.sentences += 1
        check_samples(path, f"line {number}", log.sentences, limit=len(_KINDS) * MAX_FIXES)
        try:
            _add_sentence(log, pynmea2.parse(match[0].strip(), check=True), number)
        except pynmea2.SentenceTypeError:
            continue
        except (pynmea2.ParseError, ValueError, TypeError, AttributeError):  # fields that are no numbers, or missing
            log.torn.append(f"line {number}")
    fix = "record again with a lower rate or faster port"
    repairs.add("sentence(s) that are torn", log.torn, log.sentences, most=_TORN, fix=fix)
    repairs.add("sentence(s) without a fix", log.without_fix, log.sentences, most=UNKNOWN)
    words, fix = "sentence(s) of places that were estimated, typed in or simulated", "log what the receiver measures"
    repairs.add(words, log.unmeasured, log.sentences, most=UNKNOWN, fix=fix)
    repairs.add("sentence(s) marked as not exact", log.poor, log.sentences, most=UNKNOWN)
    if len(log.moments) < 3:
        raise InputError(
            path, "", f"{len(log.moments)} GGA sentences with a fix are no recording", "log GGA (and RMC) of the run"
        )
    return _fixes(log, repairs)


def _lines(path: Path, repairs: Repairs) -> list[str]:
    """Return the lines of a log; where it is no text, the sentences between its bytes, and note it.

    Raises InputError for what ``read_text`` refuses where there are none, and for more than ``MAX_LINES``.
    """
    data = read_bytes(path)
    try:
        data.decode()
    except UnicodeDecodeError:
        sentences = [match[0].decode("ascii") for match in islice(_AMONG_BYTES.finditer(data), MAX_LINES + 1)]
        if len(sentences) > MAX_LINES:
            raise InputError(path, "", "more sentences than any run has", "cut the file to the run") from None
        if sentences:
            share = 100.0 * (1.0 - sum(map(len, sentences)) / len(data))
            repairs.add_all(f"{share:.0f} % of its bytes are binary and not read; lines count the sentences alone")
            return sentences
    return read_text(path).split("\n")


def is_nmea(path: Path) -> bool:
    """Return whether a text begins as a log of sentences does, whatever its name."""
    for piece in pieces_of_lines(path):
        return any(_ANY.search(line) for _, line in piece[:_HEAD])
    return False


def _add_sentence(log: _Log, sentence: Any, number: int) -> None:  # Any: the library makes its classes from a table
    kind = sentence.sentence_type
    if kind not in _KINDS or not sentence.timestamp:  # before the receiver knows the time
        return
    moment = _time_of_day(sentence.timestamp) + 86400.0 * log.days
    if log.moments and moment < log.moments[-1] - 43200.0:  # past midnight
        log.days += 1
        moment += 86400.0
    if kind == "GST":
        north, east = _number(sentence.std_dev_latitude), _number(sentence.std_dev_longitude)
        log.spread[moment] = float(np.hypot(north, east) / np.sqrt(2.0))
    elif kind == "RMC":
        if sentence.status == "A":  # without a fix a receiver's calendar stands at its own zero
            if log.first_day is None and isinstance(sentence.datestamp, date):
                log.first_day = sentence.datestamp - timedelta(days=log.days)
            log.speed_course[moment] = (_KNOT * _number(sentence.spd_over_grnd), _number(sentence.true_course))
    elif not sentence.gps_qual:
        log.without_fix.append(f"line {number}")
    elif int(sentence.gps_qual) in _NO_MEASUREMENT:
        log.unmeasured.append(f"line {number}")
    elif _number(sentence.horizontal_dil) >= _UNKNOWN_DILUTION:
        log.poor.append(f"line {number}")
    else:
        unit = _UNITS.get((sentence.altitude_units or "M").upper(), np.nan)
        place = (float(sentence.latitude), float(sentence.longitude), unit * _number(sentence.altitude))
        log.moments.append(moment)
        log.lines.append(number)
        log.places.append(place)


def _time_of_day(stamp: time | str) -> float:
    """Return the seconds since midnight; the library leaves a stamp as text where its second is 60, in a leap second.

    Raises ValueError for other text.
    """
    if isinstance(stamp, time):
        return stamp.hour * 3600.0 + stamp.minute * 60.0 + stamp.second + 1e-6 * stamp.microsecond
    match = _LEAP.fullmatch(stamp)
    if match is None:
        raise ValueError(stamp)
    return 3600.0 * int(match[1]) + 60.0 * int(match[2]) + float(match[3])


def _number(text: Any) -> float:  # Any: the library gives a number, a text or nothing
    """Return the number of a field, NaN where it is empty.  Raises ValueError for other text."""
    return np.nan if text in (None, "") else float(text)


def _spreads(log: _Log) -> Array:
    """Return the spread (n,) m of each fix: that of the nearest GST within ``_KEPT``, as receivers send fewer of these
    than of fixes; NaN without any.
    """
    moments = np.array(log.moments)
    known = np.array(sorted((moment, spread) for moment, spread in log.spread.items() if np.isfinite(spread)))
    if not len(known):
        return np.full(len(moments), np.nan)
    nearest = np.clip(np.searchsorted(known[:, 0], moments), 1, max(len(known) - 1, 1))
    before, after = known[nearest - 1], known[np.minimum(nearest, len(known) - 1)]
    closer = np.where((moments - before[:, 0] <= after[:, 0] - moments)[:, None], before, after)
    return np.where(np.abs(closer[:, 0] - moments) <= _KEPT, closer[:, 1], np.nan)


def _fixes(log: _Log, repairs: Repairs) -> Fixes:
    unknown, spreads = (np.nan, np.nan), _spreads(log)
    rows = [
        (moment, *place, *log.speed_course.get(moment, unknown), spread)
        for moment, place, spread in zip(log.moments, log.places, spreads.tolist(), strict=True)
    ]
    began = None
    if log.first_day is not None:
        began = datetime.combine(log.first_day, time(), UTC).timestamp() + log.moments[0]
    places = tuple(f"line {line}" for line in log.lines)
    return fixes_of_rows(repairs, np.array(rows), places, "sentence(s)", log.moments[0], began)
