"""Whether the residuals of an estimate contradict its intervals.

An interval counts the instruments' noise, whose level is sought with the estimate: up to three spreads above what such
instruments show (``noise.level_priors``).  A track that is missed by more than that is missed by what the model or the
recording has wrong: a clock, the skier, the skis.  No noise describes it, so no interval follows from it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.fitting.estimate import Estimated
from sssi_exudyn.fitting.first_fit import Fitted
from sssi_exudyn.fitting.noise import level_priors, usual_levels
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.recording.recording import Recording

_AT_BOUND: Final = 0.98
"""Share of a level's upper bound from which it counts as there: the search ends within 1 % of a bound.  Of the bundled
recordings the level is at 0.42 of it; with a clock of one instrument 3 s wrong, in all that were tried, at 1.00."""
_ASIDE: Final = 2.0 * 12.0**-0.5
"""Two standard deviations, times the root mean square distance from its mean of a path that leads aside evenly, over
that at its end.  In recordings without faults the paper's fit misses the track by 0.1 to 0.4 of that, one of few
sensors by 0.7; with a clock 3 s wrong it is 1.5 to 2.1.
"""
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
        f"this recording does not identify friction: the track is missed by {missed:.2g} m (rms). Noise of such a"
        f" receiver is {bound:.2g} m at most; {_CHECK}"
    )


def why_missed(fitted: Fitted, recording: Recording) -> str:
    """Return why a fit of friction alone gives no standard errors, in one sentence; "" where its residuals allow them.

    Such a fit (the paper's, and that of few sensors) corrects no posture.  So its track may also be missed by what skis
    do that point another way than captured or assumed, which leads a straight path aside.
    """
    if recording.gps is None:
        return ""
    inside = recording.gps.between(fitted.time[0], fitted.time[-1])
    length = float(np.sum(np.linalg.norm(np.diff(recording.gps.enu[inside, :2], axis=0), axis=1)))
    stated = float(np.median(recording.gps.sigma[inside]))
    bound = quantities(usual_levels(stated, stated, 1.0, 1.0).receiver)["size"].high * stated
    angle = recording.uncertainty.foot if recording.completed is None else recording.completed.sigma.yaw
    allowed = float(np.hypot(np.sqrt(2.0) * bound, _ASIDE * angle * length))
    missed = float(np.sqrt(np.mean(np.sum(fitted.residual**2, axis=1))))
    if missed <= allowed:
        return ""
    return (
        f"this fit does not identify friction: the track is missed by {missed:.2g} m (rms). Noise of such a"
        f" receiver and skis that point {np.degrees(angle):.2g}° wrong explain {allowed:.2g} m at most; {_CHECK}"
    )


def without_errors(fitted: Fitted) -> Fitted:
    """Return the fit with a covariance of NaN."""
    return replace(fitted, covariance=np.full_like(fitted.covariance, np.nan))


def believable_estimate(estimated: Estimated) -> Fitted:
    """Return the fit, its covariance NaN where the residuals contradict it."""
    return without_errors(estimated.fitted) if why_unidentified(estimated.posterior) else estimated.fitted


def believable_fit(fitted: Fitted, recording: Recording, judged: Fitted | None = None) -> Fitted:
    """Return a fit of friction alone, its covariance NaN where its residuals, or those of ``judged``, contradict it."""
    return without_errors(fitted) if why_missed(judged or fitted, recording) else fitted
