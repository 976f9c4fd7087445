"""A run of few sensors that is led along its fixes, at a cost that grows with its length alone.

Friction that holds a run at its mean speed, and skis that point along a receiver's smooth course, leave the simulated
run metres to tens of metres from the fixes.  What the skier did beyond that are two slow functions of time: friction
that is added by braking, b, and the turn h of the whole posture about gravity.  With the run's velocity V t over ground
(n to its left), its slope's pull, and friction that rises with speed by B,

    d(place)/dt = v t + V h n
    dv/dt = −g (b + B v) + g sin α cos α (f · n) h

are what small b and h change of place and speed v; f points down the slope.  b, h, and the fixes' slow error are
exponentially correlated.  A Kalman smoother (Rauch, Tung and Striebel 1965) finds the most likely of them from the
fixes and their speeds, and the reduced model runs with them.  That is repeated, for the run is not quite linear.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_lsq_spline

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.terms.friction_corrections import Braking, SpeedDependentFriction
from sssi_exudyn.core.frames import GRAVITY, Array, slope_to_level
from sssi_exudyn.core.noise import ExponentialNoise
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.model.model import Model, Start
from sssi_exudyn.motion.correction import PostureCorrection
from sssi_exudyn.simulation.heading import HEADING, Turn
from sssi_exudyn.simulation.reduced.prepared import Prepared, ReducedRun
from sssi_exudyn.simulation.reduced.run import simulate_reduced

_MOST_TURN: Final = 1.5
"""rad by which the posture is turned at most, less than a model's file may hold: no skis point so far from the path."""
_BRAKING: Final = ExponentialNoise(0.045, 5.0)
"""Braking that lasts for turns: as strong, over a minute, as that of ``path_balance`` (0.08 for 1.5 s)."""
_TURN_MEMORY: Final = 3.0
"""s; a heading's error lasts for a turn: a receiver that smooths the course makes every turn too flat."""
_START: Final = (0.5, 2.0)
"""Standard deviations of the start: its place over the fixes' own, and m/s of its speed."""
_STEP: Final = 0.5
"""s between the instants of the smoother at most; turns last two and more."""
SPACING: Final = 2.5
"""s between the knots of braking and heading that the model gets: half of what they are correlated over."""
_ROUNDS: Final = 3
"""Runs that are led, each about the one before: the third moves places by less than the fixes' noise."""
_WHITE: Final = 0.05
"""Error of a fix against the next, over what the receiver states: half a metre of a telephone's."""
_STANDING: Final = 0.5
"""m/s; below it a run has no direction."""
_PLACE, _SPEED, _TURN, _BRAKE, _WANDER = slice(0, 2), 2, 3, 4, slice(5, 7)
_PLACE_AND_SPEED = slice(0, 3)
_SIZE: Final = 7
"""The state: place (2) down the slope and to the left, speed, turn, braking, the fixes' slow error (2)."""


@dataclass(frozen=True)
class Fixes:
    """What a run is led by.

    time : (n,) s;  speed : (n,) m/s over ground;  speed_sigma : m/s
    place_sigma : m that the receiver states;  noise : of its places
    turn_sigma : rad by which the posture may point the wrong way
    """

    time: Array
    speed: Array
    speed_sigma: float
    place_sigma: float
    noise: ExponentialNoise
    turn_sigma: float


@dataclass(frozen=True)
class _Chain:
    """The linear process of the state at n instants.

    first : (7,) its standard deviations at the start
    moves : (n − 1, 7, 7) transitions;  noise : (n − 1, 7) variances of what is new
    fixed : (m,) the instants that have a fix
    """

    first: Array
    moves: Array
    noise: Array
    fixed: NDArray[np.intp]

    def led(self, state: Array) -> Array:
        """Return place and speed (m, 3) at the fixes to which a state's start, turns and braking (n, 7) lead."""
        states = state.copy()
        for k, move in enumerate(self.moves):
            states[k + 1, _PLACE_AND_SPEED] = move[_PLACE_AND_SPEED] @ states[k]
        return states[self.fixed, _PLACE_AND_SPEED]


def lead(
    model: Model, prepared: Prepared, run: ReducedRun, fixes: Fixes, residual: Callable[[Model, ReducedRun], Array]
) -> tuple[Model, ReducedRun]:
    """Return the model with what leads its run along the fixes, and that run.

    Parameters
    ----------
    prepared : the model's posture;  run : that of ``model`` as it is
    residual : gives measured less simulated place (n, 2) m at the fixes, level frame
    """
    time, fixed = _instants(fixes.time)
    state, led = np.zeros((len(time), _SIZE)), model
    for _ in range(_ROUNDS):
        chain = _chain(model, run, fixes, time, fixed)
        velocity = _over_ground(led, run, fixes.time)
        slower = fixes.speed - np.linalg.norm(velocity, axis=1)
        state = _smooth(chain, np.column_stack([residual(led, run), slower]) + chain.led(state), fixes)
        knots, state = _on_knots(time, state)
        led = _with(model, time, knots, state)
        turn = CubicSpline(knots, np.interp(knots, time, state[:, _TURN]))
        heading = np.stack([turn(prepared.time, order) for order in range(3)], axis=1)
        run = simulate_reduced(led, prepared.turn(Turn.of(prepared.up, heading)))
    return led, run


def _instants(fixes: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return instants (n,) ``_STEP`` apart at most, of which those at the returned indices (m,) are the fixes."""
    parts = np.maximum(1, np.ceil(np.diff(fixes) / _STEP - 1e-9)).astype(np.intp)
    fixed = np.concatenate([[0], np.cumsum(parts)])
    return np.interp(np.arange(fixed[-1] + 1), fixed, fixes), fixed


def _over_ground(model: Model, run: ReducedRun, time: Array) -> Array:
    """Return the skier's velocity (n, 2) m/s over ground, down the slope and to the left."""
    velocity = run.com_velocity @ slope_to_level(model.inclination).T
    return np.stack([np.interp(time, run.time, velocity[:, axis]) for axis in (0, 1)], axis=1)


def _chain(model: Model, run: ReducedRun, fixes: Fixes, time: Array, fixed: NDArray[np.intp]) -> _Chain:
    """Return the process about a run."""
    middle, step = 0.5 * (time[1:] + time[:-1]), np.diff(time)
    velocity = _over_ground(model, run, middle)
    speed = np.maximum(np.linalg.norm(velocity, axis=1), _STANDING)
    along = velocity / speed[:, None]
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    rises = sum(term.b for term in model.terms if isinstance(term, SpeedDependentFriction))
    turning = ExponentialNoise(fixes.turn_sigma, _TURN_MEMORY)
    noises = ((_TURN, turning), (_BRAKE, _BRAKING), (_WANDER, fixes.noise))
    moves, new = np.zeros((len(step), _SIZE, _SIZE)), np.zeros((len(step), _SIZE))
    moves[:, _PLACE, _PLACE] = np.eye(2)
    moves[:, _PLACE, _SPEED] = step[:, None] * along
    moves[:, _PLACE, _TURN] = (step * speed)[:, None] * left
    moves[:, _SPEED, _SPEED] = np.exp(-step * GRAVITY * rises)
    moves[:, _SPEED, _TURN] = step * GRAVITY * np.sin(model.inclination) * np.cos(model.inclination) * left[:, 0]
    moves[:, _SPEED, _BRAKE] = -step * GRAVITY
    first = np.zeros(_SIZE)
    first[_PLACE], first[_SPEED] = _START[0] * fixes.place_sigma, _START[1]
    for part, noise in noises:
        kept, indices = np.exp(-step / noise.correlation_time), np.atleast_1d(np.arange(_SIZE)[part])
        moves[:, indices, indices] = kept[:, None]
        new[:, indices] = ((1.0 - kept**2) * noise.sigma**2)[:, None]
        first[indices] = noise.sigma
    return _Chain(first, moves, new, fixed)


def _smooth(chain: _Chain, seen: Array, fixes: Fixes) -> Array:
    """Return the most likely states (n, 7), given place and speed (m, 3) at the fixes."""
    shows = np.zeros((3, _SIZE))
    shows[:, : _SPEED + 1] = np.eye(3)
    shows[:2, _WANDER] = np.eye(2)
    place = _WHITE * fixes.place_sigma
    noise = np.diag([place, place, fixes.speed_sigma]) ** 2
    count = len(chain.moves) + 1
    row = np.full(count, -1)
    row[chain.fixed] = np.arange(len(chain.fixed))
    mean, spread = np.zeros(_SIZE), np.diag(chain.first**2)
    means, spreads = np.zeros((count, _SIZE)), np.zeros((count, _SIZE, _SIZE))
    expected, expected_spread = means.copy(), spreads.copy()
    for k in range(count):
        if k:
            move = chain.moves[k - 1]
            mean, spread = move @ mean, move @ spread @ move.T + np.diag(chain.noise[k - 1])
        expected[k], expected_spread[k] = mean, spread
        if row[k] >= 0:
            gain = np.linalg.solve(shows @ spread @ shows.T + noise, shows @ spread).T
            mean, spread = mean + gain @ (seen[row[k]] - shows @ mean), spread - gain @ shows @ spread
        means[k], spreads[k] = mean, spread
    for k in range(count - 2, -1, -1):
        back = np.linalg.solve(expected_spread[k + 1] + 1e-12 * np.eye(_SIZE), chain.moves[k] @ spreads[k]).T
        means[k] += back @ (means[k + 1] - expected[k + 1])
    return means


def _on_knots(time: Array, state: Array) -> tuple[Array, Array]:
    """Return knots (k,) s, and the state with turn and braking as broken lines through values at these knots."""
    knots = np.linspace(time[0], time[-1], max(2, round(float(np.ptp(time)) / SPACING) + 1))
    lines = make_lsq_spline(time, state[:, [_TURN, _BRAKE]], np.r_[knots[0], knots, knots[-1]], k=1).c
    lines[:, 0] = np.clip(lines[:, 0], -_MOST_TURN, _MOST_TURN)
    about = quantities(Braking)["delta_mu"]
    lines[:, 1] = np.clip(lines[:, 1], about.low, about.high)
    state = state.copy()
    for column, line in zip((_TURN, _BRAKE), lines.T, strict=True):
        state[:, column] = np.interp(time, knots, line)
    return knots, state


def _with(model: Model, time: Array, knots: Array, state: Array) -> Model:
    """Return the model with a state's start, its braking, and its turns of the posture."""
    width = float(knots[1] - knots[0])
    angles = np.zeros((len(knots), len(PRESCRIBED)))
    angles[:, HEADING] = np.interp(knots, time, state[:, _TURN])
    if model.posture is not None:
        angles += model.posture.at(knots)
    braking = zip(np.interp(knots, time, state[:, _BRAKE]), knots, strict=True)
    return replace(
        model,
        terms=(*model.terms, *(Braking(float(more), float(at), width) for more, at in braking)),
        posture=PostureCorrection(knots, angles),
        start=_start(model, state[0]),
    )


def _start(model: Model, state: Array) -> Start:
    """Return the start with a state's place, speed and turn (7,)."""
    start, longer = model.start, 1.0 / float(np.cos(model.inclination))
    flat = np.array([start.velocity_f / longer, start.velocity_l])
    speed = max(float(np.linalg.norm(flat)), _STANDING)
    turn = np.arctan2(flat[1], flat[0]) + state[_TURN]
    faster = max(speed + state[_SPEED], 0.0)
    return replace(
        start,
        f=start.f + longer * float(state[0]),
        l=start.l + float(state[1]),
        velocity_f=longer * faster * float(np.cos(turn)),
        velocity_l=faster * float(np.sin(turn)),
    )
