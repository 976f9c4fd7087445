"""Friction that depends on the speed."""

import numpy as np

from sssi_exudyn.contact.terms.friction_corrections import SpeedDependentFriction
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Numbers, SteadyLaw, as_slope, by_sign


class FrictionBySpeed(SteadyLaw):
    """Friction along the ski that changes with the speed; the formula is that of ``SpeedDependentFriction``."""

    name = SpeedDependentFriction.name
    caption = "friction that depends on the speed"
    amplitudes = (("b", 0.008),)

    def part(self, fitted: FittedRun) -> SpeedDependentFriction:
        return SpeedDependentFriction(v_ref=float(np.mean(np.linalg.norm(fitted.run.com_velocity, axis=1))))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"μ_t changes by {numbers['b'].value:+.4f} for each m/s of speed"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        b = numbers["b"].value
        return (
            f"the skis glide {by_sign(b, 'worse', 'better')} the faster they go: {as_slope(b / 3.6)} for each km/h more"
        )
