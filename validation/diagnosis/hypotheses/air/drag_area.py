"""A skier who takes more or less air than assumed."""

from sssi_exudyn.contact.terms.wind import DragArea
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw, by_sign


class OtherDragArea(SteadyLaw):
    """Clothing or posture with another drag area; the formula is that of ``DragArea``."""

    name = DragArea.name
    caption = "another drag area of the skier"
    through_air = True
    amplitudes = (("share", 0.4),)
    distinctions = (
        Distinction(("speed_dependent_friction",), "the same skier at another speed or posture on the same snow"),
    )

    def part(self, fitted: FittedRun) -> DragArea:
        return DragArea()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        share = numbers["share"].value
        return f"the skier's drag area is {abs(100 * share):.0f} % {by_sign(share, 'larger', 'smaller')} than assumed"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        share = numbers["share"].value
        return (
            f"the air brakes {abs(100 * share):.0f} % {by_sign(share, 'more', 'less')} than expected of this skier, by "
            "clothing or posture"
        )
