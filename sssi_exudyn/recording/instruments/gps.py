"""Satellite positioning: fixes of one antenna, in local east-north-up coordinates.

Each format has one reader, chosen by the file's suffix through ``READERS``.  Files have degrees and WGS84; this module
has metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_FIXES, MAX_RATE, check_samples
from sssi_exudyn.io.table import SHORT_GAP, Clock, bridge_gaps
from sssi_exudyn.recording.instruments.fix_repairs import DEGREE, FASTEST, repaired
from sssi_exudyn.recording.instruments.fixes import Fixes, fixes_csv, fixes_gpx
from sssi_exudyn.recording.instruments.fixes_fit import fixes_fit
from sssi_exudyn.recording.instruments.fixes_gnss_logger import fixes_gnss_logger
from sssi_exudyn.recording.instruments.fixes_nmea import fixes_nmea, is_nmea
from sssi_exudyn.recording.instruments.fixes_rtklib import fixes_rtklib
from sssi_exudyn.recording.instruments.fixes_ski_apps import SUFFIXES as SKI_APPS
from sssi_exudyn.recording.instruments.fixes_ski_apps import fixes_ski_app
from sssi_exudyn.recording.instruments.fixes_tcx import fixes_tcx
from sssi_exudyn.recording.instruments.gopro import SUFFIXES as FILMS
from sssi_exudyn.recording.instruments.gopro import fixes_gopro

_BOUNDS: Final = {
    "altitude_m": (-500.0, 9000.0),
    "speed_mps": (0.0, FASTEST),
    "course_deg": (-360.0, 360.0),
    "sigma_m": (1e-4, 100.0),
}
_DECIMALS: Final = range(3, 8)
"""Decimals of degrees at which places are rounded noticeably: 110 m to 1 cm."""
_ROUNDED: Final = 0.3
"""Error by rounding over the standard deviation of a fix, from which on it counts."""
_LEVEL: Final = 2.0
"""Difference of heights, m, within which a part of a track counts as level."""
_TURN_ACCELERATION: Final = 5.0
"""Largest acceleration of a skier in a gap, m/s², for the uncertainty of an interpolated fix."""
_UNITS: Final = {"m/s": 1.0, "km/h": 3.6, "mph": 2.237, "knots": 1.944, "feet per second": 3.281}
"""Units of speed, in a m/s."""
_UNIT_ERROR: Final = 1.07
"""Factor by which speeds in a unit may miss those of the fixes."""
_UNIT_DOUBT: Final = 1.04
"""Factor between two units' misses up to which either may be meant; km/h and feet per second are 1.10 apart."""
_CHORD: Final = 5.0
"""Time, s, in which a skier goes so far that the noise of fixes no longer lengthens the way."""
_ROUNDING: Final = 1e-9
"""s; far below the time between two fixes, far above the rounding of a time of day."""
VERTICAL: Final = 1.5
"""Usual ratio of the standard deviations of a fix's height and place (Teunissen and Montenbruck 2017, ch. 21)."""


@dataclass(frozen=True)
class Gps:
    """Fixes of one antenna.

    Attributes
    ----------
    time : (n,) s on the recording's clock, rising
    enu : (n, 3) m east-north-up from the file's first fix (WGS84)
    sigma : (n,) m standard deviation of a horizontal fix; larger where the fix is interpolated
    origin : latitude (deg), longitude (deg), altitude (m) of the first fix
    segment : the joint the antenna moves with
    offset : (3,) m, the antenna from that joint, in the joint's BVH axes (x left, y up, z forward)
    speed : (n,) m/s over ground where the receiver wrote it
    course : (n,) rad clockwise from north where the receiver wrote it, unwrapped
    notes : changes of the data, in words
    barometric : whether the heights are a barometer's
    vertical : standard deviation of a height over that of its place
    """

    time: Array
    enu: Array
    sigma: Array
    origin: tuple[float, float, float]
    segment: str
    offset: Array
    speed: Array | None = None
    course: Array | None = None
    notes: tuple[str, ...] = ()
    barometric: bool = False
    vertical: float = VERTICAL

    def between(self, start: float, stop: float) -> NDArray[np.bool_]:
        """Return which fixes (n,) are from ``start`` to ``stop`` (s), both included, whatever rounding leaves of them:
        a run's ends are often times of fixes.
        """
        return np.asarray((self.time >= start - _ROUNDING) & (self.time <= stop + _ROUNDING))


def enu_from(enu: Array, origin: tuple[float, float, float], other: tuple[float, float, float]) -> Array:
    """Convert places (n, 3) m east-north-up from ``origin`` (as ``Gps.origin``) to east-north-up from ``other``."""
    return np.stack(pymap3d.geodetic2enu(*pymap3d.enu2geodetic(*enu.T, *origin), *other), axis=-1)


READERS: Final[dict[str, Callable[[Path], Fixes]]] = {
    ".csv": fixes_csv,
    ".gpx": fixes_gpx,
    ".fit": fixes_fit,
    ".nmea": fixes_nmea,
    ".log": fixes_nmea,
    ".tcx": fixes_tcx,
    **dict.fromkeys(FILMS, fixes_gopro),
    **dict.fromkeys(SKI_APPS, fixes_ski_app),
    ".pos": fixes_rtklib,
    ".txt": fixes_gnss_logger,
}


_OF_ANYTHING: Final = (".csv", ".txt")
"""Suffixes that loggers also give to logs of NMEA sentences."""


@dataclass(frozen=True)
class FixReader:
    """A reader of this kind lets a plug-in read the fixes of a receiver.

    suffix : suffix of its files, with the dot;  read : function that reads the fixes of a file

    Examples
    --------
    >>> sssi_exudyn.use_plugin(sssi_exudyn.FixReader(".xyz", read_xyz))
    """

    suffix: str
    read: Callable[[Path], Fixes]


def add_fix_reader(reader: FixReader) -> None:
    """Let recordings and imports read another format of fixes.  Raises ValueError where the suffix has a reader."""
    if READERS.setdefault(reader.suffix.lower(), reader.read) is not reader.read:
        raise ValueError(f"files {reader.suffix} have a reader already")


def read_fixes(path: Path, sigma: float | None = None) -> Fixes:
    """Read the fixes of a file with the reader of its suffix, without those that cannot be used.

    A log of NMEA sentences may also be called ``.csv`` or ``.txt``.

    Parameters
    ----------
    sigma : m, standard deviation of a horizontal fix, where the file does not have it; None where unknown

    Raises InputError for a suffix without reader, for whatever the reader refuses, and where too many fixes are bad.
    """
    try:
        suffix = path.suffix.lower()
        reader = fixes_nmea if suffix in _OF_ANYTHING and is_nmea(path) else READERS[suffix]
    except KeyError:
        *others, last = READERS
        raise InputError(
            path, "", f"no reader for {path.suffix!r}", f"export the fixes as {', '.join(others)} or {last}"
        ) from None
    fixes = reader(path)
    check_samples(path, "", len(fixes.places), limit=MAX_FIXES)
    return repaired(path, fixes, sigma)


def read_gps(
    path: Path,
    *,
    segment: str,
    offset: Array,
    sigma: float | None,
    time_offset: float = 0.0,
    covered: tuple[float, float] | None = None,
) -> Gps:
    """Read fixes with the reader of the file's suffix, check them and fill short gaps.

    Parameters
    ----------
    path : the file
    segment, offset : the antenna's place (see Gps)
    sigma : m, standard deviation of a horizontal fix; the file's own column is preferred to it
    time_offset : s, added to the file's times
    covered : s, the stretch of the recording's clock that the other instruments cover; None where there are none

    Raises InputError for a suffix without reader, for anything that the reader refuses, and for the faults described in
    ``gps_from_fixes``.
    """
    fixes = read_fixes(path, sigma)
    return gps_from_fixes(
        path, fixes, segment=segment, offset=offset, sigma=sigma, time_offset=time_offset, covered=covered
    )


def gps_from_fixes(
    path: Path,
    fixes: Fixes,
    *,
    segment: str,
    offset: Array,
    sigma: float | None,
    time_offset: float = 0.0,
    covered: tuple[float, float] | None = None,
) -> Gps:
    """Check fixes, convert them to east-north-up and fill their gaps; parameters are those of ``read_gps``.

    Of a track with long pauses, the part is kept that leads down most while the other instruments measure.

    Raises InputError for coordinates out of range, constant or swapped, for a speed in another unit, and for a missing
    standard deviation.
    """
    columns, places = fixes.columns, fixes.places
    _check_columns(path, columns, places)
    _check_rate(path, columns["time_s"], places)
    lat, lon, alt = columns["latitude_deg"], columns["longitude_deg"], columns["altitude_m"]
    origin = (float(lat[0]), float(lon[0]), float(alt[0]))
    enu = np.stack(pymap3d.geodetic2enu(lat, lon, alt, *origin), axis=-1)
    if "sigma_m" in columns:
        spread = columns["sigma_m"]
    elif sigma is not None:
        spread = np.full(len(lat), sigma)
    else:
        raise InputError(
            path, "", "the standard deviation of a fix is not given", "give sigma_m in [gps], e.g. 0.02 for RTK"
        )
    _check_travel(path, columns, enu, spread)
    spread, coarse = _with_rounding(path, columns, spread)

    def descent(part: slice) -> float:
        return _descent(columns["time_s"][part] + time_offset, enu[part, 2], covered)

    clock = bridge_gaps(path, columns["time_s"], merit=descent)
    check_samples(path, "time_s, with gaps filled", len(clock.time), limit=MAX_FIXES)
    keep = clock.keep
    speed, course = columns.get("speed_mps"), columns.get("course_deg")
    turned = None if course is None else np.unwrap(np.deg2rad(course[keep]))
    bridged_enu = _bridge(clock, enu[keep])
    # between two fixes t apart, an unknown acceleration a leaves at most a·t²/8
    spread = np.hypot(_linear(clock, spread[keep]), _TURN_ACCELERATION * clock.gap**2 / 8.0)
    return Gps(
        time=clock.time + time_offset,
        enu=bridged_enu,
        sigma=spread,
        origin=origin,
        segment=segment,
        offset=np.asarray(offset, dtype=float),
        speed=None if speed is None else _linear(clock, speed[keep]),
        course=None if turned is None else _linear(clock, turned),
        notes=fixes.notes + coarse + clock.notes,
    )


def _check_columns(path: Path, columns: dict[str, Array], places: tuple[str, ...]) -> None:
    lat, lon = columns["latitude_deg"], columns["longitude_deg"]
    bad = np.abs(lat) > 90.0
    if np.any(bad):
        first = int(np.argmax(bad))
        swapped = bool(np.all(np.abs(lon) <= 90.0) and np.all(np.abs(lat) <= 180.0))
        raise InputError(
            path,
            f"{places[first]}, latitude_deg",
            f"{lat[first]:g} is no latitude" + (": latitude and longitude look swapped" if swapped else ""),
            "swap the two columns" if swapped else "give decimal degrees",
        )
    bad = np.abs(lon) > 180.0
    if np.any(bad):
        first = int(np.argmax(bad))
        raise InputError(
            path, f"{places[first]}, longitude_deg", f"{lon[first]:g} is no longitude", "give decimal degrees"
        )
    for name, (low, high) in _BOUNDS.items():
        if name in columns:
            bad = (columns[name] < low) | (columns[name] > high)
            if np.any(bad):
                first = int(np.argmax(bad))
                hint = "give metres, not feet" if name == "altitude_m" else "correct the value or its unit"
                raise InputError(
                    path,
                    f"{places[first]}, {name}",
                    f"{columns[name][first]:g} is outside {low:g} to {high:g} {name.rsplit('_', 1)[1]}",
                    hint,
                )
    for name in ("latitude_deg", "longitude_deg", "altitude_m"):
        if np.ptp(columns[name]) == 0.0:
            raise InputError(
                path,
                f"column {name}",
                f"it is {columns[name][0]:g} all along: a constant channel cannot come from a run",
                "export the fixes again, with latitude, longitude and altitude",
            )


def _check_rate(path: Path, time: Array, places: tuple[str, ...]) -> None:
    """Raise InputError for more fixes in a second than any receiver gives."""
    crowd = np.searchsorted(time, time + 1.0) - np.arange(len(time))
    if np.max(crowd) > MAX_RATE:
        first = int(np.argmax(crowd))
        raise InputError(
            path,
            places[first],
            f"{crowd[first]} fixes follow in one second",
            "give time in seconds, at the rate of the receiver",
        )


def _with_rounding(path: Path, columns: dict[str, Array], sigma: Array) -> tuple[Array, tuple[str, ...]]:
    """Widen the standard deviations (n,) m of fixes whose degrees have few decimals, and say so where it matters."""
    for digits in _DECIMALS:
        scaled = 10.0**digits * np.stack([columns["latitude_deg"], columns["longitude_deg"]])
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-4):
            error = DEGREE * 10.0**-digits / np.sqrt(12.0)  # of a place that is rounded to a step
            if error < _ROUNDED * float(np.median(sigma)):
                break
            words = f"{path.name}: degrees have {digits} decimals only; fixes are taken as {error:.2g} m less exact"
            return np.hypot(sigma, error), (words,)
    return sigma, ()


def _descent(time: Array, height: Array, covered: tuple[float, float] | None) -> float:
    """Return by how much (m) a part of a track leads down while the other instruments measure.

    It is 0 for a part that leads up or is level to within ``_LEVEL``, and −1 for one that they do not cover.
    """
    start, stop = (-np.inf, np.inf) if covered is None else covered
    inside = (time >= start) & (time <= stop)
    if np.count_nonzero(inside) < 2 or np.ptp(time[inside]) < SHORT_GAP:
        return -1.0
    down = float(height[inside][0] - height[inside][-1])
    return down if down > _LEVEL else 0.0


def _check_travel(path: Path, columns: dict[str, Array], enu: Array, sigma: Array) -> None:
    """Raise InputError for an antenna at rest, and speeds in another unit."""
    extent = float(np.linalg.norm(np.ptp(enu[:, :2], axis=0)))
    if extent < 2.0:
        raise InputError(
            path,
            "",
            f"the whole run lies within {extent:.2f} m",
            "export decimal degrees with seven digits or more, of the run itself",
        )
    if "speed_mps" in columns:
        low, high = _speed_ratio(columns, enu, float(np.median(sigma)))
        miss = {unit: max(low / size, size / high, 1.0) for unit, size in _UNITS.items()}
        least = min(miss.values())
        near = [unit for unit, factor in miss.items() if factor <= _UNIT_DOUBT * least]
        if least < _UNIT_ERROR <= miss["m/s"]:
            ratio = f"{low:.2f}" if high < 1.01 * low else f"{low:.2f} to {high:.2f}"
            raise InputError(
                path,
                "column speed_mps",
                f"it is {ratio} times the speed of the fixes: it looks like {' or '.join(near)}",
                "convert it to m/s, or leave the column out",
            )


def _speed_ratio(columns: dict[str, Array], enu: Array, sigma: float) -> tuple[float, float]:
    """Return bounds of the ratio of the stated speeds to those of the fixes, over the faster half of the track.

    Noise (``sigma``, m) lengthens the way in a second, and turns shorten the straight line over ``_CHORD``, unless the
    course says them.  Receivers state the speed over ground or that along the slope.
    """
    time, speed = columns["time_s"], columns["speed_mps"][:, None]
    if "course_deg" in columns:
        course = np.deg2rad(columns["course_deg"])
        speed = speed * np.stack([np.sin(course), np.cos(course)], axis=1)
    stated = np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)[:, None], axis=0)
    stated = np.concatenate([np.zeros_like(stated[:1]), stated])

    def over(duration: float, axes: int) -> tuple[float, float]:
        """Return the ratio, and the way by the fixes (m)."""
        step = min(max(1, round(duration / float(np.median(np.diff(time))))), len(time) - 1)
        way = np.linalg.norm(stated[step:] - stated[:-step], axis=1)
        fast = way >= np.median(way)
        line = np.maximum(np.linalg.norm(enu[step:, :axes] - enu[:-step, :axes], axis=1)[fast], 1e-3)
        return float(np.median(way[fast] / line)), float(np.median(line))

    if "course_deg" in columns:
        bounds = (over(_CHORD, 3)[0], over(_CHORD, 2)[0])
    else:
        ratio, line = over(1.0, 2)
        without_noise = ratio / np.sqrt(max(1.0 - (2.0 * sigma / line) ** 2, 1e-6))  # two ends, two directions
        bounds = (over(1.0, 3)[0], float(min(over(_CHORD, 2)[0], without_noise)))
    return min(bounds), max(bounds)


def _linear(clock: Clock, values: Array) -> Array:
    """Interpolate values of the kept samples to the even clock, linearly across gaps."""
    return np.interp(clock.time, clock.time[~clock.bridged], values)


def _bridge(clock: Clock, enu: Array) -> Array:
    """Interpolate fixes to the even clock: across a gap by a cubic through its neighbourhood, by least squares.

    A straight line would cut the corner of a turn by a·t²/8 = 0.6 m in a second; a spline through the last two noisy
    fixes would swing.
    """
    full = np.empty((len(clock.time), 3))
    measured = np.flatnonzero(~clock.bridged)
    full[measured] = enu
    known = clock.time[measured]
    for gap in np.flatnonzero(np.diff(measured) > 1):
        gap_start, gap_stop = known[gap], known[gap + 1]
        reach = gap_stop - gap_start
        near = slice(*np.searchsorted(known, [gap_start - reach, np.nextafter(gap_stop + reach, np.inf)]))
        missing = slice(measured[gap] + 1, measured[gap + 1])
        degree = min(3, len(known[near]) - 1)
        middle = 0.5 * (gap_start + gap_stop)
        cubic = np.polynomial.polynomial.polyfit(known[near] - middle, enu[near], degree)
        full[missing] = np.polynomial.polynomial.polyval(clock.time[missing] - middle, cubic).T
    return full
