"""Resistance of snow that is pressed down."""

from sssi_exudyn.contact.terms.friction_corrections import SnowCompaction
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Numbers, SteadyLaw, as_weight


class CompactedSnow(SteadyLaw):
    """Snow that resists the ski as it is pressed down; the formula is that of ``SnowCompaction``."""

    name = SnowCompaction.name
    caption = "the resistance of compacted snow"
    amplitudes = (("c", 2e4),)

    def part(self, fitted: FittedRun) -> SnowCompaction:
        return SnowCompaction()

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return "the snow resists being pressed down ahead of the skis"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        braking = 0.01 * model.ski.length * numbers["c"].value
        return f"the snow gives way and brakes: {as_weight(braking)} for each centimetre that a ski sinks in"
