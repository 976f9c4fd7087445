"""A GPS clock that is late."""

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import CLOCK_OFFSET
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    KnownNumber,
    Numbers,
    by_sign,
)


class GpsDelay(KnownNumber):
    """The GPS clock is late: a fix reported at time t is the antenna's place at t − clock_offset."""

    name = "gps_delay"
    caption = "a GPS clock that is not on time"
    number = CLOCK_OFFSET
    scale = 0.25
    distinctions = (Distinction(("lever_arm",), "the receiver's time pulse, or the antenna's place measured"),)

    def usual(self, fitted: FittedRun) -> float:
        """Return the usual delay: a receiver that has one fix a second may report it as much later."""
        return max(super().usual(fitted), float(np.median(np.diff(fitted.measurements.fixes))))

    def _late_by_seconds(self, fitted: FittedRun) -> bool:
        """Return whether the receiver may be late by so much that the skier turns meanwhile."""
        return self.usual(fitted) > self.scale

    def always_refitted(self, fitted: FittedRun) -> bool:
        return self._late_by_seconds(fitted)

    def sides(self, fitted: FittedRun) -> tuple[float, ...]:
        return (-2.0, -1.0, 1.0, 2.0) if self._late_by_seconds(fitted) else super().sides(fitted)

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        """Propose, of a receiver that may be late by a second, also clocks that much off, by the difference that they
        make: a skier turns within that time, and no straight line leads there.
        """
        candidates, usual = super().candidates(fitted, responses), self.usual(fitted)
        if not self._late_by_seconds(fitted):
            return candidates
        low, high = fitted.model.bounds(self.number)
        now = fitted.model.value(self.number)
        for late in (*np.arange(-usual, low, -usual), *np.arange(usual, high, usual)):
            if abs(late - now) > 0.5 * usual:
                model = fitted.model.with_values({self.number: float(late)})
                changed = fitted.measurements.predict(model, fitted.run) - fitted.prediction
                secant = Freedom(changed[:, None] / (late - now), np.array([usual]))
                candidates.append(Candidate(model, secant, ((self.number,),)))
        return candidates

    def sentence(self, numbers: Numbers, model: Model) -> str:
        late = numbers["clock_offset"].value
        return f"the GPS clock is {abs(late):.3f} s {by_sign(late, 'late', 'early')}; no physics is missing"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        late = numbers["clock_offset"].value
        return f"the receiver's clock is {abs(late):.2f} s {by_sign(late, 'late', 'early')}; the skiing is not at fault"
