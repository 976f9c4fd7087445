"""Telemetry of a GoPro camera and a film around it, made from columns."""

from __future__ import annotations

import struct
from datetime import UTC, datetime, timedelta

import numpy as np
from fix_files import START
from tiny import Columns

from sssi_exudyn.core.frames import Array

_ACCEL, _GYRO = 418.0, 939.0
"""Numbers that divide the integers of acceleration and rate."""
_GPS: tuple[float, ...] = (1e7, 1e7, 1e3, 1e3, 1e2)


def key(name: bytes, kind: str, size: int, content: bytes) -> bytes:
    """Return one key with its content, padded to four bytes."""
    code = 0 if kind == "" else ord(kind)
    padded = content + b"\0" * (-len(content) % 4)
    return name + struct.pack(">BBH", code, size, len(content) // size) + padded


def nested(name: bytes, *keys: bytes) -> bytes:
    """Return a key that holds others."""
    return key(name, "", 1, b"".join(keys))


def payloads(
    fixes: Columns, time: Array, rate: Array, force: Array, *, own_clock: bool = True, fix: int = 3, axes: str = "YxZ"
) -> list[bytes]:
    """Return the payloads of a film, one a second.

    Parameters
    ----------
    time : (n,) s;  rate, force : (n, 3) rad/s and m/s², x, y, z of the camera
    own_clock : whether fixes have a clock and a quality each (GPS9), and payloads a time stamp
    fix : 0, 2 or 3;  axes : of the columns of both sensors, small where the sign is turned
    """
    order = ["XYZ".index(axis.upper()) for axis in axes]
    sign = np.array([1.0 if axis.isupper() else -1.0 for axis in axes])
    made = []
    for second in range(int(time[-1]) + 1):
        within = (time >= second) & (time < second + 1)
        streams = []
        for name, values, scale in ((b"ACCL", force, _ACCEL), (b"GYRO", rate, _GYRO)):
            whole = np.round(scale * (values[within][:, order] * sign)).astype(">i2")
            streams.append(
                nested(
                    b"STRM",
                    *_stamp(float(time[within][0]), own_clock),
                    key(b"SCAL", "s", 2, struct.pack(">h", int(scale))),
                    key(b"ORIN", "c", 1, axes.encode()),
                    key(name, "s", 6, whole.tobytes()),
                )
            )
        if np.any((fixes["time_s"] >= second) & (fixes["time_s"] < second + 1)):
            streams.append(_fixes(fixes, second, own_clock, fix))
        made.append(nested(b"DEVC", key(b"DVNM", "c", 1, b"Hero7 Black"), *streams))
    return made


def _stamp(moment: float, own_clock: bool) -> list[bytes]:
    return [key(b"STMP", "J", 8, struct.pack(">Q", round(1e6 * (1000.0 + moment))))] if own_clock else []


def _fixes(columns: Columns, second: int, own_clock: bool, fix: int) -> bytes:
    within = (columns["time_s"] >= second) & (columns["time_s"] < second + 1)
    time = columns["time_s"][within]
    names = ("latitude_deg", "longitude_deg", "altitude_m")
    rows = np.column_stack([*(columns[name][within] for name in names), np.full((len(time), 2), 8.1)])
    numbers = np.round(rows * _GPS).astype(">i4")
    scale = b"".join(struct.pack(">i", int(one)) for one in _GPS)
    moment = START + timedelta(seconds=float(time[0]))
    if not own_clock:
        return nested(
            b"STRM",
            key(b"GPSF", "L", 4, struct.pack(">I", fix)),
            key(b"GPSU", "U", 16, f"{moment:%y%m%d%H%M%S}.{moment.microsecond // 1000:03d}".encode()),
            key(b"GPSP", "S", 2, struct.pack(">H", 141)),
            key(b"SCAL", "l", 4, scale),
            key(b"GPS5", "l", 20, numbers.tobytes()),
        )
    since = (START - datetime(2000, 1, 1, tzinfo=UTC)).total_seconds() + time
    more = [struct.pack(">iiHH", int(now // 86400), round(1e3 * (now % 86400)), 141, fix) for now in since]
    body = b"".join(row.tobytes() + rest for row, rest in zip(numbers, more, strict=True))
    return nested(
        b"STRM",
        *_stamp(float(time[0]), own_clock),
        key(b"TYPE", "c", 1, b"lllllllSS"),
        key(b"SCAL", "l", 4, scale + struct.pack(">4i", 1, 1000, 100, 1)),
        key(b"GPS9", "?", 32, body),
    )


def film(parts: list[bytes], *, in_chunk: int = 2, lasting: int = 1000) -> bytes:
    """Return a film with these samples of telemetry, ``in_chunk`` behind each other, of ``lasting`` ms each."""
    head = _box(b"ftyp", b"mp41")
    chunks = [b"".join(parts[i : i + in_chunk]) for i in range(0, len(parts), in_chunk)]
    data = b"picture" + b"picture".join(chunks)
    at, places = len(head) + 8 + 7, []
    for chunk in chunks:
        places.append(at)
        at += len(chunk) + 7
    rows = [(1, in_chunk)] + ([(len(chunks), len(parts) % in_chunk)] if len(parts) % in_chunk else [])
    table = _box(
        b"stbl",
        _box(b"stsd", struct.pack(">II", 0, 1) + _box(b"gpmd", b"\0" * 8)),
        _box(b"stts", struct.pack(">IIII", 0, 1, len(parts), lasting)),
        _box(b"stsc", struct.pack(">II", 0, len(rows)) + b"".join(struct.pack(">III", *row, 1) for row in rows)),
        _box(b"stsz", struct.pack(f">III{len(parts)}I", 0, 0, len(parts), *map(len, parts))),
        _box(b"stco", struct.pack(f">II{len(places)}I", 0, len(places), *places)),
    )
    clock = _box(b"mdhd", struct.pack(">IIIII", 0, 0, 0, 1000, lasting * len(parts)))
    picture = _box(b"trak", _box(b"mdia", _box(b"minf", _box(b"stbl", _box(b"stsd", b"\0" * 8 + _box(b"avc1", b""))))))
    moov = _box(b"moov", picture, _box(b"trak", _box(b"mdia", clock, _box(b"minf", table))))
    return head + _box(b"mdat", data) + moov


def _box(name: bytes, *content: bytes) -> bytes:
    body = b"".join(content)
    return struct.pack(">I4s", 8 + len(body), name) + body
