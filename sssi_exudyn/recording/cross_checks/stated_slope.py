"""The stated slope against the plane through the track."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.slope_and_heading import angle_between

_FEET: Final = 1.0 / 0.3048


class StatedSlope:
    """A ``[slope]`` that the track does not go down, or a track whose altitude is in feet."""

    compares = "stated inclination and fall line with the plane through the track"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return sure findings for another fall line and for feet, doubts for smaller differences."""
        if evidence.setting.slope is None or evidence.slope is None:
            return ()
        stated, azimuth = evidence.slope.inclination, evidence.slope.fall_line_azimuth
        incline, fall_line = evidence.setting.slope.inclination, evidence.setting.slope.azimuth
        apart = angle_between(azimuth, fall_line.value)
        shown = f"{np.rad2deg(fall_line.value) % 360.0:.1f}"
        if apart > max(np.deg2rad(60.0), 6.0 * fall_line.sigma):
            problem = f"it is {np.rad2deg(azimuth):.1f}, but the track falls towards {shown}"
            fix = "correct it (downhill, clockwise from north), or leave [slope] out to have it estimated"
            return (Finding(evidence.toml, "[slope] fall_line_azimuth_deg", problem, fix, sure=True),)
        ratio = np.tan(incline.value) / np.tan(max(stated, 1e-3))
        if abs(ratio / _FEET - 1.0) < 0.15:  # a slope known to 15 % still distinguishes feet from metres
            problem = f"the track is {ratio:.2f} times as steep as [slope]: the altitude looks like feet"
            path, fix = evidence.files["gps"], "give the altitude in metres"
            return (Finding(path, "column altitude_m", problem, fix, sure=True),)
        doubts = []
        if abs(incline.value - stated) > max(np.deg2rad(3.0), 4.0 * incline.sigma):
            falls = f"{np.rad2deg(incline.value):.1f} ± {np.rad2deg(incline.sigma):.1f}"
            problem = f"[slope] inclination_deg is {np.rad2deg(stated):.1f}, the track falls by {falls}"
            fix = "check it, or leave [slope] out to have it estimated"
            doubts.append(Finding(evidence.toml, "", problem, fix))
        if apart > max(np.deg2rad(10.0), 4.0 * fall_line.sigma):
            falls = f"{shown} ± {np.rad2deg(fall_line.sigma):.1f}"
            problem = f"[slope] fall_line_azimuth_deg is {np.rad2deg(azimuth):.1f}, the track falls towards {falls}"
            doubts.append(Finding(evidence.toml, "", problem, "check it"))
        return doubts
