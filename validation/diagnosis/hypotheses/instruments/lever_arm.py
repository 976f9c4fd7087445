"""An antenna at another place than the recording says."""

import numpy as np

from sssi_exudyn.model.faults import LeverArm
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Numbers, SteadyFault


class OtherLeverArm(SteadyFault):
    """An antenna that sits elsewhere on its segment; the formula is that of ``LeverArm``."""

    name = LeverArm.name
    caption = "another place of the antenna"
    amplitudes = (("forward", 0.2), ("left", 0.2), ("up", 0.2))

    def part(self, fitted: FittedRun) -> LeverArm:
        return LeverArm()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        distance = np.sqrt(sum(numbers[key].value ** 2 for key, _ in self.amplitudes))
        return f"the antenna sits {distance:.2f} m from where the recording says"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"{self.sentence(numbers, model)}; the skiing is not at fault"
