"""How much more probable measurements make it that an explanation is physically possible.

Evidence integrates over every size of an effect, to both sides.  Of a force that can only brake, or of a wind that
stops lifts, a part of that does not exist: the evidence within what is possible is the whole, times the share of what
is possible afterwards over its share beforehand.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from scipy.linalg import cho_solve

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel, uncertain
from sssi_exudyn.fitting.linear_fit import Refit, with_parameters
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, Hypothesis

DRAWS: Final = 400
"""A share of one half is known to 0.025, its logarithm to 0.05; what is possible in none of them is impossible."""
POSSIBLE_SEED: Final = 2
"""Of the drawn numbers."""


def log_possible(
    hypothesis: Hypothesis, candidate: Candidate, fit: Refit, linear: LinearModel, levels: NoiseLevels
) -> float:
    """Return the log of the share of what is possible afterwards over that beforehand; ``linear`` is about the ``fit``
    with the candidate, whose parameters are the last of what is free.
    """
    known, count = uncertain(linear, levels), len(fit.parameters)
    first = len(linear.free.scales) - count
    at, scales = slice(first, first + count), fit.scales
    amounts = known.share(known.residual)[at]
    covariance = cho_solve(known.factor, np.eye(known.columns.shape[1])[:, at])[at]
    rng = np.random.default_rng(POSSIBLE_SEED)
    normal = rng.standard_normal((DRAWS, count))
    after = amounts + normal @ np.linalg.cholesky(covariance).T
    amplitude = np.array([bool(candidate.strengths & set(parameter.names)) for parameter in fit.parameters])
    before = np.where(amplitude, normal, amounts)
    means = np.array([parameter.prior.mean for parameter in fit.parameters])
    bounds = np.array([fit.model.bounds(parameter.names[0]) for parameter in fit.parameters])

    def possible(values: Array) -> bool:
        inside = (values >= bounds[:, 0]) & (values <= bounds[:, 1])
        kept = np.clip(values, bounds[:, 0], bounds[:, 1])
        return bool(np.all(inside[amplitude])) and hypothesis.possible(with_parameters(fit.model, fit.parameters, kept))

    return log_share(possible, means + scales * before, means + scales * after)


def log_share(possible: Callable[[Array], bool], before: Array, after: Array) -> float:
    """Return the log of the share of what is ``possible`` of numbers drawn ``after`` measuring (n, k) over that
    ``before``.
    """
    at_last = float(np.mean([possible(values) for values in after]))
    if at_last == 0.0:
        return -np.inf
    at_first = float(np.mean([possible(values) for values in before]))
    return float(np.log(at_last) - np.log(max(at_first, 1.0 / len(before))))
