"""Distance of a simulation from measurements.  Arrays in, figures out: they serve any simulator.

The figures are the paper's (section 2.4, "Model validation").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sssi_exudyn.core.frames import Array

LOAD_FLOOR = 0.05
"""Share of the mean total load below which a pressure ratio is meaningless: both skis are almost in the air."""


@dataclass(frozen=True)
class TrajectoryError:
    """Distances between two trajectories, sample by sample (m), and the mean in percent of the path's length."""

    mean_error: float
    rms_error: float
    max_error: float
    end_error: float
    length: float
    percent_of_length: float


@dataclass(frozen=True)
class RatioAgreement:
    """Agreement of two pressure ratios: Pearson's correlation, root mean squared difference, samples compared.

    The correlation is NaN where one of them does not vary.
    """

    correlation: float
    rmsd: float
    samples: int


def at_times(time: Array, values: Array, times: Array) -> Array:
    """Interpolate ``values`` (n,) or (n, d), known at ``time`` (n,), at ``times`` (m,) by straight lines; NaN outside.

    Between samples 5 ms apart a straight line misses a path of 20 m/s² by less than 0.1 mm.
    """
    columns = values.reshape(len(time), -1)
    inside = [np.interp(times, time, column, left=np.nan, right=np.nan) for column in columns.T]
    return np.stack(inside, axis=-1).reshape(len(times), *values.shape[1:])


def path_length(path: Array) -> float:
    """Return the length (m) of a path (n, 2) or (n, 3)."""
    return float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))


def trajectory_error(simulated: Array, measured: Array) -> TrajectoryError:
    """Compare two trajectories (n, 3) or, in the horizontal plane, (n, 2), in metres at the same instants.

    The paper's percentage is the mean distance over the length of the trajectory.  Noise makes a measured path longer
    and so an error look smaller: 10 fixes a second with 1 m of white noise add 10 m a second.  The length is therefore
    that of the shorter path.  Raises ValueError for other shapes, less than two samples or values that are not finite.
    """
    if simulated.shape != measured.shape or simulated.ndim != 2 or len(simulated) < 2:
        raise ValueError(f"two trajectories of one shape are needed, not {simulated.shape} and {measured.shape}")
    if not (np.all(np.isfinite(simulated)) and np.all(np.isfinite(measured))):
        raise ValueError("a trajectory holds a value that is not finite")
    distance = np.linalg.norm(simulated - measured, axis=1)
    length = min(path_length(simulated), path_length(measured))
    mean = float(np.mean(distance))
    return TrajectoryError(
        mean_error=mean,
        rms_error=float(np.sqrt(np.mean(distance**2))),
        max_error=float(np.max(distance)),
        end_error=float(distance[-1]),
        length=length,
        percent_of_length=100.0 * mean / length if length > 0.0 else float("nan"),
    )


def pressure_ratio(left: Array, right: Array) -> Array:
    """Return left over total load (n,), in [0, 1]; NaN where the total is below ``LOAD_FLOOR`` of its mean.

    Parameters
    ----------
    left, right : (n,) N; values that a filter leaves below zero count as zero
    """
    left, right = np.maximum(left, 0.0), np.maximum(right, 0.0)
    total = left + right
    loaded = total > LOAD_FLOOR * np.nanmean(total)
    return np.divide(left, total, out=np.full_like(total, np.nan), where=loaded)


def ratio_agreement(simulated: Array, measured: Array) -> RatioAgreement:
    """Compare two pressure ratios (n,) at the same instants, over those where both are known.

    Raises ValueError where fewer than two are.
    """
    both = np.isfinite(simulated) & np.isfinite(measured)
    if np.count_nonzero(both) < 2:
        raise ValueError("fewer than two instants at which both pressure ratios are known")
    a, b = simulated[both], measured[both]
    varies = np.ptp(a) > 0.0 and np.ptp(b) > 0.0
    return RatioAgreement(
        correlation=float(np.corrcoef(a, b)[0, 1]) if varies else float("nan"),
        rmsd=float(np.sqrt(np.mean((a - b) ** 2))),
        samples=int(np.count_nonzero(both)),
    )
