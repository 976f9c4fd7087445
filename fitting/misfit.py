"""Whether the residuals of an estimate contradict its intervals.

An interval counts the instruments' noise, whose level is sought with the estimate: up to three spreads above what such
instruments show (``noise.level_priors``).  A track that is missed by more than that is missed by what the model or the
recording has wrong: a clock, the skier, the skis.  No noise describes it, so no interval follows from it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.fitting.estimate import Estimated
from sssi_exudyn.fitting.first_fit import Fitted
from sssi_exudyn.fitting.noise import level_priors
from sssi_exudyn.fitting.posterior import Posterior

_AT_BOUND: Final = 0.98
"""Share of a level's upper bound from which it counts as there: the search ends within 1 % of a bound.  Of the bundled
recordings the level is at 0.42 of it; with a clock of one instrument 3 s wrong, in all that were tried, at 1.00."""
_CHECK: Final = "check time_offset_s of every instrument, sigma_m of the receiver, and skier and equipment"


def why_unidentified(posterior: Posterior) -> str:
    """Return why an estimate's intervals mean nothing, in one sentence; "" where its residuals allow them."""
    seen = posterior.setting.seen
    bound = level_priors(seen.usual)["gps.sigma"].high
    if posterior.levels.gps.sigma < _AT_BOUND * bound:
        return ""
    x, y = (posterior.residual[seen.blocks[name]] for name in ("x", "y"))
    missed = float(np.sqrt(np.mean(x**2 + y**2)))
    return (
        f"this recording does not identify friction: the track is missed by {missed:.2g} m (rms), and noise of such a"
        f" receiver is {bound:.2g} m at most; {_CHECK}"
    )


def believable_fit(estimated: Estimated) -> Fitted:
    """Return the fit, its covariance NaN where the residuals contradict it."""
    fitted = estimated.fitted
    if not why_unidentified(estimated.posterior):
        return fitted
    return replace(fitted, covariance=np.full_like(fitted.covariance, np.nan))
