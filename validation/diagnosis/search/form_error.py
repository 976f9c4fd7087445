"""What the form of a finding may be wrong by: nobody knows how exactly a gust swells or a patch begins.

A finding moves the measurements by d.  So does, nearly, a force g at the centre of mass, cell by cell in time, found by
least squares in units of the noise, with a latent force's prior (``missing_force``):

    d = R g + e,   g ~ N(0, K)

The true effect is (1 + δ) g, with δ of standard deviation ``FORM`` in every cell and direction, neighbours included, as
an effect may begin earlier or end later than was found.  A second finding has to explain what this does not.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import maximum_filter1d

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.search.missing_force import latent_covariance

FORM: Final = 0.3
"""Standard deviation of an effect's force about that of the law that is taken for it: measured ramps of gusts and edges
of patches differ by some tenths.
"""
_SIZE: Final = 180.0
"""N; of a force that does what a finding does, beforehand: a strong one, as it is known to be there."""
_CORRELATION: Final = 0.3
"""s over which it keeps its direction: short, so as to follow any form."""
_NEGLIGIBLE: Final = 0.05
"""Of the largest force: cells in which a form error is left out."""


def form_error(linear: LinearModel, levels: NoiseLevels, moved: Array, by_force: Array, edges: Array) -> Freedom:
    """What may vary beside a finding: (N, k) forces along the run in which it acts.

    moved : (N,) what the finding does to the measurements of ``linear``
    by_force : (N, 3·c) responses to a newton of a latent force in the cells between ``edges`` (c + 1,) s
    """
    prior = latent_covariance(0.5 * (edges[1:] + edges[:-1]), _SIZE, _CORRELATION)
    white = whiten_columns(linear, levels, np.column_stack([moved, by_force]))
    gram, pull = white[:, 1:].T @ white[:, 1:], white[:, 1:].T @ white[:, 0]
    force = np.linalg.solve(np.eye(len(prior)) + prior @ gram, prior @ pull)
    size = maximum_filter1d(np.abs(force.reshape(3, -1)), 3, axis=1, mode="nearest").ravel()
    kept = size > _NEGLIGIBLE * float(np.max(size, initial=0.0))
    return Freedom(np.asarray(by_force[:, kept]), FORM * size[kept])
