"""Insoles that do not read zero where nothing stands on them."""

from sssi_exudyn.model.faults import InsoleOffset
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyFault


class DriftedInsoleZero(SteadyFault):
    """Insoles whose zero has drifted, each by its own force; the formula is that of ``InsoleOffset``."""

    name = InsoleOffset.name
    caption = "insoles whose zero has drifted"
    amplitudes = (("left", 60.0), ("right", 60.0))
    distinctions = (Distinction(("insole_gain", "boot_cuff"), "the insoles read with both feet off the ground"),)

    def part(self, fitted: FittedRun) -> InsoleOffset:
        return InsoleOffset()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        left, right = numbers["left"].value, numbers["right"].value
        return f"the insoles read {left:+.0f} N (left) and {right:+.0f} N (right) where nothing stands on them"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"{self.sentence(numbers, model)}; the skiing is not at fault"
