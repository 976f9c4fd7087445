"""Friction that depends on the edge angle."""

import numpy as np

from sssi_exudyn.contact.terms.friction_corrections import EdgeDependentFriction
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Distinction,
    FittedRun,
    Numbers,
    SteadyLaw,
    as_slope,
    by_sign,
)


class FrictionByEdge(SteadyLaw):
    """Friction along the ski that changes with the edge angle; the formula is that of ``EdgeDependentFriction``."""

    name = EdgeDependentFriction.name
    caption = "friction that depends on the edge angle"
    amplitudes = (("b", 0.1),)
    distinctions = (
        Distinction(
            ("load_dependent_friction", "snow_compaction"), "a straight run next to the turns on the same snow"
        ),
    )

    def part(self, fitted: FittedRun) -> EdgeDependentFriction:
        return EdgeDependentFriction(edge_ref=float(np.mean(np.abs(fitted.run.edge_angle))))

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return f"μ_t changes by {numbers['b'].value * np.pi / 18:+.4f} for each 10° of edge angle"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        b = numbers["b"].value
        return (
            f"the skis glide {by_sign(b, 'worse', 'better')} the more they are edged: {as_slope(b * np.pi / 18)} for "
            "each 10° of edge angle"
        )
