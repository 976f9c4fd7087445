"""What a fit leaves uncertain, as a result's figures."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.stats import norm

from sssi_exudyn.fitting.parameters import MASS, snow_beforehand
from sssi_exudyn.fitting.posterior import Posterior, log_evidence
from sssi_exudyn.fitting.posture_errors import PostureError
from sssi_exudyn.results.summary import Correction, Interval, Noise, UncertaintyFigures

_SHOWN: Final = 8
_FAR: Final = 3.0
"""Standard deviations beyond which a correction does not fit what is known beforehand."""
_SIDES: Final = {0: "left foot's ", 1: "right foot's ", -1: ""}


def uncertainty_figures(found: Posterior) -> UncertaintyFigures:
    """Intervals, budget, noise and corrections of an estimate."""
    setting = found.setting
    pulls = (found.values - setting.means) / setting.sigmas
    every = [Correction(name, float(pull)) for name, pull in zip(setting.names, pulls, strict=True)]
    sought = snow_beforehand(found.model)
    every = [each for each in every if each.what not in sought]
    what = [*(_words(error, setting.motion.start, setting.motion.stop) for error in setting.errors), MASS]
    every += [Correction(words, float(size)) for words, size in zip(what, found.sizes, strict=True)]
    every.sort(key=lambda each: -abs(each.sigmas))
    half = norm.ppf(0.95)
    intervals, shares = {}, {}
    for name in sought:
        key = name.partition(".")[2]
        i = setting.names.index(name)
        value, spread = float(found.values[i]), float(np.sqrt(found.covariance[i, i]))
        low, high = found.model.bounds(name)
        intervals[key] = Interval(max(low, value - half * spread), min(high, value + half * spread))
        shares[key] = found.share(name)
    rms = {} if found.model.posture is None else found.model.posture.rms()
    groups = setting.seen.groups
    return UncertaintyFigures(
        interval_90=intervals,
        shares=shares,
        posture_rms_deg={name: float(np.degrees(value)) for name, value in rms.items()},
        largest=tuple(every[:_SHOWN]),
        noise={
            group: Noise(level.sigma, level.correlation_time, level.sigma / setting.seen.usual[names[0]].sigma)
            for group, names in groups.items()
            for level in (found.levels[names[0]],)
        },
        fits_priors=abs(every[0].sigmas) <= _FAR,
        log_evidence=log_evidence(found),
        widened=found.widened,
    )


def _words(error: PostureError, start: float, stop: float) -> str:
    """``left foot's yaw``, and when it is greatest where it wanders."""
    kind = error.kind.replace("_", " ")
    if error.support < 0:
        return f"{_SIDES[error.side]}{kind}"
    return f"{_SIDES[error.side]}{kind} about {error.middle(start, stop):.1f} s"
