"""The loaded foot against the turns: the outside ski carries more."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.cross_checks.turning import turning_of_track

_LEAST_TURNED: Final = 0.7
"""Root mean square of the sideways acceleration, m/s², below which turns do not decide about the load."""
_OPPOSED: Final = -0.5
"""Correlation of outside acceleration and load below which feet are exchanged, or clocks half a turn apart."""
_FEWEST: Final = 8


class LoadedFoot:
    """Insoles that show the inside foot loaded, turn for turn."""

    compares = "share of the load on the right foot with the track's acceleration to the left"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a doubt where the load is on the inside foot in most turns."""
        correlation = load_correlation(evidence)
        if correlation is None or correlation > _OPPOSED:
            return ()
        problem = f"the loaded foot is the inside one in the turns (correlation {correlation:.2f})"
        fix = "check that left and right are not exchanged, and time_offset_s"
        return (Finding(evidence.files["insoles"], "", problem, fix),)


def load_correlation(evidence: Evidence) -> float | None:
    """Return the correlation of the right foot's share of the load with the acceleration to the left.

    It is None without turns.
    """
    insoles, gps = evidence.insoles, evidence.gps
    if insoles is None or gps is None:
        return None
    track = turning_of_track(gps, evidence.start, evidence.stop)
    pull = track.to_left
    if len(pull) < _FEWEST or np.sqrt(np.mean(pull**2)) < _LEAST_TURNED or np.ptp(np.sign(pull)) < 2.0:
        return None
    total = np.maximum(insoles.left + insoles.right, 1.0)
    share = np.interp(track.time, insoles.time, (insoles.right - insoles.left) / total)
    if np.std(share) == 0.0:
        return None
    return float(np.corrcoef(share, pull)[0, 1])
