"""Friction, whatever the explanation: averaged over the names by their probability.

Most names are not refitted: what friction would be with them follows from the linear model that they were compared on.
An effect too weak to be found moves friction none the less, and each that may be there widens its interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.validation.diagnosis.evidence import whiten_columns
from sssi_exudyn.validation.diagnosis.refit import Refit
from sssi_exudyn.validation.diagnosis.result import Number
from sssi_exudyn.validation.diagnosis.search import Explanation, Round
from sssi_exudyn.validation.diagnosis.statistics.probabilities import SPREAD, Mixture

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
            likely *= chosen.probability
        weights, means, sigmas = np.array([*parts, (likely, middle, sigma)]).T
        mixture = Mixture(weights / np.sum(weights), means, sigmas)
        least, most = final.model.bounds(name)
        low, up = max(mixture.quantile(0.05), least), min(mixture.quantile(0.95), most)
        found[name.partition(".")[2]] = Number(mixture.mean, low, up, "1")
    return found


def _beside(searched: Round, chosen: Explanation) -> list[tuple[float, dict[str, tuple[float, float]]]]:
    """Of all explanations but the ``chosen`` one, the probability, and by how much more each friction is and by how
    many times less certain than by that.
    """
    others = [each for each in searched.explanations if each is not chosen and each.probability >= _NEGLIGIBLE]
    by_fit = [each for each in others if each.fit is not None and chosen.fit is not None]
    linear = [each for each in others if each not in by_fit]
    pairs = [(each, _fitted(each.fit), _fitted(chosen.fit)) for each in by_fit if each.fit and chosen.fit]
    if linear:
        alone = _linearly(searched, chosen)
        pairs += [(each, _linearly(searched, each), alone) for each in linear]
    return [
        (each.probability, {name: (its[name][0] - by[name][0], its[name][1] / by[name][1]) for name in FRICTION})
        for each, its, by in pairs
    ]


def _fitted(fit: Refit) -> dict[str, tuple[float, float]]:
    """Each friction and its standard deviation by a refit."""
    return {name: (value, above - value) for name in FRICTION for value, _, above in [fit.interval(name, 1.0)]}


def _linearly(searched: Round, explanation: Explanation) -> dict[str, tuple[float, float]]:
    """The same by the linear model of a round, all else integrated out."""
    linear, parameters, levels = searched.linear, searched.base.parameters, explanation.levels
    free = linear.all_free(levels)
    columns: list[Array] = [linear.residual[:, None], free.columns * free.scales]
    if explanation.candidate is not None:
        columns.append(explanation.candidate.free.columns * explanation.candidate.free.scales)
    table = whiten_columns(linear, levels, np.hstack(columns))
    x = table[:, 1:]
    factor = cho_factor(x.T @ x + np.eye(x.shape[1]), lower=True)
    first = linear.free.columns.shape[1] - len(parameters)
    found: dict[str, tuple[float, float]] = {}
    for i, parameter in enumerate(parameters):
        for name in set(FRICTION) & set(parameter.names):
            unit = np.zeros(x.shape[1])
            unit[first + i] = 1.0
            row, scale = cho_solve(factor, unit), float(linear.free.scales[first + i])
            mean = parameter.prior.mean + scale * float(row @ (x.T @ table[:, 0]))
            found[name] = mean, scale * float(np.sqrt(row[first + i]))
    return found
