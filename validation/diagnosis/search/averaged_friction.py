"""Friction, whatever the explanation: averaged over the names by their probability.

Most names are not refitted: what friction would be with them follows from the linear model that they were compared on.
An effect too weak to be found moves friction none the less, and each that may be there widens its interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.fitting.linear_fit import Refit, linear_values
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.model.model import Model
from sssi_exudyn.validation.diagnosis.diagnosis_data import Number
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.search.compare_hypotheses import Explanation, Round
from sssi_exudyn.validation.diagnosis.search.probabilities import SPREAD, Mixture

Values = Mapping[str, tuple[float, float]]
"""Numbers by their names, with their standard deviations."""
FRICTION: Final = ("friction.mu_t", "friction.mu_n")
_NEGLIGIBLE: Final = 1e-3
"""Probability below which an explanation does not move an interval of nine in ten."""


def averaged_friction(
    last: Round, accepted: Sequence[tuple[Round, Explanation]], final: Refit | Posterior
) -> dict[str, Number]:
    """Friction as the ``final`` model has it where all that was ``accepted`` is right, each in its round, and nothing
    more is missing in the ``last`` one; and as much beside that as another explanation has it beside the one that it is
    compared with.
    """
    every = [*accepted, (last, last.nothing)]
    usual = _if_usual(accepted, final.model)
    others = [_beside(searched, chosen) for searched, chosen in every]
    found: dict[str, Number] = {}
    for name in FRICTION:
        middle, _, high = final.interval(name, SPREAD)
        sigma, likely = high - middle, 1.0
        parts: list[tuple[float, float, float]] = []
        for (_, chosen), beside in zip(every, others, strict=True):
            for probability, moved in beside:
                shift, ratio = moved[name]
                parts.append((likely * probability, middle + shift, sigma * ratio))
            likely *= chosen.probability * (1.0 - _share_of_any(chosen))
        parts += [(likely / (len(usual) + 1), middle + shift[name], sigma) for shift in [*usual, {name: 0.0}]]
        weights, means, sigmas = np.array(parts).T
        mixture = Mixture(weights / np.sum(weights), means, sigmas)
        least, most = final.model.bounds(name)
        low, up = max(mixture.quantile(0.05), least), min(mixture.quantile(0.95), most)
        found[name.partition(".")[2]] = Number(mixture.mean, low, up, "1")
    return found


def _if_usual(accepted: Sequence[tuple[Round, Explanation]], model: Model) -> list[Mapping[str, float]]:
    """By how much frictions would be larger, were another part of the run, or another ski, the usual one."""
    found: list[Mapping[str, float]] = []
    for searched, each in accepted:
        assert each.candidate is not None
        shifts = BY_NAME[each.name].shifts_if_usual(searched.fitted, each.candidate, model)
        found += [{name: shift.get(name, 0.0) for name in FRICTION} for shift in shifts]
    return found


def _beside(searched: Round, chosen: Explanation) -> list[tuple[float, dict[str, tuple[float, float]]]]:
    """Of all explanations but the ``chosen`` one, the probability, and by how much more each friction is and by how
    many times less certain than by that.
    """
    assert chosen.fit is not None
    fitted, linear = _fitted(chosen.fit), None
    found = []

    def add(probability: float, its: Values, by: Values) -> None:
        moved = {name: (its[name][0] - by[name][0], its[name][1] / by[name][1]) for name in FRICTION}
        found.append((probability, moved))

    for each in searched.explanations:
        if each.probability < _NEGLIGIBLE:
            continue
        of_any = _share_of_any(each)
        if each.any_form is not None:
            add(each.probability * of_any, each.any_form.values, fitted)
        if each is chosen:
            continue
        if each.fit is not None:
            add(each.probability * (1.0 - of_any), _fitted(each.fit), fitted)
        else:
            linear = linear or _linearly(searched, chosen)
            add(each.probability * (1.0 - of_any), _linearly(searched, each), linear)
    return found


def _share_of_any(explanation: Explanation) -> float:
    return 0.0 if explanation.any_form is None else explanation.any_form.share


def _fitted(fit: Refit) -> dict[str, tuple[float, float]]:
    """Each friction and its standard deviation by a refit."""
    return {name: (value, above - value) for name in FRICTION for value, _, above in [fit.interval(name, 1.0)]}


def _linearly(searched: Round, explanation: Explanation) -> Values:
    """The same by the linear model of a round, all else integrated out."""
    linear, parameters = searched.linear, searched.base.parameters
    first = linear.free.columns.shape[1] - len(parameters)
    if explanation.candidate is not None:
        more = explanation.candidate.free
        linear = replace(linear, free=linear.free.with_more(more.columns, more.scales))
    return linear_values(linear, explanation.levels, parameters, first)
