"""From which size on an effect would have been noticed in a recording, and whether its simulation is near enough."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.observations import Measurements
from sssi_exudyn.validation.diagnosis.diagnosis_data import Adequacy, Smallest
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import Candidate, Hypothesis
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds


def smallest_noticed(
    hypothesis: Hypothesis,
    candidates: Sequence[Candidate],
    information: Array,
    hypotheses: Sequence[Hypothesis],
    cell: float,
    thresholds: Thresholds = THRESHOLDS,
) -> Smallest:
    """Return the first amplitude of an effect that would be found as often as not, at the median of all its places.

    information : (c, w, w) of the candidates' amplitudes, in usual sizes (``evidence.overlaps``)
    hypotheses : all that it is compared with
    cell : s, of the run's cells of time

    An amplitude a raises the log evidence by ½ a² g, of which places searched and other amplitudes take their part.
    """
    share = (1.0 - thresholds.nothing) * hypothesis.weight / sum(other.weight for other in hypotheses)
    _, volume = np.linalg.slogdet(information + np.eye(information.shape[1]))
    odds = (1.0 - thresholds.stands_out) / thresholds.stands_out * thresholds.nothing / share
    needed = np.log(odds) / thresholds.temper + 0.5 * volume + np.log(_places(candidates, cell))
    size = float(np.median(np.sqrt(2.0 * needed / np.maximum(information[:, 0, 0], 1e-12))))
    name, first = candidates[0].amplitudes[0][0], candidates[0]
    about = first.model.about(name)
    return Smallest(name.key, size * float(first.free.scales[0]), about.unit, about.meaning)


def _places(candidates: Sequence[Candidate], cell: float) -> int:
    """Return how many places there are that differ: what begins and ends in the same cells of time (s) is one, as none
    that is just noticed could be told from another there.
    """
    windows = (candidate.window for candidate in candidates)
    places = (k if window is None else (window[0] // cell, window[1] // cell) for k, window in enumerate(windows))
    return len(set(places))


def adequacy(residual: Array, measurements: Measurements, thresholds: Thresholds = THRESHOLDS) -> Adequacy:
    """Tell whether a track that is missed by ``residual`` (N,) could be a right model's, by what the instruments state.

    Errors of a receiver last for seconds, so that a run holds but a few of them.
    """
    blocks, noise = measurements.blocks, measurements.usual.gps
    squares = [residual[blocks[name]] ** 2 * measurements.counts for name in ("x", "y")]
    missed = float(np.sqrt(np.sum(squares) / np.sum(measurements.counts)))
    lasts = float(measurements.fixes[-1] - measurements.fixes[0])
    independent = 2.0 * (1.0 + lasts / (2.0 * noise.correlation_time))
    worst = float(np.sqrt(2.0 * chi2.ppf(1.0 - thresholds.miss_by_chance, independent) / independent))
    return Adequacy(missed, thresholds.worse_than_stated * measurements.gps_sigma * worst)
