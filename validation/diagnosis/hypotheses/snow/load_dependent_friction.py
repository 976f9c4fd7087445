"""Friction that depends on the load."""

import numpy as np

from sssi_exudyn.contact.terms.friction_corrections import LoadDependentFriction
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Distinction,
    FittedRun,
    Numbers,
    SteadyLaw,
    as_slope,
    by_sign,
)


class FrictionByLoad(SteadyLaw):
    """Friction along the ski that changes with the load; the formula is that of ``LoadDependentFriction``."""

    name = LoadDependentFriction.name
    caption = "friction that depends on the load"
    amplitudes = (("b", 0.05),)
    distinctions = (Distinction(("snow_compaction",), "a straight run next to the turns on the same snow"),)

    def part(self, fitted: FittedRun) -> LoadDependentFriction:
        return LoadDependentFriction(load_ref=float(np.mean(fitted.run.foot_load)))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"μ_t changes by {numbers['b'].value:+.4f} when the load on a ski doubles"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        b = numbers["b"].value
        return f"a ski glides {by_sign(b, 'worse', 'better')} with more load on it: {as_slope(b)} at twice the load"
