"""The descent of a recorded run, from its fixes alone: how far, how fast, and its track for the map."""

from __future__ import annotations

from typing import Final

import numpy as np
import pyarrow as pa
import pymap3d

from sssi_exudyn.importing.days.descents import averaged_speed
from sssi_exudyn.recording.recording import Recording

POINTS: Final = 60
"""Number of points of a track on the map: a run of 1 km has one every 17 m, a receiver's own error is 5 m."""
_EVERY: Final = 1.0
"""s between the points of a track, at least: a turn of a slow skier lasts three."""


def descent_figures(recording: Recording) -> dict[str, float | None]:
    """Return duration (s), length and vertical (m) and speeds (m/s), averaged over 5 s; nothing without fixes."""
    gps = recording.gps
    if gps is None:
        return {"duration_s": recording.stop - recording.start}
    within = (gps.time >= recording.start) & (gps.time <= recording.stop)
    time, places = gps.time[within], gps.enu[within]
    if len(time) < 2:
        return {"duration_s": recording.stop - recording.start}
    speed = averaged_speed(time, places[:, :2])
    flat = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    vertical = float(places[0, 2] - places[-1, 2])
    return {
        "duration_s": float(time[-1] - time[0]),
        "length_m": float(np.hypot(flat, vertical)),
        "vertical_m": vertical,
        "mean_speed_mps": flat / float(time[-1] - time[0]),
        "top_speed_mps": float(np.max(speed)),
    }


def track_of(recording: Recording) -> pa.Table | None:
    """Return ``POINTS`` or fewer points of the track, latitude and longitude (deg) and altitude (m); None without."""
    gps = recording.gps
    if gps is None or len(gps.time) < 2:
        return None
    count = int(np.clip(np.ptp(gps.time) / _EVERY, 12, POINTS))
    moments = np.linspace(gps.time[0], gps.time[-1], count)
    places = [np.interp(moments, gps.time, axis) for axis in gps.enu.T]
    latitude, longitude, altitude = pymap3d.enu2geodetic(*places, *gps.origin)
    return pa.table({"latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": altitude})
