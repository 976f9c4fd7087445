"""Explanations that are hard to distinguish, each linearised where its own estimate is.

Far from the truth, and as if nothing were missing, posture and snow surface have given way to what is missing; there
responses are not linear by more than what two names differ by.  So every rival of the best explanation has all that is
uncertain estimated anew with it, and is weighed by the evidence about that.

A law that nobody has listed is a rival, too, of any shape: a latent force in the place of the best law, about the
estimate with that law.  What a law does that is listed, one that is not may do as well; how much less probable the
measurements are under a force without a law says how sure a name can be.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.evidence import best_levels
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import LATENT_FORCE
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import (
    AnyForm,
    Explanation,
    Round,
    evidence_by_size,
    rank_by_probability,
    weigh_refit,
)
from sssi_exudyn.validation.diagnosis.search.free_form_force import weigh_any_form
from sssi_exudyn.validation.diagnosis.state import State, estimate_again, linear_model

RIVAL: Final = 0.03
"""Probability from which on an explanation is a rival of the best one."""
_MOST: Final = 4
"""Explanations that are estimated anew at most: each takes as long as the estimate before the search."""


@dataclass(frozen=True)
class Anew:
    """An explanation estimated anew: the problem and the state about it, and its fit there."""

    problem: DiagnosisProblem
    state: State
    fit: Refit


def estimate_rivals(
    problem: DiagnosisProblem, state: State, latest: Round, *, full: bool
) -> tuple[Round, dict[str, Anew]]:
    """The round with the best explanation and its rivals estimated anew, and these by their names.  That nothing is
    missing is a rival like any other: its estimate goes on, too.

    The best law is estimated anew where a force of unknown law alone would be: two laws may explain what one does not.
    What is not estimated anew gains as much as the least of these, so that none of it overtakes them.  Raises
    SimulationDiverged where the best cannot be estimated; a rival that cannot is none.
    """
    best, nothing = latest.best, latest.nothing
    fitted = [each for each in latest.explanations if each.name and each.fit is not None]
    rivals = [each for each in fitted if each is best or each.probability >= RIVAL][:_MOST]
    if {each.name for each in rivals} == {LATENT_FORCE.name}:
        rivals += [each for each in fitted if each is not best and np.isfinite(each.log_evidence)][:1]
    if nothing.probability >= RIVAL:
        rivals.append(nothing)
    found: dict[str, Anew] = {}
    weighed: dict[str, Explanation] = {}

    def estimate(each: Explanation) -> None:
        assert each.fit is not None
        problem.progress(None, f"posture and snow surface with {each.name or 'nothing added'}")
        anew = Anew(*estimate_again(problem, replace(state, levels=each.levels), each.fit, full=full))
        weighed[each.name] = _weigh(anew, latest.base, each)
        found[each.name] = anew

    def again() -> Round:
        """The round, what was not estimated anew with the least gain of what was."""
        gains = [weighed[each.name].log_evidence - each.log_evidence for each in rivals if each.name in found]
        gain = min((each for each in gains if np.isfinite(each)), default=0.0)
        every = [
            weighed.get(each.name) or replace(each, log_evidence=each.log_evidence + gain)
            for each in latest.explanations
        ]
        return replace(latest, explanations=tuple(every))

    for each in rivals:
        try:
            estimate(each)
        except SimulationDiverged:
            if each is best:
                raise
    any_form, law = None, best_law(again(), found)
    if law is not None and LATENT_FORCE.name in latest.responses:
        about = found[law.name]
        problem.progress(None, f"a force of any form in the place of {law.name}")
        any_form = weigh_any_form(about.problem, about.state, latest, law, about.fit, full=full)

    def ranked() -> Round:
        every = [_beside(each, any_form) if each.name == LATENT_FORCE.name else each for each in again().explanations]
        return replace(latest, explanations=rank_by_probability(every, latest.explained))

    following = ranked()
    if following.best.name == LATENT_FORCE.name and LATENT_FORCE.name not in found and following.best.fit is not None:
        estimate(next(each for each in latest.explanations if each.name == LATENT_FORCE.name))
        following = ranked()
    return following, found


def _beside(box: Explanation, any_form: tuple[float, AnyForm] | None) -> Explanation:
    """The force that no known law explains, for a while, and with a hypothesis' weight of its own in any form."""
    if any_form is None:
        return box
    of_any, form = any_form
    evidence = float(np.logaddexp(box.log_evidence, of_any))
    return replace(box, log_evidence=evidence, any_form=replace(form, share=float(np.exp(of_any - evidence))))


def best_law(latest: Round, found: Mapping[str, Anew]) -> Explanation | None:
    """The most probable explanation that has a law, of those estimated anew; None where none was."""
    laws = [each for each in latest.explanations if each.name in found and each.name not in ("", LATENT_FORCE.name)]
    possible = [each for each in laws if each.candidate is not None and np.isfinite(each.log_evidence)]
    return max(possible, key=lambda each: each.log_evidence, default=None)


def _weigh(anew: Anew, base: Refit, explanation: Explanation) -> Explanation:
    """The explanation by its evidence about its own estimate; where it acts was searched before."""
    explanation = replace(explanation, levels=anew.state.levels, fit=anew.fit)
    if explanation.candidate is None:
        levels, evidence = best_levels(linear_model(anew.problem, anew.state, anew.fit), explanation.levels)
        return replace(explanation, log_evidence=evidence, levels=levels)
    by_size = evidence_by_size(anew.problem, anew.state, base, explanation, anew.fit)
    return weigh_refit(anew.problem, anew.state, base, explanation, anew.fit, by_size)
