"""A recording of few sensors in a result: what was measured and what was assumed, and the uncertainty from it."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sssi_exudyn.core.noise import NORMAL_90
from sssi_exudyn.fitting.few_sensors.few_sensors_fit import FewSensorsFit
from sssi_exudyn.recording.few_sensors.complete import Completed
from sssi_exudyn.results.summary import Estimate, FrictionShares, Interval, Posture, PostureSigma, Prediction


def posture_figures(completed: Completed, fit: FewSensorsFit) -> Posture:
    """Return the ``posture`` group of a summary."""
    sigma, lag, path, half = completed.sigma, completed.lag, fit.path, fit.half
    wide = NORMAL_90 * path.effective_sigma
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
        mu_t_se=FrictionShares(path.track, path.air, path.heights, fit.steering),
        # steering exchanges friction along the ski for friction across it, and leaves their sum
        effective_friction=Estimate(path.effective, path.effective_sigma),
        second_half=Prediction(half.mu_t, half.speed_rms, half.usual_rms, half.split),
        effective_friction_90=Interval(path.effective - wide, path.effective + wide),
        effective_friction_of_run=fit.confirmed,
        speed_return_1_s=Estimate(path.holding, path.holding_sigma),
    )


def second_half_table(fit: FewSensorsFit) -> pd.DataFrame:
    """Return one row a fix: speed over ground, measured, predicted from the first half and estimated from the whole
    run, with the height of the snow, its slope along the path, and friction.
    """
    half, path = fit.half, fit.path
    middle = 0.5 * (path.time[1:] + path.time[:-1])
    return pd.DataFrame(
        {
            "time_s": half.time,
            "measured_mps": half.measured,
            "predicted_mps": half.predicted,
            "estimated_mps": np.interp(half.time, path.time, path.speed),
            "height_m": np.interp(half.time, path.time, path.height),
            "slope_deg": np.degrees(np.arctan(-np.interp(half.time, middle, path.slope))),
            "effective_friction": np.interp(half.time, middle, path.friction),
        }
    )
