"""A roll or a dip of the piste."""

from sssi_exudyn.contact.terms.terrain import TerrainBump
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, Terrain, by_sign


class RollOrDip(Terrain):
    """Snow that rises or falls over some metres; the formula is that of ``TerrainBump``."""

    name = TerrainBump.name
    kind = "physics"
    caption = "a roll or a dip of the piste"
    amplitude = "rise"
    scale = 0.25
    natural = 2.0  # a single roll of twice the waves
    widths = (2.0, 4.0, 8.0)
    distinctions = (Distinction(("gps_jump",), "a second receiver, or a survey of the piste"),)

    def part(self, f0: float, width: float) -> TerrainBump:
        return TerrainBump(0.0, f0, width)

    def span(self, fitted: FittedRun, f0: float, width: float) -> tuple[float, float]:
        return fitted.time_at(f0 - 2.0 * width), fitted.time_at(f0 + 2.0 * width)

    def sentence(self, numbers: Numbers, model: Model) -> str:
        rise = numbers["rise"].value
        return f"the skis go over a {by_sign(rise, 'roll', 'dip')} of {abs(rise):.2f} m"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        rise = numbers["rise"].value
        return f"the piste has a {by_sign(rise, 'roll', 'dip')} of {100 * abs(rise):.0f} cm there"
