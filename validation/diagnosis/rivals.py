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
from sssi_exudyn.fitting.snow_surface import snow_heights
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.problem import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.search import (
    Explanation,
    Round,
    evidence_by_size,
    rank_by_probability,
    weigh_refit,
)
from sssi_exudyn.validation.diagnosis.state import State, estimate_again

_RIVAL: Final = 0.03
"""Probability from which on an explanation is a rival of the best one."""
_MOST: Final = 4
"""Explanations that are estimated anew at most: each takes as long as the estimate before the search."""
_PASSES: Final = 3
"""Estimates of one explanation at most, each on the snow surface that the heights show below the posture as it is."""
_MOVED: Final = 0.05
"""Of a height's standard deviation: the surface is another one where the posture has moved it by more, up and down
along the way.  From one estimate of a model to the next it is 1 mm.  On a hill with a hidden patch of snow, what the
posture had done in its place moved the surface: a second estimate changed mu_t by 0.01 and the evidence by 8 to 26.
"""


@dataclass(frozen=True)
class Anew:
    """An explanation estimated anew: the problem and the state about it, and its fit there."""

    problem: DiagnosisProblem
    state: State
    fit: Refit


def estimate_rivals(
    problem: DiagnosisProblem, state: State, latest: Round, *, full: bool
) -> tuple[Round, dict[str, Anew]]:
    """The round with the best explanation and its rivals estimated anew, and these by their names.

    What is not estimated anew gains as much as the least of these, so that none of it overtakes them.  Raises
    SimulationDiverged where the best cannot be estimated; a rival that cannot is none.
    """
    best = latest.best
    rivals = [each for each in latest.explanations if each.name and each.fit is not None]
    rivals = [each for each in rivals if each is best or each.probability >= _RIVAL][:_MOST]
    found: dict[str, Anew] = {}
    weighed: dict[str, Explanation] = {}
    for each in rivals:
        assert each.fit is not None
        problem.progress(None, f"posture and snow surface with {each.name}")
        try:
            anew = _estimate(Anew(problem, replace(state, levels=each.levels), each.fit), full=full)
            weighed[each.name] = _weigh(anew, latest.base, each)
            found[each.name] = anew
        except SimulationDiverged:
            if each is best:
                raise
    gain = min(weighed[each.name].log_evidence - each.log_evidence for each in rivals if each.name in found)
    every = [
        weighed.get(each.name) or replace(each, log_evidence=each.log_evidence + gain) for each in latest.explanations
    ]
    return replace(latest, explanations=rank_by_probability(every, latest.explained)), found


def _estimate(start: Anew, *, full: bool) -> Anew:
    """All that is uncertain estimated anew, until the snow surface stays as it is."""
    anew = start
    for _ in range(_PASSES):
        before = anew.fit.model
        anew = Anew(*estimate_again(anew.problem, anew.state, anew.fit, full=full))
        if _surface_moved(anew.problem, before, anew.fit.model) < _MOVED:
            break
    return anew


def _surface_moved(problem: DiagnosisProblem, before: Model, after: Model) -> float:
    """Standard deviations by which the heights that show the snow surface differ along the way, root mean square."""
    gps = problem.recording.gps
    if gps is None or problem.ground is None:
        return 0.0
    old, new = (snow_heights(gps, problem.motion, replace(each, surface=None)) for each in (before, after))
    return float(np.std(new.height - old.height) / np.median(new.sigma))


def _weigh(anew: Anew, base: Refit, explanation: Explanation) -> Explanation:
    """The explanation by its evidence about its own estimate; where it acts was searched before."""
    explanation = replace(explanation, levels=anew.state.levels)
    by_size = evidence_by_size(anew.problem, anew.state, base, explanation, anew.fit)
    return weigh_refit(anew.problem, anew.state, base, explanation, anew.fit, by_size)
