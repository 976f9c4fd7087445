"""Where along the run a force is missing: a latent force, smoothed through the linearised simulation.

    residual = G u + X a + e,   u ~ N(0, K)

u is the force at the centre of mass, along and across the skis and normal to the snow, in cells of time; K says that it
is of some size and keeps its direction for some time, those of a few under which the measurements are most probable; a
is everything else that may vary (see ``evidence``).  How probable they are with some force against none is one number,
the Bayes factor with u integrated out.  It is averaged over sizes and times, and over forces in all three directions
and in one alone: friction and drag act along, a change of load normal.  What stands out is compared with what the same
smoothing makes of noise alone, with the false discovery rate held over all cells.

Were the force the snow's, it would act on the feet, and each sole would carry its part: insoles distinguish the feet by
it.  Whether it is the snow's does not follow from the two Bayes factors: a force on the feet has twice the freedom, and
takes up errors of the soles' loads as well.

Source: Rasmussen and Williams 2006, ch. 2; Benjamini and Yekutieli, Ann. Statist. 29 (2001) 1165.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from sssi_exudyn.core.frames import Array
from sssi_exudyn.core.noise import ExponentialNoise, covariance_in_cells
from sssi_exudyn.fitting.evidence import LinearModel, uncertain, whiten_columns
from sssi_exudyn.fitting.noise import NoiseLevels
from sssi_exudyn.fitting.observations import late_averages, total_and_difference
from sssi_exudyn.model.faults import insole_readings
from sssi_exudyn.validation.diagnosis.hypotheses.hypothesis import FittedRun
from sssi_exudyn.validation.diagnosis.thresholds import THRESHOLDS, Thresholds

DIRECTIONS: Final = ("along", "across", "normal")
PLACEBOS: Final = 19
"""A finding that beats all of them is one that chance gives in one of twenty."""
PLACEBO_SEED: Final = 0
"""Of their forces."""


@dataclass(frozen=True)
class ForceOnFeet:
    """The force that is missing, were it the snow's.

    force, band : (c, 2, 3) N on the left and the right foot, as those of ``MissingForce``
    log_bayes_factor : of some force on the feet against none
    """

    force: Array
    band: Array
    log_bayes_factor: float


@dataclass(frozen=True)
class MissingForce:
    """The force that is missing, cell by cell.

    edges : (c + 1,) s of the cells;  force, band : (c, 3) N along, across and normal, with its standard deviation
    score : (c, 3) the force in standard deviations of what noise alone would show
    stands_out : (c, 3) true within a window whose mean stands out
    log_bayes_factor : of some force against none
    on_feet : None without insoles
    """

    edges: Array
    force: Array
    band: Array
    score: Array
    stands_out: NDArray[np.bool_]
    log_bayes_factor: float
    on_feet: ForceOnFeet | None

    @property
    def energy(self) -> float:
        """Integral of the force's square over the time, N² s."""
        return float(np.diff(self.edges) @ np.sum(self.force**2, axis=1))

    def impulse(self, window: tuple[float, float]) -> Array:
        """Return (3,) N s within a window of time (s)."""
        overlap = np.minimum(self.edges[1:], window[1]) - np.maximum(self.edges[:-1], window[0])
        return np.asarray(np.maximum(overlap, 0.0) @ self.force)

    def stretches(self) -> list[tuple[float, float]]:
        """Return windows (s) in which some direction stands out, neighbours joined."""
        windows: list[tuple[float, float]] = []
        for k in np.flatnonzero(self.stands_out.any(axis=1)):
            begin, end = float(self.edges[k]), float(self.edges[k + 1])
            if windows and begin - windows[-1][1] < 1e-9:
                windows[-1] = (windows[-1][0], end)
            else:
                windows.append((begin, end))
        return windows


def missing_force(linear: LinearModel, levels: NoiseLevels, fitted: FittedRun, responses: Array) -> MissingForce:
    """Smooth the residual of ``linear`` into a force; ``responses`` (N, 3·c) are those to a newton down the fall line,
    to the left and away from the snow in each cell.
    """
    edges = fitted.time_edges
    cells = len(edges) - 1
    course = course_of(fitted)
    shaped = along_course(fitted, responses)
    known = uncertain(linear, levels)

    def smooth(columns: Array, parts: int) -> _Smoothed:
        """Return a force of independent ``parts``, three directions each, by its columns (N, 3·parts·c)."""
        g = whiten_columns(linear, levels, columns)
        return _smooth(g.T @ known.remove_from(g), g.T @ known.remove_from(known.residual), *forms_of(fitted, parts))

    on_body = smooth(shaped, 1)
    gain, gram, mean, band = on_body.gain, on_body.gram, on_body.mean, on_body.band
    under_noise = gain @ gram @ gain.T
    score, out = _standing_out(mean.reshape(3, cells), under_noise, fitted.thresholds)
    on_feet = None
    if len(fitted.measurements.windows):
        carried = carried_by_soles(fitted, course)
        on_both = smooth(np.hstack([shaped + carried[0], shaped + carried[1]]), 2)
        force, spread = (np.moveaxis(row.reshape(2, 3, cells), 2, 0) for row in (on_both.mean, on_both.band))
        on_feet = ForceOnFeet(force, spread, on_both.log_bayes_factor)
    return MissingForce(
        edges, mean.reshape(3, cells).T, band.reshape(3, cells).T, score.T, out.T, on_body.log_bayes_factor, on_feet
    )


def course_of(fitted: FittedRun) -> Array:
    """Return (2, c) unit vectors of the skis' path in the cells, down the fall line and to the left."""
    edges, forward = fitted.time_edges, fitted.run.foot_forward.mean(axis=1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    course = np.stack([np.interp(middles, fitted.run.time, forward[:, axis]) for axis in range(2)])
    return np.asarray(course / np.linalg.norm(course, axis=0))


def along_course(fitted: FittedRun, responses: Array) -> Array:
    """Return (N, 3·c) responses to a newton along and across the skis' path and normal to the snow in each cell;
    ``responses`` as in ``missing_force``.
    """
    cosine, sine = course_of(fitted)
    by_f, by_l, by_n = responses.reshape(len(responses), 3, -1).transpose(1, 0, 2)
    return np.hstack([by_f * cosine + by_l * sine, by_l * cosine - by_f * sine, by_n])


def forms_of(fitted: FittedRun, parts: int) -> tuple[list[Array], list[Array]]:
    """Return covariances N², of every size and time, of forces of independent ``parts`` in the run's cells: in all
    three directions, and in one of them alone.
    """
    edges, thresholds = fitted.time_edges, fitted.thresholds
    cells = len(edges) - 1
    alike = [
        latent_covariance(edges, size, time, thresholds.cell)
        for size in thresholds.force_sizes
        for time in thresholds.force_memories
    ]
    every = [np.asarray(np.kron(np.eye(parts) / parts, covariance), dtype=np.float64) for covariance in alike]
    ways = np.kron(np.eye(len(DIRECTIONS)), np.ones(cells))
    return every, [prior * np.outer(kept, kept) for kept in np.tile(ways, parts) for prior in every]


def carried_by_soles(fitted: FittedRun, course: Array) -> Array:
    """Return (2, N, 3·c) what insoles show in addition where a newton acts on the left or right foot, not on the body.

    The newton is along or across the ``course`` (2, c) or normal to the snow in each cell.  Insoles show the component
    square to the sole, which is nothing along the ski.
    """
    time, edges = fitted.run.time, fitted.time_edges
    within = (time[:, None] >= edges[:-1]) & (time[:, None] < edges[1:])
    square = fitted.prepared.of_run(fitted.model, fitted.run).foot_rotation[..., 2]  # (n, 2, 3)
    (cosine, sine), none = course, np.zeros(len(edges) - 1)
    ways = np.array([[none, none, none], [-sine, cosine, none], [none, none, none + 1.0]])  # (3, 3, c)
    sole = np.einsum("nsi,dic,nc->nsdc", square, ways, within).reshape(len(time), 2, -1)
    return np.stack([_readings(fitted, sole[:, foot], foot) for foot in (0, 1)])


def _readings(fitted: FittedRun, sole: Array, foot: int) -> Array:
    """Return what the insoles show, (N, k), of forces (n, k) N square to one foot's sole, at the run's instants."""
    measurements = fitted.measurements
    readings = np.zeros((len(measurements.measured), sole.shape[1]))
    place = slice(measurements.blocks["load"].start, measurements.blocks["difference"].stop)
    unloaded = insole_readings(fitted.model.sensors, np.zeros((len(measurements.windows), 2)))
    for k, column in enumerate(late_averages(fitted.model, fitted.run.time, sole, measurements.windows).T):
        both = np.zeros((len(column), 2))
        both[:, foot] = column
        # a zero that has drifted is there without any force
        readings[place, k] = total_and_difference(insole_readings(fitted.model.sensors, both) - unloaded)
    return readings


@dataclass(frozen=True)
class _Smoothed:
    """Amplitudes (k,) of a latent force with their standard deviations and covariance, their information ``gram``, and
    the log Bayes factor of some of it against none.
    """

    mean: Array
    band: Array
    gain: Array
    gram: Array
    log_bayes_factor: float


def _smooth(gram: Array, pull: Array, priors: Sequence[Array], alone: Sequence[Array]) -> _Smoothed:
    """Smooth under the most probable of ``priors`` (k, k).  The Bayes factor is averaged over these and those in one
    direction ``alone``, half each.
    """
    gains, factors = zip(*(gain_of(prior, gram, pull) for prior in priors), strict=True)
    gain = gains[int(np.argmax(factors))]
    band = np.sqrt(np.maximum(np.diag(gain), 0.0))
    factor = half_each(factors, [gain_of(prior, gram, pull)[1] for prior in alone])
    return _Smoothed(gain @ pull, band, gain, gram, factor)


def half_each(*log_factors: Sequence[float]) -> float:
    """Return the log of the mean of the means of some groups' factors."""
    means = [np.logaddexp.reduce(some) - np.log(len(some)) for some in log_factors]
    return float(np.logaddexp.reduce(means) - np.log(len(means)))


def gain_of(prior: Array, gram: Array, pull: Array) -> tuple[Array, float]:
    """Return the covariance afterwards of amplitudes of covariance ``prior``, and the log Bayes factor of them against
    none, from what is known of them: information ``gram`` and ``pull`` (Rasmussen and Williams 2006, A.9 and A.10).
    """
    inner = np.eye(len(prior)) + prior @ gram
    gain: Array = np.asarray(np.linalg.solve(inner, prior), dtype=np.float64)
    return gain, 0.5 * float(pull @ gain @ pull) - 0.5 * float(np.linalg.slogdet(inner)[1])


def placebos(fitted: FittedRun, responses: Array) -> Array:
    """Return (N, ``PLACEBOS``) what forces do that are drawn at random, as large and as lasting as a missing one may
    be; ``responses`` as in ``missing_force``.
    """
    edges = fitted.time_edges
    lower = np.linalg.cholesky(latent_covariance(edges, *fitted.thresholds.usual_force, held=fitted.thresholds.cell))
    draws = np.random.default_rng(PLACEBO_SEED).normal(size=(lower.shape[0], PLACEBOS))
    return np.asarray(responses @ (lower @ draws))


def latent_covariance(edges: Array, size: float, time: float, held: float) -> Array:
    """Return the prior covariance (3·c, 3·c) N² of a missing force, in its three directions in c cells.

    edges : (c + 1,) s of the cells;  size, time : N, and s for which the force keeps its direction
    held : s for which it stays the same, as long as usual cells; longer ones, of long runs, have its means
    """
    return np.asarray(np.kron(np.eye(3), covariance_in_cells(edges, ExponentialNoise(size, time), held)))


def _standing_out(force: Array, under_noise: Array, thresholds: Thresholds) -> tuple[Array, NDArray[np.bool_]]:
    """Return (3, c) scores of single cells, and whether a cell is in a window whose mean stands out.

    Windows of several lengths are asked, since a force of a second or two is found better as a whole; the false
    discovery rate is held over all of them.
    """
    cells = force.shape[1]
    asked, scores = [], []
    for direction in range(3):
        for length in thresholds.windows:
            for begin in range(cells - length + 1):
                part = slice(direction * cells + begin, direction * cells + begin + length)
                spread = float(np.sqrt(max(np.sum(under_noise[part, part]), 1e-12)))
                asked.append((direction, begin, begin + length))
                scores.append(float(np.sum(force[direction, begin : begin + length])) / spread)
    discovered = discoveries(2.0 * ndtr(-np.abs(scores)), thresholds.false_discoveries)
    out = np.zeros((3, cells), dtype=bool)
    for (direction, begin, end), hit in zip(asked, discovered, strict=True):
        out[direction, begin:end] |= hit
    single = np.sqrt(np.maximum(np.diag(under_noise), 1e-12)).reshape(3, cells)
    return force / single, out


def discoveries(p: Array, rate: float = THRESHOLDS.false_discoveries) -> NDArray[np.bool_]:
    """Return which of the p-values (…) stand out with that expected share of false ones, however they depend on each
    other (Benjamini and Yekutieli 2001).
    """
    flat = np.sort(p.ravel())
    size = len(flat)
    allowed = rate * np.arange(1, size + 1) / size / np.sum(1.0 / np.arange(1, size + 1))
    below = np.flatnonzero(flat <= allowed)
    return np.asarray(p <= flat[below[-1]]) if len(below) else np.zeros(np.shape(p), dtype=bool)
