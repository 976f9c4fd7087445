"""A motion capture whose heading drifts."""

import numpy as np

from sssi_exudyn.model.faults import HeadingDrift
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Numbers, SteadyFault, by_sign


class DriftingHeading(SteadyFault):
    """A heading that turns away slowly; the formula is that of ``HeadingDrift``."""

    name = HeadingDrift.name
    caption = "a motion capture whose heading drifts"
    amplitudes = (("rate", 0.008),)

    def part(self, fitted: FittedRun) -> HeadingDrift:
        return HeadingDrift(t_ref=float(fitted.run.time.mean()))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        rate = 60 * np.degrees(numbers["rate"].value)
        return f"the capture's heading drifts by {rate:+.1f}° a minute; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        rate = 60 * np.degrees(numbers["rate"].value)
        return (
            f"the motion capture turns away slowly, and has to be turned back by {abs(rate):.1f}° a minute to the "
            f"{by_sign(rate, 'left', 'right')}; the skiing is not at fault"
        )
