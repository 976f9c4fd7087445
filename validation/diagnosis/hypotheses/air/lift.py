"""A skier whom the air lifts."""

from sssi_exudyn.contact.terms.wind import Lift
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw, by_sign


class OtherLift(SteadyLaw):
    """Clothing or posture with other lift; the formula is that of ``Lift``."""

    name = Lift.name
    caption = "another lift of the air on the skier"
    amplitudes = (("c_l", 0.8),)
    distinctions = (
        Distinction(
            ("insole_gain", "insole_offset", "boot_cuff", "load_dependent_friction", "snow_compaction"),
            "the same skier at half the speed, where the lift is a quarter",
        ),
    )

    def part(self, fitted: FittedRun) -> Lift:
        return Lift()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        more = numbers["c_l"].value
        return f"the air lifts the skier, with a lift coefficient {abs(more):.2f} {by_sign(more, 'larger', 'smaller')}"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        more = numbers["c_l"].value
        return (
            f"the air lifts the skier {by_sign(more, 'more', 'less')} than expected, so that he weighs "
            f"{by_sign(more, 'less', 'more')} on the snow the faster he is"
        )
