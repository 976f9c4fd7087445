"""A correction of the captured posture: slowly changing angles that are added to the skier's.

A fit estimates it where the capture's errors show in the track, the soles' loads or the balance of the skier.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.core.frames import Array
from sssi_exudyn.motion.motion import Motion, greville_abscissae


@dataclass(frozen=True)
class PostureCorrection:
    """Angles that are added to the coordinates ``chain.PRESCRIBED``.

    time : (k,) s, increasing, k ≥ 2;  angles : (k, 28) rad, a cubic spline over time, constant beyond its ends
    """

    time: Array
    angles: Array

    def at(self, time: Array) -> Array:
        """Return the angles (n, 28) rad at ``time`` (n,) s."""
        return np.asarray(CubicSpline(self.time, self.angles)(np.clip(time, self.time[0], self.time[-1])))

    @property
    def digest(self) -> str:
        """SHA-256 of the numbers."""
        table = np.column_stack([self.time, self.angles])
        return hashlib.sha256(np.ascontiguousarray(table, dtype="<f8").tobytes()).hexdigest()

    def rms(self) -> dict[str, float]:
        """Return the root mean square over time, rad, of each coordinate that is corrected."""
        sizes = np.sqrt(np.mean(self.angles**2, axis=0))
        return {name: float(value) for name, value in zip(PRESCRIBED, sizes, strict=True) if value > 0.0}


def correct_posture(motion: Motion, correction: PostureCorrection | None) -> Motion:
    """Return the motion with the correction added, or the motion itself where there is none.

    A spline whose coefficients are a slow function at the knots' averages (Greville's abscissae) is that function, up
    to (spacing of the knots / time over which it changes)².
    """
    if correction is None:
        return motion
    coefficients = motion.coefficients + correction.at(greville_abscissae(motion))
    return replace(motion, coefficients=coefficients)
