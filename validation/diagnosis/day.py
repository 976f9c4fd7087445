"""Several runs of one day compared together: the same snow, the same air, each its own path.

What one run cannot distinguish, several may: friction and drag take the same speed from one run, but not from a slow
and a fast one.  Friction along and across the ski is one number for all runs, and so is the strength of whatever acts
everywhere; starts, headings, mountings and the capture's errors are each run's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve

from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.model.faults import Sensor
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.evidence import Freedom, LinearModel, NoiseLevels, log_volume, whiten_columns
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import STEADY_LAWS
from sssi_exudyn.validation.diagnosis.hypothesis import FittedRun, add_part, responses_of
from sssi_exudyn.validation.diagnosis.result import NOTHING_MISSING, Number
from sssi_exudyn.validation.diagnosis.search_result import SeparateFit
from sssi_exudyn.validation.diagnosis.statistics.probabilities import INTERVAL_90, SIZES, probabilities

SHARED: Final = ("friction.mu_t", "friction.mu_n")


@dataclass(frozen=True)
class DayRun:
    """What is needed of one run.

    linear : about its fit without anything that all share;  levels : its noise
    shared : columns of the linear model's freedom that are the day's numbers, in the order of ``SHARED``
    """

    linear: LinearModel
    levels: NoiseLevels
    shared: tuple[int, ...]


@dataclass(frozen=True)
class DayExplanation:
    """An explanation of the whole day, or that nothing is missing, and its numbers, those of friction first."""

    name: str
    probability: float
    log_evidence: float
    numbers: dict[str, Number]


def joint_evidence(runs: Sequence[DayRun], extra: Sequence[Freedom] | None = None) -> tuple[float, Array, Array]:
    """Log evidence of all runs, with what ``extra`` (one a run, of the same scales) adds in common; and the most
    probable shared numbers with their standard deviations: those of ``SHARED``, then the extra ones.
    """
    rows, shared, own, volume = [], [], [], 0.0
    for i, run in enumerate(runs):
        linear = run.linear
        free = linear.all_free(run.levels)
        columns = free.columns * free.scales
        common = columns[:, list(run.shared)]
        if extra is not None:
            common = np.hstack([common, extra[i].columns * extra[i].scales])
        apart = np.delete(columns, list(run.shared), axis=1)
        table = whiten_columns(linear, run.levels, np.column_stack([linear.residual, common, apart]))
        rows.append(table[:, 0])
        shared.append(table[:, 1 : 1 + common.shape[1]])
        own.append(table[:, 1 + common.shape[1] :])
        volume += log_volume(linear, run.levels)
    y, x = np.concatenate(rows), np.hstack([np.vstack(shared), block_diag(*own)])
    factor = cho_factor(x.T @ x + np.eye(x.shape[1]), lower=True)
    along = x.T @ y
    found = cho_solve(factor, along)
    evidence = -0.5 * float(y @ y - along @ found) - float(np.sum(np.log(np.diag(factor[0])))) - volume
    count = shared[0].shape[1]
    first = runs[0].linear.free.scales[list(runs[0].shared)]
    scales = first if extra is None else np.concatenate([first, extra[0].scales])
    inverse = cho_solve(factor, np.eye(x.shape[1])[:, :count])
    return evidence, scales * found[:count], scales * np.sqrt(np.diag(inverse[:count]))


def day_run(own: SeparateFit) -> DayRun:
    """What the day needs of a run."""
    names = [p.names[0] for p in own.fit.parameters]
    mounting = own.linear.free.columns.shape[1] - len(names)  # those of the instruments' mounting come first
    return DayRun(own.linear, own.levels, tuple(mounting + names.index(name) for name in SHARED))


def _responses(fitted: FittedRun, parts: Sequence[Term | Sensor]) -> list[Array]:
    """(N, amplitudes) of the laws ``parts`` of all ``STEADY_LAWS``, in one pass over the run."""
    probes = [hypothesis.probes_of(fitted.model, part) for hypothesis, part in zip(STEADY_LAWS, parts, strict=True)]
    columns = responses_of([p for some in probes for p in some], fitted.prepared, fitted.measurements)
    return np.split(columns, np.cumsum([len(some) for some in probes])[:-1], axis=1)


def compare_for_day(runs_alone: Sequence[SeparateFit]) -> list[DayExplanation]:
    """Everything that can act on all runs alike, and nothing, the most probable first.

    What was found in one run alone, a gust or a late clock, stays with it.
    """
    runs = [day_run(each) for each in runs_alone]
    first = runs_alone[0]
    known = {p.names[0]: p.prior.mean for p in first.fit.parameters if p.names[0] in SHARED}

    def numbers(model: Model, names: Sequence[str], values: Array, errors: Array) -> dict[str, Number]:
        found = [known.get(name, 0.0) + float(value) for name, value in zip(names, values, strict=True)]
        half = [INTERVAL_90 * float(error) for error in errors]
        return {
            name: Number(value, value - h, value + h, model.about(name).unit)
            for name, value, h in zip(names, found, half, strict=True)
        }

    evidence, values, errors = joint_evidence(runs)
    found = [("", evidence, numbers(first.fit.model, SHARED, values, errors))]
    # one law for all: the speed, edge or load that it refers to is the same
    parts = [hypothesis.part(first.fitted) for hypothesis in STEADY_LAWS]
    by_run = [_responses(each.fitted, parts) for each in runs_alone]
    for hypothesis, part, responses in zip(STEADY_LAWS, parts, zip(*by_run, strict=True), strict=True):
        usual = hypothesis.scales
        by_size = [joint_evidence(runs, [Freedom(r, size * usual) for r in responses]) for size in SIZES]
        total = float(np.logaddexp.reduce([each[0] for each in by_size]) - np.log(len(SIZES)))
        _, values, errors = max(by_size, key=lambda each: each[0])
        names = (*SHARED, *(f"{hypothesis.name}.{key}" for key, _ in hypothesis.amplitudes))
        found.append((hypothesis.name, total, numbers(add_part(first.fit.model, part), names, values, errors)))
    odds = probabilities([name for name, _, _ in found], np.array([total for _, total, _ in found]))
    explanations = [
        DayExplanation(name or NOTHING_MISSING, float(probability), evidence, fitted)
        for probability, (name, evidence, fitted) in zip(odds, found, strict=True)
    ]
    return sorted(explanations, key=lambda each: -each.probability)
