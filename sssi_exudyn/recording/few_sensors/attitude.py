"""The rotation of a sensor, from its rates and specific force, and its mounting on its segment.

The filter is VQF (Laidig and Seel, Information Fusion 91 (2023) 187), in its offline form, which also estimates the
gyroscope's bias.  A skier's specific force is not gravity: in a turn it leans with the skier.  So the acceleration
that the track shows is taken off first.  Heading comes from integrated rates and drifts; the course corrects its slow
part (``align_sensor``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation
from vqf import offlineVQF

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.rotations import nearest_rotation
from sssi_exudyn.recording.instruments.imu import Imu

DRIFT_SPACING: Final = 15.0
"""Time between the knots of a heading's drift, s: several turns, so that a turn's own effect is kept."""
_STIFFNESS: Final = 7.0
"""Weight of the drift's bending: skis are 10° from the course for a second, and a heading's drift changes by 1.5° more
from knot to knot, 0.1 °/s.
"""
_ROUNDS: Final = 50
_SPARSE: Final = 100_000
"""Number of entries of a matrix of splines from which sparse products are faster."""
_ENOUGH: Final = 0.1
"""Time between the samples from which mountings are estimated, s."""


@dataclass(frozen=True)
class Attitude:
    """The rotation of a sensor over time.

    time : (n,) s;  rotation : (n, 3, 3) sensor → a world with z up whose heading drifts
    yaw_rate : (n,) rad/s about up, left positive, without bias
    bias : (3,) rad/s of the gyroscope, mean over the run;  bias_sigma : rad/s; both are zero where the device gave its
        own orientation
    """

    time: Array
    rotation: Array
    yaw_rate: Array
    bias: Array
    bias_sigma: float


def attitude_of(imu: Imu, acceleration: Array | None = None) -> Attitude:
    """Fuse a sensor's channels; the device's own orientation is preferred to the filter's.

    Parameters
    ----------
    acceleration : (n, 3) m/s² of the sensor in its own axes, where another source gives it; it is subtracted from the
        specific force, so that gravity is left
    """
    if imu.orientation is not None:
        rotation = Rotation.from_quat(imu.orientation, scalar_first=True).as_matrix()
        return Attitude(imu.time, rotation, _rate_about_up(rotation, imu.rate), np.zeros(3), 0.0)
    assert imu.force is not None  # its reader asks for one of both
    force = imu.force if acceleration is None else imu.force - acceleration
    filtered = offlineVQF(np.ascontiguousarray(imu.rate), np.ascontiguousarray(force), None, imu.step)
    rotation = Rotation.from_quat(filtered["quat6D"], scalar_first=True).as_matrix()
    return Attitude(
        imu.time,
        rotation,
        _rate_about_up(rotation, imu.rate - filtered["bias"]),
        np.asarray(np.mean(filtered["bias"], axis=0)),
        float(np.median(filtered["biasSigma"])),
    )


def _rate_about_up(rotation: Array, rate: Array) -> Array:
    return np.asarray(np.einsum("nj,nj->n", rotation[:, 2, :], rate))


def slow_curve(time: Array, values: Array, weights: Array, spacing: float) -> BSpline:
    """Fit a cubic spline with knots about ``spacing`` s apart through ``values`` (n,) at ``time`` (n,).

    The fit is by weighted least squares; outliers count less (Huber).
    """
    pieces = max(1, round(float(time[-1] - time[0]) / spacing))
    inner = np.linspace(time[0], time[-1], pieces + 1)
    knots = np.r_[[inner[0]] * 3, inner, [inner[-1]] * 3]
    columns = spline_columns(time, knots)
    stiff = _STIFFNESS * np.sqrt(len(time) / float(time[-1] - time[0]))  # a second of samples counts as one
    bend = stiff * np.diff(np.eye(columns.shape[1]), 2, axis=0)
    bending = bend.T @ bend
    robust = np.ones(len(time))
    for _ in range(10):
        coefficients = solve_spline(columns, values, weights * robust, bending)
        left = np.abs(values - columns @ coefficients)
        scale = 1.4826 * float(np.median(left)) + 1e-12  # a perfect fit must not divide by nothing
        robust = np.minimum(1.0, 1.345 * scale / np.maximum(left, 1e-12))
    return BSpline(knots, coefficients, 3)


def spline_columns(time: Array, knots: Array) -> Array | csr_array:
    """Return the cubic B-splines over ``knots`` (p + 4,) at ``time`` (n,): (n, p), sparse where that is less work."""
    columns = csr_array(BSpline.design_matrix(time, knots, 3))
    return columns if columns.shape[0] * columns.shape[1] > _SPARSE else columns.toarray()


def solve_spline(columns: Array | csr_array, values: Array, weights: Array, bending: Array) -> Array:
    """Return the coefficients c (p,) with least Σ weights·(values − columns·c)² + c·bending·c, by the normal equations.

    Many ``columns`` (n, p) are sparse, so that the work grows with n, not with n·p².
    """
    if isinstance(columns, csr_array):
        normal = (columns.T @ columns.multiply(weights[:, None])).toarray() + bending
    else:
        normal = columns.T @ (columns * weights[:, None]) + bending
    # what neither data nor bending determine, such as the gain of a sensor that never turns, becomes zero
    normal += 1e-13 * np.trace(normal) / len(normal) * np.eye(len(normal))
    return np.asarray(np.linalg.solve(normal, columns.T @ (weights * values)))


@dataclass(frozen=True)
class Alignment:
    """The rotation of a segment as a sensor on it shows it.

    rotation : (n, 3, 3) segment → level frame
    mounting : (3, 3) segment → sensor, constant over the run
    drift : rad, range of the heading's drift that was taken out
    misfit : rad, root mean square of the angle to the segment's expected rotation
    """

    rotation: Array
    mounting: Array
    drift: float
    misfit: float


def align_sensor(time: Array, rotation: Array, expected: Array, weights: Array) -> Alignment:
    """Estimate a sensor's mounting on its segment, and its heading, from the segment's expected mean rotation.

    In ``rotation(t) = turn(a(t)) · expected(t) · mountingᵀ`` the mounting is constant and a(t) slow.  Both are
    estimated alternately by least squares.  Rotation that is faster than a(t), and not constant, stays as measured.

    Parameters
    ----------
    time : (n,) s;  rotation : (n, 3, 3) sensor → a world with z up
    expected : (n, 3, 3) segment → level frame;  weights : (n,) of the samples, zero where no rotation is expected
    """
    every = slice(None, None, max(1, round(_ENOUGH / float(time[1] - time[0]))))
    at, seen, target, weight = time[every], rotation[every], expected[every], weights[every]
    # the first headings: the course's less the sensor's own, whatever its axes are, from where they agree best
    swing = slow_curve(at, _headings(seen, target, weight), weight, DRIFT_SPACING)
    firsts = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    first = max(firsts, key=lambda c: float(np.linalg.norm(_mean_mounting(swing(at) + c, seen, target, weight), "nuc")))
    turn = swing(at) + first
    for _ in range(_ROUNDS):
        mounting = nearest_rotation(_mean_mounting(turn, seen, target, weight))
        # the turn about up that brings what is seen nearest to what is expected, sample by sample
        cross = target @ np.swapaxes(seen @ mounting, -1, -2)
        best = np.unwrap(np.arctan2(cross[:, 1, 0] - cross[:, 0, 1], cross[:, 0, 0] + cross[:, 1, 1]))
        slow = slow_curve(at, best, weight, DRIFT_SPACING)
        turn = slow(at)
    turn = slow(time)
    aligned = _rotations_about_up(turn) @ rotation @ mounting
    apart = np.linalg.norm(aligned - expected, axis=(-2, -1)) / np.sqrt(2.0)
    misfit = float(np.sqrt(np.average(apart**2, weights=weights)))
    return Alignment(aligned, mounting, float(np.ptp(turn)), misfit)


def _mean_mounting(turn: Array, rotation: Array, expected: Array, weights: Array) -> Array:
    """Return the mean (3, 3) of (turn · rotation)ᵀ · expected.

    It is near the mounting; the better the samples agree, the nearer it is to a rotation.
    """
    return np.asarray(
        np.einsum("n,nji,njk->ik", weights, _rotations_about_up(turn) @ rotation, expected) / weights.sum()
    )


def _headings(rotation: Array, expected: Array, weights: Array) -> Array:
    """Return the difference (n,) rad of the expected heading and the sensor's since the first sample."""

    def heading(matrices: Array) -> Array:
        """Sum the turns about up between neighbours."""
        step = matrices[1:] @ np.swapaxes(matrices[:-1], -1, -2)
        turned = np.arctan2(step[:, 1, 0] - step[:, 0, 1], step[:, 0, 0] + step[:, 1, 1])
        return np.concatenate([[0.0], np.cumsum(turned)])

    return np.asarray(heading(expected) - heading(rotation))


def _rotations_about_up(angle: Array) -> Array:
    return Rotation.from_euler("z", angle[:, None]).as_matrix()
