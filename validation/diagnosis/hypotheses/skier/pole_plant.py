"""Pole plants between turns."""

from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Hypothesis,
    Numbers,
    Probe,
    as_weight,
    by_sign,
    probes_by,
)


class PolePlants(Hypothesis):
    """A pole planted at or near every change of edges, with the same impulse; the formula is that of ``PolePlant``."""

    name = PolePlant.name
    kind = "physics"
    caption = "a pole plant at each change of edges"
    distinctions = (Distinction(("edge_dependent_friction",), "a force sensor in the pole, or a run without planting"),)
    _KEYS: Final = ("forward", "up")
    _SHIFTS: Final = (-0.4, -0.2, 0.0, 0.2, 0.4)
    _USUAL: Final = 15.0

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return [
            probe
            for shift in self._SHIFTS
            for t in fitted.edge_changes
            for probe in probes_by(fitted.model, PolePlant(t=float(t) + shift), self._KEYS)
        ]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        candidates = []
        plants = len(fitted.edge_changes)
        if not plants:
            return []
        of_all = responses.reshape(len(responses), len(self._SHIFTS), plants, 2).sum(axis=2)
        for k, shift in enumerate(self._SHIFTS):
            model, owners = fitted.model, []
            for t in fitted.edge_changes:
                part = PolePlant(t=float(t) + shift)
                owners.append(name_in_model(model, part))
                model = add_part(model, part)
            names = tuple(tuple(NumberRef.of(owner, key) for owner in owners) for key in self._KEYS)
            candidates.append(Candidate(model, Freedom(of_all[:, k], np.full(2, self._USUAL)), names))
        return candidates

    def draw_amplitudes(self, rng: np.random.Generator, count: int) -> Array:
        """Draw amplitudes of poles, which push away from the snow and never pull."""
        forward, up = rng.standard_normal(2)
        return np.array([forward, abs(up)])

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> None:
        return None

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return (
            f"each pole plant gives {numbers['forward'].value:+.0f} N s in the direction of travel and "
            f"{numbers['up'].value:+.0f} N s away from the snow"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        forward, up = (numbers[key].value for key in self._KEYS)
        faster = forward / (model.skier.mass + 2.0 * (model.equipment.ski_mass + model.equipment.boot_mass))
        return (
            f"each pole plant makes the skier {abs(3.6 * faster):.1f} km/h {by_sign(faster, 'faster', 'slower')}, and "
            f"lifts him for a tenth of a second, {as_weight(up / 0.1)}"
        )
