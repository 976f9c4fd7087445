"""One ski in a steady turn: a template that ``compiled`` joins with the laws and the kernels of
``ski_on_snow``.

The ski's heading is the x axis, which turns with it.  Sought are the boot centre's sideslip v_y and the yaw rate ω,

    m v̇_y + d_y (v_y − v̄_y) = Q − F tanλ,   I ω̇ + d_ω (ω − ω̄) = M_z,
    d ż = P − F,   d_p β̇ = M_y,   ω_k² η + 2ζω_k η̇ = Σ φ·(snow's force)

P, Q : snow's force on the ski along the snow's normal and to the left;  F, λ : load and lean
M_z, M_y : moments of the snow's forces about the centre of pressure, and z, β the boot centre's height and the pitch

v̄_y, ω̄ : running means of v_y and ω over the last half of the ski's length

The speed along the ski and the edge angle are given.  Mass, inertia I and dampers d only lead to the steady turn, in
which they do nothing.  Without d_y and d_ω the offset from the groove's wall and the mass swing against each other.
With an eighth of d_ω an edge that has play goes to and fro between its walls; with more of d_y, or twice d_ω, a light
ski comes into its turn so late that its shovel leaves the snow.
Steps are backward Euler's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import inlined, njit

press_edges: Callable[..., None]
SkiPose: Callable[..., Any]
advect: Callable[..., None]
accept: Callable[..., None]
backward: Callable[..., Any]
rate_to: Callable[..., float]
eliminate: Callable[..., bool]

TURN_ITERATIONS = 30
"""Newton iterations at most."""
TURN_SMALL = 1e-5
"""m/s, rad/s, m, rad and the modes' own unit: the change of what is sought at which a step is found."""
MASS, INERTIA = 10.0, 1.0
"""kg and kg m²; of sideslip and yaw, until the turn is steady."""
SLIPPING, YAWING = 500.0, 400.0
"""N s/m and N m s: dampers against the running means."""
SINKING, PITCHING = 1500.0, 100.0
"""N s/m and N m s: dampers until the turn is steady."""


class Turn(NamedTuple):
    """What is given for a run of n steps.

    edge : (n,) rad, of the sole, > 0 in a turn to the left;  lean : tan of the resultant's angle from the normal
    load : N along the snow's normal;  speed : m/s
    step : s;  pressure : m, the centre of pressure ahead of the boot centre
    """

    edge: Array
    lean: Array
    load: float
    speed: float
    step: float
    pressure: float


class TurnState(NamedTuple):
    """sought : (4 + k,) v_y (m/s), ω (rad/s), z (m), pitch (rad), η;  mean : (2,) of v_y and ω"""

    sought: Array
    mean: Array


class TurnSystem(NamedTuple):
    """A step's equations: matrix (4 + k, 4 + k) and right side (4 + k,), and the ski's rotation (3, 3).

    coordinate : (4 + k,) of the ski's coordinates, those that are sought, in their order
    """

    matrix: Array
    right: Array
    frame: Array
    coordinate: Array


@njit(cache=True, error_model="numpy")
def follow_turn(parameters, ski, turn, state, memory, work, series):
    """Let the ski run through all steps; fills series (n, 4): sideslip (m/s), yaw rate (rad/s), height (m), pitch.

    The number of steps that Newton's method solved.
    """
    size = state.sought.shape[0]
    coordinate = np.arange(2, 2 + size)  # the modes; a ski's own come first
    coordinate[0], coordinate[1], coordinate[2], coordinate[3] = 1, 5, 2, 4
    system = TurnSystem(np.zeros((size, size)), np.zeros(size), np.zeros((3, 3)), coordinate)
    work.by_place[:] = 0.0
    work.by_rate[:] = 0.0
    rule = backward(1, turn.step, 1)
    for i in range(size):  # sideslip and yaw rate are rates themselves
        work.by_place[coordinate[i]] = 1.0 if i > 1 else 0.0
        work.by_rate[coordinate[i]] = 1.0 / rule.share if i > 1 else 1.0
    lately = min(1.0, 2.0 * turn.speed * turn.step / (ski.station[-1] - ski.station[0]))
    solved = 0
    for n in range(turn.edge.shape[0]):
        outcome = advance_turn(parameters, ski, turn, n, state, memory, work, system)
        if outcome < 0:
            return solved
        solved += outcome
        for c in range(2):
            state.mean[c] += lately * (state.sought[c] - state.mean[c])
        for c in range(4):
            series[n, c] = state.sought[c]
    return solved


@inlined
def advance_turn(parameters, ski, turn, n, state, memory, work, system):
    """Bring the ski a step on; 1 where Newton's method solves it, 0 where it comes near, −1 where it fails."""
    sought, change, rule = state.sought, system.right, backward(1, turn.step, 1)
    advect(ski, memory, turn.step)
    old, rate = sought.copy(), np.zeros(sought.shape[0])
    solved = 0
    for iteration in range(TURN_ITERATIONS):
        for i in range(sought.shape[0]):
            rate[i] = rate_to(rule, sought[i], old[i], 0.0)
        turn_edged(sought[3], -turn.edge[n], system.frame)
        speed, spin = (turn.speed, sought[0], rate[2]), (0.0, rate[3], sought[1])
        none = (0.0, 0.0, 0.0)  # no axes to heave and pitch about: the boot centre is free to
        pose = SkiPose(sought[2], speed, system.frame, spin, none, none, sought[4:], rate[4:])
        press_edges(parameters, ski, memory, pose, turn.step, work)
        turn_equations(ski, turn, n, state, rate, work, system)
        if not eliminate(system.matrix, change):
            return -1
        share = min(1.0, 0.3 / max(abs(change[0]), 1e-9), 1.0 / max(abs(change[1]), 1e-9))
        share = min(share, 3e-3 / max(abs(change[2]), 1e-9), 0.02 / max(abs(change[3]), 1e-9))
        if iteration > 10:
            share *= 0.5  # between two branches of a law Newton's method may go to and fro
        largest = 0.0
        for i in range(sought.shape[0]):
            sought[i] += share * change[i]
            largest = max(largest, abs(change[i]))
        if not largest < 1e6:
            return -1
        if largest < TURN_SMALL:
            solved = 1
            break
    accept(memory)
    return solved


@inlined
def turn_edged(pitch, roll, frame):
    """Fill ``frame`` with the rotation (3, 3) of a ski that is pitched and rolled (rad)."""
    a, b = math.cos(pitch), math.sin(pitch)
    upright, edged = math.cos(roll), math.sin(roll)
    frame[0, 0], frame[0, 1], frame[0, 2] = a, b * edged, b * upright
    frame[1, 0], frame[1, 1], frame[1, 2] = 0.0, upright, -edged
    frame[2, 0], frame[2, 1], frame[2, 2] = -b, a * edged, a * upright


@inlined
def turn_equations(ski, turn, n, state, rate, work, system):
    """Fill the equations of a step, moments about the centre of pressure.

    rate : (4 + k,) of what is sought;  work : ``EdgeWork`` with the snow's forces
    """
    sought, force, matrix, right = state.sought, work.force, system.matrix, system.right
    ahead, down = turn.pressure * math.cos(sought[3]), -turn.pressure * math.sin(sought[3])
    right[0] = force[1] - turn.load * turn.lean[n] - MASS * rate[0] - SLIPPING * (sought[0] - state.mean[0])
    right[1] = force[5] - ahead * force[1] - INERTIA * rate[1] - YAWING * (sought[1] - state.mean[1])
    right[2] = force[2] - turn.load - SINKING * rate[2]
    right[3] = force[4] + ahead * force[2] - down * force[0] - PITCHING * rate[3]
    for i in range(sought.shape[0]):
        by = work.matrix[:, system.coordinate[i]]
        matrix[0, i], matrix[1, i] = by[1], by[5] - ahead * by[1]
        matrix[2, i], matrix[3, i] = by[2], by[4] + ahead * by[2] - down * by[0]
        for k in range(4, sought.shape[0]):
            matrix[k, i] = by[2 + k]
    matrix[0, 0] += MASS / turn.step + SLIPPING
    matrix[1, 1] += INERTIA / turn.step + YAWING
    matrix[2, 2] += SINKING / turn.step
    matrix[3, 3] += PITCHING / turn.step
    for k in range(ski.omega.shape[0]):
        w, damping = ski.omega[k], 2.0 * ski.ratio[k] * ski.omega[k]
        right[4 + k] = force[6 + k] - w * w * sought[4 + k] - damping * rate[4 + k]
        matrix[4 + k, 4 + k] += w * w + damping / turn.step
