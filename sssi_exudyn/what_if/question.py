"""A what-if as a problem of least squares: a run of the reduced model at any corrections and pace, and its tangents.

The unknowns u are amplitudes of B-splines over the recorded clock: of each correction in its scale, then of the pace.

    r(u) = [W (figures(u) − figures recorded), u],   ½ |r|² + w T least

T is how much later the skier passes the end of the recorded path, and the worth w of a second is zero but for a skier
in a hurry.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sssi_exudyn.core.choices import Keep
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.balance import Balance, balance_of, own_moment
from sssi_exudyn.fitting.observations import averages
from sssi_exudyn.fitting.posture_errors import PostureMap
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion, spline_motion
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.reduced.carved_run import CarvedMoment, carved_run, reduced_run_of
from sssi_exudyn.simulation.reduced.derivatives import TableChange
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.reduced.sensitivities import sensitivities
from sssi_exudyn.what_if.corrections import Directions, Supports
from sssi_exudyn.what_if.gates import Gates, moved_path
from sssi_exudyn.what_if.intent import (
    BALANCE_TIME,
    FIGURES,
    LOOK_AHEAD,
    MOMENT,
    NOTICED,
    PATH_SIGMA,
    PLACE,
    SAMPLING,
    SPEED,
    STRICT_PATH_SIGMA,
    Intent,
    intent_of,
    weights_of,
)
from sssi_exudyn.what_if.pace import Pace
from sssi_exudyn.what_if.recorded_run import RecordedRun, nodes_of

STEP: Final = 0.01
"""s; steps of the reduced model, as in a fit."""
_BEYOND: Final = 0.02
"""s that a run goes on after its end, so that its last sample lies within."""
PACE_SCALE: Final = 0.3
"""Of g, the logarithm of the slowness: a skier a third slower.  What he meets says far more of it."""
_DIFFERENCE: Final = 1e-3
"""Scales of a correction by which the body's own moment is differentiated."""
_AT_ONCE: Final = 800_000
"""Changes of the tables times instants that are differentiated by at once: each takes some 1 kB."""
_LEAST_AT_ONCE: Final = 24
"""The least of them, as each pass takes a run."""
_AS_THEY_STAND: Final = Gates()
_APART: Final = 5
"""Splines from one to the next that shares none of its samples: a cubic one extends over four spacings."""


@dataclass(frozen=True)
class Played:
    """A movement that was played by a model.

    times : (n,) s, own times of the samples
    figures : (n, ``FIGURES``) at them
    begin : of the run, where it goes on from another
    """

    model: Model
    motion: Motion
    pace: Pace
    prepared: Prepared
    run: ReducedRun
    balance: Balance
    times: Array
    figures: Array
    begin: CarvedMoment | None


@dataclass(frozen=True)
class Stretch:
    """A part of a run in which a skier decides how he moves; what was before is as it was.

    begin : of the run where it begins;  stop : s of the recorded clock
    given : (k,) unknowns of the whole run, of which those of ``free`` are to be found
    """

    begin: CarvedMoment | None
    stop: float
    given: Array
    free: NDArray[np.intp]


def play(
    model: Model,
    motion: Motion,
    pace: Pace,
    samples: Array,
    begin: CarvedMoment | None = None,
    stop: float | None = None,
) -> Played:
    """Simulate a model along a motion whose pace is known.

    begin : of a run that goes on, on snow that edges cut;  stop : s, own time of its end, that of the motion if None

    Raises SimulationDiverged when its simulation does.
    """
    times = pace.own(samples)
    stop = (motion.stop if stop is None else stop) + _BEYOND
    prepared = prepare(model, motion, step=STEP, start=None if begin is None else begin.time, stop=stop)
    if begin is None:
        run = simulate_reduced(model, prepared)
    else:
        run = reduced_run_of(carved_run(model, prepared, begin=begin))
    balance = balance_of(model, motion, prepared, run)
    figures = figures_of(run, prepared, balance, times)
    return Played(model, motion, pace, prepared, run, balance, times, figures, begin)


def figures_of(run: ReducedRun, prepared: Prepared, balance: Balance, times: Array) -> Array:
    """Return the figures (n, ``FIGURES``) of a run at ``times`` (n,) s; the run may carry a complex step."""
    speed = np.sqrt(np.sum(run.com_velocity**2, axis=1, keepdims=True))
    series = [run.com[:, :2], balance.residual(run, prepared), run.edge_angle, speed]
    return _sampled(run.time.real, np.concatenate(series, axis=1), times)


def _sampled(clock: Array, series: Array, times: Array) -> Array:
    """Return the series (k, ``FIGURES``) at ``times`` (n,) s, the moment averaged over ``BALANCE_TIME``."""
    figures = np.stack([np.interp(times, clock, column) for column in series.T], axis=1)
    figures[:, MOMENT] = _averaged(clock, series[:, MOMENT], times)
    return figures


def _averaged(clock: Array, moments: Array, times: Array) -> Array:
    """Return averages (n, c) of moments (k, c) over ``BALANCE_TIME`` about ``times`` (n,) s, within its ends."""
    inside = np.clip(times, clock[0] + 0.5 * BALANCE_TIME, clock[-1] - 0.5 * BALANCE_TIME)
    return averages(clock, moments, inside, BALANCE_TIME)


class Question:
    """A recorded run, the model that is asked about, and what the skier keeps.

    The skier reacts from ``LOOK_AHEAD`` before the recorded movement first plays differently on the asked model.  Least
    squares over the whole run would otherwise have him faster all the way to a patch of slow snow.  A
    skier who keeps his line to be fast may change his run from its start on.

    Where the snow decides the heading, the skier turns about gravity as the residual moment there demands.  That moment
    then is weighed as a law, and not as a skill.  Integrated forward from the start without
    steering, the heading would part from any intended one within seconds.

    Raises SimulationDiverged when the recorded movement cannot be simulated on the recorded or on the asked model.
    """

    def __init__(self, recorded: RecordedRun, asked: Model, keep: Keep, gates: Gates = _AS_THEY_STAND) -> None:
        self.worth = 0.0
        self.recorded, self.asked, self.keep, self.gates = recorded, asked, keep, gates
        motion = recorded.motion
        self.nodes = nodes_of(motion.start, motion.stop)
        self.samples = np.linspace(
            motion.start + SAMPLING, motion.stop, max(3, round((motion.stop - motion.start) / SAMPLING))
        )
        even = Pace(self.nodes, np.ones(len(self.nodes)))
        self.as_recorded = play(recorded.model, motion, even, self.samples)
        self.path = moved_path(gates, self.as_recorded.run, self.nodes) if gates.moved else None
        self._angles = motion.evaluate(self.nodes)[0]
        if self.path is not None:
            self.asked = replace(asked, start=self.path.begin(asked.start))
            self._angles = self.path.posture(self._angles, motion.inclination)
            motion = spline_motion(motion.geometry, motion.inclination, self.nodes, self._angles)
        self._directions = Directions(
            self.intent.corrections, PostureMap(Parts(recorded.model, motion), self.as_recorded.prepared.time)
        )
        self.supports = Supports(motion.start, motion.stop, motion.start)
        self.stretch = self._whole()
        self.unchanged = self.play(np.zeros(self.size))
        self.weights = self._weights(PATH_SIGMA)
        begin = motion.start if keep == "line" else self._met() - LOOK_AHEAD
        self.supports = Supports(motion.start, motion.stop, begin)
        self.stretch = self._whole()

    def _whole(self) -> Stretch:
        """Return all of the run."""
        size = self.supports.count * self._kinds
        return Stretch(None, self.recorded.motion.stop, np.zeros(size), np.arange(size))

    def during(self, stretch: Stretch, first: float) -> Question:
        """Return the same question about a stretch alone, which begins at ``first`` (s).

        Moments that are averaged over what comes before or after it do not count.
        """
        other = copy(self)
        rows = np.flatnonzero((self.samples >= first) & (self.samples <= stretch.stop))
        other.stretch, other.samples = stretch, self.samples[rows]
        other.weights, other.intended, other.way = self.weights[rows], self.intended[rows], self.way[rows]
        if stretch.begin is not None:
            other.weights[other.samples < other.samples[0] + 0.5 * BALANCE_TIME, -3:] = 0.0
        if stretch.stop < self.stretch.stop:
            other.weights[other.samples > stretch.stop - 0.5 * BALANCE_TIME, -3:] = 0.0
        return other

    def hurried(self, worth: float) -> Question:
        """Return the same question for a skier to whom each second is worth so much of ½ |r|²."""
        other = copy(self)
        other.worth = worth
        return other

    def stricter(self) -> Question:
        """Return the same question for a skier who keeps his path to ``STRICT_PATH_SIGMA``."""
        other = copy(self)
        other.weights = self._weights(STRICT_PATH_SIGMA)
        return other

    def _weights(self, path_sigma: float) -> Array:
        return weights_of(self.keep, self.samples, self.way, path_sigma, snow_turns=self.recorded.snow_turns)

    @cached_property
    def intent(self) -> Intent:
        """Return what the skier keeps, and by which corrections."""
        left, right = np.moveaxis(self.as_recorded.prepared.foot_rotation[:, :, :2, 0], 1, 0)
        across = left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0]
        # from the left ski to the right one anticlockwise, seen from above: tips together
        between = float(np.mean(np.arctan2(across, np.sum(left * right, axis=1))))
        return intent_of(self.keep, between, snow_turns=self.recorded.snow_turns)

    @cached_property
    def intended(self) -> Array:
        """(n, ``FIGURES``) that the skier keeps: the recorded run's, on the path between gates that are moved."""
        return self.on_path(self.as_recorded.figures)

    def on_path(self, recorded: Array) -> Array:
        """Return figures (n, ``FIGURES``, …) of the recorded run, or derivatives of them, on the path that is kept."""
        return recorded if self.path is None else self.path.figures(recorded, self.samples)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.stretch.free)

    @property
    def _kinds(self) -> int:
        """Number of corrections, the pace among them."""
        return len(self.intent.corrections) + self.intent.paced

    def of_run(self, unknowns: Array) -> Array:
        """Return the unknowns of the whole run."""
        every = self.stretch.given.copy()
        every[self.stretch.free] = unknowns
        return every

    @cached_property
    def way(self) -> Array:
        """(n, 2) directions of the path that is kept, at the samples."""
        run = self.as_recorded.run
        velocity = np.stack([np.interp(self.samples, run.time, run.com_velocity[:, i]) for i in range(2)], axis=1)
        way = np.asarray(velocity / np.linalg.norm(velocity, axis=1, keepdims=True))
        return way if self.path is None else self.path.way(way)

    def _met(self) -> float:
        """Return the instant (s) at which the run meets the change; the start where there is none."""
        apart = np.einsum("nrk,nk->nr", self.weights, self.unchanged.figures - self.intended)
        return float(self.samples[np.argmax(np.max(np.abs(apart), axis=1) > NOTICED)])

    def amounts(self, unknowns: Array, recorded: Array) -> Array:
        """Return the corrections (n, c), in rad and m, at instants (n,) of the recorded clock (s)."""
        several, count = self.intent.corrections, self.supports.count
        amplitudes = self.of_run(unknowns)[: count * len(several)].reshape(len(several), count)
        factors = np.array([self.supports.of(correction) for correction in several]).reshape(amplitudes.shape)
        return np.asarray(self.supports.at(recorded) @ (factors * amplitudes).T)

    def added(self, unknowns: Array) -> Array:
        """Return the angles (nodes, 28) rad that the corrections add to the recorded ones."""
        amounts = self.amounts(unknowns, self.nodes)
        return np.asarray(np.einsum("nc,cnk->nk", amounts, self._directions.at(self.nodes)))

    def pace(self, unknowns: Array) -> Pace:
        """Return the pace."""
        slower = np.zeros(len(self.nodes)) if self.path is None else self.path.slower
        every = self.of_run(unknowns)
        if self.intent.paced and np.any(every):
            slower = slower + self._pace_splines @ every[-self.supports.count :]
        return Pace(self.nodes, np.exp(slower))

    def movement(self, unknowns: Array) -> tuple[Motion, Pace]:
        """Return the corrected movement at its pace."""
        motion, pace = self.recorded.motion, self.pace(unknowns)
        if not np.any(self.of_run(unknowns)) and self.path is None:
            return motion, pace
        own = pace.own(self.nodes)
        return spline_motion(motion.geometry, motion.inclination, own, self._angles + self.added(unknowns)), pace

    def play(self, unknowns: Array) -> Played:
        """Simulate the asked model at these unknowns.  Raises SimulationDiverged when its simulation does."""
        motion, pace = self.movement(unknowns)
        asked, stretch = replace(self.asked, terms=pace.retimed(self.asked.terms)), self.stretch
        stop = None if stretch.stop >= self.nodes[-1] else float(pace.own(np.array([stretch.stop]))[0])
        return play(asked, motion, pace, self.samples, stretch.begin, stop)

    def residual(self, unknowns: Array, played: Played) -> Array:
        """Return r."""
        apart = np.einsum("nrk,nk->nr", self.weights, played.figures - self.intended)
        return np.concatenate([apart.ravel(), unknowns])

    def cost(self, unknowns: Array, played: Played) -> float:
        """Return ½ |r|² + w T."""
        residual = self.residual(unknowns, played)
        return 0.5 * float(residual @ residual) + self.worth * self.later_at_end(played)

    def later_at_end(self, played: Played) -> float:
        """Return T, s: by how much the last sample is later, and what is left from there to the end of the path."""
        ahead = (played.figures[-1] - self.intended[-1])[PLACE] @ self.way[-1]
        return float(played.times[-1] - self.samples[-1] - ahead / played.figures[-1, SPEED][0])

    def later_at_end_by(self, by_unknown: Array, played: Played) -> Array:
        """Return the derivatives (size,) of T; that of the speed acts on the centimetres that are left alone."""
        ahead = np.einsum("c,ck->k", self.way[-1], by_unknown[-1, PLACE])
        return np.asarray(self.later(played)[-1] - ahead / played.figures[-1, SPEED][0])

    def jacobian(self, by_unknown: Array) -> Array:
        """Return dr/du from the figures' derivatives (n, ``FIGURES``, size)."""
        rows = self.weighed(by_unknown)
        return np.concatenate([rows, np.eye(self.size)])

    def weighed(self, derivatives: Array) -> Array:
        """Return W times derivatives (n, ``FIGURES``, k) of the figures."""
        rows = np.einsum("nrj,njk->nrk", self.weights, derivatives)
        samples, kept, count = rows.shape
        return np.asarray(rows.reshape(samples * kept, count))

    def slope(self, unknowns: Array, played: Played, by_unknown: Array) -> Array:
        """Return the derivatives (size,) of the cost from those of the figures."""
        slope = self.jacobian(by_unknown).T @ self.residual(unknowns, played)
        return np.asarray(slope + self.worth * self.later_at_end_by(by_unknown, played))

    def linearise(self, unknowns: Array, played: Played) -> Array:
        """Return the derivatives (n, ``FIGURES``, size) of the figures at the samples by the unknowns."""
        derivatives = figures_tangents(played, (), self._changes(played))
        derivatives[:, MOMENT] += self._own_moments(unknowns, played)
        if self.intent.paced:
            derivatives += self._rates(played)[..., None] * self.later(played)[:, None]
        return derivatives

    def later(self, played: Played) -> Array:
        """Return the derivatives (n, size) of the samples' own times by the unknowns, s."""
        later = np.zeros((len(self.samples), self.size))
        if self.intent.paced:
            paced = self._kind == len(self.intent.corrections)
            later[:, paced] = played.pace.later(self._pace_splines)(self.samples)[:, self._spline[paced]]
        return later

    @property
    def _kind(self) -> NDArray[np.intp]:
        """(size,) of which correction each unknown is, in the order of the intent; the pace is the last."""
        return self.stretch.free // self.supports.count

    @property
    def _spline(self) -> NDArray[np.intp]:
        """(size,) which spline each unknown is of."""
        return self.stretch.free % self.supports.count

    @cached_property
    def _pace_splines(self) -> Array:
        return PACE_SCALE * self.supports.at(self.nodes)

    def _changes(self, played: Played) -> list[TableChange]:
        """Return what each of the unknowns changes of the posture's tables."""
        moving = PostureMap(Parts(played.model, played.motion), played.prepared.time)
        on_grid, on_tables = (played.pace.back(time) for time in (moving.grid, played.prepared.time))
        shapes = self.supports.at(on_tables)
        directions = list(self._directions.at(on_grid))
        profiles = [shapes * self.supports.of(correction) for correction in self.intent.corrections]
        if self.intent.paced:
            directions.append(played.motion.evaluate(moving.grid)[1])
            profiles.append(-played.pace.later(self._pace_splines)(on_tables))
        responses = [moving.responses(angles) for angles in directions]
        return [
            responses[kind].change(profiles[kind][:, spline])
            for kind, spline in zip(self._kind, self._spline, strict=True)
        ]

    def _own_moments(self, unknowns: Array, played: Played) -> Array:
        """Return the derivatives (n, 3, size) of the moment that the body has of itself, at the samples.

        A spline acts where it is not zero.  So those that are ``_APART`` of one another share a difference.
        """
        own = own_moment(Parts(played.model, played.motion), played.times)
        columns = np.zeros((*own.shape, self.size))
        acting = np.abs(self.supports.at(self.samples)) > 0.0
        for group in self._apart():
            step = np.zeros(self.size)
            step[group] = _DIFFERENCE
            motion, pace = self.movement(unknowns + step)
            change = (own_moment(Parts(played.model, motion), pace.own(self.samples)) - own) / _DIFFERENCE
            columns[..., group] = change[..., None] * acting[:, None, self._spline[group]]
        return _averaged(played.times, columns.reshape(len(own), -1), played.times).reshape(columns.shape)

    def _apart(self) -> Iterator[NDArray[np.intp]]:
        """Yield the unknowns in groups of one kind whose splines do not overlap."""
        for kind in range(self._kinds):
            for first in range(_APART):
                group = np.flatnonzero((self._kind == kind) & (self._spline % _APART == first))
                if len(group):
                    yield group

    def _rates(self, played: Played) -> Array:
        """Return the rates (n, ``FIGURES``) at which the figures change in time, the body's own moment apart."""
        run, clock = played.run, played.run.time
        speed = np.linalg.norm(run.com_velocity, axis=1, keepdims=True)
        moment = played.balance.residual(run, played.prepared) - played.balance.own
        changing = np.concatenate([moment, run.edge_angle, speed], axis=1)
        rates = np.concatenate([run.com_velocity[:, :2], np.gradient(changing, clock, axis=0)], axis=1)
        return _sampled(clock, rates, played.times)


def figures_tangents(played: Played, names: Sequence[str], changes: Sequence[TableChange]) -> Array:
    """Return the derivatives (n, ``FIGURES``, k) of the figures at fixed times, by numbers and by changed tables."""

    def observed(_model: Model, run: ReducedRun) -> Array:
        return figures_of(run, played.prepared, played.balance, played.times)

    if not names and not changes:
        return np.zeros((len(played.times), FIGURES, 0))
    most = max(_LEAST_AT_ONCE, _AT_ONCE // len(played.prepared.time))
    parts = [(names, changes[:most]), *(((), changes[k : k + most]) for k in range(most, len(changes), most))]
    derivatives = [
        sensitivities(played.model, played.prepared, some, observed, others, played.begin)[1] for some, others in parts
    ]
    return np.concatenate(derivatives, axis=-1)
