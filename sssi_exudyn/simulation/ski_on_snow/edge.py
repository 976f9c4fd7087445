"""The snow's forces on the edges of one ski, and their linearisation: a template that ``compiled`` joins with the laws,
``ground``, ``groove`` and the formulas of ``point`` and ``edge_point``.

A ski has the coordinates x, y, z of its foot, small turns of the foot about the snow's axes, and its modes; the snow is
the plane z = 0, or the plane that the caller has turned the ski into the frame of.

What a station's forces depend on is linearised by the formulas' derivatives, and along the branches that law and memory
take, kinks included: a wall that yields, an edge that rises from the groove's floor, the edge that is the deeper one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, dot, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import inlined, njit

edge_force: Callable[..., tuple[float, float, float, float]]
edge_derivatives: Callable[..., tuple[float, ...]]
edge_linearisation: Callable[..., None]
edge_memory: Callable[..., tuple[float, float]]
edge_capacity: Callable[..., tuple[float, float]]
memory_linearisation: Callable[..., None]
edge_axes: Callable[..., Any]
flat_edge: Callable[..., tuple[float, ...]]
flat_edge_linearisation: Callable[..., None]
turned_edge_linearisation: Callable[..., None]
force_on_deeper: Callable[..., tuple[float, float, float]]
point_velocity: Callable[..., tuple[float, float, float]]
pass_over: Callable[..., None]

AT_LOWER, AT_UPPER, AT_SINKING, AT_V_T, AT_V_N, AT_RISE, AT_ANGLE, AT_DIRECTION = range(8)
"""Where ``turned_edge`` gives what the law depends on; ``flat_edge`` and ``edge_state`` give the first seven."""
STEERED = (AT_LOWER, AT_UPPER, AT_SINKING, AT_V_T, AT_V_N, AT_ANGLE)
"""Those by which ``edge_derivatives`` differentiates the forces."""
BY_LOW, BY_HIGH, BY_TANGENT, BY_VELOCITY = 0, 1, 2, 5
"""First columns of ``flat_edge_linearisation``: heights of both edges, tangent, velocity."""
ON_HEIGHT, ON_VELOCITY, ON_TURN, ON_SPIN, ON_MODES = 0, 1, 4, 7, 10
"""First columns of a linearisation: the boot centre's height, velocity, turn and spin on the snow, then amplitudes and
rates of the modes (k each) as far as they bend the ski there, then the laws' parameters (c).  In the place of the
modes ``turned_edge_linearisation`` has what they change of a station: places of both edges, tangent, velocity."""
POINT = 22
"""Columns of ``turned_edge_linearisation``."""


class EdgeSki(NamedTuple):
    """A ski's edges in the foot's frame: m stations from tail to tip, both edges (left, right), k modes.

    points, tangents : (m, 2, 3) m and unit vectors forward along the edge, unloaded
    shape, turning : (m, 2, 3, k) change of both a unit of the mode, against the boot centre
    give : (2, k) m, rad by which the boot centre heaves and pitches a unit of the mode; zero where it is held
    width, length, station : (m,) m: of the ski, of the edge that the point stands for, and place along the ski
    omega, ratio : (k,) rad/s, share of critical damping
    """

    points: Array
    tangents: Array
    shape: Array
    turning: Array
    give: Array
    width: Array
    length: Array
    station: Array
    omega: Array
    ratio: Array


class SkiPose(NamedTuple):
    """A ski as its edges meet the snow, in the snow's frame: height (m), velocity, rotation (3, 3) and spin of its
    boot centre, along which axis that heaves and about which it pitches with the modes, and the modes' amplitudes and
    rates (k,).  Vectors are tuples.
    """

    height: float
    velocity: Any
    frame: Array
    spin: Any
    heave_axis: Any
    pitch_axis: Any
    eta: Array
    rate: Array


class EdgeWork(NamedTuple):
    """What the forces on a ski are, and arrays in which they are found.

    force : (6 + k,) of the snow on the ski's coordinates;  matrix : (6 + k, 6 + k) their derivatives, the sign turned
    by_place, by_rate : (6 + k,) how the coordinates and their rates follow from what is sought
    state : (7, 8) derivatives by what ``flat_edge`` takes, pull : (4, 8) of the forces by the same
    towards, slopes : (4m, 6 + k) the forces' directions, and the derivatives of the forces in them: four rows for each
        station in the snow, the last rows unused
    seen : (m, 13) of each station at its deeper edge: normal, along, across (N), the wall's greatest force (N), depth
        of the edge and of the groove left (m), offset (m), v_t, v_n (m/s), edge (rad), rise (1), rate (m/s), and the
        wall's force (N, ≥ 0)
    """

    force: Array
    matrix: Array
    by_place: Array
    by_rate: Array
    state: Array
    pull: Array
    towards: Array
    slopes: Array
    seen: Array

    @classmethod
    def room(cls, points: int, modes: int) -> EdgeWork:
        """Make room for the forces on a ski of so many points an edge and vibrations."""
        size = 6 + modes
        return cls(
            force=np.zeros(size),
            matrix=np.zeros((size, size)),
            by_place=np.ones(size),
            by_rate=np.ones(size),
            state=np.zeros((7, 8)),
            pull=np.zeros((4, 8)),
            towards=np.zeros((4 * points, size)),
            slopes=np.zeros((4 * points, size)),
            seen=np.zeros((points, 13)),
        )


class EdgeLines(NamedTuple):
    """The linearisations of both skis, m stations, k modes, i = 10 + 2k + c columns; and room for one station's.

    force : (2, 6 + k, i) of the force on the boot centre, the moment about it and what bends the ski there
    by_memory : (2, 6 + k, 4m) of these by the memory that arrives: groove, offset, each the left edge's m points first
    left : (2, 6m, i) of what the snow remembers after the step: groove, offset, the m stations' speed and drift
    kept : (2, 2m, 2, 2) of groove and offset after the step by both as they arrive
    point : (8, 22) of what the law depends on, pull : (4, 22) of the forces, memory : (2, 22) of groove and offset
    towards, slopes : (4m, 6 + k), (4m, i) as in ``EdgeWork``
    reach : (k, 9) the modes' displacements of the deeper and of the other edge, and their turns of the tangent
    state, parameter, memory_state, memory_parameter : (4, 9), (4, p), (2, 9), (2, p) of the laws
    """

    force: Array
    by_memory: Array
    left: Array
    kept: Array
    point: Array
    pull: Array
    memory: Array
    towards: Array
    slopes: Array
    reach: Array
    state: Array
    parameter: Array
    memory_state: Array
    memory_parameter: Array

    @classmethod
    def room(cls, points: int, modes: int, columns: int, parameters: int) -> EdgeLines:
        """Make room for the linearisation by ``columns`` of the laws' ``parameters``."""
        size, width = 6 + modes, ON_MODES + 2 * modes + columns
        return cls(
            force=np.zeros((2, size, width)),
            by_memory=np.zeros((2, size, 4 * points)),
            left=np.zeros((2, 6 * points, width)),
            kept=np.zeros((2, 2 * points, 2, 2)),
            point=np.zeros((8, POINT)),
            pull=np.zeros((4, POINT)),
            memory=np.zeros((2, POINT)),
            towards=np.zeros((4 * points, size)),
            slopes=np.zeros((4 * points, width)),
            reach=np.zeros((modes, 9)),
            state=np.zeros((4, 9)),
            parameter=np.zeros((4, parameters)),
            memory_state=np.zeros((2, 9)),
            memory_parameter=np.zeros((2, parameters)),
        )


@njit(cache=True, error_model="numpy")
def press_edges(parameters, ski, memory, pose, step, work):
    """Fill ``work`` with a ski's snow forces and with their derivatives for Newton's method, and ``memory`` with what
    the snow would remember.

    Left out of the derivatives: how the directions of the forces turn, how the tangent's rise changes, and that the
    points' velocities change with their places.
    """
    force, matrix, towards, slopes = work.force, work.matrix, work.towards, work.slopes
    force[:] = 0.0
    work.seen[:] = 0.0
    rows = 0
    for i in range(ski.width.shape[0]):
        low, arm, other, tangent, bending = bend_station(ski, pose, i)
        velocity = point_velocity(pose.velocity, pose.spin, arm, bending)
        side = 2.0 * low - 1.0
        heights = pose.height + arm[2], pose.height + other[2]
        state = flat_edge(heights[0], heights[1], tangent, velocity, ski.width[i], side)
        pass_over(memory, low, i, state[AT_UPPER], state[AT_V_T], state[AT_V_N])
        if state[AT_LOWER] <= 0.0:
            continue
        section = law_section(state, memory, low, i, ski.width[i], ski.length[i], step)
        pressed = edge_derivatives(parameters, *section)
        memory.next_groove[low, i], memory.next_offset[low, i] = edge_memory(parameters, *section)
        see_station(work.seen, i, pressed, section, edge_capacity(parameters, *section), memory, low)
        axes = axes_on_plane(tangent)
        flat_edge_linearisation(heights[0], heights[1], tangent, velocity, ski.width[i], side, work.state)
        steer(work.pull, work.state, pressed, axes)
        pull = pull_of(pressed[0], pressed[1], pressed[2], pressed[3], axes)
        steer_station(ski, pose, i, low, (arm, other, tangent), pull, work, rows)
        rows += 4
    matrix[:] = 0.0
    if rows > 0:
        matrix -= np.dot(towards[:rows].T, slopes[:rows])


@njit(cache=True, error_model="numpy")
def axes_on_plane(tangent):
    """Return t, n and the normal of an edge on the plane z = 0."""
    up = (0.0, 0.0, 1.0)
    t, n = edge_axes(tangent, up)
    return t, n, up


@njit(cache=True, error_model="numpy")
def bend_station(ski, pose, i):
    """Return which edge of a station is the deeper one (0 left, 1 right), and where it and the other are on the snow.

    Places are about the foot (m).  The deeper edge's tangent (not of unit length) and its velocity by the modes (m/s)
    follow.
    """
    frame, eta = pose.frame, pose.eta
    left = bent_vector(frame, three(ski.points[i, 0], 0), ski.shape, eta, i, 0)
    right = bent_vector(frame, three(ski.points[i, 1], 0), ski.shape, eta, i, 1)
    low = 1 if -pose.height - right[2] > -pose.height - left[2] else 0
    arm, other = (right, left) if low == 1 else (left, right)
    tangent = bent_vector(frame, three(ski.tangents[i, low], 0), ski.turning, eta, i, low)
    return low, arm, other, tangent, bent_vector(frame, (0.0, 0.0, 0.0), ski.shape, pose.rate, i, low)


@njit(cache=True, error_model="numpy")
def law_section(state, memory, low, i, width, length, step):
    """Return a station as the laws of the edges take it."""
    groove, offset = memory.arrived_groove[low, i], memory.arrived_offset[low, i]
    return (
        state[AT_LOWER], state[AT_UPPER], state[AT_SINKING], width, groove, offset, step, state[AT_V_T], state[AT_V_N],
        state[AT_RISE], state[AT_ANGLE], length,
    )  # fmt: skip


@inlined
def see_station(seen, i, pressed, section, wall, memory, low):
    """Fill a station's row of ``EdgeWork.seen``.

    wall : N, the greatest force of the groove's wall, and its force
    """
    seen[i, 0], seen[i, 1], seen[i, 2], seen[i, 3], seen[i, 12] = pressed[0], pressed[1], pressed[2], wall[0], wall[1]
    seen[i, 4], seen[i, 5], seen[i, 6] = section[0], memory.next_groove[low, i], memory.next_offset[low, i]
    seen[i, 7], seen[i, 8], seen[i, 9], seen[i, 10], seen[i, 11] = (
        section[7], section[8], section[10], section[9], section[2]
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def pull_of(push, along, across, at_other, axes):
    """Return the components of the force on the deeper edge, and the force along the normal on the other one; or the
    changes of these.

    axes : t, n and the normal of the deeper edge
    """
    force = force_on_deeper(push, along, across, at_other, axes[0], axes[1], axes[2])
    return force[0], force[1], force[2], at_other


@njit(cache=True, error_model="numpy")
def steer(pull, state, pressed, axes):
    """Fill ``pull`` (4, columns) with the derivatives of ``pull_of`` by what ``state`` (≥ 7, columns) is linearised by.

    pressed : as ``edge_derivatives`` gives it
    """
    for c in range(pull.shape[1]):
        push, along, across, at_other = 0.0, 0.0, 0.0, 0.0
        for j in range(6):
            slope = state[STEERED[j], c]
            push += pressed[4 + j] * slope
            along += pressed[10 + j] * slope
            across += pressed[16 + j] * slope
            at_other += pressed[22 + j] * slope
        pull[0, c], pull[1, c], pull[2, c], pull[3, c] = pull_of(push, along, across, at_other, axes)


@inlined
def steer_station(ski, pose, i, low, point, pull, work, row):
    """Add a station's forces ``pull`` to ``work.force``; fill its rows of ``towards`` and ``slopes``, from ``row`` on.

    point : places of the deeper and of the other edge about the foot, and the deeper one's tangent
    """
    (arm, other, tangent), frame, modes = point, pose.frame, ski.omega.shape[0]
    none = (0.0, 0.0, 0.0)
    for c in range(6):
        axis = (1.0 if c % 3 == 0 else 0.0, 1.0 if c % 3 == 1 else 0.0, 1.0 if c % 3 == 2 else 0.0)
        moved, over, turned = (axis, axis, none) if c < 3 else (
            cross(axis, arm), cross(axis, other), cross(axis, tangent)
        )  # fmt: skip
        steer_coordinate(work, row, c, moved, over[2], turned, pull)
    pitched, over_pitched = cross(pose.pitch_axis, arm), cross(pose.pitch_axis, other)
    tipped, up = cross(pose.pitch_axis, tangent), pose.heave_axis
    for k in range(modes):
        heave, pitch = ski.give[0, k], ski.give[1, k]
        moved = plus(mode_vector(frame, ski.shape, i, low, k), plus(times(heave, up), times(pitch, pitched)))
        over = plus(mode_vector(frame, ski.shape, i, 1 - low, k), plus(times(heave, up), times(pitch, over_pitched)))
        turned = plus(mode_vector(frame, ski.turning, i, low, k), times(pitch, tipped))
        steer_coordinate(work, row, 6 + k, moved, over[2], turned, pull)


@njit(cache=True, error_model="numpy")
def mode_vector(frame, shape, i, edge, k):
    """Return what a unit of a mode changes of a vector of an edge point."""
    return out_of(frame, (shape[i, edge, 0, k], shape[i, edge, 1, k], shape[i, edge, 2, k]))


@inlined
def steer_coordinate(work, row, c, moved, over, turned, pull):
    """Fill a coordinate's column of a station's rows.

    moved, over, turned : by which a unit of it moves the deeper edge, lifts the other and turns the tangent
    """
    by_place, by_rate, by = work.by_place[c], work.by_rate[c], work.pull
    for part in range(4):
        placed, paced = by[part, BY_LOW] * moved[2] + by[part, BY_HIGH] * over, 0.0
        for d in range(3):
            placed += by[part, BY_TANGENT + d] * turned[d]
            paced += by[part, BY_VELOCITY + d] * moved[d]
        work.slopes[row + part, c] = by_place * placed + by_rate * paced
    for part in range(3):
        work.towards[row + part, c] = moved[part]
    work.towards[row + 3, c] = over
    work.force[c] += pull[0] * moved[0] + pull[1] * moved[1] + pull[2] * moved[2] + pull[3] * over


@njit(cache=True, error_model="numpy")
def linearise_edges(parameters, ski, memory, pose, step, columns, lines, side):
    """Fill the linearisations of one ski in ``lines``, the memory advected; the others as in ``press_edges``."""
    stations = ski.width.shape[0]
    lines.force[side] = 0.0
    lines.by_memory[side] = 0.0
    lines.left[side] = 0.0
    lines.kept[side] = 0.0
    rows = 0
    for i in range(stations):
        low, arm, other, tangent, bending = bend_station(ski, pose, i)
        turned_edge_linearisation(
            pose.height, pose.velocity, pose.spin, arm, other, tangent, bending, ski.width[i], 2.0 * low - 1.0,
            lines.point,
        )  # fmt: skip
        velocity = point_velocity(pose.velocity, pose.spin, arm, bending)
        state = flat_edge(
            pose.height + arm[2], pose.height + other[2], tangent, velocity, ski.width[i], 2.0 * low - 1.0
        )  # fmt: skip
        fill_reach(lines.reach, ski, pose.frame, i, low)
        by_coordinates(lines.point[AT_V_T], lines.reach, lines.left[side, 4 * stations + i])
        by_coordinates(lines.point[AT_V_N], lines.reach, lines.left[side, 5 * stations + i])
        if state[AT_LOWER] <= 0.0:
            continue
        over = (1 - low) * stations + i
        if state[AT_UPPER] > memory.arrived_groove[1 - low, i]:
            by_coordinates(lines.point[AT_UPPER], lines.reach, lines.left[side, over])
        elif state[AT_UPPER] > 0.0:
            lines.kept[side, over, 0, 0] = 1.0
        section = law_section(state, memory, low, i, ski.width[i], ski.length[i], step)
        edge_linearisation(parameters, *section, lines.state, lines.parameter)
        memory_linearisation(parameters, *section, lines.memory_state, lines.memory_parameter)
        axes = axes_on_plane(tangent)
        pressed = edge_force(parameters, *section)
        linearise_pull(lines, pressed, axes)
        linearise_station(lines, columns, side, i, low, axes, rows)
        towards, row = lines.towards[rows : rows + 4], low * stations + i
        rows += 4
        direct_forces(towards, arm, other, lines.reach)
        add_remembered(lines.by_memory[side], towards, row, lines.state, axes)
        pull = pull_of(pressed[0], pressed[1], pressed[2], pressed[3], axes)
        add_swung(lines.force[side], arm, other, lines.reach, (pull[0], pull[1], pull[2]), (0.0, 0.0, pull[3]))
    if rows > 0:
        lines.force[side] += np.dot(lines.towards[:rows].T, lines.slopes[:rows])


@inlined
def fill_reach(reach, ski, frame, i, low):
    """Fill ``reach`` with what each mode changes of a station's edges and of its tangent."""
    for k in range(reach.shape[0]):
        moved, over = mode_vector(frame, ski.shape, i, low, k), mode_vector(frame, ski.shape, i, 1 - low, k)
        turned = mode_vector(frame, ski.turning, i, low, k)
        for c in range(3):
            reach[k, c], reach[k, 3 + c], reach[k, 6 + c] = moved[c], over[c], turned[c]


@njit(cache=True, error_model="numpy")
def by_coordinates(by_point, reach, to):
    """Fill a row ``to`` (≥ 10 + 2k,) with derivatives by the ski's coordinates, from those by a station (22,)."""
    modes = reach.shape[0]
    for c in range(ON_MODES):
        to[c] = by_point[c]
    for k in range(modes):
        placed, paced = 0.0, 0.0
        for c in range(9):
            placed += by_point[ON_MODES + c] * reach[k, c]
        for c in range(3):
            paced += by_point[ON_MODES + 9 + c] * reach[k, c]
        to[ON_MODES + k], to[ON_MODES + modes + k] = placed, paced


@njit(cache=True, error_model="numpy")
def by_station(by_state, point, c):
    """Return a law's derivative by a column of ``point``, from that by its state (9,)."""
    return (
        by_state[0] * point[AT_LOWER, c] + by_state[1] * point[AT_UPPER, c] + by_state[2] * point[AT_SINKING, c]
        + by_state[5] * point[AT_V_T, c] + by_state[6] * point[AT_V_N, c] + by_state[7] * point[AT_RISE, c]
        + by_state[8] * point[AT_ANGLE, c]
    )  # fmt: skip


@inlined
def linearise_pull(lines, pressed, axes):
    """Fill ``lines.pull`` and ``lines.memory`` from the laws' derivatives; the forces turn with the edge."""
    by, after, point, pull = lines.state, lines.memory_state, lines.point, lines.pull
    swung = plus(times(pressed[1], axes[1]), times(-pressed[2], axes[0]))
    for c in range(POINT):
        push, along, across, at_other = (
            by_station(by[0], point, c), by_station(by[1], point, c), by_station(by[2], point, c),
            by_station(by[3], point, c),
        )  # fmt: skip
        x, y, z, up = pull_of(push, along, across, at_other, axes)
        turned = point[AT_DIRECTION, c]
        pull[0, c], pull[1, c], pull[2, c], pull[3, c] = x + swung[0] * turned, y + swung[1] * turned, z, up
        lines.memory[0, c], lines.memory[1, c] = by_station(after[0], point, c), by_station(after[1], point, c)


@inlined
def linearise_station(lines, columns, side, i, low, axes, first):
    """Fill a station's rows of ``slopes``, from ``first`` on, and of ``left``, and what the memory does that arrives
    there.
    """
    left, kept, after = lines.left[side], lines.kept[side], lines.memory_state
    stations, fixed = left.shape[0] // 6, ON_MODES + 2 * lines.reach.shape[0]
    row = low * stations + i
    for part in range(4):
        by_coordinates(lines.pull[part], lines.reach, lines.slopes[first + part])
    for part in range(2):
        at = 2 * stations * part + row
        by_coordinates(lines.memory[part], lines.reach, left[at])
        kept[row, part, 0], kept[row, part, 1] = after[part, 3], after[part, 4]
        for column in columns.edge:
            left[at, fixed + column] = lines.memory_parameter[part, columns.index[column]]
    for column in columns.edge:
        changed = lines.parameter[:, columns.index[column]]
        pull = pull_of(changed[0], changed[1], changed[2], changed[3], axes)
        for part in range(4):
            lines.slopes[first + part, fixed + column] = pull[part]


@inlined
def direct_forces(towards, arm, other, reach):
    """Fill four rows (6 + k) of a station: the directions of the forces along x, y and z on the deeper edge, and up on
    the other one.
    """
    for part in range(4):
        c = min(part, 2)
        axis = (1.0 if c == 0 else 0.0, 1.0 if c == 1 else 0.0, 1.0 if c == 2 else 0.0)
        turning = cross(other if part == 3 else arm, axis)
        for d in range(3):
            towards[part, d], towards[part, 3 + d] = axis[d], turning[d]
        for k in range(reach.shape[0]):
            towards[part, 6 + k] = reach[k, 5 if part == 3 else c]


@inlined
def add_remembered(by_memory, towards, row, by_state, axes):
    """Add to ``by_memory`` (6 + k, 4m) what groove and offset do that arrive at a station.

    row : of the groove at the deeper edge;  by_state : (4, 9) of the law
    """
    for part in range(2):
        at = part * (by_memory.shape[1] // 2) + row
        by = by_state[:, 3 + part]
        pull = pull_of(by[0], by[1], by[2], by[3], axes)
        for c in range(by_memory.shape[0]):
            for d in range(4):
                by_memory[c, at] += towards[d, c] * pull[d]


@inlined
def add_swung(force, arm, other, reach, at_low, at_other):
    """Add to ``force`` (6 + k, i) what a station's forces (3) at both edges do where these move under them."""
    modes = reach.shape[0]
    for j in range(3):
        axis = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        turning = plus(cross(cross(axis, arm), at_low), cross(cross(axis, other), at_other))
        for c in range(3):
            force[3 + c, ON_TURN + j] += turning[c]
        for k in range(modes):
            moved, over = cross(axis, three(reach[k], 0)), cross(axis, three(reach[k], 3))
            force[6 + k, ON_TURN + j] += dot(moved, at_low) + dot(over, at_other)
    for k in range(modes):
        turning = plus(cross(three(reach[k], 0), at_low), cross(three(reach[k], 3), at_other))
        for c in range(3):
            force[3 + c, ON_MODES + k] += turning[c]


@njit(cache=True, error_model="numpy")
def bent_vector(frame, unloaded, shape, eta, i, edge):
    """Return a vector of an edge point in the bent ski, or with the modes' rates its rate, turned out of the foot's
    frame.

    unloaded : (3) of the ski as it was made
    """
    a, b, c = unloaded
    for k in range(eta.shape[0]):
        a += shape[i, edge, 0, k] * eta[k]
        b += shape[i, edge, 1, k] * eta[k]
        c += shape[i, edge, 2, k] * eta[k]
    return out_of(frame, (a, b, c))


@njit(cache=True, error_model="numpy")
def eliminate(matrix, right):
    """Solve a linear system in place of its right side (n,), with row pivoting.  False where it is singular."""
    n = right.shape[0]
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(matrix[r, i]) > abs(matrix[best, i]):
                best = r
        if not abs(matrix[best, i]) > 0.0:
            return False
        if best != i:
            for c in range(i, n):
                matrix[i, c], matrix[best, c] = matrix[best, c], matrix[i, c]
            right[i], right[best] = right[best], right[i]
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in range(i + 1, n):
                    matrix[r, c] -= factor * matrix[i, c]
                right[r] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for c in range(i + 1, n):
            total -= matrix[i, c] * right[c]
        right[i] = total / matrix[i, i]
    return True
