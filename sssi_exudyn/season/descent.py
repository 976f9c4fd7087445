"""The descent of a recorded run, from its fixes alone: how far, how fast, and its track."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
import pyarrow as pa
import pymap3d
from numpy.typing import NDArray

from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import height_noise, speed_noise
from sssi_exudyn.importing.days.descents import averaged_speed
from sssi_exudyn.recording.few_sensors.course import velocity_of
from sssi_exudyn.recording.instruments.gps import Gps, gps_from_fixes, read_fixes
from sssi_exudyn.recording.recording import Equipment, Recording, Skier

POINTS: Final = 60
"""Number of points of a track on the map: a run of 1 km has one every 17 m, a receiver's own error is 5 m."""
_EVERY: Final = 0.4
"""s between the fixes of a track that are kept, at least: a turn lasts one."""
_UNSTATED: Final = 3.0
"""m; error of a place where the receiver does not state it, as an import takes it."""
_AS_A_TELEPHONE: Final = 10.0
"""m; what telephones state, for the speeds of a receiver that states nothing: it may smooth them as they do."""
_DISAGREE: Final = 1.0
"""m/s (root mean square) by which a receiver's speeds differ from those of its places where they are not believed: the
largest error of the latter.  Some watches filter speed over ten seconds and more."""
_DRAG_AREA: Final = 0.5
"""m²; the model's of a skier who turns (0.23 in a tuck to 0.66 upright)."""
_MASS: Final = Skier().mass + 2.0 * (Equipment().ski_mass + Equipment().boot_mass)
TRACK: Final = (
    "time_s", "latitude_deg", "longitude_deg", "altitude_m", "speed_mps",
    "sigma_m", "speed_sigma_mps", "height_sigma_m", "wander_m", "wander_s", "drag_per_m",
)  # fmt: skip
"""Columns of a track.  The second line is what is known of the whole run, the same in each row: errors of places, of
speeds and of heights, independent and slow with its time, and drag over mass and squared speed."""


def descent_figures(recording: Recording) -> dict[str, float | None]:
    """Return duration (s), length and vertical (m) and speeds (m/s), averaged over 5 s; nothing without fixes."""
    gps = recording.gps
    if gps is None:
        return {"duration_s": recording.stop - recording.start}
    within = gps.between(recording.start, recording.stop)
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
    """Return the track of a recording, with the columns ``TRACK``; None without."""
    gps = recording.gps
    if gps is None:
        return None
    within = gps.between(recording.start, recording.stop)
    if np.count_nonzero(within) < 2:
        return None
    equipment = recording.equipment
    mass = recording.skier.mass + 2.0 * (equipment.ski_mass + equipment.boot_mass)
    return _track(gps, within, speed_noise(gps, float(np.median(gps.sigma))), mass)


def points_of(track: pd.DataFrame) -> Array:
    """Return ``POINTS`` or fewer points of a track for the map: (n, 3) latitude and longitude (deg), altitude (m)."""
    rows = np.unique(np.linspace(0, len(track) - 1, POINTS).round().astype(int))
    return np.asarray(track[["latitude_deg", "longitude_deg", "altitude_m"]].to_numpy(dtype=float)[rows])


def track_of_fixes(path: Path) -> pa.Table:
    """Return the track of a file of fixes, of a skier of usual mass.

    Raises InputError for what ``read_gps`` refuses.
    """
    fixes = read_fixes(path, _UNSTATED)
    gps = gps_from_fixes(path, fixes, segment="", offset=np.zeros(3), sigma=_UNSTATED)
    stated = float(np.median(gps.sigma)) if "sigma_m" in fixes.columns else _AS_A_TELEPHONE
    return _track(gps, np.full(len(gps.time), True), speed_noise(gps, stated), _MASS)


def _track(gps: Gps, within: NDArray[np.bool_], speed_sigma: float, mass: float) -> pa.Table:
    time, places, stated = gps.time[within], gps.enu[within], float(np.median(gps.sigma))
    thin = slice(None, None, max(1, int(_EVERY / float(np.median(np.diff(time))))))
    speed = np.linalg.norm(velocity_of(replace(gps, speed=None)), axis=1)[within]
    if gps.speed is not None and np.sqrt(np.mean((gps.speed[within] - speed) ** 2)) < _DISAGREE:
        speed = gps.speed[within]
    latitude, longitude, altitude = pymap3d.enu2geodetic(*places[thin].T, *gps.origin)
    height_sigma, wander = height_noise(gps, stated)
    drag = 0.5 * AirDrag().rho * _DRAG_AREA / mass
    known = (stated, speed_sigma, height_sigma, wander.sigma, wander.correlation_time, drag)
    columns = (time[thin], latitude, longitude, altitude, speed[thin], *(np.full(len(latitude), one) for one in known))
    return pa.table(dict(zip(TRACK, columns, strict=True)))
