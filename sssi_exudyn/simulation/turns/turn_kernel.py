"""One ski in a steady turn: a template that ``compiled`` joins with the laws and ``carving_kernel``.

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
from typing import NamedTuple

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit

press_edges: Callable[..., None]
advect: Callable[..., None]
accept: Callable[..., None]
eliminate: Callable[..., bool]

ITERATIONS = 25
"""Newton iterations at most."""
SMALL = 1e-8
"""m/s, rad/s, m, rad and the modes' own unit: the change of what is sought at which a step is found."""
MASS, INERTIA = 10.0, 1.0
"""kg and kg m²; of sideslip and yaw, on the way to the steady turn."""
SLIPPING, YAWING = 500.0, 400.0
"""N s/m and N m s: dampers against the running means."""
SINKING, PITCHING = 1500.0, 100.0
"""N s/m and N m s: dampers on the way to the steady turn."""


HELD = (0.0, 0.0, 0.0)
"""In place of the axes along and about which a boot centre that is free heaves and pitches."""


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
    """sought : (4 + k,) v_y (m/s), ω (rad/s), z (m), pitch (rad), η;  mean : (2,) of v_y and ω
    force : (6 + k,) of the snow at the end
    """

    sought: Array
    mean: Array
    force: Array


@njit(cache=True, error_model="numpy")
def follow_turn(parameters, ski, turn, state, memory, work, series):
    """Let the ski run through all steps; fills series (n, 4): sideslip (m/s), yaw rate (rad/s), height (m), pitch.

    The number of steps that Newton's method solved.
    """
    modes = ski.omega.shape[0]
    size = 6 + modes
    sought, mean, force = state.sought, state.mean, state.force
    lately = min(1.0, 2.0 * turn.speed * turn.step / (ski.station[-1] - ski.station[0]))
    old = sought.copy()
    frame = np.zeros((3, 3))
    matrix, right = np.zeros((size, size)), np.zeros(size)
    system, change = np.zeros((4 + modes, 4 + modes)), np.zeros(4 + modes)
    by_place, by_rate = np.zeros(size), np.zeros(size)
    # of the ski's coordinates, those that are sought, in the order of what is sought
    coordinate = np.zeros(4 + modes, np.int64)
    coordinate[0], coordinate[1], coordinate[2], coordinate[3] = 1, 5, 2, 4
    for k in range(modes):
        coordinate[4 + k] = 6 + k
    step = turn.step
    by_rate[1], by_rate[5] = 1.0, 1.0
    for c in range(2, 4 + modes):
        by_place[coordinate[c]], by_rate[coordinate[c]] = 1.0, 1.0 / step
    eta, rate = np.zeros(modes), np.zeros(modes)
    solved = 0
    for n in range(turn.edge.shape[0]):
        advect(ski, memory, step)
        for c in range(4 + modes):
            old[c] = sought[c]
        roll = -turn.edge[n]
        for iteration in range(ITERATIONS):
            pitch = sought[3]
            a, b = math.cos(pitch), math.sin(pitch)
            upright, edged = math.cos(roll), math.sin(roll)
            frame[0, 0], frame[0, 1], frame[0, 2] = a, b * edged, b * upright
            frame[1, 0], frame[1, 1], frame[1, 2] = 0.0, upright, -edged
            frame[2, 0], frame[2, 1], frame[2, 2] = -b, a * edged, a * upright
            for k in range(modes):
                eta[k] = sought[4 + k]
                rate[k] = (sought[4 + k] - old[4 + k]) / step
            sinking, pitching = (sought[2] - old[2]) / step, (pitch - old[3]) / step
            force[:] = 0.0
            matrix[:] = 0.0
            spin = (0.0, pitching, sought[1])
            foot = (sought[2], (turn.speed, sought[0], sinking), frame, spin, HELD, HELD)
            press_edges(parameters, ski, memory, foot, eta, rate, step, by_place, by_rate, force, matrix, work)
            # moments about the centre of pressure: the foot's place is moved there
            ahead, down = turn.pressure * a, -turn.pressure * b
            right[0] = force[1] - turn.load * turn.lean[n] - MASS * (sought[0] - old[0]) / step
            right[0] -= SLIPPING * (sought[0] - mean[0])
            right[1] = force[5] - ahead * force[1] - INERTIA * (sought[1] - old[1]) / step
            right[1] -= YAWING * (sought[1] - mean[1])
            right[2] = force[2] - turn.load - SINKING * sinking
            right[3] = force[4] + ahead * force[2] - down * force[0] - PITCHING * pitching
            for i in range(4 + modes):
                column = coordinate[i]
                system[0, i], system[2, i] = matrix[1, column], matrix[2, column]
                system[1, i] = matrix[5, column] - ahead * matrix[1, column]
                system[3, i] = matrix[4, column] + ahead * matrix[2, column] - down * matrix[0, column]
                for k in range(modes):
                    system[4 + k, i] = matrix[6 + k, column]
            system[0, 0] += MASS / step + SLIPPING
            system[1, 1] += INERTIA / step + YAWING
            system[2, 2] += SINKING / step
            system[3, 3] += PITCHING / step
            for k in range(modes):
                w = ski.omega[k]
                right[4 + k] = force[6 + k] - w * w * eta[k] - 2.0 * ski.ratio[k] * w * rate[k]
                system[4 + k, 4 + k] += w * w + 2.0 * ski.ratio[k] * w / step
            for i in range(4 + modes):
                change[i] = right[i]
            if not eliminate(system, change):
                return solved
            share = min(1.0, 0.3 / max(abs(change[0]), 1e-9), 1.0 / max(abs(change[1]), 1e-9))
            share = min(share, 3e-3 / max(abs(change[2]), 1e-9), 0.02 / max(abs(change[3]), 1e-9))
            if iteration > 10:
                share *= 0.5  # between two branches of a law Newton's method may go to and fro
            largest = 0.0
            for i in range(4 + modes):
                sought[i] += share * change[i]
                largest = max(largest, abs(change[i]))
            if not largest < 1e6:
                return solved
            if largest < SMALL:
                solved += 1
                break
        accept(memory)
        for c in range(2):
            mean[c] += lately * (sought[c] - mean[c])
        series[n, 0], series[n, 1], series[n, 2], series[n, 3] = sought[0], sought[1], sought[2], sought[3]
    return solved
