"""The simulated track in the formats of maps: GPX, KML and GeoJSON."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pymap3d

from sssi_exudyn.core.frames import Array
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.runtime.optional import import_for

RATE: Final = 10.0
"""Points a second, as of a good receiver."""
TRACK_FORMATS: Final = {".gpx": "gpxpy", ".kml": "simplekml", ".geojson": "geojson"}
"""Library of each ending."""
_ACCURATE: Final = 8
"""Digits of degrees: 1 mm."""
Origin = tuple[float, float, float]
"""Latitude (degrees), longitude (degrees) and altitude (m), WGS84."""


def track_points(run: StoredRun, origin: Origin) -> Array:
    """Return latitude (degrees), longitude (degrees), altitude (m) and time (s) of the track, (k, 4).

    It is the antenna's, or that of the centre of mass where there is no antenna.
    """
    name = "antenna" if np.all(np.isfinite(run.series["antenna_east_m"])) else "com"
    places = run.series[[f"{name}_{axis}_m" for axis in ("east", "north", "up")]].to_numpy(dtype=float)
    time = np.arange(run.time[0], run.time[-1] + 1e-9, 1.0 / RATE)
    enu = np.stack([np.interp(time, run.time, column) for column in places.T], axis=1)
    latitude, longitude, altitude = pymap3d.enu2geodetic(*enu.T, *origin)
    return np.column_stack([latitude, longitude, altitude, time])


def track_text(run: StoredRun, origin: Origin, suffix: str) -> str:
    """Return the track as the text of a file with that ending.

    Raises SssiError where the library of the format is not installed.
    """
    library: Any = import_for(f"a track as {suffix}", TRACK_FORMATS[suffix], "export")
    write = {".gpx": _gpx, ".kml": _kml, ".geojson": _geojson}[suffix]
    return write(library, run.name, _rounded(run, origin))


def _rounded(run: StoredRun, origin: Origin) -> list[tuple[float, float, float, float]]:
    return [
        (round(latitude, _ACCURATE), round(longitude, _ACCURATE), round(altitude, 3), round(time, 3))
        for latitude, longitude, altitude, time in track_points(run, origin).tolist()
    ]


def _gpx(gpxpy: Any, name: str, points: list[tuple[float, float, float, float]]) -> str:
    gpx = gpxpy.gpx.GPX()
    track, segment = gpxpy.gpx.GPXTrack(name=name), gpxpy.gpx.GPXTrackSegment()
    segment.points += [gpxpy.gpx.GPXTrackPoint(lat, lon, elevation=up) for lat, lon, up, _ in points]
    track.segments.append(segment)
    gpx.tracks.append(track)
    return str(gpx.to_xml())


def _kml(simplekml: Any, name: str, points: list[tuple[float, float, float, float]]) -> str:
    kml = simplekml.Kml(name=name)
    line = kml.newlinestring(name=name, coords=[(lon, lat, up) for lat, lon, up, _ in points])
    line.altitudemode = simplekml.AltitudeMode.clamptoground  # maps' heights differ by metres
    line.style.linestyle.width = 3
    return str(kml.kml())


def _geojson(geojson: Any, name: str, points: list[tuple[float, float, float, float]]) -> str:
    line = geojson.LineString([(lon, lat, up) for lat, lon, up, _ in points], precision=_ACCURATE)
    properties = {"name": name, "time_s": [time for *_, time in points]}
    return str(geojson.dumps(geojson.FeatureCollection([geojson.Feature(geometry=line, properties=properties)])))
