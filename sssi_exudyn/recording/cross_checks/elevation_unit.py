"""The heights of an elevation model against those of the fixes over it: feet or decimetres for metres, in either."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import pymap3d

from sssi_exudyn.core.frames import Array
from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.terrain.elevation_model import open_elevations

_UNITS: Final = {"feet": 0.3048, "decimetres": 0.1, "centimetres": 0.01}
"""Metres in the units in which models come without saying so."""
_FOOT: Final = 0.3048
"""Metres in the other unit in which fixes come."""
_MOST: Final = 300
"""Maximum number of fixes that are compared."""
_HIGH: Final = 300.0
"""Altitude, m, from which on a wrong unit changes it by more than zeros of heights differ (the geoid's 100 m)."""
_SIGMAS: Final = 4.0
"""Standard deviations by which the model's fall has to differ from the fixes' before it is doubted."""


class ElevationUnit:
    """An elevation model whose heights change in another measure than those of the fixes."""

    compares = "heights of the elevation model with those of the fixes along the path"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding for another unit, a doubt for another fall.

        Raises InputError for an elevation model that cannot be used.
        """
        gps, elevations = evidence.gps, evidence.elevations
        if gps is None or elevations is None:
            return ()
        inside = np.flatnonzero(gps.between(evidence.start, evidence.stop))
        if len(inside) < 5:
            return ()
        inside = inside[:: 1 + len(inside) // _MOST]
        latitude, longitude, altitude = pymap3d.enu2geodetic(*gps.enu[inside].T, *gps.origin)
        with open_elevations(elevations.path, elevations.crs) as sample:
            ground = sample(np.asarray(latitude), np.asarray(longitude), len(inside))
        ratio, sigma = _fall(ground, np.asarray(altitude), gps.vertical * float(np.median(gps.sigma)))
        if abs(ratio - 1.0) < _SIGMAS * sigma:
            return ()
        high = float(np.median(altitude)) / float(np.median(ground)) if float(np.median(ground)) > _HIGH else np.nan
        shown = f"the path falls {1.0 / max(ratio, 1e-3):.2f} times as much on the elevation model as by the fixes"
        suspects = [(elevations.path, "band 1", unit, metres, metres) for unit, metres in _UNITS.items()]
        suspects.append((evidence.files["gps"], "column altitude_m", "feet", 1.0 / _FOOT, _FOOT))
        for path, place, unit, expected, metres in suspects:
            same_height, same_fall = abs(high / expected - 1.0) < 0.05, abs(ratio / expected - 1.0) < 0.15
            if same_fall and (same_height or sigma < 0.2 * expected):
                fix = f"convert the heights to metres (times {metres:g})"
                return (Finding(path, place, f"its heights look like {unit}: {shown}", fix, sure=True),)
        if abs(ratio - 1.0) < 0.3:
            return ()
        return (Finding(elevations.path, "band 1", shown, "check its unit and its place"),)


def _fall(ground: Array, altitude: Array, sigma: float) -> tuple[float, float]:
    """Return the ratio of the fixes' heights to the model's along the path, and its standard deviation.

    A receiver's height wanders by ``sigma`` (m) from end to end, or by what the residuals show if that is less.
    """
    centred = ground - np.mean(ground)
    reach = float(np.sum(centred**2))
    if reach < 1e-6:
        return 1.0, np.inf
    ratio = float(centred @ altitude) / reach
    left = altitude - np.mean(altitude) - ratio * centred
    wander = min(sigma, 3.0 * float(np.std(left)) + 0.1)
    return ratio, np.sqrt(2.0) * wander / float(np.ptp(ground))
