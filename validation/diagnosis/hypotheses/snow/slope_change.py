"""A piste that steepens or flattens."""

import numpy as np

from sssi_exudyn.contact.terms.terrain import SlopeChange
from sssi_exudyn.model.model import Model
from sssi_exudyn.terrain.from_heights import STEEPNESS
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, Terrain, by_sign


class OtherInclination(Terrain):
    """From one place on the inclination is another; the formula is that of ``SlopeChange``."""

    name = SlopeChange.name
    kind = "physics"
    caption = "another inclination of the piste"
    smallest = "an inclination that changes by {degrees:.1f}°"
    amplitude = "delta"
    scale = 0.03
    natural = 2.0 * STEEPNESS  # twice the waves' slopes
    widths = (3.0, 10.0)
    distinctions = (Distinction(("terrain_bump",), "a survey of the piste"),)

    def part(self, f0: float, width: float) -> SlopeChange:
        return SlopeChange(0.0, f0, width)

    def span(self, fitted: FittedRun, f0: float, width: float) -> tuple[float, float]:
        return fitted.time_at(f0), float(fitted.run.time[-1])

    def sentence(self, numbers: Numbers, model: Model) -> str:
        delta = numbers["delta"].value
        return f"the piste is {abs(np.degrees(delta)):.1f}° {by_sign(delta, 'steeper', 'flatter')} than before"
