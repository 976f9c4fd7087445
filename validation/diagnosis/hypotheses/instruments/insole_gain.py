"""Insoles with a wrong calibration."""

from sssi_exudyn.model.faults import InsoleGain
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyFault


class WrongInsoleGain(SteadyFault):
    """Insoles that read too much or too little, each by its own factor; the formula is that of ``InsoleGain``."""

    name = InsoleGain.name
    caption = "insoles that are wrongly calibrated"
    amplitudes = (("left", 0.2), ("right", 0.2))
    distinctions = (Distinction(("boot_cuff",), "the insoles read while standing still"),)

    def part(self, fitted: FittedRun) -> InsoleGain:
        return InsoleGain()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        left, right = 100 * numbers["left"].value, 100 * numbers["right"].value
        return f"the insoles' readings are off by {left:+.0f} % (left) and {right:+.0f} % (right)"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"{self.sentence(numbers, model)}; the skiing is not at fault"
