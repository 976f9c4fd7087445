"""Pole plants between turns."""

from typing import Final

import numpy as np

from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.evidence import Freedom
from sssi_exudyn.validation.diagnosis.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Hypothesis,
    Numbers,
    Probe,
    add_part,
    name_in_model,
)


class PolePlants(Hypothesis):
    """A pole planted at or near every change of edges, with the same impulse; the formula is that of ``PolePlant``."""

    name = PolePlant.name
    kind = "physics"
    caption = "a pole plant at each change of edges"
    distinctions = (Distinction(("edge_dependent_friction",), "a force sensor in the pole, or a run without planting"),)
    _SHIFTS: Final = (-0.4, -0.2, 0.0, 0.2, 0.4)
    _TRIAL: Final = 4.0
    _USUAL: Final = 15.0

    def _with_plants(self, fitted: FittedRun, shift: float, forward: float, up: float) -> tuple[Model, list[str]]:
        model, owners = fitted.model, []
        for t in fitted.edge_changes:
            part = PolePlant(forward, up, float(t) + shift)
            owners.append(name_in_model(model, part))
            model = add_part(model, part)
        return model, owners

    def probes(self, fitted: FittedRun) -> list[Probe]:
        if not len(fitted.edge_changes):
            return []
        pushes = ((self._TRIAL, 0.0), (0.0, self._TRIAL))
        return [Probe(self._with_plants(fitted, s, *push)[0], self._TRIAL) for s in self._SHIFTS for push in pushes]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        found = []
        usual = np.full(2, self._USUAL)
        for k in range(responses.shape[1] // 2):
            model, owners = self._with_plants(fitted, self._SHIFTS[k], 0.0, 0.0)
            names = tuple(tuple(f"{owner}.{key}" for owner in owners) for key in ("forward", "up"))
            found.append(Candidate(model, Freedom(responses[:, 2 * k : 2 * k + 2], usual), names))
        return found

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> None:
        return None

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return (
            f"each pole plant gives {numbers['forward'].value:+.0f} N s in the direction of travel and "
            f"{numbers['up'].value:+.0f} N s away from the snow"
        )
