"""How well a fitted model predicts the turns that it was not fitted to."""

from __future__ import annotations

import itertools

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.measurements import Measurements
from sssi_exudyn.validation.diagnosis.evidence import Whitener
from sssi_exudyn.validation.diagnosis.refit import Refit

_FOLDS = 4
"""Parts of a run that has not as many changes of edges."""


def folds_of(measurements: Measurements, edge_changes: Array) -> list[tuple[float, float]]:
    """The turns from one change of edges to the next (s), or equal parts where there are fewer than three of them."""
    begin, end = float(measurements.fixes[0]), float(measurements.fixes[-1])
    inner = edge_changes[(edge_changes > begin + 0.5) & (edge_changes < end - 0.5)]
    if len(inner) < _FOLDS - 1:
        inner = np.linspace(begin, end, _FOLDS + 1)[1:-1]
    edges = [begin, *(float(t) for t in inner), end + 1e-9]
    return list(itertools.pairwise(edges))


def held_out_error(
    fit: Refit, residual: Array, measurements: Measurements, covariance: Whitener, folds: list[tuple[float, float]]
) -> float:
    """Mean horizontal error (m) at the fixes of each fold, predicted by a fit to everything outside of it.

    The fits are single Gauss-Newton steps from the fit to all; near it they are the fits themselves.

    residual : (N,) measured less predicted by ``fit``
    covariance : of everything that is noise, by its Cholesky factor
    """
    nothing = np.zeros((len(residual), 1))
    return float(held_out_errors(fit, residual, measurements, covariance, folds, nothing)[0])


def held_out_errors(
    fit: Refit,
    residual: Array,
    measurements: Measurements,
    covariance: Whitener,
    folds: list[tuple[float, float]],
    more: Array,
) -> Array:
    """(c,) the same for each of c fits that have one number more, whose response is a column of ``more`` (N, c) and
    whose usual size is one.
    """
    whole = covariance.lower @ covariance.lower.T
    blocks = measurements.blocks
    time = np.concatenate([measurements.time_of(name) for name in blocks])
    n, k, c = len(measurements.fixes), len(fit.values), more.shape[1]
    prior = np.diag(np.concatenate([fit.scales**-2.0, [1.0]]))
    pulls = np.concatenate([fit.pulls, [0.0]])
    errors = np.full((n, c), np.nan)
    for begin, end in folds:
        outside = (time < begin) | (time >= end)
        lower = np.linalg.cholesky(whole[np.ix_(outside, outside)])
        table = np.linalg.solve(lower, np.column_stack([residual, fit.sensitivity, more])[outside])
        inside = (measurements.fixes >= begin) & (measurements.fixes < end)
        for i in range(c):
            slopes = np.column_stack([table[:, 1 : k + 1], table[:, k + 1 + i]])
            step = np.linalg.solve(slopes.T @ slopes + prior, slopes.T @ table[:, 0] - prior @ pulls)
            left = residual - fit.sensitivity @ step[:k] - step[k] * more[:, i]
            errors[inside, i] = np.hypot(left[blocks["x"]], left[blocks["y"]])[inside]
    return np.asarray(np.nanmean(errors, axis=0))


def track_error(residual: Array, measurements: Measurements) -> float:
    """Mean horizontal error (m) at the fixes."""
    return float(np.mean(np.hypot(residual[measurements.blocks["x"]], residual[measurements.blocks["y"]])))


def misfit(residual: Array, measurements: Measurements, covariance: Whitener, parameters: int) -> float:
    """χ² of the horizontal track per degree of freedom under the noise as it is."""
    track = slice(0, measurements.blocks["y"].stop)
    whole = covariance.lower @ covariance.lower.T
    lower = np.linalg.cholesky(whole[track, track])
    y = np.linalg.solve(lower, residual[track])
    return float(y @ y) / max(1, len(y) - parameters)
