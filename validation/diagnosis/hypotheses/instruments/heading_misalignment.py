"""A motion capture that is turned about the vertical."""

import numpy as np

from sssi_exudyn.core.number_ref import HEADING_OFFSET
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, KnownNumber, Numbers, by_sign


class HeadingMisalignment(KnownNumber):
    """The capture's heading is off by ``heading_offset``, more than its instrument states: the commonest fault of
    inertial sensors, whose compasses have steel edges and bindings near them.
    """

    name = "heading_misalignment"
    caption = "a motion capture that is turned"
    number = HEADING_OFFSET
    scale = 0.1
    weight = 4.0
    distinctions = (
        Distinction(
            ("heading_drift",), "the capture's heading held against a known direction before and after the run"
        ),
    )

    def sentence(self, numbers: Numbers, model: Model) -> str:
        offset = np.degrees(numbers["heading_offset"].value)
        return f"the capture's heading is off by {offset:+.1f}°; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        offset = np.degrees(numbers["heading_offset"].value)
        return (
            f"the motion capture is turned by {abs(offset):.1f}°, and has to be turned back to the "
            f"{by_sign(offset, 'left', 'right')}; the skiing is not at fault"
        )
