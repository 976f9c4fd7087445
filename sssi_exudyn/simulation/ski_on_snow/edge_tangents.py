"""The forces on the edges of a ski, and what the snow remembers of it, linearised: a template that ``compiled`` joins
with ``ground_kernel``, ``groove_kernel``, ``carving_kernel`` and the laws.

Everything is differentiated along the branches that the law takes, kinks included: a wall that yields, an edge that
rises from the groove's floor, the edge that is the deeper one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, dot, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit

angle_by_depths: Callable[..., float]
edge_force: Callable[..., tuple[float, float, float, float]]
edge_linearisation: Callable[..., None]
memory_linearisation: Callable[..., None]
deeper_edge: Callable[..., tuple[Any, ...]]
between_stations: Callable[..., tuple[int, int, float]]
passing_time: Callable[..., float]
LOWER: int
UPPER: int
RATE: int
ALONG: int
ACROSS: int
SWING: int

RISE, TILT = 6, 7
"""Rows of what a point's force depends on besides those of ``carving_kernel``: the tangent's rise, the edge angle."""
ON_HEIGHT, ON_VELOCITY, ON_TURN, ON_SPIN, ON_MODES = 0, 1, 4, 7, 10
"""First columns of a linearisation: the boot centre's height, velocity, turn and spin on the snow, then amplitudes and
rates of the modes (k each) as far as they bend the ski there, then the laws' parameters (c)."""


class EdgeLines(NamedTuple):
    """The linearisations of both skis, m stations, k modes, i = 10 + 2k + c columns; and room for one point's.

    force : (2, 6 + k, i) of the force on the boot centre, the moment about it and what bends the ski there
    by_memory : (2, 6 + k, 4m) of these by the memory that arrives: groove, offset, each the left edge's m points first
    left : (2, 6m, i) of what the snow remembers after the step: groove, offset, the m stations' speed and drift
    kept : (2, 2m, 2, 2) of groove and offset after the step by both as they arrive
    rows : (8, i) of what a point's force depends on;  towards, slopes : (5m, 6 + k), (5m, i)
    reach : (2, k, 3) the modes' displacements of the deeper and of the other edge
    state, parameter, memory_state, memory_parameter : (4, 9), (4, p), (2, 9), (2, p) of the laws
    """

    force: Array
    by_memory: Array
    left: Array
    kept: Array
    rows: Array
    towards: Array
    slopes: Array
    reach: Array
    state: Array
    parameter: Array
    memory_state: Array
    memory_parameter: Array


@njit(cache=True, error_model="numpy")
def edge_lines(points, modes, columns, parameters):
    """Room for the linearisation by so many of the laws' ``parameters``."""
    size, width = 6 + modes, ON_MODES + 2 * modes + columns
    return EdgeLines(
        np.zeros((2, size, width)), np.zeros((2, size, 4 * points)), np.zeros((2, 6 * points, width)),
        np.zeros((2, 2 * points, 2, 2)), np.zeros((8, width)), np.zeros((5 * points, size)),
        np.zeros((5 * points, width)), np.zeros((2, modes, 3)), np.zeros((4, 9)), np.zeros((4, parameters)),
        np.zeros((2, 9)), np.zeros((2, parameters)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def fill_column(rows, column, arm, other, tangent, moving, at):
    """Fill a column of ``rows`` where one coordinate moves a point's edges by ``arm`` and ``other``, and changes the
    tangent and the velocity.

    at : the tangent, its directions t and n in the snow's plane, its length in it, rise, v_t, v_n, and the edge angle
        by the difference of both depths
    """
    whole, t, n, flat, rise, v_t, v_n, by_depths = at
    square = dot(whole, whole)
    swing = dot(n, tangent) / flat
    rows[LOWER, column], rows[UPPER, column], rows[RATE, column] = -arm[2], -other[2], -moving[2]
    rows[ALONG, column] = dot(t, moving) + v_n * swing
    rows[ACROSS, column] = dot(n, moving) - v_t * swing
    rows[SWING, column] = swing
    rows[RISE, column] = tangent[2] / math.sqrt(square) - rise * dot(whole, tangent) / square
    rows[TILT, column] = by_depths * (other[2] - arm[2])


@njit(cache=True, error_model="numpy")
def fill_point(rows, reach, ski, foot, eta, rate, i):
    """Fill ``rows`` (but the parameters' columns) and ``reach`` for a station; its ``deeper_edge``, t, n, rise, v_t and
    v_n.
    """
    frame, spin = foot[2], foot[3]
    modes = ski.omega.shape[0]
    low, lower, upper, edge, arm, other, tangent, bending, moving = deeper_edge(ski, foot, eta, rate, i)
    flat = math.sqrt(tangent[0] * tangent[0] + tangent[1] * tangent[1])
    t = (tangent[0] / flat, tangent[1] / flat, 0.0)
    n = (-t[1], t[0], 0.0)
    rise = tangent[2] / math.sqrt(dot(tangent, tangent))
    v_t, v_n = dot(moving, t), dot(moving, n)
    at = (tangent, t, n, flat, rise, v_t, v_n, angle_by_depths(low, edge, ski.width[i]))
    none = (0.0, 0.0, 0.0)
    fill_column(rows, ON_HEIGHT, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), none, none, at)
    for j in range(3):
        axis = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        swung = cross(axis, arm)
        turned = plus(cross(spin, swung), cross(axis, bending))
        fill_column(rows, ON_VELOCITY + j, none, none, none, axis, at)
        fill_column(rows, ON_TURN + j, swung, cross(axis, other), cross(axis, tangent), turned, at)
        fill_column(rows, ON_SPIN + j, none, none, none, swung, at)
    for k in range(modes):
        for edge_of in range(2):
            e = low if edge_of == 0 else 1 - low
            moved = out_of(frame, (ski.shape[i, e, 0, k], ski.shape[i, e, 1, k], ski.shape[i, e, 2, k]))
            for c in range(3):
                reach[edge_of, k, c] = moved[c]
        moved, over = three(reach[0, k], 0), three(reach[1, k], 0)
        swung = out_of(frame, (ski.turning[i, low, 0, k], ski.turning[i, low, 1, k], ski.turning[i, low, 2, k]))
        fill_column(rows, ON_MODES + k, moved, over, swung, cross(spin, moved), at)
        fill_column(rows, ON_MODES + modes + k, none, none, none, moved, at)
    return low, lower, upper, edge, arm, other, -moving[2], t, n, rise, v_t, v_n


@njit(cache=True, error_model="numpy")
def fill_directions(towards, arm, other, reach, t, n, across, along):
    """Fill five rows (6 + k) of a point: the directions of the forces along the normal, t, n and of the share that acts
    at the other edge, and what forces ``along`` t and ``across`` add where the tangent turns.
    """
    up = (0.0, 0.0, 1.0)
    lever = cross(plus(other, times(-1.0, arm)), up)
    for part in range(3):
        direction = up if part == 0 else (t if part == 1 else n)
        turning = cross(arm, direction)
        for c in range(3):
            towards[part, c], towards[part, 3 + c] = direction[c], turning[c]
        for k in range(reach.shape[1]):
            towards[part, 6 + k] = dot(three(reach[0, k], 0), direction)
    for c in range(3):
        towards[3, c], towards[3, 3 + c] = 0.0, lever[c]
    for k in range(reach.shape[1]):
        towards[3, 6 + k] = reach[1, k, 2] - reach[0, k, 2]
    for c in range(towards.shape[1]):
        towards[4, c] = along * towards[2, c] - across * towards[1, c]


@njit(cache=True, error_model="numpy")
def add_swung(force, arm, other, reach, at_low, at_other):
    """Add to ``force`` (6 + k, i) what a point's forces (3) at both edges do where these move under them."""
    modes = reach.shape[1]
    for j in range(3):
        axis = (1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0)
        turning = plus(cross(cross(axis, arm), at_low), cross(cross(axis, other), at_other))
        for c in range(3):
            force[3 + c, ON_TURN + j] += turning[c]
        for k in range(modes):
            moved, over = cross(axis, three(reach[0, k], 0)), cross(axis, three(reach[1, k], 0))
            force[6 + k, ON_TURN + j] += dot(moved, at_low) + dot(over, at_other)
    for k in range(modes):
        turning = plus(cross(three(reach[0, k], 0), at_low), cross(three(reach[1, k], 0), at_other))
        for c in range(3):
            force[3 + c, ON_MODES + k] += turning[c]


@njit(cache=True, error_model="numpy")
def add_laws(to, by_state, rows, by_parameter, columns, fixed):
    """Fill a row ``to`` (i,) with a law's derivatives by its state (9,) times what the state depends on, and by its
    parameters.
    """
    for c in range(fixed):
        to[c] = (
            by_state[0] * rows[LOWER, c] + by_state[1] * rows[UPPER, c] + by_state[2] * rows[RATE, c]
            + by_state[5] * rows[ALONG, c] + by_state[6] * rows[ACROSS, c] + by_state[7] * rows[RISE, c]
            + by_state[8] * rows[TILT, c]
        )  # fmt: skip
    for column in columns.edge:
        to[fixed + column] = by_parameter[columns.index[column]]


@njit(cache=True, error_model="numpy")
def linearise_edges(parameters, ski, memory, foot, eta, rate, step, columns, lines, side):
    """Fill the linearisations of one ski in ``lines``, the memory advected; the others as in ``press_edges``."""
    stations, modes = ski.width.shape[0], ski.omega.shape[0]
    fixed = ON_MODES + 2 * modes
    force, by_memory, left, kept = lines.force[side], lines.by_memory[side], lines.left[side], lines.kept[side]
    rows, towards, slopes, reach = lines.rows, lines.towards, lines.slopes, lines.reach
    by, by_parameter, after, after_parameter = lines.state, lines.parameter, lines.memory_state, lines.memory_parameter
    force[:] = 0.0
    by_memory[:] = 0.0
    left[:] = 0.0
    kept[:] = 0.0
    towards[:] = 0.0
    slopes[:] = 0.0
    for i in range(stations):
        low, lower, upper, edge, arm, other, sinking, t, n, rise, v_t, v_n = fill_point(
            rows, reach, ski, foot, eta, rate, i
        )
        for c in range(fixed):
            left[4 * stations + i, c] = rows[ALONG, c]
            left[5 * stations + i, c] = rows[ACROSS, c]
        if lower <= 0.0:
            continue
        row, over = low * stations + i, (1 - low) * stations + i
        if upper > memory.arrived_groove[1 - low, i]:
            for c in range(fixed):
                left[over, c] = rows[UPPER, c]
        elif upper > 0.0:
            kept[over, 0, 0] = 1.0
        groove, offset = memory.arrived_groove[low, i], memory.arrived_offset[low, i]
        width, length = ski.width[i], ski.length[i]
        normal, along, across, share = edge_force(
            parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, edge, length
        )
        edge_linearisation(
            parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, edge, length,
            by, by_parameter,
        )  # fmt: skip
        memory_linearisation(
            parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, edge, length,
            after, after_parameter,
        )  # fmt: skip
        fill_directions(towards[5 * i : 5 * i + 5], arm, other, reach, t, n, across, along)
        for part in range(4):
            add_laws(slopes[5 * i + part], by[part], rows, by_parameter[part], columns, fixed)
            for c in range(force.shape[0]):
                by_memory[c, row] += towards[5 * i + part, c] * by[part, 3]
                by_memory[c, 2 * stations + row] += towards[5 * i + part, c] * by[part, 4]
        for c in range(fixed):
            slopes[5 * i + 4, c] = rows[SWING, c]
        at_low = plus((0.0, 0.0, normal - share), plus(times(along, t), times(across, n)))
        add_swung(force, arm, other, reach, at_low, (0.0, 0.0, share))
        for part in range(2):
            add_laws(left[2 * stations * part + row], after[part], rows, after_parameter[part], columns, fixed)
            kept[row, part, 0], kept[row, part, 1] = after[part, 3], after[part, 4]
    force += np.dot(towards.T, slopes)


@njit(cache=True, error_model="numpy")
def advect_tangents(ski, memory, step, held, arrived):
    """Fill ``arrived`` (4m, d) with the tangents of the memory that ``advect`` brings, from those of what the last step
    left, ``held`` (6m, d).  To be called before its memory is accepted anew.
    """
    station = ski.station
    stations = station.shape[0]
    for edge in range(2):
        for i in range(stations):
            row = edge * stations + i
            speed = memory.speed[edge, i]
            place = station[i] + step * speed
            arrived[row] = 0.0
            arrived[2 * stations + row] = 0.0
            if not (speed >= 0.0 and place <= station[stations - 1]):
                continue
            ahead, beyond, share = between_stations(station, i, place)
            pace = step / (station[beyond] - station[ahead]) if beyond > ahead else 0.0
            for part in range(2):
                values = memory.groove if part == 0 else memory.offset
                first = 2 * stations * part + edge * stations
                slope = pace * (values[edge, beyond] - values[edge, ahead])
                for k in range(held.shape[1]):
                    arrived[first + i, k] = (
                        (1.0 - share) * held[first + ahead, k] + share * held[first + beyond, k]
                        + slope * held[4 * stations + i, k]
                    )  # fmt: skip
            since = passing_time(station, ahead, beyond, share, speed, step)
            rising = memory.drift[edge, beyond] - memory.drift[edge, ahead]
            by_speed = (step - since) * (pace + (1.0 - share) / speed) * rising if speed > 0.0 else 0.0
            by_ahead, by_beyond = (1.0 - share) * (step - since), share * step + (1.0 - share) * since
            for k in range(held.shape[1]):
                arrived[2 * stations + row, k] += 0.5 * (
                    by_ahead * held[5 * stations + ahead, k] + by_beyond * held[5 * stations + beyond, k]
                    - step * held[5 * stations + i, k] + by_speed * held[4 * stations + i, k]
                )  # fmt: skip


@njit(cache=True, error_model="numpy")
def leave_tangents(lines, side, moved, arrived, held):
    """Fill ``held`` (6m, d) with the tangents of what the step leaves, ``moved`` (i, d) those of what moves the ski."""
    np.dot(lines.left[side], moved, held)
    kept = lines.kept[side]
    rows = kept.shape[0]
    for row in range(rows):
        for part in range(2):
            for k in range(held.shape[1]):
                held[rows * part + row, k] += (
                    kept[row, part, 0] * arrived[row, k] + kept[row, part, 1] * arrived[rows + row, k]
                )
