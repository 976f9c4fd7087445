"""Load that the boots' cuffs take past the insoles."""

from sssi_exudyn.model.faults import BootCuff
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Numbers, SteadyFault, by_sign


class LoadOnCuffs(SteadyFault):
    """Boots whose cuffs take another share of the load than usual; the formula is that of ``BootCuff``."""

    name = BootCuff.name
    caption = "another share of the load on the boots' cuffs"
    amplitudes = (("share", 0.2),)

    def part(self, fitted: FittedRun) -> BootCuff:
        return BootCuff()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        share = numbers["share"].value
        return (
            f"the boots' cuffs carry {abs(100 * share):.0f} % {by_sign(share, 'more', 'less')} of the load than usual"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        return f"{self.sentence(numbers, model)}, which the insoles do not feel; the skiing is not at fault"
