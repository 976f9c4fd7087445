"""How well a fitted model predicts the turns that it was not fitted to."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel, uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.observations import Measurements

_FOLDS = 4
"""Parts of a run that has not as many changes of edges, the first and the last of which are not predicted."""


def folds_of(measurements: Measurements, edge_changes: Array) -> list[tuple[float, float]]:
    """Return the turns from one change of edges to the next (s), or two equal parts where there are fewer than three
    changes.

    What is before the first of them and after the last has measurements on one side only.  Its errors are those of
    extrapolation, several times as large as all others, and say nothing of a name.
    """
    begin, end = float(measurements.fixes[0]), float(measurements.fixes[-1])
    inner = edge_changes[(edge_changes > begin + 0.5) & (edge_changes < end - 0.5)]
    if len(inner) < _FOLDS - 1:
        inner = np.linspace(begin, end, _FOLDS + 1)[1:-1]
    return list(itertools.pairwise(inner.tolist()))


def held_out_errors(
    linear: LinearModel, levels: NoiseLevels, folds: list[tuple[float, float]], more: Array | None = None
) -> Array:
    """Return (fixes, c) horizontal errors (m) at the fixes of each fold, predicted from everything outside of it.

    more : (N, c) the responses of c models with one number more, whose usual size is one; without it, one model
        without such a number

    What is uncertain is estimated from outside, too: parameters, instruments, posture and snow surface.
    """
    measurements = linear.measurements
    if more is None:
        more = np.zeros((len(linear.residual), 1))
    free = linear.all_free(levels)
    columns = free.columns * free.scales
    blocks = measurements.blocks
    errors = np.full((len(measurements.fixes), more.shape[1]), np.nan)
    for begin, end in folds:
        outside = {name: ~_within(measurements.time_of(name), begin, end) for name in blocks}
        known, m = uncertain(linear, levels, outside), whiten_columns(linear, levels, more, outside)
        of_more = known.share(m)
        cleared = m - known.columns @ of_more
        amplitude = (cleared.T @ known.residual) / (np.sum(cleared * m, axis=0) + 1.0)
        of_rest = known.share(known.residual)[:, None] - of_more * amplitude
        left = linear.residual[:, None] - columns @ of_rest - more * amplitude
        inside = _within(measurements.fixes, begin, end)
        errors[inside] = np.hypot(left[blocks["x"]], left[blocks["y"]])[inside]
    return errors


def _within(time: Array, begin: float, end: float) -> NDArray[np.bool_]:
    return np.asarray((time >= begin) & (time < end))


def best_residual(linear: LinearModel, levels: NoiseLevels) -> Array:
    """Return (N,) measured less predicted, with everything that is uncertain where it is most probable."""
    free, known = linear.all_free(levels), uncertain(linear, levels)
    return np.asarray(linear.residual - (free.columns * free.scales) @ known.share(known.residual))


def track_error(residual: Array, measurements: Measurements) -> float:
    """Return the mean horizontal error (m) at the fixes."""
    return float(np.mean(np.hypot(residual[measurements.blocks["x"]], residual[measurements.blocks["y"]])))


def misfit(linear: LinearModel, levels: NoiseLevels) -> float:
    """Return χ² of the horizontal track per measurement, under noise and all that is uncertain: 1 is expected."""
    measurements = linear.measurements
    track = {name: np.full(at.stop - at.start, name in ("x", "y")) for name, at in measurements.blocks.items()}
    known = uncertain(linear, levels, track)
    return known.chi_squared / len(known.residual)
