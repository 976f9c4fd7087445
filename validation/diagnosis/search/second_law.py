"""Two laws in the place of a force without one."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from sssi_exudyn.validation.diagnosis.search.explanation import Nothing, Refitted, Round

_LEAST: Final = 1e-12
"""Probability below which nothing is as good as impossible."""


def count_second_law(latest: Round, law: Refitted, following: Round) -> Round | None:
    """Return the round in which its best law is as probable as it is alone or with a second one; None where two laws
    together explain less than a force without a law.

    law : the best law of ``latest``, whose best explanation is a force without one
    following : the round about the estimate with that law

    That there is a second is as probable beforehand as that there is a first; each counts by its own probability.
    """
    second, nothing = following.best, following.nothing
    both = law.log_evidence + second.log_evidence - nothing.log_evidence
    if not second.has_law or both <= latest.best.log_evidence:
        return None
    by_laws = sum(
        explanation.probability
        for explanation in following.explanations
        if isinstance(explanation, Nothing) or explanation.has_law
    )
    prior = latest.fitted.thresholds.nothing
    more = max(prior * by_laws / max(nothing.probability, _LEAST), 1.0)
    shares = [explanation.probability * (more if explanation is law else 1.0) for explanation in latest.explanations]
    weighed = [
        replace(explanation, probability=share / sum(shares))
        for explanation, share in zip(latest.explanations, shares, strict=True)
    ]
    return replace(latest, explanations=tuple(sorted(weighed, key=lambda explanation: -explanation.probability)))
