"""Fixes in logs of NMEA 0183 sentences, as receivers send them: GGA, with additions from RMC and GST."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, date, datetime, time, timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.io.bounds import MAX_FIXES, check_samples
from sssi_exudyn.io.files import read_text
from sssi_exudyn.recording.instruments.fixes import OPTIONAL, Fixes
from sssi_exudyn.runtime.optional import library

_KNOT: Final = 1852.0 / 3600.0
"""Size of a knot, m/s."""
_KINDS: Final = ("GGA", "RMC", "GST")
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
    torn: int = 0
    sentences: int = 0
    without_fix: int = 0


def fixes_nmea(path: Path) -> Fixes:
    """Read a log of sentences; sentences other than GGA, RMC and GST are ignored.

    Torn sentences (by their checksum) and those without a fix are left out and noted.

    Raises InputError where the library is missing, more than a tenth of the lines is torn, or less than three fixes
    are there.
    """
    pynmea2 = library("pynmea2", path)
    log = _Log()
    for number, line in enumerate(read_text(path).split("\n"), 1):
        at = line.find("$")  # loggers put their own clock before it
        if at < 0:
            continue
        if line[at + 3 : at + 6] not in _KINDS:
            continue
        log.sentences += 1
        check_samples(path, f"line {number}", log.sentences, limit=len(_KINDS) * MAX_FIXES)
        try:
            _add_sentence(log, pynmea2.parse(line[at:].strip(), check=True), number)
        except pynmea2.SentenceTypeError:
            continue
        except (pynmea2.ParseError, ValueError, TypeError, AttributeError):  # fields that are no numbers, or missing
            log.torn += 1
    if log.torn > _TORN * log.sentences:
        raise InputError(
            path,
            "",
            f"{log.torn} of {log.sentences} sentences are torn",
            "record again with a lower rate or faster port",
        )
    if len(log.moments) < 3:
        raise InputError(
            path, "", f"{len(log.moments)} GGA sentences with a fix are no recording", "log GGA (and RMC) of the run"
        )
    return _columns(path, log)


def _add_sentence(log: _Log, sentence: Any, number: int) -> None:  # Any: the library makes its classes from a table
    kind = sentence.sentence_type
    if kind not in _KINDS or not isinstance(sentence.timestamp, time):
        return
    clock = sentence.timestamp
    moment = clock.hour * 3600.0 + clock.minute * 60.0 + clock.second + 1e-6 * clock.microsecond + 86400.0 * log.days
    if log.moments and moment < log.moments[-1] - 43200.0:  # past midnight
        log.days += 1
        moment += 86400.0
    if kind == "GST":
        log.spread[moment] = float(
            np.hypot(float(sentence.std_dev_latitude), float(sentence.std_dev_longitude)) / np.sqrt(2.0)
        )
    elif kind == "RMC":
        if log.first_day is None and isinstance(sentence.datestamp, date):
            log.first_day = sentence.datestamp - timedelta(days=log.days)
        if sentence.status == "A":
            log.speed_course[moment] = (_KNOT * float(sentence.spd_over_grnd), float(sentence.true_course))
    elif not sentence.gps_qual:
        log.without_fix += 1
    else:
        place = (float(sentence.latitude), float(sentence.longitude), float(sentence.altitude))
        log.moments.append(moment)
        log.lines.append(number)
        log.places.append(place)


def _columns(path: Path, log: _Log) -> Fixes:
    moments = np.array(log.moments)
    latitude, longitude, altitude = np.array(log.places).T.copy()
    columns = {
        "time_s": moments - moments[0],
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "altitude_m": altitude,
    }
    notes = []
    if all(moment in log.speed_course for moment in log.moments):  # only where every fix has them
        both = np.array([log.speed_course[moment] for moment in log.moments])
        columns |= dict(zip(OPTIONAL[:2], both.T.copy(), strict=True))
    if all(moment in log.spread for moment in log.moments):
        columns["sigma_m"] = np.array([log.spread[moment] for moment in log.moments])
    if log.torn:
        notes.append(f"{path.name}: {log.torn} torn sentence(s) left out")
    if log.without_fix:
        notes.append(f"{path.name}: {log.without_fix} sentence(s) without a fix left out")
    began = None
    if log.first_day is not None:
        began = datetime.combine(log.first_day, time(), UTC).timestamp() + float(moments[0])
    return Fixes(columns, tuple(f"line {line}" for line in log.lines), began=began, notes=tuple(notes))
