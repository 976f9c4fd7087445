"""One track in the formats of receivers, watches and telephones."""

from __future__ import annotations

import io
import struct
import zipfile
from datetime import UTC, datetime, timedelta

import numpy as np
import pymap3d
from tiny import Columns

START = datetime(2026, 2, 1, 23, 59, 57, tzinfo=UTC)
"""Three seconds before midnight, so that NMEA's clock passes it."""


def nmea(columns: Columns, *, knots: float = 8.0, course: float = 160.0) -> str:
    """Return GGA, RMC and GST for every fix, with checksums."""
    lines = []
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        moment = START + timedelta(seconds=float(time))
        clock = f"{moment:%H%M%S}.{moment.microsecond // 10000:02d}"
        place = f"{_minutes(lat, 2)},N,{_minutes(lon, 3)},E"
        lines += [
            f"GPGGA,{clock},{place},4,12,0.8,{alt:.3f},M,48.0,M,,",
            f"GPRMC,{clock},A,{place},{knots:.2f},{course:.1f},{moment:%d%m%y},,",
            f"GPGST,{clock},0.02,,,,0.03,0.04,0.05",
            f"GPGSA,A,3,,,,,,,,,,,,,1.5,0.8,{time:.1f}",
        ]
    return "".join(f"${line}*{_checksum(line):02X}\r\n" for line in lines)


def _minutes(degrees: float, digits: int) -> str:
    whole = int(degrees)
    return f"{whole:0{digits}d}{(degrees - whole) * 60.0:010.7f}"


def _checksum(line: str) -> int:
    return int(np.bitwise_xor.reduce(np.frombuffer(line.encode(), np.uint8)))


def gpx(columns: Columns) -> str:
    """Return a track of points with times."""
    points = "".join(
        f'<trkpt lat="{lat:.9f}" lon="{lon:.9f}"><ele>{alt:.4f}</ele>'
        f"<time>{START + timedelta(seconds=float(time)):%Y-%m-%dT%H:%M:%S.%fZ}</time></trkpt>\n"
        for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True)
    )
    return f'<?xml version="1.0"?>\n<gpx version="1.1"><trk><trkseg>\n{points}</trkseg></trk></gpx>'


def tcx(columns: Columns, *, speed: float = 8.1) -> str:
    """Return two laps of a watch's track points, the first of which has no place yet."""
    points = [f"<Trackpoint><Time>{START:%Y-%m-%dT%H:%M:%S.000Z}</Time></Trackpoint>\n"]
    points += [
        f"<Trackpoint><Time>{START + timedelta(seconds=float(time)):%Y-%m-%dT%H:%M:%S.%fZ}</Time><Position>"
        f"<LatitudeDegrees>{lat:.9f}</LatitudeDegrees><LongitudeDegrees>{lon:.9f}</LongitudeDegrees></Position>"
        f"<AltitudeMeters>{alt:.4f}</AltitudeMeters><HeartRateBpm><Value>120</Value></HeartRateBpm>"
        f"<Extensions><ns3:TPX><ns3:Speed>{speed}</ns3:Speed></ns3:TPX></Extensions></Trackpoint>\n"
        for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True)
    ]
    half = len(points) // 2
    laps = "".join(f"<Lap><Track>\n{''.join(part)}</Track></Lap>" for part in (points[:half], points[half:]))
    spaces = 'xmlns="http://www.garmin.com/xmlschemas/TrainingCenterDatabase/v2" '
    spaces += 'xmlns:ns3="http://www.garmin.com/xmlschemas/ActivityExtension/v2"'
    return (
        f'<?xml version="1.0"?>\n<TrainingCenterDatabase {spaces}><Activities><Activity Sport="Other">{laps}'
        "</Activity></Activities></TrainingCenterDatabase>"
    )


def ski_app(columns: Columns, suffix: str, *, radius: float = 4.5, speed: float = 8.1) -> bytes:
    """Return the archive of a ski app; the first speed and course are unknown."""
    rows = []
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        moved = "-1.0,-1.0" if not rows else f"160.5,{speed}"
        clock = f"{START.timestamp() + time:.3f}"
        rows.append(f"{clock},{lat:.9f},{lon:.9f},{alt:.4f},{moved},{radius},3.0")
    table = "\n".join(rows) + "\n"
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Track.xml" if suffix == ".skiz" else "Metadata.xml", "<track/>")
        archive.writestr("Nodes.csv" if suffix == ".skiz" else "day/RawGPS.csv", table)
        archive.writestr("Segment.csv" if suffix == ".skiz" else "day/GPS.csv", "0,0,0,0\n" * 5)
    return held.getvalue()


def gnss_logger(columns: Columns, *, radius: float = 4.5, titles: bool = True) -> str:
    """Return a log of GnssLogger: fixes of three providers among raw measurements."""
    lines = ["# Raw,utcTimeMillis,TimeNanos"]
    if titles:
        lines.append(
            "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,"
            "UnixTimeMillis,SpeedAccuracyMps"
        )
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        clock = round(1e3 * (START.timestamp() + time))
        more = f"{alt:.4f},8.1,{radius},160.5,{clock},0.3"
        lines += [f"Raw,{clock},1,2,3", f"Fix,GPS,{lat:.9f},{lon:.9f},{more}"]
        lines += [f"Fix,FLP,{lat + 1e-4:.9f},{lon:.9f},{more}", f"Fix,NLP,{lat:.4f},{lon:.4f},,,900.0,,{clock},"]
    return "\n".join(lines) + "\n"


def rtklib(columns: Columns, form: str = "deg", clock: str = "GPST", *, weeks: bool = False) -> str:
    """Return a solution of RTKLIB.

    Parameters
    ----------
    form : "deg", "minutes" or "ecef";  clock : "GPST", "UTC" or "JST";  weeks : whether times are GPS weeks and seconds
    """
    place = {
        "deg": "latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)",
        "minutes": "latitude(d'\")   longitude(d'\")  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)",
        "ecef": "x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)",
    }[form]
    lines = ["% program   : RTKPOST ver.2.4.3", f"%  {clock}                  {place} age(s)  ratio vn(m/s) ve(m/s)"]
    ahead = {"GPST": 18.0, "UTC": 0.0, "JST": 32400.0}[clock]
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        moment = START + timedelta(seconds=ahead + float(time))
        since = (moment - datetime(1980, 1, 6, tzinfo=UTC)).total_seconds()
        shown = f"{moment:%Y/%m/%d %H:%M:%S}.{moment.microsecond // 1000:03d}"
        shown = f"{int(since // 604800)} {since % 604800:.3f}" if weeks else shown
        where = f"{lat:.9f} {lon:.9f} {alt:.4f}"
        if form == "minutes":
            where = f"{_sexagesimal(lat)} {_sexagesimal(lon)} {alt:.4f}"
        elif form == "ecef":
            where = " ".join(f"{value:.4f}" for value in pymap3d.geodetic2ecef(lat, lon, alt))
        lines.append(f"{shown}   {where}   1  12   0.0300   0.0400   0.0500   0.00   50.0  -3.0  4.0")
    return "\n".join(lines) + "\n"


def _sexagesimal(degrees: float) -> str:
    minutes = 60.0 * (degrees - int(degrees))
    return f"{int(degrees)} {int(minutes)} {60.0 * (minutes - int(minutes)):.6f}"


_FIT_ZERO = 631065600
"""Seconds from 1970 to FIT's zero of time."""
_FIT_TIES = {
    "timestamp_correlation": (162, ((253, 4, 0x86), (4, 2, 0x84), (1, 4, 0x86), (5, 2, 0x84))),
    "gps_metadata": (160, ((6, 4, 0x86), (8, 2, 0x84), (253, 4, 0x86), (0, 2, 0x84))),
}
"""Messages and their fields of UTC and of the time since power-on, s and ms each; ``gps_metadata`` has no ms of UTC,
and its field 8 has no name.
"""


def fit(columns: Columns, *, speed: float = 8.1, uptime: int | None = None, ties: tuple[str, ...] = ()) -> bytes:
    """Return records with timestamp, place, enhanced altitude and speed, and one without a place before them.

    Parameters
    ----------
    uptime : s from power-on to the first record, where time counts from there
    ties : messages behind the records that state a moment by both clocks
    """
    fields = ((253, 4, 0x86), (0, 4, 0x85), (1, 4, 0x85), (78, 4, 0x86), (73, 4, 0x86))
    body = _fit_definition(20, fields)
    began = int(START.timestamp()) - _FIT_ZERO
    first = began if uptime is None else uptime
    body += struct.pack("<BIiiII", 0, first, 0x7FFFFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF)
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        semicircles = (round(float(angle) * 2**31 / 180.0) for angle in (lat, lon))
        high = 0xFFFFFFFF if np.isnan(alt) else round((alt + 500.0) * 5.0)
        body += struct.pack("<BIiiII", 0, first + round(float(time)), *semicircles, high, round(1000.0 * speed))
    for name in ties:  # 5 s behind the first record
        body += _fit_definition(*_FIT_TIES[name]) + struct.pack("<BIHIH", 0, began + 5, 250, first + 5, 250)
    head = struct.pack("<BBHI4s", 14, 0x20, 2132, len(body), b".FIT")
    head += struct.pack("<H", _fit_crc(head))
    return head + body + struct.pack("<H", _fit_crc(head + body))


def _fit_definition(message: int, fields: tuple[tuple[int, int, int], ...]) -> bytes:
    """Return the definition of a message's fields: number, bytes and type of each."""
    head = struct.pack("<BBBHB", 0x40, 0, 0, message, len(fields))
    return head + b"".join(struct.pack("BBB", *field) for field in fields)


def _fit_crc(data: bytes) -> int:
    """Return the CRC-16/ARC of the FIT protocol."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def phone(columns: Columns, *, radius: float = 4.5, bearing: float = 160.5) -> str:
    """Return Sensor Logger's Location.csv; the first fix is the telephone's guess before the satellites."""
    rows = ["time,seconds_elapsed,bearingAccuracy,speedAccuracy,verticalAccuracy,horizontalAccuracy,"
            "speed,bearing,altitude,longitude,latitude"]  # fmt: skip
    start = int(START.timestamp()) * 10**9
    lat, lon, alt = (columns[name][0] for name in ("latitude_deg", "longitude_deg", "altitude_m"))
    rows.append(f"{start - 10**9},-1.0,0,0,0,1400.0,0,0,{alt:.1f},{lon:.7f},{lat + 0.01:.7f}")
    for time, lat, lon, alt in zip(*(columns[name] for name in columns), strict=True):
        when = start + round(float(time) * 1e9)
        rows.append(f"{when},{time:.3f},5.0,0.3,3.0,{radius},8.1,{bearing},{alt:.3f},{lon:.9f},{lat:.9f}")
    return "\n".join(rows) + "\n"
