"""GPS fixes that are displaced for a while."""

import itertools
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.faults import GpsJump
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Hypothesis,
    Numbers,
    Probe,
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
    _LEAST: Final = 3
    """Fixes at least that are displaced."""
    _LONGEST: Final = 0.5
    """Share of the run at most."""
    _STEPS: Final = 80
    """Places in the run at most where fixes may jump."""
    _GRADUAL: Final = 20
    """The same of what comes and goes gradually: its ends are fitted."""
    _RISES: Final = (0.4, 1.0)
    """Shares of its time in which it does so, each tried."""

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return []

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        time = fitted.measurements.fixes
        n = len(time)
        step = max(1, n // self._STEPS)
        candidates = []
        for i, j in self._stretches([*range(0, n, step), n]):
            t0 = float(0.5 * (time[i - 1] + time[i])) if i else float(time[0] - 1.0)
            t1 = float(0.5 * (time[j - 1] + time[j])) if j < n else float(time[-1] + 1.0)
            candidates.append(self._candidate(fitted, GpsJump(t0=t0, t1=t1), 0.0))
        step = max(1, n // self._GRADUAL)
        for i, j in self._stretches([*range(0, n, step), n - 1]):
            for rise in self._RISES:
                part = GpsJump(t0=float(time[i]), t1=float(time[j]), rise=rise)
                candidates.append(self._candidate(fitted, part, float(time[step] - time[0])))
        return candidates

    def _stretches(self, edges: list[int]) -> list[tuple[int, int]]:
        """Return the first fix of each stretch that may be displaced, and the first after it."""
        longest = self._LONGEST * edges[-1]
        return [(i, j) for i, j in itertools.combinations(edges, 2) if self._LEAST <= j - i <= longest]

    def _candidate(self, fitted: FittedRun, part: GpsJump, spread: float) -> Candidate:
        """Return a candidate whose ends are known to a ``spread`` (s), or are between two fixes if that is zero."""
        time = fitted.measurements.fixes
        n = len(time)
        columns = np.zeros((len(fitted.prediction), 2))
        columns[:n, 0] = columns[n : 2 * n, 1] = part.share(time)
        owner = name_in_model(fitted.model, part)
        usual = max(self._USUAL, self._TIMES * fitted.measurements.gps_sigma)
        places = (NumberRef.of(owner, "t0"), NumberRef.of(owner, "t1")) if spread else ()
        return Candidate(
            add_part(fitted.model, part),
            Freedom(columns, np.full(2, usual)),
            ((NumberRef.of(owner, "x"),), (NumberRef.of(owner, "y"),)),
            dict.fromkeys(places, spread),
            (max(part.t0, float(time[0])), min(part.t1, float(time[-1]))),
        )

    def window(self, fitted: FittedRun, candidate: Candidate, numbers: Numbers) -> tuple[float, float] | None:
        if not candidate.places:
            return candidate.window
        return numbers["t0"].value, numbers["t1"].value

    def sentence(self, numbers: Numbers, model: Model) -> str:
        distance = np.hypot(numbers["x"].value, numbers["y"].value)
        return f"the GPS fixes are displaced by {distance:.2f} m; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        distance = np.hypot(numbers["x"].value, numbers["y"].value)
        return f"the receiver's fixes are {distance:.2f} m off; the skiing is not at fault"
