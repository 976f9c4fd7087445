"""How often a search finds as much in runs in which nothing is hidden.

Runs are drawn from the fitted model without anything added: all that is uncertain and the instruments' noise as known
beforehand.  In each all hypotheses are compared at all places and sizes, as in the recording, by their linear
responses: it is the best of the whole search that is compared, not one name.

Source: Davison and Hinkley 1997, ch. 4 (parametric bootstrap of a test).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import LinearModel, log_factors, overlaps, uncertain
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.diagnosis_data import Chance
from sssi_exudyn.validation.diagnosis.hypotheses.catalogue import BY_NAME
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.search.probabilities import SIZES, probabilities

RUNS: Final = 400
"""Runs that are drawn: a chance of 5 % is known to 1 %."""
CHANCE_SEED: Final = 1
"""Of the drawn runs."""


def search_by_chance(
    linear: LinearModel, levels: NoiseLevels, fitted: FittedRun, responses: dict[str, Array]
) -> Chance:
    """Of a run linearised without anything added, under its noise ``levels``; ``responses`` (N, probes) of every
    hypothesis by its name.
    """
    known = uncertain(linear, levels)
    rng = np.random.default_rng(CHANCE_SEED)
    n, k = known.columns.shape
    drawn = rng.standard_normal((n, RUNS)) + known.columns @ rng.standard_normal((k, RUNS))
    every = np.column_stack([known.residual, drawn])  # the recording first
    names, evidence = [""], [np.zeros(RUNS + 1)]
    for name, columns in responses.items():
        candidates = [candidate.free for candidate in BY_NAME[name].candidates(fitted, columns)]
        if not candidates:
            continue
        factors = log_factors(*overlaps(linear, levels, known, candidates, every), SIZES)
        names.append(name)
        evidence.append(np.logaddexp.reduce(factors, axis=(0, 1)) - np.log(len(SIZES) * len(candidates)))
    nothing = np.array([probabilities(names, column)[0] for column in np.stack(evidence, axis=1)])
    as_strong = (1 + np.count_nonzero(nothing[1:] <= nothing[0])) / (RUNS + 1)
    return Chance(RUNS, float(as_strong), float(nothing[0]), float(np.quantile(nothing[1:], 0.05)))
