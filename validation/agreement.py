"""Comparison of a simulated run with the measurements of the recording's instruments (paper, 2.4)."""

from __future__ import annotations

import numpy as np
import pandas as pd

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import lowpass
from sssi_exudyn.recording.instruments.gps import Gps
from sssi_exudyn.recording.instruments.insoles import Insoles
from sssi_exudyn.validation.metrics import at_times, path_length, pressure_ratio, ratio_agreement, trajectory_error


def judge_track(series: pd.DataFrame, gps: Gps | None) -> dict[str, float]:
    """Compute the ``trajectory`` figures of a summary: horizontal error at the fixes, and length of the path.

    They are empty where there is no GPS, or fewer than two fixes within the run.
    """
    if gps is None:
        return {}
    simulated = at_times(series["time_s"].to_numpy(), antenna_of(series), gps.time)
    inside = np.isfinite(simulated[:, 0])
    if np.count_nonzero(inside) < 2:
        return {}
    error = trajectory_error(simulated[inside, :2], gps.enu[inside, :2])
    length = path_length(simulated[inside])
    return {
        "mean_error_m": error.mean_error,
        "rms_error_m": error.rms_error,
        "max_error_m": error.max_error,
        "end_error_m": error.end_error,
        "percent_of_length": 100.0 * error.mean_error / length,
        "length_m": length,
    }


def judge_loads(series: pd.DataFrame, insoles: Insoles | None) -> dict[str, float]:
    """Compute the ``pressure_ratio`` figures of a summary; empty where there are no insoles.

    Insoles measure the pressure square to the sole: on an edged ski that is the snow's normal force and its sideways
    push together.  The paper compares the normal force alone; ``snow_correlation`` and ``snow_rmsd`` are that
    comparison.
    """
    if insoles is None:
        return {}
    time = series["time_s"].to_numpy()
    inside = (insoles.time >= time[0]) & (insoles.time <= time[-1])
    if np.count_nonzero(inside) < 2:
        return {}
    measured = filtered_ratio(insoles.time, insoles.left, insoles.right)[inside]
    sole, snow = (
        ratio_agreement(pressure_ratio(*at_times(time, series[names].to_numpy(), insoles.time[inside]).T), measured)
        for names in (["left_sole_N", "right_sole_N"], ["left_load_N", "right_load_N"])
    )
    return {
        "correlation": sole.correlation,
        "rmsd": sole.rmsd,
        "snow_correlation": snow.correlation,
        "snow_rmsd": snow.rmsd,
    }


CUTOFF_HZ = 6.0
"""The paper's filter of insole data (2.4)."""


def antenna_of(series: pd.DataFrame) -> Array:
    """Return the simulated antenna (n, 3), east-north-up in metres, of a result's time series."""
    return series[[f"antenna_{axis}_m" for axis in ("east", "north", "up")]].to_numpy(dtype=float)


def distances(series: pd.DataFrame, times: Array, fixes: Array) -> Array:
    """Return horizontal distances (m,) in metres of the simulated antenna to GPS fixes (m, 3) at ``times`` (m,).

    They are NaN outside the run.
    """
    simulated = at_times(series["time_s"].to_numpy(dtype=float), antenna_of(series), times)
    return np.asarray(np.linalg.norm((simulated - fixes)[:, :2], axis=1))


def filtered_ratio(time: Array, left: Array, right: Array) -> Array:
    """Return the pressure ratio (n,) of measured loads (N), both filtered first as in the paper (2.4)."""
    rate = 1.0 / float(np.median(np.diff(time)))
    if rate > 2.0 * CUTOFF_HZ:
        left, right = lowpass(left, rate, CUTOFF_HZ), lowpass(right, rate, CUTOFF_HZ)
    return pressure_ratio(left, right)
