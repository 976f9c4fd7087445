"""Friction of one ski that no known law explains."""

from sssi_exudyn.contact.terms.friction_corrections import UnexplainedFriction
from sssi_exudyn.core.number_ref import MU_T
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import (
    Candidate,
    Distinction,
    FittedRun,
    Numbers,
    Shifts,
    SteadyLaw,
    as_slope,
    by_sign,
)


class FrictionOfOneSki(SteadyLaw):
    """One ski that glides unlike the other, all the time, for a reason that is not known; the formula is that of
    ``UnexplainedFriction``.
    """

    name = UnexplainedFriction.name
    kind = "unexplained"
    caption = "one ski that glides unlike the other"
    smallest = "a ski whose μ_t differs from the other's by {value:.3f}"
    plain_smallest = "a ski that glides worse than the other, as if the slope changed by {degrees:.1f}° under it"
    amplitudes = (("delta_mu", 0.05),)
    distinctions = (
        Distinction(("snow_patch", "gust", "load_dependent_friction"), "a run with the skis changed left for right"),
    )

    def part(self, fitted: FittedRun) -> UnexplainedFriction:
        return UnexplainedFriction()

    def shifts_if_usual(self, fitted: FittedRun, candidate: Candidate, model: Model) -> Shifts:
        """Return the shifts to either ski, which may be the usual one."""
        half = 0.5 * model.value(candidate.amplitudes[0][0])
        return {MU_T: half}, {MU_T: -half}

    def sentence(self, numbers: Numbers, model: Model) -> str:
        mean, half = model.friction.mu_t, 0.5 * numbers["delta_mu"].value
        return (
            f"the left ski is braked {by_sign(half, 'more', 'less')} than the right one, which no known law explains: "
            f"its μ_t is {mean + half:.3f}, that of the right one {mean - half:.3f}"
        )

    def plain_words(self, numbers: Numbers, model: Model) -> str:
        delta = numbers["delta_mu"].value
        return (
            f"the left ski glides {by_sign(delta, 'worse', 'better')} than the right one, {as_slope(delta)} under it; "
            "none of the known causes explains it"
        )
