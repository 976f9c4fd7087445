"""A diagnosis in one sentence: its findings, and the measurement that would decide between explanations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.diagnosis_data import Adequacy, Alternative, Finding
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, distinguishing_measurement
from sssi_exudyn.validation.diagnosis.search.explanation import Round
from sssi_exudyn.validation.diagnosis.search.search_result import Figures
from sssi_exudyn.validation.diagnosis.thresholds import Thresholds

REJECTED: Final = "Turns that were not fitted are met worse with it, so the name is not sure"

UNLIKE: Final = "No simulated run with a known cause looks like this recording, so do not rely on a name"
_CERTAIN: Final = 0.99
"""Probability above which no number is said: no search is so certain."""


def sentence_of(
    findings: Sequence[Finding],
    verdict: str,
    last: Round,
    near: Adequacy,
    models: tuple[Model, Model],
    figures: Sequence[Figures],
) -> str:
    """Return the sentence that a diagnosis begins with; ``models`` and ``figures`` are those before and after."""
    first, final = figures[0], figures[-1]
    if verdict == "none":
        friction = models[0].friction
        return (
            f"Nothing is missing: the track is met to {_metres(first.trajectory_error)} m, which is what the "
            f"instruments' noise leaves. μ_t is {friction.mu_t:.3f} and μ_n {friction.mu_n:.2f}. Of effects "
            f"of these sizes half would have been noticed: {_list_smallest(last)}."
        )
    clauses = [_clause(finding, models[1], last.fitted.thresholds) for finding in findings]
    if clauses:
        if clauses[0][0].isascii():  # a coefficient's Greek letter stays small
            clauses[0] = clauses[0][0].upper() + clauses[0][1:]
        clauses = [
            " Besides, ".join(clauses),
            f"With this the track is met to {_metres(final.trajectory_error)} m instead of "
            f"{_metres(first.trajectory_error)} m (turns not fitted: "
            f"{_metres(final.held_out_error)} instead of {_metres(first.held_out_error)} m), and μ_t is "
            f"{models[1].friction.mu_t:.3f} instead of {models[0].friction.mu_t:.3f}.",
        ]
    if not near.adequate:
        clauses.append(
            f"The model does not describe this run: it misses the track by {_metres(near.missed_m)} m where the "
            f"instruments allow {_metres(near.allowed_m)} m. Do not trust what was fitted and found."
        )
    elif verdict == "not_adequate" and findings:
        clauses.append(f"{UNLIKE}.")
    elif verdict == "not_adequate":
        clauses.append(
            f"This recording cannot tell whether something is missing: the track is met to "
            f"{_metres(first.trajectory_error)} m. That nothing is missing is {last.nothing.probability:.0%} probable, "
            f"{last.best.name} {last.best.probability:.0%}."
        )
    return " ".join(clauses)


def _metres(distance: float) -> str:
    """Return metres with the digits that count: a good receiver's track is met to some millimetres."""
    return f"{distance:.3f}" if distance < 0.1 else f"{distance:.2f}"


def _list_smallest(last: Round) -> str:
    """Say from which size on the usual effects would have been noticed."""
    words = [(BY_NAME[name].smallest, smallest.value) for name, smallest in last.noticed.items()]
    return ", ".join(text.format(value=value, degrees=np.degrees(value)) for text, value in words if text)


def _clause(finding: Finding, model: Model, thresholds: Thresholds) -> str:
    where = finding.where
    when = "" if where is None else f"between {where.t0_s:.1f} s and {where.t1_s:.1f} s "
    words = when + BY_NAME[finding.name].sentence(finding.parameters, model)
    if finding.probability < thresholds.sure and finding.alternatives:
        words += f" ({percent(finding.probability)} probable; {list_alternatives(finding.name, finding.alternatives)})"
    else:
        words += f" ({percent(finding.probability)} probable)"
    return f"{words}. {REJECTED}." if finding.evidence.is_rejected_by_turns else f"{words}."


def percent(probability: float) -> str:
    """Return a percentage without a certainty that no search has."""
    return "more than 99%" if probability > _CERTAIN else f"{probability:.0%}"


def list_alternatives(name: str, others: Sequence[Alternative]) -> str:
    """Return what else it may be than the hypothesis of that name, with probabilities.

    Add the measurement that would distinguish it from the most probable other for which one is known.
    """
    listed = ", ".join(f"{other.name} ({other.probability:.0%})" for other in others)
    measurements = (distinguishing_measurement(name, other.name) for other in others)
    best = next((measurement for measurement in measurements if measurement), None)
    return f"it may also be {listed}" + (f"; {best} would distinguish them" if best else "")
