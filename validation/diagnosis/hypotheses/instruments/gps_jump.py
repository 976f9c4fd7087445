"""GPS fixes that are displaced for a while."""

from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.faults import GpsJump
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Hypothesis,
    Numbers,
    Probe,
    add_part,
    name_in_model,
)


class DisplacedFixes(Hypothesis):
    """Fixes that are displaced for a while, which needs no simulation; the formula is that of ``GpsJump``."""

    name = GpsJump.name
    kind = "sensor"
    comes_again = False
    caption = "displaced GPS fixes"
    distinctions = (Distinction(("gust", "unexplained_force"), "a second receiver"),)
    _USUAL: Final = 0.6
    """m, of a receiver with a fixed solution."""
    _TIMES: Final = 3.0
    """What the receiver states of its fixes, where that is more: fixes less displaced are its noise."""

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return []

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        time, candidates = fitted.measurements.fixes, []
        n = len(time)
        usual = max(self._USUAL, self._TIMES * fitted.measurements.gps_sigma)
        step = max(1, n // 80)
        edges = [*range(0, n, step), n]
        for a in range(len(edges) - 1):
            for b in range(a + 1, len(edges)):
                i, j = edges[a], edges[b]
                if j - i < 3 or j - i > 0.5 * n:
                    continue
                t0 = float(0.5 * (time[i - 1] + time[i])) if i else float(time[0] - 1.0)
                t1 = float(0.5 * (time[j - 1] + time[j])) if j < n else float(time[-1] + 1.0)
                columns = np.zeros((len(fitted.prediction), 2))
                columns[i:j, 0] = 1.0
                columns[n + i : n + j, 1] = 1.0
                part = GpsJump(t0=t0, t1=t1)
                owner = name_in_model(fitted.model, part)
                candidates.append(
                    Candidate(
                        add_part(fitted.model, part),
                        Freedom(columns, np.full(2, usual)),
                        ((NumberRef.of(owner, "x"),), (NumberRef.of(owner, "y"),)),
                        {},
                        (max(t0, float(time[0])), min(t1, float(time[-1]))),
                    )
                )
        return candidates

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float] | None:
        return candidate.window

    def sentence(self, numbers: Numbers, model: Model) -> str:
        distance = np.hypot(numbers["x"].value, numbers["y"].value)
        return f"the GPS fixes are displaced by {distance:.2f} m; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        distance = np.hypot(numbers["x"].value, numbers["y"].value)
        return f"the receiver's fixes are {distance:.2f} m off; the skiing is not at fault"
