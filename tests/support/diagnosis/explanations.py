"""Explanations and rounds of a search, as a test writes them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from sssi_exudyn.validation.diagnosis.diagnosis_data import NOTHING_MISSING
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.explanation import (
    Explanation,
    Nothing,
    Refitted,
    Round,
    Screened,
    rank_by_probability,
)
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS

NOWHERE: Any = SimpleNamespace(thresholds=THRESHOLDS)
"""In the place of a run on which nothing is computed."""


def explained(
    name: str,
    log_evidence: float = 0.0,
    *,
    probability: float = 0.0,
    fit: Any = None,
    candidate: Any = None,
    levels: Any = None,
) -> Explanation:
    """The explanation of that name, "nothing" for none; screened where it has no fit."""
    if name == NOTHING_MISSING:
        return Nothing(log_evidence, levels, fit, probability)
    screened = Screened(BY_NAME[name], candidate, log_evidence, levels, probability)
    return screened if fit is None else screened.with_fit(fit)


def refitted(name: str, log_evidence: float = 0.0, *, fit: Any, **others: Any) -> Refitted:
    """The explanation of that name, fitted."""
    explanation = explained(name, log_evidence, fit=fit, **others)
    assert isinstance(explanation, Refitted)
    return explanation


def round_of(
    *explanations: Explanation, fitted: Any = NOWHERE, linear: Any = None, base: Any = None, responses: Any = None
) -> Round:
    """A round with these explanations as they are."""
    return Round(explanations, linear, base, fitted, responses or {}, {})


def ranked(*explanations: Explanation, base: Any = None) -> Round:
    """A round in which these are as probable as their evidence makes them."""
    return round_of(*rank_by_probability(explanations, NOWHERE), base=base)
