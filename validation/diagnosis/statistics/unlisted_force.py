"""A law that nobody has listed, of any shape: a latent force in the place of a law that was found.

What a listed law does, one that is not listed may do as well.  About the estimate with the law, where responses are
linear, the law is taken out and a latent force (``missing_force``) put in.  How probable the measurements are so says
how sure the law's name can be; and what friction would be then is less certain, as a force along the way does what
friction does.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.validation.diagnosis.evidence import (
    LinearModel,
    NoiseLevels,
    log_evidence,
    log_prior,
    uncertain,
    whiten_columns,
)
from sssi_exudyn.validation.diagnosis.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.statistics.missing_force import along_course, forms_of, gain_of, half_each

_NEGLIGIBLE: Final = 1e-9
"""Share of the largest variance below which a direction of the force is left out."""


def unlisted_force(
    linear: LinearModel, levels: NoiseLevels, fitted: FittedRun, responses: Array
) -> tuple[float, LinearModel]:
    """Log evidence of measurements of which some force explains what a law did, averaged over the forms of the force;
    and the linear model in which the most probable form is free, after all else.

    linear : about an estimate whose law is taken out;  responses : as in ``missing_force``
    """
    columns = along_course(fitted, responses)
    known, white = uncertain(linear, levels), whiten_columns(linear, levels, columns)
    gram, pull = white.T @ known.remove_from(white), white.T @ known.remove_from(known.residual)
    forms = forms_of(fitted.time_edges, 1)
    factors = [[gain_of(form, gram, pull)[1] for form in some] for some in forms]
    best = max(zip(chain(*factors), chain(*forms), strict=True), key=lambda pair: pair[0])[1]
    sizes, directions = np.linalg.eigh(best)
    kept = sizes > _NEGLIGIBLE * sizes[-1]
    free = linear.free.with_more(columns @ directions[:, kept], np.sqrt(sizes[kept]))
    without = log_evidence(linear, levels) + log_prior(linear.measurements, levels)
    return without + half_each(*factors), replace(linear, free=free)
