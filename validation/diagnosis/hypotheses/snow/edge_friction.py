"""Edges that cut: friction that acts along and across the edges, not the ski."""

from typing import Final

import numpy as np

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.contact.terms.friction_corrections import EdgeFriction
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Distinction, FittedRun, Numbers, SteadyLaw

_LOADED: Final = 0.25
"""Share of the ski's length ahead of the boot and behind it that bears most of the load."""


class EdgesCut(SteadyLaw):
    """Friction across each edge in its own direction; the formula is that of ``EdgeFriction``."""

    name = EdgeFriction.name
    caption = "friction along the edges"
    amplitudes = (("c", 0.5),)
    distinctions = (
        Distinction(
            ("edge_dependent_friction", "load_dependent_friction", "snow_compaction", "speed_dependent_friction"),
            "a run of the same turns on skis of another sidecut",
        ),
    )

    def part(self, fitted: FittedRun) -> EdgeFriction:
        cut = mesh(fitted.model.ski)
        place, tangents = fitted.model.ski.x_of_s(cut.contact_s), cut.edge_tangents[:, 0]
        turned = np.arctan2(tangents[:, 1], tangents[:, 0])[np.abs(place) < _LOADED * fitted.model.ski.length]
        return EdgeFriction(spread=float(np.sqrt(3.0 * np.mean(turned**2))))  # as wide as an even spread of that size

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return (
            f"the edges cut: friction of {abs(numbers['c'].value):.2f} acts across each edge, not across the whole ski"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        share = min(abs(numbers["c"].value) / model.friction.mu_n, 1.0)
        return (
            "the skis grip along the curve of their edges and not along their own length: with "
            f"{100 * share:.0f} % of their grip to the side"
        )

    def possible(self, model: Model) -> bool:
        return model.value(f"{self.name}.c") > 0.0
