"""Friction of a run from the balance of energy along its path, for recordings of few sensors.

Speed v, height of the snow z and the wander of the receiver's heights w are unknown at every node of time, a handful of
numbers for the whole run.  With q = √(1 + (dz/ds)²) and the load n m g square to the snow, the balance gives friction:

    μ = −[d(½ q² v²)/dt + g dz/dt + k q³ v³] / (n g q v)

A skier brakes by choice, so that friction varies along a run:

    μ = μ̄ + c (mean slope − slope) + (κ/g) (v − mean speed) + noise

c is the share of a change of slope that the skier brakes away, κ the rate at which the speed returns to its mean.  The
slope is dz/ds, negative downhill.  Slope and noise are exponentially correlated.  Gauss-Newton finds the most likely
run: its curvature has a band of constant width with a border of the run's own numbers, so that memory and work grow
with the run's length alone.

Sources: Särkkä, Bayesian Filtering and Smoothing (2013), ch. 10; priors: docs/notebook/real-runs.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.fitting.objective import Prior

STEP: Final = 0.5
"""s between nodes: receivers give a fix a second, turns last two and more."""
FRICTION: Final = Prior(0.12, 0.1)
"""μ̄: from gliding (0.02 to 0.14, Wolfsperger et al., Front. Mech. Eng. 7 (2021) 728722) to a snowplough (0.2 and
more).
"""
HOLDING: Final = Prior(float(np.log(0.25)), 0.5)
"""Logarithm of κ in 1/s: speeds of phones' runs return within two to eight seconds."""
BRAKED: Final = Prior(1.15, 0.15)
"""c: skiers brake a little more than a steeper slope pulls, so that steep stretches are slower."""
_DRAG_SPREAD: Final = 0.25
"""Standard deviation of the drag's logarithm: drag areas of 0.23 m² in a tuck to 0.66 m² upright."""
_BRAKING: Final = ExponentialNoise(0.08, 1.5)
"""Friction that neither slope nor speed explains, and the seconds that it lasts: parts of a turn."""
_SLOPES: Final = (0.06, 40.0)
"""Deviation of a piste's slope from its mean along a run (1), and the metres over which it lasts."""
_MEAN_SLOPE: Final = Prior(0.2, 0.2)
_STANDING: Final = 0.2
"""m/s; below it friction of a run means nothing, and divisors stay above it."""
_KINDS: Final = 3
_REACH: Final = 3
"""Unknowns of a node: v, z, w.  Every residual depends on so many nodes in a row at most."""
_GLOBALS: Final = 5
"""μ̄, ln κ, c, the drag's logarithm against its prior, mean of dz/ds."""
_BAND: Final = _KINDS * _REACH
_ITERATIONS: Final = 40
_ENOUGH: Final = 1e-4
"""Of the objective: a hundredth of a standard deviation of anything."""


@dataclass(frozen=True)
class PathData:
    """What is measured along a run, and the model's terms that act on it.

    time, speed : (n,) s, m/s over ground;  speed_sigma : m/s
    height_time, height : (m,) s, m;  height_sigma, wander : their independent and their slow error
    load : n, the load square to the snow over the weight
    drag : k in 1/m, drag over mass and squared speed
    """

    time: Array
    speed: Array
    speed_sigma: float
    height_time: Array
    height: Array
    height_sigma: float
    wander: ExponentialNoise
    load: float
    drag: float

    def until(self, stop: float) -> PathData:
        """Return what was measured until then."""
        fixes, heights = self.time <= stop, self.height_time <= stop
        return replace(
            self,
            time=self.time[fixes],
            speed=self.speed[fixes],
            height_time=self.height_time[heights],
            height=self.height[heights],
        )


@dataclass(frozen=True)
class PathEstimate:
    """The most likely run.

    time : (k,) s, nodes;  speed, height, wander : (k,)
    friction : (k − 1,) of the intervals between nodes
    distance : (k,) m over ground;  slope : (k − 1,) dz/ds of the intervals, negative downhill
    mu, holding, braked, drag : μ̄, κ (1/s), c, k (1/m);  holding_sigma : 1/s
    mean_speed, mean_slope : about which friction varies
    effective, effective_sigma : work of the snow's friction over the load's path, and its standard deviation
    track, heights, air : parts of that deviation from speeds and friction's own course, from heights, and from drag
    residual : (n,) measured less estimated speed, m/s
    iterations, converged, objective : how the search ended
    unknowns, stored : numbers that were sought, and numbers that their curvature is stored in
    """

    time: Array
    speed: Array
    height: Array
    wander: Array
    friction: Array
    distance: Array
    slope: Array
    mu: float
    holding: float
    holding_sigma: float
    braked: float
    drag: float
    mean_speed: float
    mean_slope: float
    effective: float
    effective_sigma: float
    track: float
    heights: float
    air: float
    residual: Array
    iterations: int
    converged: bool
    objective: float
    unknowns: int
    stored: int


@dataclass(frozen=True)
class _Rows:
    """Residuals in standard deviations (r,), the first node that each depends on (r,), and the groups' ends."""

    values: NDArray[Any]
    node: NDArray[np.intp]
    ends: tuple[int, ...]


class _Balance:
    """The residuals of a run as functions of its unknowns: (k, 3) of nodes, (5,) of the run."""

    def __init__(self, data: PathData) -> None:
        self.data = data
        first, last = float(data.time[0]), float(data.time[-1])
        count = max(_REACH + 1, round((last - first) / STEP) + 1)
        self.time = np.linspace(first, last, count)
        self.step = float(self.time[1] - self.time[0])
        self.mean_speed = float(np.mean(data.speed))
        inside = (data.height_time >= first) & (data.height_time <= last)
        self.height_time, self.height = data.height_time[inside], data.height[inside] - data.height[inside][0]
        self.speed_at, self.speed_share = self._between(data.time)
        self.height_at, self.height_share = self._between(self.height_time)
        travelled = np.maximum(np.interp(self.time, data.time, data.speed), _STANDING) * self.step
        self.slope_kept = np.exp(-travelled[1:-1] / _SLOPES[1])
        self.friction_kept = float(np.exp(-self.step / _BRAKING.correlation_time))
        self.wander_kept = float(np.exp(-self.step / data.wander.correlation_time))

    def start(self) -> tuple[Array, Array]:
        """Return the unknowns where the search begins: as measured, the run's numbers at their priors' means."""
        speed = np.interp(self.time, self.data.time, self.data.speed)
        height = np.interp(self.time, self.height_time, self.height)
        down = (height[-1] - height[0]) / max(float(np.sum(speed) * self.step), 1.0)
        run = np.array([FRICTION.mean, HOLDING.mean, BRAKED.mean, 0.0, down])
        return np.stack([speed, height, np.zeros(len(speed))], axis=1), run

    def course(self, nodes: NDArray[Any], run: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        """Return friction, slope dz/ds and speed (k − 1,) of the intervals, and the load's path over each, m."""
        v, z = nodes[:, 0], nodes[:, 1]
        middle = np.sqrt((0.5 * (v[1:] + v[:-1])) ** 2 + _STANDING**2)
        slope = (z[1:] - z[:-1]) / (self.step * middle)
        longer = np.sqrt(1.0 + slope**2)
        kinetic = longer**2 * middle * (v[1:] - v[:-1]) / self.step
        air = self.data.drag * np.exp(run[3]) * (longer * middle) ** 3
        lost = -(kinetic + GRAVITY * slope * middle + air)
        travelled = self.data.load * longer * middle
        return lost / (GRAVITY * travelled), slope, middle, travelled * self.step

    def rows(self, nodes: NDArray[Any], run: NDArray[Any]) -> _Rows:
        """Return all residuals."""
        data = self.data
        friction, slope, speed, _ = self.course(nodes, run)
        mean, holding, braked, thicker, down = run
        apart = friction - mean - braked * (down - slope) - np.exp(holding) / GRAVITY * (speed - self.mean_speed)
        first, inner, every = np.array([0]), np.arange(len(slope) - 1), np.arange(len(nodes) - 1)
        leaving = slope - down
        wander = nodes[:, 2]
        priors = np.stack(
            [
                (mean - FRICTION.mean) / FRICTION.sigma,
                (holding - HOLDING.mean) / HOLDING.sigma,
                (braked - BRAKED.mean) / BRAKED.sigma,
                thicker / _DRAG_SPREAD,
                (down + _MEAN_SLOPE.mean) / _MEAN_SLOPE.sigma,
            ]
        )
        seen_speed = self._at(nodes[:, 0], self.speed_at, self.speed_share)
        seen_height = self._at(nodes[:, 1] + wander, self.height_at, self.height_share)
        groups = (
            (self.speed_at, (seen_speed - data.speed) / data.speed_sigma),
            (self.height_at, (seen_height - self.height) / data.height_sigma),
            (first, wander[:1] / data.wander.sigma),
            (every, _increments(wander, self.wander_kept, data.wander.sigma)),
            (first, leaving[:1] / _SLOPES[0]),
            (inner, _increments(leaving, self.slope_kept, _SLOPES[0])),
            (first, apart[:1] / _BRAKING.sigma),
            (inner, _increments(apart, self.friction_kept, _BRAKING.sigma)),
            (np.zeros(_GLOBALS, dtype=np.intp), priors),
        )
        ends = tuple(np.cumsum([len(node) for node, _ in groups]).tolist())
        return _Rows(np.concatenate([values for _, values in groups]), np.concatenate([n for n, _ in groups]), ends)

    def _between(self, at: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the node (n,) before each of these times, and the share of the way to the next."""
        before = np.clip(np.searchsorted(self.time, at, side="right") - 1, 0, len(self.time) - 2)
        return before, (at - self.time[before]) / self.step

    @staticmethod
    def _at(values: NDArray[Any], before: NDArray[np.intp], share: Array) -> NDArray[Any]:
        return np.asarray((1.0 - share) * values[before] + share * values[before + 1])


def _increments(values: NDArray[Any], kept: Array | float, sigma: float) -> NDArray[Any]:
    """Return what of exponentially correlated ``values`` (n,) is new at each but the first, in standard deviations."""
    return np.asarray((values[1:] - kept * values[:-1]) / (sigma * np.sqrt(1.0 - np.square(kept))))


@dataclass(frozen=True)
class _Curvature:
    """The Gauss-Newton curvature: Cholesky factor of its band (9, 3 k), its border (3 k, 5), Schur complement."""

    factor: Array
    border: Array
    solved: Array
    corner: Array

    @staticmethod
    def of(jacobian: Array, by_run: Array, node: NDArray[np.intp], count: int) -> _Curvature:
        """Assemble it from the residuals' derivatives (r, 9) by three nodes from ``node`` on, and (r, 5) by the run."""
        size = _KINDS * count
        # room for residuals of the last nodes, whose derivatives by nodes beyond the end are zero
        band, border = np.zeros((_BAND, size + _BAND)), np.zeros((size + _BAND, _GLOBALS))
        column = _KINDS * node
        for i in range(_BAND):
            for j in range(i + 1):
                np.add.at(band[i - j], column + j, jacobian[:, i] * jacobian[:, j])
            np.add.at(border, column + i, jacobian[:, i, None] * by_run)
        factor = cholesky_banded(band[:, :size], lower=True)
        border = border[:size]
        solved = cho_solve_banded((factor, True), border)
        return _Curvature(factor, border, solved, by_run.T @ by_run - border.T @ solved)

    def solve(self, nodes: Array, run: Array) -> tuple[Array, Array]:
        """Return the solution for a right side (3 k, …), (5, …)."""
        inner = cho_solve_banded((self.factor, True), nodes)
        of_run = np.asarray(np.linalg.solve(self.corner, run - self.border.T @ inner), dtype=np.float64)
        return inner - self.solved @ of_run, of_run


def _derivatives(balance: _Balance, nodes: Array, run: Array) -> tuple[_Rows, Array, Array]:
    """Return the residuals and their derivatives (r, 9), (r, 5), by complex steps.

    Nodes three apart share no residual, so that all of them are moved at once.
    """
    tiny = 1e-30
    rows = balance.rows(nodes, run)
    jacobian = np.zeros((len(rows.node), _REACH, _KINDS))
    for offset in range(_REACH):
        for kind in range(_KINDS):
            moved = nodes.astype(complex)
            moved[offset::_REACH, kind] += 1j * tiny
            slope = balance.rows(moved, run).values.imag / tiny
            place = (offset - rows.node) % _REACH
            jacobian[np.arange(len(slope)), place, kind] = slope
    by_run = np.zeros((len(rows.node), _GLOBALS))
    for index in range(_GLOBALS):
        shifted = run.astype(complex)
        shifted[index] += 1j * tiny
        by_run[:, index] = balance.rows(nodes, shifted).values.imag / tiny
    return rows, jacobian.reshape(len(rows.node), _BAND), by_run


def estimate_path(data: PathData) -> PathEstimate:
    """Return the most likely run.

    Raises ValueError for fewer than four fixes or heights, or fixes that are not apart in time.
    """
    if len(data.time) <= _REACH or len(data.height_time) <= _REACH or data.time[-1] - data.time[0] < 2.0 * STEP:
        raise ValueError("a balance along the path wants four fixes at least")
    balance = _Balance(data)
    nodes, run = balance.start()
    iterations, converged = 0, False
    while not converged and iterations < _ITERATIONS:
        iterations += 1
        rows, jacobian, by_run = _derivatives(balance, nodes, run)
        value = 0.5 * float(rows.values @ rows.values)
        curvature = _Curvature.of(jacobian, by_run, rows.node, len(nodes))
        step, of_run = curvature.solve(*_gradient(jacobian, by_run, rows, len(nodes)))
        nodes, run, lower = _shorten(balance, nodes, run, value, step.reshape(nodes.shape), of_run)
        converged = value - lower < _ENOUGH
    rows, jacobian, by_run = _derivatives(balance, nodes, run)
    curvature = _Curvature.of(jacobian, by_run, rows.node, len(nodes))
    effective, parts = _effective(balance, nodes, run, (rows, jacobian, by_run), curvature)
    friction, slope, speed, _ = balance.course(nodes, run)
    return PathEstimate(
        time=balance.time,
        speed=nodes[:, 0],
        height=nodes[:, 1],
        wander=nodes[:, 2],
        friction=friction,
        distance=np.concatenate([[0.0], np.cumsum(speed * balance.step)]),
        slope=slope,
        mu=float(run[0]),
        holding=float(np.exp(run[1])),
        holding_sigma=float(np.exp(run[1]) * np.sqrt(np.linalg.inv(curvature.corner)[1, 1])),
        braked=float(run[2]),
        drag=data.drag * float(np.exp(run[3])),
        mean_speed=balance.mean_speed,
        mean_slope=float(run[4]),
        effective=effective,
        effective_sigma=float(np.linalg.norm(parts)),
        track=parts[0],
        heights=parts[1],
        air=parts[2],
        residual=-data.speed_sigma * rows.values[: rows.ends[0]],
        iterations=iterations,
        converged=converged,
        objective=0.5 * float(rows.values @ rows.values),
        unknowns=nodes.size + run.size,
        stored=curvature.factor.size + curvature.border.size + curvature.corner.size,
    )


def _gradient(jacobian: Array, by_run: Array, rows: _Rows, count: int) -> tuple[Array, Array]:
    right = np.zeros(_KINDS * count + _BAND)
    for i in range(_BAND):
        np.add.at(right, _KINDS * rows.node + i, jacobian[:, i] * rows.values)
    return right[: _KINDS * count], by_run.T @ rows.values


def _shorten(
    balance: _Balance, nodes: Array, run: Array, value: float, step: Array, of_run: Array
) -> tuple[Array, Array, float]:
    """Return the unknowns after the longest of halved steps that lowers the objective, and the objective there."""
    share = 1.0
    for _ in range(20):
        moved, shifted = nodes - share * step, run - share * of_run
        values = balance.rows(moved, shifted).values
        lower = 0.5 * float(values @ values)
        if lower < value:
            return moved, shifted, lower
        share *= 0.5
    return nodes, run, value


def _effective(
    balance: _Balance, nodes: Array, run: Array, derivatives: tuple[_Rows, Array, Array], curvature: _Curvature
) -> tuple[float, tuple[float, float, float]]:
    """Return the effective friction, and the parts of its standard deviation: track, heights, air.

    With H = JᵀJ the variance gᵀH⁻¹g is the sum of (J H⁻¹ g)² over the residuals, each with its own source.
    """
    friction, _, _, travelled = balance.course(nodes, run)
    effective = float(np.sum(friction * travelled) / np.sum(travelled))

    def lost(at: NDArray[Any], of_run: NDArray[Any]) -> NDArray[Any]:
        mu, _, _, path = balance.course(at, of_run)
        return np.asarray(((mu - effective) * path).imag / np.sum(travelled))

    tiny, slope = 1e-30, np.zeros(nodes.shape)
    for offset in range(2):  # an interval depends on the nodes at its ends
        for kind in range(_KINDS):
            moved = nodes.astype(complex)
            moved[offset::2, kind] += 1j * tiny
            part = lost(moved, run) / tiny
            interval = np.arange(len(part))
            np.add.at(slope[:, kind], interval + (offset - interval) % 2, part)
    shifted = run.astype(complex)
    shifted[3] += 1j * tiny
    by_run = np.zeros(_GLOBALS)
    by_run[3] = float(np.sum(lost(nodes, shifted))) / tiny
    inner, outer = curvature.solve(slope.ravel(), by_run)
    rows, jacobian, of_run = derivatives
    padded = np.concatenate([inner, np.zeros(_BAND)])
    moved_rows = np.sum(jacobian * padded[_KINDS * rows.node[:, None] + np.arange(_BAND)], axis=1) + of_run @ outer
    variance = np.add.reduceat(moved_rows**2, [0, *rows.ends[:-1]])
    air = float(moved_rows[-2] ** 2)
    heights = float(np.sum(variance[1:6]) + moved_rows[-1] ** 2)
    track = float(np.sum(variance)) - heights - air
    return effective, (float(np.sqrt(track)), float(np.sqrt(heights)), float(np.sqrt(air)))


@dataclass(frozen=True)
class SecondHalf:
    """A run estimated up to its middle, and predicted from there.

    mu_t : friction at the mean speed and slope, from the first half
    speed_rms, usual_rms : m/s, rms of predicted less measured speed over ground in the second half, and of the first
        half's mean speed less the measured one
    time, predicted, measured : (n,) s and m/s over the whole run
    split : s
    """

    mu_t: float
    speed_rms: float
    usual_rms: float
    time: Array
    predicted: Array
    measured: Array
    split: float


_WITHIN: Final = 0.1
"""s; steps of a predicted speed."""


def predict_second_half(data: PathData, whole: PathEstimate) -> SecondHalf:
    """Estimate the first half and predict the speed in the second.

    Of the second half it uses the ground alone: the slope at places along the path, as ``whole`` has it.

    Raises ValueError for a half with fewer than four fixes.
    """
    split = 0.5 * float(data.time[0] + data.time[-1])
    first = estimate_path(data.until(split))
    late = data.time > split
    usual = float(np.mean(data.speed[~late]))
    predicted = np.interp(data.time, first.time, first.speed)
    predicted[late] = _predicted(first, whole, data.load, data.time[late])
    return SecondHalf(
        mu_t=first.mu,
        speed_rms=float(np.sqrt(np.mean((predicted - data.speed)[late] ** 2))),
        usual_rms=float(np.sqrt(np.mean((usual - data.speed)[late] ** 2))),
        time=data.time,
        predicted=predicted,
        measured=data.speed,
        split=split,
    )


def _predicted(first: PathEstimate, whole: PathEstimate, load: float, time: Array) -> Array:
    """Return the speed (n,) m/s at times after the first half's end, by its friction on the whole run's ground."""
    place = 0.5 * (whole.distance[1:] + whole.distance[:-1])
    steps = max(1, round(float(time[-1] - first.time[-1]) / _WITHIN))
    at = np.linspace(first.time[-1], time[-1], steps + 1)
    speed, distance = np.zeros(steps + 1), float(np.interp(first.time[-1], whole.time, whole.distance))
    speed[0] = first.speed[-1]
    for i in range(steps):
        v = max(speed[i], _STANDING)
        slope = float(np.interp(distance, place, whole.slope))
        longer = np.sqrt(1.0 + slope**2)
        friction = first.mu + first.braked * (first.mean_slope - slope)
        friction += first.holding / GRAVITY * (v - first.mean_speed)
        pull = -GRAVITY * (slope / longer + load * friction) - first.drag * (longer * v) ** 2
        speed[i + 1] = max(v + (at[i + 1] - at[i]) * pull / longer, 0.0)
        distance += v * (at[i + 1] - at[i])
    return np.interp(time, at, speed)
