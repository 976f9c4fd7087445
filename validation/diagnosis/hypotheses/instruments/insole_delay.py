"""Insoles whose clock is late."""

from sssi_exudyn.model.faults import InsoleDelay
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Distinction,
    FittedRun,
    Numbers,
    SteadyFault,
    by_sign,
)


class LateInsoles(SteadyFault):
    """Insoles whose clock is late against the capture's; the formula is that of ``InsoleDelay``."""

    name = InsoleDelay.name
    caption = "insoles whose clock is not on time"
    amplitudes = (("late", 0.06),)
    distinctions = (Distinction(("insole_gain", "boot_cuff"), "a hop before the run, which capture and insoles show"),)

    def part(self, fitted: FittedRun) -> InsoleDelay:
        return InsoleDelay()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        late = numbers["late"].value
        return f"the insoles' clock is {abs(late):.3f} s {by_sign(late, 'late', 'early')}; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        late = numbers["late"].value
        return f"the insoles' clock is {abs(late):.2f} s {by_sign(late, 'late', 'early')}; the skiing is not at fault"
