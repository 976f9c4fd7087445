"""How often a search finds as much in runs in which nothing is hidden.

Runs are drawn from the fitted model without anything added: all that is uncertain as known beforehand, and noise whose
levels are known from the recording alone.  In each all hypotheses are compared at all places and sizes, as in the
recording, by their linear responses: it is the best of the whole search that is compared, not one name.

Source: Davison and Hinkley 1997, ch. 4 (parametric bootstrap of a test).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel, log_factors, overlaps, uncertain
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.diagnosis_data import Chance
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun, Hypothesis
from sssi_exudyn.validation.diagnosis.search.drawn_noise import draw_instrument_noise
from sssi_exudyn.validation.diagnosis.search.probabilities import probabilities

RUNS: Final = 400
"""Runs that are drawn: a chance of 5 % is known to 1 %."""
CHANCE_SEED: Final = 1
"""Of the drawn runs."""


def search_by_chance(
    linear: LinearModel,
    levels: NoiseLevels,
    fitted: FittedRun,
    hypotheses: Sequence[Hypothesis],
    responses: Mapping[str, Array],
) -> Chance:
    """Return how often a search of ``hypotheses`` finds as much in runs without anything added.

    The run is linearised under its noise ``levels``; ``responses`` (N, probes) are those of every hypothesis by its
    name.
    """
    known, sizes = uncertain(linear, levels), fitted.thresholds.sizes
    rng = np.random.default_rng(CHANCE_SEED)
    drawn = known.columns @ rng.standard_normal((known.columns.shape[1], RUNS))
    drawn += draw_instrument_noise(linear, levels, RUNS, rng)
    every = np.column_stack([known.residual, drawn])  # the recording first
    weights, evidence = [], []
    for hypothesis in hypotheses:
        candidates = [candidate.free for candidate in hypothesis.candidates(fitted, responses[hypothesis.name])]
        if not candidates:
            continue
        factors = log_factors(*overlaps(linear, levels, known, candidates, every), sizes)
        weights.append(hypothesis.weight)
        evidence.append(np.logaddexp.reduce(factors, axis=(0, 1)) - np.log(len(sizes) * len(candidates)))
    prior = np.array(weights)
    nothing = np.array(
        [probabilities(0.0, column, prior, fitted.thresholds)[0] for column in np.stack(evidence, axis=1)]
    )
    as_strong = (1 + np.count_nonzero(nothing[1:] <= nothing[0])) / (RUNS + 1)
    return Chance(RUNS, float(as_strong), float(nothing[0]), float(np.quantile(nothing[1:], 0.05)))
