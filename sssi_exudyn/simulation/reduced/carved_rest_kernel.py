"""A skier at rest on snow that edges cut: a template that ``compiled`` joins with ``carved_steps_kernel``.

The pelvis' height follows from the load, and yaw, roll and bend of each ski from what holds it against its foot.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sssi_exudyn.contact.codegen.vectors import dot, out_of, plus, three
from sssi_exudyn.runtime.jit import inlined, njit

press_edges: Callable[..., None]
SkiPose: Callable[..., Any]
of_ski: Callable[..., Any]
eliminate: Callable[..., bool]
standing_on: Callable[..., float]
turn_into: Callable[..., None]
place_ski: Callable[..., Any]
press_ski: Callable[..., Any]

START = np.int64(0)
"""The first instant, and no literal: for that the functions of any instant would be compiled again."""
REST_ITERATIONS = 200
REST = 1e-7
"""m by which the height of a skier at rest is known."""


@njit(cache=True, error_model="numpy")
def rest_height(system, place, load, memory, work):
    """Return the height of the pelvis (m) at which both unbent skis at the first instant carry ``load`` (N) in fresh
    snow, negative infinity where none is found.
    """
    still, none = np.zeros(system.ski.omega.shape[0]), (0.0, 0.0, 0.0)
    low, high = place[2] - 0.3, place[2] + 0.3
    for _ in range(50):
        middle = 0.5 * (low + high)
        carried = 0.0
        for side in range(2):
            at = plus((place[0], place[1], middle), three(system.motion.foot_place[0, side], 0))
            height = standing_on(system.parameters, at, system.surface, work.snow)
            turn_into(work.snow, system.motion.foot_rotation[0, side], work.local)
            pose = SkiPose(height, none, work.local, none, none, none, still, still)
            press_edges(system.parameters, system.ski, of_ski(memory, side), pose, 0.0, work.edges)
            carried += work.edges.force[2]
        if carried > load:
            low = middle
        else:
            high = middle
    return middle if high < place[2] + 0.3 else -np.inf


@njit(cache=True, error_model="numpy")
def bend_at_rest(system, place, load, bent, memory, work):
    """Find yaw, roll and bend ``bent`` (2, 2 + k) of both skis at rest in fresh snow at the first instant, and the
    height ``place[2]`` (m) at which they carry ``load`` (N) then.  False where Newton's method finds none.
    """
    own = bent.shape[1]
    matrix, residual = np.zeros((1 + 2 * own, 1 + 2 * own)), np.zeros(1 + 2 * own)
    bent[:] = 0.0
    for c in range(work.edges.by_place.shape[0]):
        work.edges.by_place[c], work.edges.by_rate[c] = 1.0, 0.0
    for _ in range(REST_ITERATIONS):
        matrix[:] = 0.0
        residual[:] = 0.0
        residual[0] = load
        for side in range(2):
            rest_equations(system, place, bent, side, of_ski(memory, side), work, matrix, residual)
        if not eliminate(matrix, residual):
            return False
        # a ski that is let down by more than it sinks leaves the snow
        share = min(1.0, 2e-3 / max(abs(residual[0]), 1e-12))
        place[2] -= share * residual[0]
        for side in range(2):
            for i in range(own):
                bent[side, i] -= share * residual[1 + side * own + i]
        if not abs(residual[0]) < 1.0:
            return False
        if abs(residual[0]) < REST:
            return True
    return False


@inlined
def rest_equations(system, place, bent, side, memory, work, matrix, residual):
    """Add to the equations of rest those of a ski: the pelvis' height first, then what turns and bends each ski."""
    ski, coupling, joint, motion, own = system.ski, system.coupling, system.joint, system.motion, bent.shape[1]
    base, still, none = 1 + side * own, np.zeros(own - 2), (0.0, 0.0, 0.0)
    _, height, _, upright, long, left = place_ski(system, START, side, three(place, 0), bent[side], work)
    axes = out_of(work.snow, upright), out_of(work.snow, left)
    pose = SkiPose(height, none, work.local, none, axes[0], axes[1], bent[side, 2:], still)
    force, slopes = press_ski(system, memory, pose, out_of(work.snow, long), 0.0, work)
    for i in range(1 + own):
        row = 0 if i == 0 else base + i - 1
        residual[row] -= force[2 + i]
        for j in range(1 + own):
            matrix[row, 0 if j == 0 else base + j - 1] += slopes[2 + i, 2 + j]
    for i in range(own):
        held = joint.stiffness[i] if i < 2 else ski.omega[i - 2] ** 2
        rest = joint.rest[side, i] if i < 2 else 0.0
        residual[base + i] += held * (bent[side, i] - rest)
        matrix[base + i, base + i] += held
    acceleration, turning = three(motion.ski_acceleration[0, side], 0), three(motion.ski_turning[0, side], 0)
    for k in range(own - 2):
        residual[base + 2 + k] += dot(three(coupling.translation[k], 0), acceleration)
        residual[base + 2 + k] += dot(three(coupling.rotation[k], 0), turning)
