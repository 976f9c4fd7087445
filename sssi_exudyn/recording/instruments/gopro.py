"""Telemetry of GoPro cameras: fixes, gyroscope and accelerometer in the track ``gpmd`` of a film (GPMF).

GPMF is a sequence of keys with a type, a size and a count, padded to four bytes; keys of type 0 hold others.  A payload
of about a second has one stream (STRM) a sensor: SCAL divides its integers, TYPE names the kinds of compound ones, ORIN
the axes of its columns (a small letter turns the sign), STMP its time in microseconds.  Source: the format's
description at https://github.com/gopro/gpmf-parser.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.files import read_bytes
from sssi_exudyn.io.mp4 import MAX_SAMPLES, Sample, samples_of
from sssi_exudyn.io.repairs import Repairs
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_of_rows

SUFFIXES: Final = (".mp4", ".gpmf", ".raw")
"""Films, and telemetry that was taken out of them."""
_MOST: Final = 100_000_000
"""Maximum size of a film's telemetry, bytes; an hour has 25 MB."""
_MOST_KEYS: Final = 1_000_000
"""Maximum number of keys; an hour has 700 000."""
_PAYLOAD: Final = 1.001
"""Duration of a payload, s, where nothing states it: 30 frames at 29.97 a second."""
_KINDS: Final = {"b": "i1", "B": "u1", "s": ">i2", "S": ">u2", "l": ">i4", "L": ">u4", "f": ">f4", "d": ">f8",
                 "j": ">i8", "J": ">u8"}  # fmt: skip
_AXES: Final = "ZXY"
"""Axes of the columns where a stream does not name them: those of the first cameras with telemetry."""
_DAY_0: Final = 946684800.0
"""UTC of 2000-01-01, from which days of GPS9 count, s since 1970."""
_POOR: Final = 50.0
"""Dilution of precision from which on a fix is useless."""
_SENSORS: Final = (b"GYRO", b"ACCL")
_FIXES: Final = (b"GPS5", b"GPS9")


@dataclass
class _Part:
    """The samples of a sensor in one payload, which begins and ends at these times, s; stop is NaN where unknown."""

    start: float
    stop: float
    values: Array


@dataclass
class _Parts:
    """What was read so far, by key, and the first of the camera's own time stamps (s)."""

    of: dict[bytes, list[_Part]] = field(default_factory=dict)
    zero: float | None = None


@dataclass(frozen=True)
class Telemetry:
    """The content of a film's telemetry; times count from the same zero.

    rate, force : (n, 4) time (s) and x, y, z in the camera's axes, rad/s and m/s²
    fixes : (n, 8) time (s), latitude, longitude (degrees), altitude (m), speed (m/s), UTC (s since 1970), dilution and
        fix (0, 2 or 3); NaN where the camera does not write it
    notes : what was left out, in words
    """

    rate: Array
    force: Array
    fixes: Array
    notes: tuple[str, ...] = ()


def fixes_gopro(path: Path) -> Fixes:
    """Read the fixes of a film; those without a fix or beyond a dilution of 50 are left out and noted.

    Raises InputError where there is no telemetry or less than three fixes.
    """
    telemetry = read_telemetry(path)
    rows = telemetry.fixes
    places = tuple(f"fix {number}" for number in range(1, len(rows) + 1))
    repairs = Repairs(path)
    lost = (rows[:, 7] < 2.0) | (rows[:, 6] >= _POOR)
    if np.count_nonzero(~lost) < 3:
        problem = f"{np.count_nonzero(~lost)} fixes are no recording"
        raise InputError(path, "GPS5", problem, "switch GPS on in the camera, and wait for its fix before the run")
    rows[lost, 1:3] = np.nan
    timed = np.isfinite(rows[:, 5]) & ~lost
    began = float(np.median(rows[timed, 5] - rows[timed, 0])) if np.any(timed) else None
    fixes = fixes_of_rows(repairs, rows[:, :5], places, "fix(es)", 0.0, began)
    notes = telemetry.notes + fixes.notes
    return Fixes(fixes.columns, fixes.places, fixes.began, clock_of_sensors=True, notes=notes)


def read_telemetry(path: Path) -> Telemetry:
    """Read a film's track of telemetry, or a file of it.

    Of a damaged payload what comes before is read, with a note.  Raises InputError where there is none.
    """
    payloads = list(_payloads(path))
    if not payloads:
        problem = "the film has no telemetry (a track gpmd)"
        raise InputError(path, "", problem, "give the camera's own file, not one that another program wrote")
    parts, keys = _Parts(), _Keys(path)
    damaged: list[str] = []
    for number, payload in enumerate(payloads, 1):
        try:
            for stream in keys.streams(payload.content):
                _add_stream(parts, stream, payload)
        except (struct.error, ValueError, OverflowError):
            damaged.append(f"payload {number}")
    repairs = Repairs(path)
    repairs.add("payload(s) that are damaged", damaged, len(payloads), fix="copy it from the camera again")
    fixes = b"GPS9" if b"GPS9" in parts.of else b"GPS5"  # cameras that write both write the same fixes
    rate, force = (_spread(parts.of.get(key, []), 4) for key in _SENSORS)
    return Telemetry(rate, force, _spread(parts.of.get(fixes, []), 8), repairs.notes)


def _payloads(path: Path) -> Iterator[Sample]:
    if path.suffix.lower() == ".mp4":
        yield from samples_of(path, b"gpmd", _MOST)
        return
    data = read_bytes(path, _MOST)
    at = count = 0
    while at + 8 <= len(data) and data[at : at + 4] == b"DEVC":
        _, size, repeat = struct.unpack_from(">BBH", data, at + 4)
        length = 8 + (size * repeat + 3) // 4 * 4
        yield Sample(data[at : at + length], count * _PAYLOAD, (count + 1) * _PAYLOAD)
        at, count = at + length, count + 1
        if count > MAX_SAMPLES:
            raise InputError(path, f"payload {count}", "more than any run has", "cut the film to the run")


Stream = dict[bytes, tuple[str, int, int, bytes]]
"""Type, size, count and content by key."""


class _Keys:
    """The keys of a file's payloads, counted, so that a hostile file ends."""

    def __init__(self, path: Path) -> None:
        self.path, self.count = path, 0

    def streams(self, payload: bytes) -> Iterator[Stream]:
        """Yield the streams of a payload."""
        for key, _, _, _, content in self.read(payload):
            if key == b"DEVC":
                for inner, _, _, _, stream in self.read(content):
                    if inner == b"STRM":
                        yield {name: rest for name, *rest in self.read(stream)}  # type: ignore[misc]

    def read(self, data: bytes) -> Iterator[tuple[bytes, str, int, int, bytes]]:
        """Yield key, type, size, count and content.  Raises ValueError for a content that is longer than the data."""
        at = 0
        while at + 8 <= len(data):
            self.count += 1
            if self.count > _MOST_KEYS:
                raise InputError(self.path, "", "more keys than any run has", "cut the film to the run")
            key = data[at : at + 4]
            if key == b"\0\0\0\0":
                return
            kind, size, count = struct.unpack_from(">BBH", data, at + 4)
            length = size * count
            if at + 8 + length > len(data):
                raise ValueError
            yield key, chr(kind), size, count, data[at + 8 : at + 8 + length]
            at += 8 + (length + 3) // 4 * 4


def _add_stream(parts: _Parts, stream: Stream, payload: Sample) -> None:
    """Add the samples of a stream that is needed.  Raises ValueError for a damaged one."""
    for key in (*_SENSORS, *_FIXES):
        if key not in stream:
            continue
        start, stop = payload.start, payload.stop
        stamp = _numbers(stream, b"STMP")
        if stamp is not None:
            moment = 1e-6 * float(stamp[0, 0])
            parts.zero = moment if parts.zero is None else parts.zero
            start, stop = moment - parts.zero, np.nan
        values = _scaled(stream, key)
        values = _in_axes(values, stream) if key in _SENSORS else _fixes_of(values, stream, key)
        parts.of.setdefault(key, []).append(_Part(start, stop, values))


def _numbers(stream: Stream, key: bytes) -> Array | None:
    """Return the numbers of a key (count, kinds), None where it is not there.  Raises ValueError for damaged ones."""
    if key not in stream:
        return None
    kind, size, count, content = stream[key]
    names = _text(stream, b"TYPE") if kind == "?" else kind
    if not names or any(name not in _KINDS for name in names):
        raise ValueError
    one = np.dtype([(str(i), _KINDS[name]) for i, name in enumerate(names)])
    if kind != "?" and size % one.itemsize == 0:
        one = np.dtype([(str(i), _KINDS[kind]) for i in range(size // one.itemsize)])
    if one.itemsize != size or not count:
        raise ValueError
    table = np.frombuffer(content, one, count)
    return np.column_stack([table[name].astype(np.float64) for name in one.names or ()])


def _scaled(stream: Stream, key: bytes) -> Array:
    """Return the numbers of a key over those of SCAL."""
    values, scale = _numbers(stream, key), _numbers(stream, b"SCAL")
    if values is None or scale is None or np.any(scale == 0.0):
        raise ValueError
    return np.asarray(values / scale.reshape(-1))


def _text(stream: Stream, key: bytes) -> str:
    return stream[key][3].split(b"\0")[0].decode("latin-1") if key in stream else ""


def _in_axes(values: Array, stream: Stream) -> Array:
    """Return values (n, 3) with the columns x, y, z."""
    axes = _text(stream, b"ORIN") or _AXES
    if sorted(axes.upper()) != ["X", "Y", "Z"] or values.shape[1] != 3:
        raise ValueError
    turned = np.empty_like(values)
    for column, axis in enumerate(axes):
        turned[:, "XYZ".index(axis.upper())] = values[:, column] * (1.0 if axis.isupper() else -1.0)
    return turned


def _fixes_of(values: Array, stream: Stream, key: bytes) -> Array:
    """Return fixes (n, 7) as ``Telemetry`` has them, without time.

    Those of GPS9 have a clock and a quality each; those of GPS5 share their payload's.
    """
    table = np.full((len(values), 7), np.nan)
    table[:, :4] = values[:, :4]
    if key == b"GPS9":
        if values.shape[1] != 9:
            raise ValueError
        table[:, 4] = _DAY_0 + 86400.0 * values[:, 5] + values[:, 6]
        table[:, 5:] = values[:, 7:]
        return table
    moment, dilution, fix = _text(stream, b"GPSU"), _numbers(stream, b"GPSP"), _numbers(stream, b"GPSF")
    if moment:
        table[0, 4] = datetime.strptime(moment, "%y%m%d%H%M%S.%f").replace(tzinfo=UTC).timestamp()
    if dilution is not None:
        table[:, 5] = 0.01 * dilution[0, 0]
    if fix is not None:
        table[:, 6] = fix[0, 0]
    return table


def _spread(parts: list[_Part], width: int) -> Array:
    """Return the samples (n, width) of all payloads, each evenly from its start to that of the next, time first."""
    rows = [np.empty((0, width))]
    for i, part in enumerate(parts):
        count, stop = len(part.values), part.stop
        if np.isnan(stop):
            following = parts[i + 1].start if i + 1 < len(parts) else part.start
            before = part.start - parts[i - 1].start if i else _PAYLOAD
            stop = following if following > part.start else part.start + before
        time = part.start + (stop - part.start) * np.arange(count) / count
        rows.append(np.column_stack([time, part.values]))
    return np.concatenate(rows)
