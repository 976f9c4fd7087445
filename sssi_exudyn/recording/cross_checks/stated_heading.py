"""The stated heading of the capture against course and skis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sssi_exudyn.recording.cross_checks.check import Evidence, Finding
from sssi_exudyn.recording.slope_and_heading import angle_between


class StatedHeading:
    """A ``heading_deg`` that disagrees with its estimate."""

    compares = "stated heading with the skis' direction along the course"

    def judge(self, evidence: Evidence) -> Sequence[Finding]:
        """Return a sure finding for skis across or against their own course, a doubt for less."""
        estimate, given = evidence.setting.heading, evidence.heading
        if estimate is None or given is None:
            return ()
        difference = angle_between(given, estimate.value)
        shown = f"{np.rad2deg(estimate.value) % 360.0:.1f} ± {np.rad2deg(estimate.sigma):.1f}"
        problem = f"heading_deg is {np.rad2deg(given):.1f}, the estimate from course and skis is {shown}"
        place = "[motion] heading_deg"
        if difference > max(np.deg2rad(45.0), 6.0 * estimate.sigma):
            fix = "correct it (clockwise from north), or leave it out to have it estimated"
            return (Finding(evidence.toml, place, problem, fix, sure=True),)
        if difference > max(np.deg2rad(10.0), 4.0 * estimate.sigma):
            return (Finding(evidence.toml, place, problem, "check it, or leave it out to have it estimated"),)
        return ()
