"""A motion capture whose heading drifts."""

import numpy as np

from sssi_exudyn.model.faults import HeadingDrift
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypothesis import FittedRun, Numbers, SteadyFault


class DriftingHeading(SteadyFault):
    """A heading that turns away slowly; the formula is that of ``HeadingDrift``."""

    name = HeadingDrift.name
    caption = "a correction of the capture's drifting heading"
    amplitudes = (("rate", 0.008),)

    def part(self, fitted: FittedRun) -> HeadingDrift:
        return HeadingDrift(t_ref=float(fitted.run.time.mean()))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        rate = 60 * np.degrees(numbers["rate"].value)
        return f"the capture's heading drifts by {rate:+.1f}° a minute; no physics is missing"
