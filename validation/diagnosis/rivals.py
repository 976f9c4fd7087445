"""Explanations that are hard to distinguish, each linearised where its own estimate is.

Far from the truth, and as if nothing were missing, posture and snow surface have given way to what is missing; there
responses are not linear by more than what two names differ by.  So every rival of the best explanation has all that is
uncertain estimated anew with it, and is weighed by the evidence about that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.validation.diagnosis.evidence import best_levels
from sssi_exudyn.validation.diagnosis.problem import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.search import (
    Explanation,
    Round,
    evidence_by_size,
    rank_by_probability,
    weigh_refit,
)
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

    What is not estimated anew gains as much as the least of these, so that none of it overtakes them.  Raises
    SimulationDiverged where the best cannot be estimated; a rival that cannot is none.
    """
    best, nothing = latest.best, latest.nothing
    rivals = [each for each in latest.explanations if each.name and each.fit is not None]
    rivals = [each for each in rivals if each is best or each.probability >= RIVAL][:_MOST]
    if nothing.probability >= RIVAL:
        rivals.append(nothing)
    found: dict[str, Anew] = {}
    weighed: dict[str, Explanation] = {}
    for each in rivals:
        assert each.fit is not None
        problem.progress(None, f"posture and snow surface with {each.name or 'nothing added'}")
        try:
            anew = Anew(*estimate_again(problem, replace(state, levels=each.levels), each.fit, full=full))
            weighed[each.name] = _weigh(anew, latest.base, each)
            found[each.name] = anew
        except SimulationDiverged:
            if each is best:
                raise
    gains = [weighed[each.name].log_evidence - each.log_evidence for each in rivals if each.name in found]
    gain = min((each for each in gains if np.isfinite(each)), default=0.0)
    every = [
        weighed.get(each.name) or replace(each, log_evidence=each.log_evidence + gain) for each in latest.explanations
    ]
    return replace(latest, explanations=rank_by_probability(every, latest.explained)), found


def _weigh(anew: Anew, base: Refit, explanation: Explanation) -> Explanation:
    """The explanation by its evidence about its own estimate; where it acts was searched before."""
    explanation = replace(explanation, levels=anew.state.levels, fit=anew.fit)
    if explanation.candidate is None:
        levels, evidence = best_levels(linear_model(anew.problem, anew.state, anew.fit), explanation.levels)
        return replace(explanation, log_evidence=evidence, levels=levels)
    by_size = evidence_by_size(anew.problem, anew.state, base, explanation, anew.fit)
    return weigh_refit(anew.problem, anew.state, base, explanation, anew.fit, by_size)
