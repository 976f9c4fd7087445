"""How a sensor is turned in space, from its rates and specific force; how it sits on what it is fixed to.

The filter is VQF (Laidig and Seel, Information Fusion 91 (2023) 187), in its offline form, which also estimates the
gyroscope's bias.  A skier's specific force is not gravity: in a turn it leans with the skier.  So the acceleration
that the track shows is taken off first.  Heading comes from integrated rates and drifts; what is slow of it is put
right by the course (``aligned``).
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
"""s between the knots of a heading's drift: several turns, so that what a turn does to it is kept."""
_STIFFNESS: Final = 7.0
"""Skis are 10° from the course for a second; a heading's drift changes by 1.5° more from knot to knot, 0.1 °/s."""
_ROUNDS: Final = 50
_SPARSE: Final = 100_000
"""Entries of a matrix of splines from which sparse products are faster."""
_ENOUGH: Final = 0.1
"""s between samples from which mountings are found."""


@dataclass(frozen=True)
class Attitude:
    """A sensor's rotation over time.

    time : (n,) s;  rotation : (n, 3, 3) sensor → a world with z up whose heading drifts
    yaw_rate : (n,) rad/s about up, left positive, without bias
    bias : (3,) rad/s of the gyroscope, mean over the run;  bias_sigma : rad/s; both zero where the device gave its own
        orientation
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
    acceleration : (n, 3) m/s² of the sensor in its own axes, where it is known otherwise; it is subtracted from the
        specific force, so that gravity is left
    """
    if imu.orientation is not None:
        rotation = Rotation.from_quat(imu.orientation, scalar_first=True).as_matrix()
        return Attitude(imu.time, rotation, _rate_about_up(rotation, imu.rate), np.zeros(3), 0.0)
    assert imu.force is not None  # its reader asks for one of both
    force = imu.force if acceleration is None else imu.force - acceleration
    found = offlineVQF(np.ascontiguousarray(imu.rate), np.ascontiguousarray(force), None, imu.step)
    rotation = Rotation.from_quat(found["quat6D"], scalar_first=True).as_matrix()
    return Attitude(
        imu.time,
        rotation,
        _rate_about_up(rotation, imu.rate - found["bias"]),
        np.asarray(np.mean(found["bias"], axis=0)),
        float(np.median(found["biasSigma"])),
    )


def _rate_about_up(rotation: Array, rate: Array) -> Array:
    return np.asarray(np.einsum("nj,nj->n", rotation[:, 2, :], rate))


def slow_curve(time: Array, values: Array, weights: Array, spacing: float) -> BSpline:
    """A cubic spline with knots about ``spacing`` s apart through ``values`` (n,) at ``time`` (n,), by weighted least
    squares; outliers count less (Huber).
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
        found = solve_spline(columns, values, weights * robust, bending)
        left = np.abs(values - columns @ found)
        scale = 1.4826 * float(np.median(left)) + 1e-12  # a perfect fit must not divide by nothing
        robust = np.minimum(1.0, 1.345 * scale / np.maximum(left, 1e-12))
    return BSpline(knots, found, 3)


def spline_columns(time: Array, knots: Array) -> Array | csr_array:
    """The cubic B-splines over ``knots`` (p + 4,) at ``time`` (n,): (n, p), sparse where that is less work."""
    columns = csr_array(BSpline.design_matrix(time, knots, 3))
    return columns if columns.shape[0] * columns.shape[1] > _SPARSE else columns.toarray()


def solve_spline(columns: Array | csr_array, values: Array, weights: Array, bending: Array) -> Array:
    """Coefficients c (p,) with least Σ weights·(values − columns·c)² + c·bending·c, by the normal equations.

    ``columns`` (n, p) are sparse where they are many, so that the work grows with n, not with n·p².
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
    """A segment's rotation as a sensor on it shows it.

    rotation : (n, 3, 3) segment → level frame
    mounting : (3, 3) segment → sensor, constant over the run
    drift : rad, the heading's change that was taken out, from least to greatest
    misfit : rad, root mean square of the angle to what was expected of the segment
    """

    rotation: Array
    mounting: Array
    drift: float
    misfit: float


def align_sensor(time: Array, rotation: Array, expected: Array, weights: Array) -> Alignment:
    """Find how a sensor sits on its segment, and its heading, from how the segment is expected to be on average.

    In ``rotation(t) = turn(a(t)) · expected(t) · mountingᵀ`` the mounting is constant and a(t) slow; both are found in
    turn by least squares.  What the sensor sees that is faster than a(t), and no constant, stays its own.

    Parameters
    ----------
    time : (n,) s;  rotation : (n, 3, 3) sensor → a world with z up
    expected : (n, 3, 3) segment → level frame;  weights : (n,) of the samples, zero where nothing is expected
    """
    every = slice(None, None, max(1, round(_ENOUGH / float(time[1] - time[0]))))
    at, seen, wanted, weight = time[every], rotation[every], expected[every], weights[every]
    # the first headings: the course's less the sensor's own, whatever its axes are, from where they agree best
    swing = slow_curve(at, _headings(seen, wanted, weight), weight, DRIFT_SPACING)
    firsts = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    first = max(firsts, key=lambda c: float(np.linalg.norm(_mean_mounting(swing(at) + c, seen, wanted, weight), "nuc")))
    turn = swing(at) + first
    for _ in range(_ROUNDS):
        mounting = nearest_rotation(_mean_mounting(turn, seen, wanted, weight))
        # the turn about up that brings what is seen nearest to what is expected, sample by sample
        cross = wanted @ np.swapaxes(seen @ mounting, -1, -2)
        best = np.unwrap(np.arctan2(cross[:, 1, 0] - cross[:, 0, 1], cross[:, 0, 0] + cross[:, 1, 1]))
        slow = slow_curve(at, best, weight, DRIFT_SPACING)
        turn = slow(at)
    turn = slow(time)
    found = _rotations_about_up(turn) @ rotation @ mounting
    apart = np.linalg.norm(found - expected, axis=(-2, -1)) / np.sqrt(2.0)
    misfit = float(np.sqrt(np.average(apart**2, weights=weights)))
    return Alignment(found, mounting, float(np.ptp(turn)), misfit)


def _mean_mounting(turn: Array, rotation: Array, expected: Array, weights: Array) -> Array:
    """(3, 3) mean of (turn · rotation)ᵀ · expected: near the mounting, the nearer a rotation the better they agree."""
    return np.asarray(
        np.einsum("n,nji,njk->ik", weights, _rotations_about_up(turn) @ rotation, expected) / weights.sum()
    )


def _headings(rotation: Array, expected: Array, weights: Array) -> Array:
    """(n,) rad: by how much the expected heading and the sensor's differ since the first sample."""

    def heading(matrices: Array) -> Array:
        """Of the turn about up between neighbours, summed."""
        step = matrices[1:] @ np.swapaxes(matrices[:-1], -1, -2)
        turned = np.arctan2(step[:, 1, 0] - step[:, 0, 1], step[:, 0, 0] + step[:, 1, 1])
        return np.concatenate([[0.0], np.cumsum(turned)])

    return np.asarray(heading(expected) - heading(rotation))


def _rotations_about_up(angle: Array) -> Array:
    return Rotation.from_euler("z", angle[:, None]).as_matrix()
