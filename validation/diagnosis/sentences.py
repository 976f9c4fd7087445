"""A diagnosis in words: its findings in one sentence, and the measurement that would decide between explanations."""

from __future__ import annotations

from collections.abc import Sequence

from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, distinguishing_measurement
from sssi_exudyn.validation.diagnosis.result import Alternative, Finding
from sssi_exudyn.validation.diagnosis.search_result import SURE, Figures


def sentence_of(
    verdict: str, findings: Sequence[Finding], before: Model, after: Model, first: Figures, last: Figures
) -> str:
    """The sentence that a diagnosis begins with."""
    if verdict == "none":
        return (
            f"Nothing is missing: the track is met to {first.trajectory_error:.2f} m, which is what the instruments' "
            f"noise leaves; μ_t is {before.friction.mu_t:.3f} and μ_n {before.friction.mu_n:.2f}."
        )
    clauses = [_clause(finding, after) for finding in findings]
    clauses[0] = clauses[0][0].upper() + clauses[0][1:]
    return (
        f"{' Besides, '.join(clauses)} With this the track is met to {last.trajectory_error:.2f} m instead of "
        f"{first.trajectory_error:.2f} m (turns not fitted: {last.held_out_error:.2f} instead of "
        f"{first.held_out_error:.2f} m)."
    )


def _clause(finding: Finding, model: Model) -> str:
    where = finding.where
    when = "" if where is None else f"between {where.t0_s:.1f} s and {where.t1_s:.1f} s "
    words = when + BY_NAME[finding.name].sentence(finding.parameters, model)
    if finding.probability < SURE and finding.alternatives:
        words += f" ({finding.probability:.0%} probable; {list_alternatives(finding.name, finding.alternatives)})"
    return words + "."


def list_alternatives(name: str, others: Sequence[Alternative]) -> str:
    """What else it may be than the hypothesis of that name, with probabilities, and the measurement that would decide
    between it and the most probable other for which one is known.
    """
    listed = ", ".join(f"{other.name} ({other.probability:.0%})" for other in others)
    measurements = (distinguishing_measurement(name, other.name) for other in others)
    best = next((measurement for measurement in measurements if measurement), None)
    return f"it may also be {listed}" + (f"; {best} would distinguish them" if best else "")
