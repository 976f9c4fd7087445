"""Friction, whatever the explanation: averaged over the names by their probability.

Most names are not refitted: what friction would be with them follows from the linear model that they were compared on.
An effect too weak to be found moves friction none the less, and each that may be there widens its interval.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.linalg import cho_solve

from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.validation.diagnosis.evidence import uncertain
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
    assert chosen.fit is not None
    fitted, linear = _fitted(chosen.fit), None
    found = []
    for each in searched.explanations:
        if each is chosen or each.probability < _NEGLIGIBLE:
            continue
        if each.fit is not None:
            its, by = _fitted(each.fit), fitted
        else:
            linear = linear or _linearly(searched, chosen)
            its, by = _linearly(searched, each), linear
        moved = {name: (its[name][0] - by[name][0], its[name][1] / by[name][1]) for name in FRICTION}
        found.append((each.probability, moved))
    return found


def _fitted(fit: Refit) -> dict[str, tuple[float, float]]:
    """Each friction and its standard deviation by a refit."""
    return {name: (value, above - value) for name in FRICTION for value, _, above in [fit.interval(name, 1.0)]}


def _linearly(searched: Round, explanation: Explanation) -> dict[str, tuple[float, float]]:
    """The same by the linear model of a round, all else integrated out."""
    linear, parameters = searched.linear, searched.base.parameters
    first = linear.free.columns.shape[1] - len(parameters)
    if explanation.candidate is not None:
        more = explanation.candidate.free
        linear = replace(linear, free=linear.free.with_more(more.columns, more.scales))
    known = uncertain(linear, explanation.levels)
    amounts = known.share(known.residual)
    sigmas = np.sqrt(np.diag(cho_solve(known.factor, np.eye(len(amounts)))))
    found: dict[str, tuple[float, float]] = {}
    for i, parameter in enumerate(parameters, first):
        for name in set(FRICTION) & set(parameter.names):
            scale = float(linear.free.scales[i])
            found[name] = parameter.prior.mean + scale * float(amounts[i]), scale * float(sigmas[i])
    return found
