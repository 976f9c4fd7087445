"""A diagnosis as one paragraph for a coach: what was looked for, what was found, when and how large, how sure it is,
what was not ruled out, and what to do next.

Sizes are in each hypothesis' ``plain_words``; nothing here knows one of them by its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.diagnosis_data import (
    NOTHING_MISSING,
    Adequacy,
    Finding,
    Next,
    Outcome,
    Smallest,
    Where,
)
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME, distinguishing_measurement
from sssi_exudyn.validation.diagnosis.search.explanation import Round
from sssi_exudyn.validation.diagnosis.search.search_result import Figures
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds
from sssi_exudyn.validation.diagnosis.wording.sentence import REJECTED, UNLIKE, percent

_KMH: Final = 3.6
"""km/h of 1 m/s."""


def paragraph_of(
    findings: Sequence[Finding],
    verdict: Outcome,
    last: Round,
    near: Adequacy,
    model: Model,
    figures: Sequence[Figures],
    following: Sequence[Next],
) -> str:
    """Return the paragraph; ``last`` is the last round of the search, ``model`` the one with all findings, ``figures``
    those before and after, ``following`` what to measure next.
    """
    causes, thresholds = len(last.hypotheses), last.fitted.thresholds
    sentences = [
        f"The run was simulated and compared with the recording. {causes} possible causes of a difference were tried, "
        "from snow, slope and wind to the skier's own pushes and faults of the instruments"
    ]
    if not near.adequate:
        sentences.append(
            f"The simulation misses the recorded path by {near.missed_m:.2f} m where the instruments allow "
            f"{near.allowed_m:.2f} m, so it does not describe this run. Do not trust what was found or fitted, not "
            "even friction; no cause is ruled out"
        )
    if findings:
        sentences += [text for finding in findings for text in _of_finding(finding, model, thresholds)]
        sentences += _gain(figures)
        if near.adequate and verdict == "not_adequate":
            sentences.append(UNLIKE)
    elif near.adequate:
        sentences += _without_finding(verdict, last, figures[0])
    if near.adequate:
        names = {finding.name for finding in findings}
        sentences += _too_small({name: smallest for name, smallest in last.noticed.items() if name not in names})
    sentences.append(f"Next: {what_next(findings, verdict, following, thresholds, adequate=near.adequate)}")
    return ". ".join(sentences) + "."


def _of_finding(finding: Finding, model: Model, thresholds: Thresholds) -> list[str]:
    """Say what a finding is, when it acts, how large and how sure it is, and what it may be instead."""
    words = BY_NAME[finding.name].plain_words(finding.parameters, model)
    certain = f"this is {percent(finding.probability)} probable"
    if finding.probability < thresholds.sure:
        certain += ", which is not enough to rely on"
    others = [f"{_cause(other.name)} ({percent(other.probability)})" for other in finding.alternatives]
    ruled_out = (
        f"not ruled out: {', '.join(others)}"
        if others
        else f"no other cause is as probable as {thresholds.worth_naming:.0%}"
    )
    rejected = [REJECTED] if finding.evidence.is_rejected_by_turns else []
    return [f"{_when(finding.where)} {words}", f"{certain[0].upper()}{certain[1:]}; {ruled_out}", *rejected]


def _when(where: Where | None) -> str:
    if where is None:
        return "All along the run"
    time = f"from {where.t0_s:.1f} s to {where.t1_s:.1f} s"
    way = f"{where.distance_m[0]:.0f} m to {where.distance_m[1]:.0f} m along the path"
    if not where.turns:
        return f"{time[0].upper()}{time[1:]} ({way})"
    first, last = where.turns[0], where.turns[-1]
    turns = f"turn {first}" if first == last else f"turns {first} {'and' if last == first + 1 else 'to'} {last}"
    return f"In {turns} ({time}, {way})"


def _gain(figures: Sequence[Figures]) -> list[str]:
    """Say what a model with all findings does on turns that it was not fitted to."""
    before, after = figures[0].held_out_error, figures[-1].held_out_error
    if f"{after:.2f}" == f"{before:.2f}":
        return [f"Turns that were left out of the fit are predicted to {after:.2f} m with and without it"]
    means = "that speaks for it" if after < before else "that speaks against it"
    return [
        f"Turns that were left out of the fit are then predicted to {after:.2f} m instead of {before:.2f} m: {means}"
    ]


def _without_finding(verdict: Outcome, last: Round, figures: Figures) -> list[str]:
    nothing, best = last.nothing.probability, last.best
    met = f"the simulated path is {figures.trajectory_error:.2f} m from the recorded one"
    if verdict == "none":
        return [
            f"Nothing was found: {met}, which the instruments' noise explains",
            f"That nothing is missing is {percent(nothing)} probable; not ruled out: {_cause(best.name)} "
            f"({percent(best.probability)})",
        ]
    return [
        f"This recording cannot tell whether something is missing: {met}. That nothing is missing is "
        f"{percent(nothing)} probable",
        f"Not ruled out: {_cause(best.name)} ({percent(best.probability)}) and others",
    ]


def _too_small(noticed: dict[str, Smallest]) -> list[str]:
    """Say from which size on the usual effects would have been noticed."""
    listed = []
    for name, smallest in noticed.items():
        text = BY_NAME[name].plain_smallest or BY_NAME[name].smallest
        if text:
            listed.append(
                text.format(value=smallest.value, degrees=np.degrees(smallest.value), kmh=_KMH * smallest.value)
            )
    words = "Of effects of these sizes half would have been noticed, of smaller ones fewer"
    return [f"{words}: {', '.join(listed)}"] if listed else []


def what_next(
    findings: Sequence[Finding],
    verdict: Outcome,
    following: Sequence[Next],
    thresholds: Thresholds = THRESHOLDS,
    *,
    adequate: bool = True,
) -> str:
    """Return what to do after a diagnosis by a model that describes the run, or not."""
    if not adequate:
        return (
            "check what the recording states of slope, equipment and the sensors' places, or record the run "
            "again with a better receiver"
        )
    if following:
        best = following[0]
        return (
            f"{best.measurement}. With a probability of {percent(best.probability)} it leaves only one of "
            f"{_cause(best.distinguishes[0])} and {_cause(best.distinguishes[1])}"
        )
    if verdict == "none":
        return "nothing needs to be measured again for this"
    if not findings:
        return "ski the slope again, faster or slower, or with a better receiver"
    unsure = (finding for finding in findings if finding.probability < thresholds.sure)
    known = (
        distinguishing_measurement(finding.name, other.name) for finding in unsure for other in finding.alternatives
    )
    measurement = next((measurement for measurement in known if measurement), None)
    if measurement is not None:
        return f"{measurement}"
    least = min(findings, key=lambda finding: finding.probability)
    if least.kind == "sensor":
        return "correct the instrument before the next run; the figures of this run take its fault into account"
    comes_again = least.name not in BY_NAME or BY_NAME[least.name].comes_again
    there = "be there again" if comes_again else "be gone"
    return f"ski the slope once more; {_cause(least.name)} would {there}"


def _cause(name: str) -> str:
    """Return a cause as a reader knows it; one of a plug-in that is not loaded has its name alone."""
    if name == NOTHING_MISSING:
        return "that nothing is missing"
    return BY_NAME[name].caption if name in BY_NAME else name.replace("_", " ")
