"""A recording of few sensors in a result: what was measured and what was assumed, and the uncertainty from it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sssi_exudyn.core.number_ref import MU_T, NumberRef
from sssi_exudyn.recording.few_sensors.complete import Completed
from sssi_exudyn.results.summary import Estimate, FrictionShares, Posture, PostureSigma, Prediction
from sssi_exudyn.validation.posture_uncertainty import SecondHalf, Shares


def posture_figures(completed: Completed, names: tuple[NumberRef, ...], shares: Shares, half: SecondHalf) -> Posture:
    """Return the ``posture`` group of a summary.

    names : (k,) the fitted numbers, in the order of the shares
    """
    sigma, lag = completed.sigma, completed.lag
    index = names.index(MU_T)
    track, posture, slope, steering = (
        float(share[index]) for share in (shares.track, shares.posture, shares.slope, shares.steering)
    )
    return Posture(
        measured=tuple(completed.measured),
        assumed=tuple(completed.assumed),
        sigma=PostureSigma(
            edge_deg=float(np.degrees(sigma.roll)),
            pitch_deg=float(np.degrees(sigma.pitch)),
            heading_deg=float(np.degrees(sigma.yaw)),
            height_m=sigma.height,
        ),
        gps_lag_s=None if lag is None else Estimate(lag.value, lag.sigma),
        unbalanced_rms_m=float(np.sqrt(np.mean(completed.unbalanced**2))),
        mu_t_se=FrictionShares(track, posture, slope, steering),
        # steering exchanges friction along the ski for friction across it, and leaves their sum
        effective_friction=Estimate(shares.effective, float(np.linalg.norm([track, posture, slope]))),
        second_half=Prediction(half.mu_t, half.speed_rms, half.usual_rms, half.split),
    )


def second_half_table(half: SecondHalf) -> pd.DataFrame:
    """Return the speed over ground, measured and predicted from the first half: one row a fix."""
    return pd.DataFrame({"time_s": half.time, "measured_mps": half.measured, "predicted_mps": half.predicted})
