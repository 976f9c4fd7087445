"""From log evidence to probabilities: priors of the hypotheses, and what evidence is worth when no model is exact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

_FARTHEST: Final = 8.0
"""Standard deviations beyond which nothing of a normal distribution is looked for."""


@dataclass(frozen=True)
class Mixture:
    """A number that is known otherwise under each of k explanations: probabilities (k,), means and standard deviations
    (k,).
    """

    weights: Array
    means: Array
    sigmas: Array

    def quantile(self, share: float) -> float:
        """Return the value below which the number is with that probability."""

        def beyond(value: float) -> float:
            return float(self.weights @ norm.cdf((value - self.means) / self.sigmas)) - share

        low, high = (self.means + side * _FARTHEST * self.sigmas for side in (-1.0, 1.0))
        return float(brentq(beyond, np.min(low), np.max(high), xtol=1e-9 * float(np.max(high) - np.min(low))))

    @property
    def mean(self) -> float:
        """Averaged over the explanations."""
        return float(self.weights @ self.means)


def probabilities(
    nothing: float,
    log_evidence: Array,
    weights: Array,
    thresholds: Thresholds = THRESHOLDS,
    *,
    log_natural: Array | None = None,
) -> Array:
    """Return the posterior probabilities (1 + k,) of nothing missing and of k hypotheses.

    Parameters
    ----------
    nothing : log evidence of nothing missing
    log_evidence, weights : (k,) of the hypotheses; their weights are prior probabilities relative to each other
    log_natural : (k,) densities of each one's size were it the slope's own over that were it not: what shapes the snow
        may be the slope's own; then nothing is missing, as the surface has it

    Differences of log evidence count less than they are (``Thresholds.temper``).
    """
    prior = thresholds.nothing
    shares = np.concatenate([[prior], (1.0 - prior) * weights / np.sum(weights)])
    evidence = np.concatenate([[nothing], log_evidence])
    behind = thresholds.temper * (np.max(evidence) - evidence)
    logs = np.log(shares) - behind
    if log_natural is not None:
        own = np.log(thresholds.natural * prior) - behind[1:] + log_natural
        logs[0] = np.logaddexp.reduce([logs[0], *own])
    odds = np.exp(logs - logs.max())
    return np.asarray(odds / odds.sum())
