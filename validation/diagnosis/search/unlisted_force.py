"""A law that nobody has listed, of any shape: a latent force in the place of a law that was found.

What a listed law does, one that is not listed may do as well.  About the estimate with the law, where responses are
linear, the law is taken out and a latent force (``missing_force``) put in.  How probable the measurements are so says
how sure the law's name can be; and what friction would be then is less certain, as a force along the way does what
friction does.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.evidence import Freedom, LinearModel, log_posterior, uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.search.missing_force import (
    DIRECTIONS,
    along_course,
    course_of,
    forms_of,
    gain_of,
    half_each,
)

_NEGLIGIBLE: Final = 1e-9
"""Share of the largest variance below which a direction of the force is left out."""


@dataclass(frozen=True)
class ForceOfAnyForm:
    """What measurements know of a force of any form.

    log_evidence : averaged over the forms
    force : (3, c) N down the fall line, to the left and away from the snow in cells of time, of the most probable form
    free : the most probable form before the data speak, its directions with their standard deviations
    """

    log_evidence: float
    force: Array
    free: Freedom


def unlisted_force(linear: LinearModel, levels: NoiseLevels, fitted: FittedRun, responses: Array) -> ForceOfAnyForm:
    """Of measurements of which some force explains what a law did.

    linear : about an estimate, its residual as if no such force acted;  responses : as in ``missing_force``
    """
    columns = along_course(fitted, responses)
    known, white = uncertain(linear, levels), whiten_columns(linear, levels, columns)
    gram, pull = white.T @ known.remove_from(white), white.T @ known.remove_from(known.residual)
    forms = forms_of(fitted.time_edges, 1)
    found = [[gain_of(form, gram, pull) for form in some] for some in forms]
    (gain, _), best = max(zip(chain(*found), chain(*forms), strict=True), key=lambda pair: pair[0][1])
    along, across, normal = (gain @ pull).reshape(len(DIRECTIONS), -1)
    cosine, sine = course_of(fitted)
    sizes, directions = np.linalg.eigh(best)
    kept = sizes > _NEGLIGIBLE * sizes[-1]
    without = log_posterior(linear, levels)
    return ForceOfAnyForm(
        log_evidence=without + half_each(*([factor for _, factor in some] for some in found)),
        force=np.stack([along * cosine - across * sine, along * sine + across * cosine, normal]),
        free=Freedom(columns @ directions[:, kept], np.sqrt(sizes[kept])),
    )
