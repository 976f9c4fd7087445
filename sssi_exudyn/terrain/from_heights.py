"""The snow surface from heights measured along the path: a Gaussian process over the slope's plane.

    y_i = h(x_i) + c + g·x_i + e(t_i) + w_i

h is a process over the plane with waves of all lengths, a sum of Matérn 5/2 processes.  c and g are the height's origin
and the plane's own error, with prior standard deviations ``OFFSET`` and ``TILT``.  e is the receiver's slow error
(exponential correlation over ``noise.correlation_time``), and w is the error that is independent from fix to fix.  The
waves' amplitude makes the heights most probable, with a weak prior.  Single fixes that are far off count less
(``core.noise.tail_weight``).  Heights of other runs on the slope are included; each run has an origin c and a slow
error e of its own.

Source: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), equations 2.23 to 2.30 and 4.17.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Final

import numpy as np
from scipy.linalg import block_diag, cho_solve, cholesky
from scipy.optimize import minimize_scalar
from scipy.spatial.distance import cdist

from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.core.noise import ExponentialNoise, Scale, tail_weight, uneven_covariance
from sssi_exudyn.terrain.surface import MOST_MODES, Surface, surface_over

OFFSET: Final = 10.0
"""Prior standard deviation of the height's origin, m."""
TILT: Final = float(np.radians(1.0))
"""Prior standard deviation of inclination and cross slope, rad, as of a stated slope."""
AMPLITUDE: Final = (0.3, 1.0)
"""Usual amplitude of a groomed slope's waves, m, and the standard deviation of its logarithm."""
WAVES: Final = ((0.33, 6.0), (0.67, 15.0), (1.33, 40.0))
"""Share of the slope's amplitude in its waves, and their length (m): waves of each length make slopes alike."""
HEIGHT: Final = float(np.sqrt(sum(share**2 for share, _ in WAVES)))
"""Root mean square height of such waves over the slope's plane, per metre of amplitude."""
STEEPNESS: Final = float(np.sqrt(5.0 / 3.0 * sum((share / length) ** 2 for share, length in WAVES)))
"""Root mean square slope of such waves per metre of amplitude, 1/m (of Matérn 5/2, √(5/3)/length)."""
_AMPLITUDES: Final = (0.003, 5.0)
SHORT: Final = 0.5
"""Share of the noise that is independent from fix to fix."""
LEAST: Final = 4
"""Minimum number of heights for a surface."""
_ROUNDS: Final = 10
_TOLERANCE: Final = 0.05
"""Tolerance of the amplitude's logarithm."""
_SETTLED: Final = 0.05
"""Change of a weight below which the weights have settled."""
_MOST: Final = 500
"""Maximum number of heights; more are averaged by neighbours.  With other runs, the run at hand has half of them."""
_POOR, _OF_POOR = 0.3, 100
"""Standard deviation, m, above which heights show little of waves, and the maximum number of modes there.  Loads alone
must determine them: with 183 modes a search had not settled after 14 rounds, and mu_n was off by three standard errors.
"""
TILTS: Final = 2
"""Number of first modes of such a process: the plane's tilt along and across the slope."""
_EXACT: Final = 0.001
"""Accuracy of a surface's modes from its own heights, m."""
_APART: Final = 1.0
"""Distance over which a slope is taken from heights, m."""
_MOST_ALONG: Final = 300
"""Maximum number of places along the path from which modes are computed."""
_SECOND: Final = 1.0
"""Duration over which the path's velocity is taken, s."""
_STANDING: Final = 0.1
"""Speed, m/s, below which a path has no direction."""
_SPACING: Final = 2.0
"""Distance between nodes, m: the shortest wave has 2.5 nodes."""
_MOST_NODES: Final = 300_000
"""Maximum number of nodes, of a square kilometre; over more ground they are farther apart."""
_BLOCK: Final = 2_000_000
"""Numbers of a covariance with nodes that are held at a time: 16 MB."""
_MARGIN: Final = 15.0
"""Margin around the path, m: for skis, a track that is off by metres, and enough nodes that the border has no effect.
"""


@dataclass(frozen=True)
class Heights:
    """Measured heights of the snow.

    time : (n,) s, rising;  places : (n, 2) m, f and l;  height : (n,) m over the slope's plane
    sigma : (n,) m of each;  noise : the receiver's slow error, for a height of the median sigma
    others : heights of other runs on the same slope, each with its own origin and its own receiver's error
    """

    time: Array
    places: Array
    height: Array
    sigma: Array
    noise: ExponentialNoise
    others: tuple[Heights, ...] = ()

    @property
    def all_places(self) -> Array:
        """Places (m, 2) m of all runs' heights, those of the run at hand first."""
        return np.concatenate([run.places for run in (self, *self.others)])

    @property
    def all_heights(self) -> Array:
        """Heights (m,) m of all runs, those of the run at hand first."""
        return np.concatenate([run.height for run in (self, *self.others)])

    @property
    def all_sigmas(self) -> Array:
        """Standard deviations (m,) m of all runs' heights, those of the run at hand first."""
        return np.concatenate([run.sigma for run in (self, *self.others)])


@dataclass(frozen=True)
class Noticed:
    """Effects of a surface that the other instruments hardly notice, root mean square over the run.

    They are infinite where there is no such instrument.

    place : m of the track;  speed : m/s of it;  lift : m/s² by which the snow throws the skier up
    tilt : rad across the path, by which one ski is higher than the other
    """

    place: float
    speed: float = np.inf
    lift: float = np.inf
    tilt: float = np.inf


@dataclass(frozen=True)
class Estimate:
    """The posterior of the surface.

    amplitude : amplitude of the process, m
    weight : (m,) weight of each height, those of the run at hand first; 1 for an ordinary one
    """

    heights: Heights
    amplitude: float
    weight: Array

    @cached_property
    def _solved(self) -> tuple[Array, Array]:
        """Cholesky factor (m, m) of the heights' covariance, and its solution (m,) for the heights."""
        factor = cholesky(_covariance(self.heights, self.amplitude, self.weight), lower=True)
        return factor, cho_solve((factor, True), self.heights.all_heights)

    def _cross(self, places: Array) -> Array:
        """Return the covariance (k, m) of the surface at ``places`` (k, 2) with all heights, without their origins."""
        return self._prior(places, self.heights.all_places)

    def _prior(self, a: Array, b: Array) -> Array:
        """Return the prior covariance (m, n) m² of the surface at places (m, 2) and (n, 2)."""
        return _of_surface(a, b, self.amplitude)

    def mean(self, places: Array) -> Array:
        """Return the mean height (m,) m over the slope's plane at ``places`` (m, 2), up to a constant."""
        solved = self._solved[1]
        return _in_blocks(lambda block: self._cross(block) @ solved, places, len(solved))

    def covariance(self, places: Array) -> Array:
        """Return the covariance (m, m) m² of the surface at ``places`` (m, 2), relative to their mean height."""
        cross = self._cross(places)
        posterior = self._prior(places, places) - cross @ cho_solve((self._solved[0], True), cross.T)
        level = np.eye(len(places)) - 1.0 / len(places)
        return np.asarray(level @ posterior @ level)

    def surface(self, empty: Surface, noticed: Noticed | None = None) -> Surface:
        """Return the mean as a spline on the nodes of ``empty``, with its leading modes.

        Its height at the first place is 0.

        noticed : modes that together have no more effect than this are left out
        """
        nodes, shape = empty.nodes(), empty.mean.shape
        mean = self.mean(nodes) - self.mean(self.heights.places[:1])[0]
        modes = np.zeros((0, len(nodes))) if noticed is None else self._modes(nodes, noticed)
        return replace(
            empty,
            mean=mean.reshape(shape),
            deviation=self._deviation(nodes).reshape(shape),
            modes=modes.reshape(-1, *shape),
            amounts=(0.0,) * len(modes),
        )

    def process(self, empty: Surface, noticed: Noticed) -> tuple[Surface, Array, Array, Array]:
        """Return the mean as a spline on the nodes of ``empty``, with the prior's modes and maps to their amounts.

        The modes are relative to the first place.  Further results are places (p, 2) along the path and around it, and
        two maps.  The first (k, p) leads from a surface's heights there to the modes' amounts, the second (p, m) from
        the measured heights of all runs to those heights.

        The first two modes are the plane's tilt.  The others are the leading ones, in standard deviations, of a
        process with waves of all lengths, ranked by their effect on the other instruments.  Loads show short waves.
        The track shows slopes across the path, which no height along it does.  The rest of the mean is kept.
        """
        nodes, first = empty.nodes(), self.heights.places[:1]
        places, table = self._noticed(noticed)
        gain = cho_solve((self._solved[0], True), self._cross(places).T).T  # (places, heights)
        waves = _of_waves(places, places, self.amplitude)
        sizes, shapes = self._leading(table @ (waves @ table.T))
        mixed = table.T @ (shapes / sizes)

        def modes(at: Array, covariance: Array) -> Array:
            """Return modes (k, n) m at places (n, 2), from the waves' covariance (n, p) with those at ``places``."""
            return np.column_stack([TILT * at, covariance @ mixed]).T

        # heights determine amounts up to an origin and the waves that are left out
        unknown = OFFSET**2 + _EXACT**2 * np.eye(len(places))
        known = cholesky(_with_tilt(waves, places, places) + unknown, lower=True)
        follow = cho_solve((known, True), modes(places, waves).T).T
        on_nodes, at_first = (
            _in_blocks(lambda block: modes(block, _of_waves(block, places, self.amplitude)), at, len(places))
            for at in (nodes, first)
        )
        shown = on_nodes - at_first
        smooth = gain - cho_solve((self._solved[0], True), self._cross(first).T).T
        amounts = follow @ smooth @ self.heights.all_heights
        mean = self.mean(nodes) - self.mean(first)[0]
        surface = replace(
            empty,
            mean=(mean - amounts @ shown).reshape(empty.mean.shape),
            deviation=self._deviation(nodes).reshape(empty.mean.shape),
            modes=shown.reshape(-1, *empty.mean.shape),
            amounts=tuple(amounts.tolist()),
        )
        return surface, places, np.asarray(follow), np.asarray(smooth)

    def _leading(self, covariance: Array) -> tuple[Array, Array]:
        """Return the leading standard deviations (k,) and directions (r, k) of a covariance (r, r), largest first.

        The covariance is that of the effects on the other instruments.  The rest together has a variance of 1 at most,
        unless there would be too many modes.
        """
        variances, shapes = np.linalg.eigh(covariance)
        most = MOST_MODES - TILTS if np.median(self.heights.sigma) < _POOR else _OF_POOR
        left_out = int(np.sum(np.cumsum(np.maximum(variances, 0.0)) <= 1.0))
        strong = np.arange(left_out, len(variances))[::-1][:most]
        return np.sqrt(variances[strong]), shapes[:, strong]

    def _deviation(self, nodes: Array) -> Array:
        """Return the standard deviation (n,) m at ``nodes`` (n, 2), relative to the mean height along the path."""
        along_path, count = self._cross(self.heights.places), len(self.heights.time)

        def deviation(block: Array) -> Array:
            with_path = self._cross(block)
            cross = with_path - along_path.mean(axis=0)
            own = (HEIGHT * self.amplitude) ** 2 + TILT**2 * np.sum(block**2, axis=1)
            prior = own - 2.0 * with_path[:, :count].mean(axis=1) + along_path[:, :count].mean()
            explained = np.sum(cross * cho_solve((self._solved[0], True), cross.T).T, axis=1)
            return np.asarray(np.sqrt(np.maximum(prior - explained, 0.0)))

        return _in_blocks(deviation, nodes, along_path.shape[1])

    def _modes(self, nodes: Array, noticed: Noticed) -> Array:
        """Return the posterior's Karhunen–Loève modes (k, n) m at ``nodes`` (n, 2).

        The modes are those of the effects on the other instruments; their heights at the nodes follow by regression.
        """
        around, table = self._noticed(noticed)
        measured = table @ self._cross(around)
        gain = cho_solve((self._solved[0], True), measured.T)
        sizes, shapes = self._leading(table @ self._prior(around, around) @ table.T - measured @ gain)

        def modes(block: Array) -> Array:
            covariance = self._prior(block, around) @ table.T - self._cross(block) @ gain
            return np.asarray((covariance @ shapes / sizes).T)

        return _in_blocks(modes, nodes, len(around))

    def _noticed(self, noticed: Noticed) -> tuple[Array, Array]:
        """Return places (p, 2) m along the path and around it, and the effects (r, p) of a surface's heights there.

        A slope's change pulls with g along it.  Its integral changes the speed, and its double integral the place, up
        to the part that another start explains.  Along the path a wave throws the skier up, v² times its curvature.
        """
        some = slice(None, None, -(-len(self.heights.time) // _MOST_ALONG))
        places, time, velocity = self.heights.places[some], self.heights.time[some], _velocities(self.heights)[some]
        count = len(time)
        speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), _STANDING)
        ahead = _APART * velocity / speed
        steps = [*(0.5 * _APART * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])), ahead, -ahead, np.zeros(2)]
        around = np.concatenate([places + step for step in steps])
        once, none = _integral(time), np.zeros((count, count))
        rows = []
        for least, integrated, order in ((noticed.place, once @ once, 1), (noticed.speed, once, 0)):
            effect = _without_start(time, integrated, order) * (GRAVITY / (_APART * least))
            rows += [[-effect, effect, none, none, *[none] * 3], [none, none, -effect, effect, *[none] * 3]]
        thrown = np.diag(speed[:, 0] ** 2 / (_APART**2 * noticed.lift))
        rows.append([*[none] * 4, thrown, thrown, -2.0 * thrown])
        to_f, to_l = (np.diag(share / (_APART * noticed.tilt)) for share in (-ahead[:, 1], ahead[:, 0]))
        rows.append([to_f, -to_f, to_l, -to_l, *[none] * 3])
        table = np.block(rows)
        return around, table[np.any(table != 0.0, axis=1)] / np.sqrt(count)


def level_surface(heights: Heights) -> Surface:
    """Return a level surface over the path and around it."""
    area = float(np.prod(np.ptp(heights.places[:, :2], axis=0) + 2.0 * _MARGIN))
    return surface_over(heights.places, max(_SPACING, float(np.sqrt(area / _MOST_NODES))), _MARGIN)


def _in_blocks(of: Callable[[Array], Array], places: Array, others: int) -> Array:
    """Return what ``of`` makes of ``places`` (n, 2), the last axis being theirs, a block of them at a time: it forms
    covariances with ``others`` places.
    """
    rows = max(1, _BLOCK // others)
    return np.concatenate([of(places[begin : begin + rows]) for begin in range(0, len(places), rows)], axis=-1)


def estimate_surface(heights: Heights, usual: float = AMPLITUDE[0]) -> Estimate:
    """Estimate the posterior of the surface from its heights.

    ``usual`` (m) is the usual amplitude of such a surface's waves over the plane, or over whatever else the heights
    count from; they leave it by ``HEIGHT`` times as much.

    Raises ValueError for fewer heights than ``LEAST``.
    """
    if len(heights.time) < LEAST:
        raise ValueError(f"fewer than {LEAST} heights make no surface")
    heights = _bounded_heights(heights)
    bounds = tuple(np.log(_AMPLITUDES))
    # weighed before the search: waves short enough to follow single fixes would explain them
    weight = _weights(Estimate(heights, usual, np.ones(len(heights.all_heights))))
    for _ in range(_ROUNDS):
        objective = partial(_minus_log_posterior, heights, weight, usual)
        optimum = minimize_scalar(objective, bounds=bounds, method="bounded", options={"xatol": _TOLERANCE})
        estimate = Estimate(heights, float(np.exp(optimum.x)), weight)
        again = _weights(estimate)
        if np.max(np.abs(again - weight)) < _SETTLED:
            break
        weight = again
    return estimate


def _integral(time: Array) -> Array:
    """Return the operator (n, n) s that integrates rates at ``time`` (n,) by trapezoids."""
    step = np.diff(time)
    once = np.zeros((len(time), len(time)))
    once[1:, :-1] += np.tril(np.broadcast_to(0.5 * step, (len(step), len(step))))
    once[1:, 1:] += np.tril(np.broadcast_to(0.5 * step, (len(step), len(step))))
    return once


def _without_start(time: Array, operator: Array, order: int) -> Array:
    """Return an operator (n, n) less the part that another place at the start explains.

    For ``order`` 1 it is less the part of another speed too.
    """
    line = np.vander(time - time.mean(), order + 1)
    return np.asarray(operator - line @ np.linalg.lstsq(line, operator, rcond=None)[0])


def _velocities(heights: Heights) -> Array:
    """Return the velocity (n, 2) m/s along the path, over a second, since single fixes may be far off."""
    ahead, behind = heights.time + 0.5 * _SECOND, heights.time - 0.5 * _SECOND
    ahead, behind = (np.clip(at, heights.time[0], heights.time[-1]) for at in (ahead, behind))
    moved = [
        np.interp(ahead, heights.time, column) - np.interp(behind, heights.time, column) for column in heights.places.T
    ]
    return np.asarray(np.stack(moved, axis=1) / (ahead - behind)[:, None])


def _minus_log_posterior(heights: Heights, weight: Array, usual: float, log: float) -> float:
    factor = cholesky(_covariance(heights, float(np.exp(log)), weight), lower=True)
    whitened = np.linalg.solve(factor, heights.all_heights)
    prior = ((log - np.log(usual)) / AMPLITUDE[1]) ** 2
    return float(0.5 * whitened @ whitened + np.sum(np.log(np.diag(factor))) + 0.5 * prior)


def _covariance(heights: Heights, amplitude: float, weight: Array) -> Array:
    """Return the covariance (m, m) m² of all heights: surface and tilt, which runs share, and each run's own errors."""
    own = block_diag(*(_own_errors(run) for run in (heights, *heights.others)))
    independent = np.diag((SHORT * heights.all_sigmas) ** 2 / weight)
    return np.asarray(_of_surface(heights.all_places, heights.all_places, amplitude) + own + independent)


def _own_errors(heights: Heights) -> Array:
    """Return the covariance (n, n) m² of one run's heights by their origin and the receiver's slow error."""
    noise = replace(heights.noise, correlation_time=max(heights.noise.correlation_time, 1e-9))
    # fixes with a larger stated sigma are off together
    stated = heights.sigma / np.median(heights.sigma)
    return OFFSET**2 + uneven_covariance(heights.time, noise, Scale(stated, stated))


def _of_surface(a: Array, b: Array, amplitude: float) -> Array:
    """Return the prior covariance (m, n) m² of the surface, with the plane's tilt, at places (m, 2) and (n, 2)."""
    return _with_tilt(_of_waves(a, b, amplitude), a, b)


def _with_tilt(waves: Array, a: Array, b: Array) -> Array:
    """Return the covariance of ``waves`` (m, n) m² with the plane's tilt added."""
    return np.asarray(waves + TILT**2 * a @ b.T)


def _of_waves(a: Array, b: Array, amplitude: float) -> Array:
    """Return the prior covariance (m, n) m² of waves of all lengths at places (m, 2) and (n, 2)."""
    distance = cdist(a, b)
    return np.asarray(sum(_matern(distance, share * amplitude, length) for share, length in WAVES))


def _matern(distance: Array, amplitude: float, length: float) -> Array:
    """Return the Matérn 5/2 covariance m² of places so far apart, m (Rasmussen and Williams 4.17)."""
    gap = distance * (np.sqrt(5.0) / length)
    return np.asarray(amplitude**2 * (1.0 + gap + gap**2 / 3.0) * np.exp(-gap))


def _weights(estimate: Estimate) -> Array:
    """Return the weight (n,) of each height, from its distance to the prediction by all others."""
    inverse = cho_solve((estimate._solved[0], True), np.eye(len(estimate.weight)))
    # Rasmussen and Williams 5.12: residual and variance of a value left out
    residual, variance = estimate._solved[1] / np.diag(inverse), 1.0 / np.diag(inverse)
    own = (SHORT * estimate.heights.all_sigmas) ** 2
    square = residual**2 / (variance - own / estimate.weight + own)
    return tail_weight(square, 1)


def _bounded_heights(heights: Heights) -> Heights:
    """Average heights until all runs together have no more than ``_MOST``."""
    if not heights.others:
        return _binned(heights, _MOST)
    half = _MOST // 2
    others = tuple(_binned(run, max(half // len(heights.others), LEAST)) for run in heights.others)
    return replace(_binned(heights, half), others=others)


def _binned(heights: Heights, most: int) -> Heights:
    """Average neighbours of one run until there are no more than ``most``."""
    n = len(heights.time)
    if n <= most:
        return heights
    cell = np.arange(n) * most // n
    count = np.bincount(cell).astype(float)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(cell, values) / count)

    return replace(
        heights,
        time=mean(heights.time),
        places=np.stack([mean(column) for column in heights.places.T], axis=1),
        height=mean(heights.height),
        sigma=mean(heights.sigma) / np.sqrt(count),
    )
