"""The track against what skiing is: downhill, at some speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding

_CLIMB: Final = 10.0
"""Rise, m, that no receiver's wander explains over a run, if it is also six standard deviations of a height."""
_SLOW, _FAST = 1.0, 40.0
"""Mean speeds, m/s, below and above which hardly anyone skis a whole run."""
_COVERED: Final = 3.0
"""Least duration, s, over which a mean speed means something."""


class Travel:
    """A track that climbs, stands still or races."""

    compares = "drop and mean speed of the track with those of skiing"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding for a track that clearly leads uphill, doubts for speeds that are no skier's."""
        gps = evidence.gps
        if gps is None:
            return ()
        inside = gps.between(evidence.start, evidence.stop)
        duration = float(np.ptp(gps.time[inside])) if np.any(inside) else 0.0
        if duration < _COVERED:
            return ()
        place = gps.enu[inside]
        rise = float(place[-1, 2] - place[0, 2])
        sigma = gps.vertical * float(np.median(gps.sigma[inside]))
        path = evidence.files["gps"]
        if rise > max(_CLIMB, 6.0 * sigma):
            problem = f"the track climbs by {rise:.0f} m from {evidence.start:.1f} to {evidence.stop:.1f} s"
            fix = "give the run itself, not the ascent; check the sign of altitude_m and time_offset_s"
            return (Finding(path, "column altitude_m", problem, fix, sure=True),)
        seconds = np.arange(gps.time[inside][0], gps.time[inside][-1], 1.0)
        coarse = np.column_stack([np.interp(seconds, gps.time[inside], axis) for axis in place[:, :2].T])
        speed = float(np.sum(np.linalg.norm(np.diff(coarse, axis=0), axis=1))) / max(float(np.ptp(seconds)), 1.0)
        if _SLOW <= speed <= _FAST:
            return ()
        problem = f"the mean speed over ground is {speed:.2g} m/s"
        return (Finding(path, "", problem, "check that this is the run, with time in seconds"),)
