"""Uncertainty of a fit, as a result's figures."""

from __future__ import annotations

from typing import Final

import numpy as np

from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.fitting.misfit import why_unidentified
from sssi_exudyn.fitting.parameters import MASS, snow_beforehand
from sssi_exudyn.fitting.posterior import Posterior
from sssi_exudyn.fitting.posture_errors import PostureError
from sssi_exudyn.results.summary import Correction, Interval, Noise, UncertaintyFigures

_SHOWN: Final = 8
_FAR: Final = 3.0
"""Standard deviations beyond which a correction does not fit its prior."""
_INSTRUMENTS: Final = {"gps": "fixes", "difference": "load difference"}
"""Instruments whose noise has another name in ``summary.json``."""
_SIDES: Final = {0: "left foot's ", 1: "right foot's ", -1: ""}


def uncertainty_figures(posterior: Posterior) -> UncertaintyFigures:
    """Return intervals, budget, noise and corrections of an estimate; without intervals where a misfit denies them."""
    setting = posterior.setting
    pulls = (posterior.values - setting.means) / setting.sigmas
    corrections = [Correction(str(name), float(pull)) for name, pull in zip(setting.names, pulls, strict=True)]
    snow_numbers = snow_beforehand(posterior.model)
    corrections = [correction for correction in corrections if correction.what not in snow_numbers]
    sources = [*(_words(error, setting.motion.start, setting.motion.stop) for error in setting.errors), MASS]
    corrections += [Correction(words, float(size)) for words, size in zip(sources, posterior.sizes, strict=True)]
    corrections.sort(key=lambda correction: -abs(correction.sigmas))
    intervals, shares = {}, {}
    withheld = why_unidentified(posterior) or None
    for name in snow_numbers if withheld is None else ():
        key = name.key
        low, high = posterior.model.bounds(name)
        _, at_least, at_most = posterior.interval(name, NORMAL_90)
        intervals[key] = Interval(max(low, at_least), min(high, at_most))
        shares[key] = posterior.share(name)
    rms = {} if posterior.model.posture is None else posterior.model.posture.rms()
    usual = setting.seen.usual
    return UncertaintyFigures(
        interval_90=intervals,
        shares=shares,
        posture_rms_deg={name: float(np.degrees(value)) for name, value in rms.items()},
        largest=tuple(corrections[:_SHOWN]),
        noise={
            _INSTRUMENTS.get(name, name): Noise(
                level.sigma, level.correlation_time, level.sigma / usual.of(blocks[0]).sigma
            )
            for name, blocks in setting.seen.groups.items()
            for level in (posterior.levels.of(blocks[0]),)
        },
        fits_priors=abs(corrections[0].sigmas) <= _FAR,
        log_evidence=posterior.log_evidence,
        widened=posterior.widened,
        withheld=withheld,
    )


def _words(error: PostureError, start: float, stop: float) -> str:
    """Return ``left foot's yaw`` or the like, and the time of its largest value where it varies."""
    kind = error.kind.replace("_", " ")
    if error.support < 0:
        return f"{_SIDES[error.side]}{kind}"
    return f"{_SIDES[error.side]}{kind} about {error.middle(start, stop):.1f} s"
