"""Explanations that are hard to distinguish, each linearised about its own estimate.

Far from the truth, and as if nothing were missing, posture and snow surface stand for part of what is missing; there
responses are not linear by more than what two names differ by.  So every rival of the best explanation has all that is
uncertain estimated again with it, and is weighed by the evidence about that.

A hypothesis without a law is a rival in any form, too: in the place of the best law, about the estimate with that law.
What a law does that is listed, one that is not may do as well; how much less probable the measurements are without a
law says how sure a name can be.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final, Protocol

import numpy as np

from sssi_exudyn.core.advance import silent
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.fitting.evidence import best_evidence
from sssi_exudyn.fitting.linear_fit import Refit
from sssi_exudyn.runtime.threads import side_by_side
from sssi_exudyn.validation.diagnosis.context import DiagnosisProblem
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FreeFormForce
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import evidence_by_size, weigh_refit
from sssi_exudyn.validation.diagnosis.search.explanation import (
    Explanation,
    Nothing,
    OtherForm,
    Refitted,
    Round,
    Screened,
)
from sssi_exudyn.validation.diagnosis.search.form_error import count_form_error
from sssi_exudyn.validation.diagnosis.search.free_form_force import weigh_free_form
from sssi_exudyn.validation.diagnosis.state import Reestimate, State, estimate_again, linear_model

_ESTIMATED: Final = 0.7
"""Share of the work after which rivals have their estimates, and forces of any form are weighed."""


class Estimator(Protocol):
    """Estimates all that is uncertain again with an explanation, and weighs it by the evidence about that."""

    def __call__(
        self, problem: DiagnosisProblem, state: State, latest: Round, explanation: Nothing | Refitted, *, full: bool
    ) -> tuple[Nothing | Refitted, Reestimate]: ...


def estimate_with(
    problem: DiagnosisProblem, state: State, latest: Round, explanation: Nothing | Refitted, *, full: bool
) -> tuple[Nothing | Refitted, Reestimate]:
    """Estimate all that is uncertain again with an explanation of the round, and weigh it by the evidence about that; a
    law with all that its form may be wrong by.

    Raises SimulationDiverged where it cannot be simulated.
    """
    added = "nothing added" if isinstance(explanation, Nothing) else explanation.name
    problem.progress(None, f"posture and snow surface with {added}")
    start = replace(state, levels=explanation.levels)
    about = Reestimate(*estimate_again(problem, start, explanation.fit, full=full))
    weighed = weigh_about(about, latest.base, explanation)
    return (count_form_error(latest, weighed, about) if isinstance(weighed, Refitted) else weighed), about


def estimate_rivals(
    problem: DiagnosisProblem, state: State, latest: Round, *, full: bool, estimate: Estimator = estimate_with
) -> tuple[Round, dict[str, Reestimate]]:
    """Return the round with the best explanation and its rivals estimated again, and these by their names.

    That nothing is missing is a rival like any other: its estimate goes on, too.  The best law is estimated again where
    a hypothesis without a law alone would be: two laws may explain what one does not.  What is not estimated again
    gains as much as the least of these, so that none of it overtakes them.

    Raises SimulationDiverged where the best cannot be estimated; a rival that cannot is none.
    """
    estimates: dict[str, Reestimate] = {}
    weighed: dict[str, Nothing | Refitted] = {}
    rivals = _rivals(latest)
    estimating = problem.reporting(0.0, _ESTIMATED)

    def estimated(explanation: Nothing | Refitted, part: DiagnosisProblem) -> tuple[Nothing | Refitted, Reestimate]:
        near, start = _begin_near(state, explanation, estimates)
        again, about = estimate(part, near, latest, start, full=full)
        return again, replace(about, problem=replace(about.problem, progress=problem.progress))

    def estimated_if_possible(
        rival: Nothing | Refitted, part: DiagnosisProblem
    ) -> tuple[Nothing | Refitted, Reestimate] | None:
        try:
            return estimated(rival, part)
        except SimulationDiverged:
            if rival is latest.best:
                raise
            return None

    def add(made: tuple[Nothing | Refitted, Reestimate] | None) -> None:
        if made is not None:
            weighed[made[0].name], estimates[made[0].name] = made

    first = next((i + 1 for i, rival in enumerate(rivals) if rival is not latest.nothing), len(rivals))
    for i, rival in enumerate(rivals[:first]):
        add(estimated_if_possible(rival, estimating.reporting(i / len(rivals), (i + 1) / len(rivals))))
    # all others begin at the first law's estimate, or at none; the first of them says how far they are
    parts = [estimating.reporting(first / len(rivals), 1.0), *[replace(problem, progress=silent)] * len(rivals)]
    for made in side_by_side(lambda pair: estimated_if_possible(*pair), zip(rivals[first:], parts, strict=False)):
        add(made)
    explanations = _with_estimates(latest, rivals, weighed)
    law = best_law(explanations, estimates)
    free_forms: dict[str, tuple[float, OtherForm]] = {}
    forces = [one for one in problem.hypotheses if isinstance(one, FreeFormForce) and one.name in latest.responses]
    ends = np.linspace(_ESTIMATED, 1.0, len(forces) + 1).tolist()
    for force, part in zip(forces, itertools.pairwise(ends), strict=True):
        if law is not None:
            problem.progress(part[0], f"a force of any form in the place of {law.name}")
            about = estimates[law.name]
            about = replace(about, problem=about.problem.reporting(*part))
            free_forms[force.name] = weigh_free_form(force, about, latest, law, full=full)
    following = latest.ranked(_in_free_form(explanations, free_forms))
    best = following.best
    if isinstance(best, Refitted) and not best.has_law and best.name not in estimates:
        of_best = next(explanation for explanation in latest.refitted if explanation.name == best.name)
        add(estimated(of_best, problem.reporting(1.0, 1.0)))
        following = latest.ranked(_in_free_form(_with_estimates(latest, rivals, weighed), free_forms))
    return following, estimates


def _begin_near(
    state: State, explanation: Nothing | Refitted, estimates: Mapping[str, Reestimate]
) -> tuple[State, Nothing | Refitted]:
    """Return where the estimate with a law begins: with posture, snow surface and mass as the first law's estimate has
    them.

    Estimates with laws that explain the same are near each other, and all of them ten standard deviations from the one
    as if nothing were missing.
    """
    others = [name for name in estimates if name != Nothing.name]
    known = estimates[others[0]].state.estimate if others else None
    if known is None or isinstance(explanation, Nothing):
        return state, explanation
    about = known.model
    model = replace(explanation.fit.model, posture=about.posture, surface=about.surface, skier=about.skier)
    return replace(state, estimate=known), replace(explanation, fit=replace(explanation.fit, model=model))


def _rivals(latest: Round) -> list[Nothing | Refitted]:
    """Return the best explanation and what is hard to distinguish from it."""
    best, thresholds = latest.best, latest.fitted.thresholds
    near = best.log_evidence - thresholds.rival_gain * max(best.log_evidence - latest.nothing.log_evidence, 0.0)
    hypotheses = [
        explanation
        for explanation in latest.refitted
        if explanation is best or explanation.probability >= thresholds.rival or explanation.log_evidence >= near
    ]
    hypotheses = hypotheses[: thresholds.most_rivals]
    if hypotheses and not any(explanation.has_law for explanation in hypotheses):
        hypotheses += [
            explanation
            for explanation in latest.refitted
            if explanation is not best and np.isfinite(explanation.log_evidence)
        ][:1]
    return [*hypotheses, *([latest.nothing] if latest.nothing.probability >= thresholds.rival else [])]


def _with_estimates(
    latest: Round, rivals: Sequence[Nothing | Refitted], weighed: Mapping[str, Nothing | Refitted]
) -> list[Explanation]:
    """Return the explanations of a round, each rival as it was ``weighed`` about its own estimate.

    All others gain as much as the rival that gained least.
    """
    gains = [weighed[rival.name].log_evidence - rival.log_evidence for rival in rivals if rival.name in weighed]
    gain = min((gain for gain in gains if np.isfinite(gain)), default=0.0)
    return [
        weighed[explanation.name]
        if explanation.name in weighed
        else replace(explanation, log_evidence=explanation.log_evidence + gain)
        for explanation in latest.explanations
    ]


def _in_free_form(
    explanations: Sequence[Explanation], weighed: Mapping[str, tuple[float, OtherForm]]
) -> list[Explanation]:
    """Return the explanations, where those without a law may also take the free form that was ``weighed``.

    weighed : by name, its log evidence and its numbers
    """
    both = list(explanations)
    for i, explanation in enumerate(explanations):
        if isinstance(explanation, Screened) and explanation.name in weighed:
            free_evidence, form = weighed[explanation.name]
            evidence = float(np.logaddexp(explanation.log_evidence, free_evidence))
            share = float(np.exp(free_evidence - evidence))
            both[i] = replace(explanation, log_evidence=evidence, other_form=replace(form, share=share))
    return both


def best_law(explanations: Sequence[Explanation], estimates: Mapping[str, Reestimate]) -> Refitted | None:
    """Return the most probable explanation that has a law, of those estimated again; None where none was."""
    laws = [law for law in explanations if isinstance(law, Refitted) and law.name in estimates and law.has_law]
    possible = [law for law in laws if np.isfinite(law.log_evidence)]
    return max(possible, key=lambda law: law.log_evidence, default=None)


def weigh_about(about: Reestimate, base: Refit, explanation: Nothing | Refitted) -> Nothing | Refitted:
    """Return the explanation by its evidence ``about`` its own estimate; where it acts was searched before, from
    ``base``.
    """
    explanation = replace(explanation, levels=about.state.levels, fit=about.fit)
    if isinstance(explanation, Nothing):
        levels, evidence = best_evidence(linear_model(about.problem, about.state, about.fit), explanation.levels)
        return replace(explanation, log_evidence=evidence, levels=levels)
    by_size = evidence_by_size(about.problem, about.state, base, explanation, about.fit)
    return weigh_refit(about.problem, about.state, base, explanation, about.fit, by_size)
