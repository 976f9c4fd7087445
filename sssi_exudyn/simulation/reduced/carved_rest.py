"""A skier at rest on snow that edges cut, and the derivatives of that.

The pelvis' height follows from the load, and yaw, roll and bend of each ski from what holds it against its foot.
A run needs this once: it is plain Python over the compiled functions of a run's steps, since a compiled loop of its own
would compile all these functions again.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.reduced.carved_steps_kernel import CarvedSystem, CarvedWork
from sssi_exudyn.simulation.reduced.carved_tangents_kernel import AT, BENT, FORCE, CarvedRoom
from sssi_exudyn.simulation.ski_on_snow.edge import EdgeLines
from sssi_exudyn.simulation.ski_on_snow.structs import Groove, TangentInputs

_ITERATIONS: Final = 200
_REST: Final = 1e-7
"""m by which the height of a skier at rest is known."""
_STILL: Final = (0.0, 0.0, 0.0)


def rest_height(
    kernel: Any, system: CarvedSystem, place: Array, load: float, memory: Groove, work: CarvedWork
) -> float:
    """Return the height of the pelvis (m) at which both unbent skis at the first instant carry ``load`` (N) in fresh
    snow, negative infinity where none is found.
    """
    still = np.zeros(len(system.ski.omega))
    low, high = place[2] - 0.3, place[2] + 0.3
    of_skis = [kernel.of_ski(memory, side) for side in range(2)]
    for _ in range(50):
        middle = 0.5 * (low + high)
        carried = 0.0
        for side in range(2):
            at = tuple(np.array([place[0], place[1], middle]) + system.motion.foot_place[0, side])
            height = kernel.standing_on(system.parameters, at, system.surface, work.snow)
            kernel.turn_into(work.snow, system.motion.foot_rotation[0, side], work.local)
            pose = kernel.SkiPose(height, _STILL, work.local, _STILL, _STILL, _STILL, still, still)
            kernel.press_edges(system.parameters, system.ski, of_skis[side], pose, 0.0, work.edges)
            carried += work.edges.force[2]
        if carried > load:
            low = middle
        else:
            high = middle
    return float(middle) if high < place[2] + 0.3 else -np.inf


def bend_at_rest(
    kernel: Any, system: CarvedSystem, place: Array, load: float, bent: Array, memory: Groove, work: CarvedWork
) -> bool:
    """Find yaw, roll and bend ``bent`` (2, 2 + k) of both skis at rest in fresh snow at the first instant, and the
    height ``place[2]`` (m) at which they carry ``load`` (N) then.  False where Newton's method finds none.
    """
    own = bent.shape[1]
    matrix, residual = np.zeros((1 + 2 * own, 1 + 2 * own)), np.zeros(1 + 2 * own)
    bent[:] = 0.0
    work.edges.by_place[:], work.edges.by_rate[:] = 1.0, 0.0
    for _ in range(_ITERATIONS):
        matrix[:] = 0.0
        residual[:] = 0.0
        residual[0] = load
        for side in range(2):
            of_side = kernel.of_ski(memory, side)
            _add_equations(kernel, system, (place, bent[side]), side, of_side, work, (matrix, residual))
        if not kernel.eliminate(matrix, residual):
            return False
        # a ski that is let down by more than it sinks leaves the snow
        share = min(1.0, 2e-3 / max(abs(residual[0]), 1e-12))
        place[2] -= share * residual[0]
        bent -= share * residual[1:].reshape(bent.shape)
        if not abs(residual[0]) < 1.0:
            return False
        if abs(residual[0]) < _REST:
            return True
    return False


def _add_equations(
    kernel: Any, system: CarvedSystem, at: tuple[Array, Array], side: int, memory: Groove, work: CarvedWork,
    equations: tuple[Array, Array],
) -> None:  # fmt: skip
    """Add to the matrix and the residual of rest those of a ski: the pelvis' height first, then what turns and bends
    each ski.

    at : place of the pelvis, and what turns and bends the ski
    """
    (place, bent), (matrix, residual) = at, equations
    coupling, joint, motion, own = system.coupling, system.joint, system.motion, len(bent)
    _, height, _, upright, long, left = kernel.place_ski(system, 0, side, tuple(place), bent, work)
    heave_axis, pitch_axis, level = (tuple(work.snow @ axis) for axis in (upright, left, long))
    pose = kernel.SkiPose(height, _STILL, work.local, _STILL, heave_axis, pitch_axis, bent[2:], np.zeros(own - 2))
    force, slopes = kernel.press_ski(system, memory, pose, level, 0.0, work)
    base = 1 + side * own
    rows = np.array([0, *range(base, base + own)])
    residual[rows] -= force[2:]
    matrix[np.ix_(rows, rows)] += slopes[2:, 2:]
    held = np.concatenate((joint.stiffness, system.ski.omega**2))
    felt = coupling.translation @ motion.ski_acceleration[0, side] + coupling.rotation @ motion.ski_turning[0, side]
    residual[rows[1:]] += held * bent
    residual[base : base + 2] -= joint.stiffness * joint.rest[side]
    residual[base + 2 : base + own] += felt
    matrix[rows[1:], rows[1:]] += held


def rest_tangents(
    kernel: Any, system: CarvedSystem, inputs: TangentInputs, at: tuple[Array, Array], load: Array, memory: Groove,
    rooms: tuple[CarvedWork, EdgeLines, CarvedRoom], start: Array,
) -> None:  # fmt: skip
    """Fill ``start`` (7 + 2k, d), whose first two rows are given, with the tangents of the pelvis' place and of both
    skis at rest in fresh snow.

    system : with a motion without speeds;  inputs : alike;  load : (d,) N
    at : what ``bend_at_rest`` finds, place of the pelvis and what turns and bends the skis
    """
    (place, bent), (work, lines, room), own = at, rooms, at[1].shape[1]
    size, first = 3 + 2 * own, 3 + own
    matrix, right, still = np.zeros((size - 2, size - 2)), np.zeros((size, len(load))), np.zeros_like(start)
    known = tuple(place), _STILL, np.zeros(size), bent, np.zeros_like(bent)
    right[2] = load
    for side in range(2):
        feet, base = inputs.feet[0, side], 3 + side * own
        kernel.collect_moved(room.moved[side], start, still, feet, side, own)
        room.moved[side, :, :first] = 0.0
        room.moved[side, AT + 2, 2] = 1.0
        for j in range(own):
            room.moved[side, BENT + j, 3 + j] = 1.0
        room.arrived[side] = 0.0
        kernel.linearise_ski(system, inputs, 0, side, 0.0, known, memory, work, lines, room)
        equations, carried, rows = room.equations[side], room.seen[side, FORCE + 2], slice(base - 2, base - 2 + own)
        matrix[0, 0] += carried[2]
        matrix[0, rows] = carried[3:first]
        matrix[rows, 0] = equations[3:, 2]
        matrix[rows, rows] = equations[3:, 3:first]
        right[2] -= carried[first:]
        right[base : base + own] -= equations[3:, first:]
        kernel.feel_tables(system.coupling, feet, base, right)
    start[2:] = np.linalg.solve(matrix, right[2:])
