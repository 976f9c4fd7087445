"""A GPS clock that is late."""

import numpy as np

from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypothesis import Distinction, FittedRun, KnownNumber, Numbers, by_sign


class GpsDelay(KnownNumber):
    """The GPS clock is late: a fix reported at time t is the antenna's place at t − clock_offset."""

    name = "gps_delay"
    caption = "a GPS clock that is not on time"
    number = "start.clock_offset"
    scale = 0.25
    distinctions = (Distinction(("lever_arm",), "the receiver's time pulse, or the antenna's place measured"),)

    def usual(self, fitted: FittedRun) -> float:
        """A receiver that has one fix a second may report it as much later."""
        return max(super().usual(fitted), float(np.median(np.diff(fitted.measurements.fixes))))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        late = numbers["clock_offset"].value
        return f"the GPS clock is {abs(late):.3f} s {by_sign(late, 'late', 'early')}; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        late = numbers["clock_offset"].value
        return f"the receiver's clock is {abs(late):.2f} s {by_sign(late, 'late', 'early')}; the skiing is not at fault"
