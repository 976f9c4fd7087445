"""Resistance of snow that is pressed down."""

from typing import Final

from sssi_exudyn.contact.terms.friction_corrections import SnowCompaction
from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.number_ref import NumberRef
from sssi_exudyn.fitting.evidence import Freedom
from sssi_exudyn.model.model import Model, add_part, name_in_model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    FittedRun,
    Numbers,
    Probe,
    SteadyLaw,
    as_weight,
    probes_by,
)

_POWERS: Final = (1.0, 1.5, 2.0)
"""Of the groove's area, from snow of one strength to snow whose pressure grows as it is pressed down."""
_SPREAD: Final = 0.5
"""Standard deviation of the power beforehand: the step between these."""
_DEPTH: Final = 0.01
"""m; a depth that readers can picture."""


class CompactedSnow(SteadyLaw):
    """Snow that resists the ski as it is pressed down; the formula is that of ``SnowCompaction``.

    By its first power alone, a resistance that grew with the power 1.5 was friction by the edge angle (0.99), with a
    mu_t of 0.162 for 0.046.  A day's runs share the resistance at the middle power.
    """

    name = SnowCompaction.name
    caption = "the resistance of compacted snow"
    amplitudes = (("c", 2e4),)

    def part(self, fitted: FittedRun) -> SnowCompaction:
        return SnowCompaction(power=_POWERS[1])

    def probes(self, fitted: FittedRun) -> list[Probe]:
        return [probe for power in _POWERS for probe in probes_by(fitted.model, SnowCompaction(power=power), ["c"])]

    def candidates(self, fitted: FittedRun, responses: Array) -> list[Candidate]:
        candidates = []
        for k, power in enumerate(_POWERS):
            part = SnowCompaction(power=power)
            owner = name_in_model(fitted.model, part)
            candidates.append(
                Candidate(
                    add_part(fitted.model, part),
                    Freedom(responses[:, [k]], self.scales),
                    ((NumberRef.of(owner, "c"),),),
                    {NumberRef.of(owner, "power"): _SPREAD},
                )
            )
        return candidates

    def sentence(self, numbers: Numbers, model: Model) -> str:
        return "the snow resists being pressed down ahead of the skis"

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        snow = SnowCompaction()
        groove = _DEPTH * model.ski.length
        braking = numbers["c"].value * groove * (groove / snow.groove_ref) ** (numbers["power"].value - 1.0)
        return f"the snow gives way and brakes: {as_weight(braking)} where a ski sinks in by a centimetre"
