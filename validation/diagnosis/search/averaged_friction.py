"""Friction, whatever the explanation: averaged over the names by their probability.

Most names are not refitted: what friction would be with them follows from the linear model that they were compared on.
An effect too weak to be found moves friction none the less, and each that may be there widens its interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sssi_exudyn.core.mixture import Mixture
from sssi_exudyn.core.number_ref import FRICTION, NumberRef
from sssi_exudyn.fitting.linear_fit import Refit, linear_values
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.search.explanation import Explanation, Nothing, Refitted, Round, Screened, Values


def averaged_friction(
    last: Round, accepted: Sequence[tuple[Round, Refitted]], final: Refit | Posterior
) -> dict[str, Number]:
    """Return friction over all explanations, with 90 % intervals.

    It is that of the ``final`` model where everything that was ``accepted`` is right, each in its round, and nothing
    more is missing in the ``last`` one; another explanation moves it as much as it moves that of the one it is compared
    with.
    """
    every: list[tuple[Round, Nothing | Refitted]] = [*accepted, (last, last.nothing)]
    usual = _if_usual(accepted, final.model)
    others = [_other_explanations(searched, chosen) for searched, chosen in every]
    averaged: dict[str, Number] = {}
    for name in FRICTION:
        middle, _, high = final.interval(name, last.fitted.thresholds.spread)
        sigma, likely = high - middle, 1.0
        parts: list[tuple[float, float, float]] = []
        for (_, chosen), moves in zip(every, others, strict=True):
            for probability, moved in moves:
                shift, ratio = moved[name]
                parts.append((likely * probability, middle + shift, sigma * ratio))
            likely *= chosen.probability * (1.0 - chosen.share_of_other_form)
        parts += [(likely / (len(usual) + 1), middle + shift[name], sigma) for shift in [*usual, {name: 0.0}]]
        weights, means, sigmas = np.array(parts).T
        mixture = Mixture(weights / np.sum(weights), means, sigmas)
        numbers = np.array([mixture.mean, mixture.quantile(0.05), mixture.quantile(0.95)])
        value, low, high = np.clip(numbers, *final.model.bounds(name)).tolist()
        averaged[name.key] = Number(value, low, high, "1")
    return averaged


def _if_usual(accepted: Sequence[tuple[Round, Refitted]], model: Model) -> list[Mapping[NumberRef, float]]:
    """Return by how much each friction would be larger if another part of the run, or another ski, were usual."""
    return [
        {name: shift.get(name, 0.0) for name in FRICTION}
        for searched, finding in accepted
        for shift in finding.hypothesis.shifts_if_usual(searched.fitted, finding.candidate, model)
    ]


def _other_explanations(
    searched: Round, chosen: Nothing | Refitted
) -> list[tuple[float, dict[NumberRef, tuple[float, float]]]]:
    """Return for every explanation except the ``chosen`` one its probability and how it moves each friction.

    The two numbers of a friction are the difference from its ``chosen`` value and the ratio of the standard deviations.
    """
    by_fit, by_response = _fitted(chosen.fit), None
    moves = []

    def add(probability: float, its: Values, by: Values) -> None:
        moved = {name: (its[name][0] - by[name][0], its[name][1] / by[name][1]) for name in FRICTION}
        moves.append((probability, moved))

    for explanation in searched.explanations:
        if explanation.probability < searched.fitted.thresholds.negligible:
            continue
        if isinstance(explanation, Screened) and explanation.other_form is not None:
            add(explanation.probability * explanation.other_form.share, explanation.other_form.values, by_fit)
        if explanation is chosen:
            continue
        in_its_form = explanation.probability * (1.0 - explanation.share_of_other_form)
        if isinstance(explanation, Nothing | Refitted):
            add(in_its_form, _fitted(explanation.fit), by_fit)
        else:
            by_response = by_response or _linearly(searched, chosen)
            add(in_its_form, _linearly(searched, explanation), by_response)
    return moves


def _fitted(fit: Refit) -> Values:
    """Return each friction and its standard deviation by a refit."""
    return {name: (value, above - value) for name in FRICTION for value, _, above in [fit.interval(name, 1.0)]}


def _linearly(searched: Round, explanation: Explanation) -> Values:
    """Return the same by the linear model of a round, all else integrated out."""
    linear, parameters = searched.linear, searched.base.parameters
    first = linear.free.columns.shape[1] - len(parameters)
    if isinstance(explanation, Screened):
        more = explanation.candidate.free
        linear = replace(linear, free=linear.free.with_more(more.columns, more.scales))
    return linear_values(linear, explanation.levels, parameters, first)
