"""From log evidence to probabilities: priors of the hypotheses, and what evidence is worth when no model is exact."""

from __future__ import annotations

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds


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
        shapes = np.count_nonzero(np.isfinite(log_natural))
        if shapes:  # that nothing is missing has its prior probability with and without a roll of the slope's own
            own = np.log(thresholds.natural * prior / shapes) - behind[1:] + log_natural
            logs[0] = np.logaddexp.reduce([logs[0] + np.log1p(-thresholds.natural), *own])
    odds = np.exp(logs - logs.max())
    return np.asarray(odds / odds.sum())
