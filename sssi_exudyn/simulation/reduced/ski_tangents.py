"""Derivatives of the forces of one ski on snow that edges do not cut, by what moves it and by the laws' parameters: a
template that ``compiled`` joins with ``tangents_kernel``.

A pass over the contact points linearises them; a point that touches down or lifts off adds nothing, as its force begins
from zero without a jump.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import cross, dot, out_of, plus, three_of, times
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.simulation.ski_on_snow.structs import SkiWork
from sssi_exudyn.terrain.surface import PATCH, on_change, patch_changes, patch_under

foot_derivatives: Callable[..., tuple[float, ...]]
foot_linearisation: Callable[..., None]
foot_on_snow_linearisation: Callable[..., None]
heights: Callable[..., tuple[float, float, float]]
linearise_ground: Callable[..., None]
mode_force_derivatives: Callable[..., Any]
penetration: Callable[..., float]
pose_points: Callable[..., None]
point_arm_derivatives: Callable[..., Any]
point_derivatives: Callable[..., tuple[float, float, float]]
point_in_snow_linearisation: Callable[..., None]
point_linearisation: Callable[..., None]
point_velocity: Callable[..., tuple[float, float, float]]
point_wrench: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float]]]
point_wrench_derivatives: Callable[..., Any]
risen_boot: Callable[..., Any]
sinking_rate: Callable[..., float]
ski_axes: Callable[..., Any]
snow_normal: Callable[..., tuple[float, float, float]]
snow_normal_derivatives: Callable[..., Any]
terrain_linearisation: Callable[..., None]
uneven: Callable[..., bool]
with_values: Callable[..., LawParameters]
GAP: int

PLACE, VELOCITY, TURN, SPIN, MODES = 0, 3, 6, 9, 12
"""First columns of a ski's linearisation: its foot's motion (3 each), then amplitudes and rates of the modes (k each),
then the parameters (c), then the six numbers of the snow surface's patch under the ski."""
ARM, NORMAL, CURVATURE, SLOPES, STATE, FORCE = 0, 3, 6, 9, 11, 14
"""First columns of ``SkiWork.touching``: a point's arm, the snow's normal, curvature (h_ff, h_fl, h_ll) and slopes;
depth, rate and length of edge; and the force."""
REACH, BENDING, RAISED = 12, 15, 18
"""Further columns of ``point_in_snow``'s derivatives, whose first twelve are those of the foot's motion."""
DEPTH, PUSH, TILT = range(3)
"""Rows of ``SkiWork.slopes`` and ``SkiWork.on_patch``; the last is the first of two."""
MODAL = 3
"""First row of the forces on the modes; the rows before are the snow's normal force on the pelvis."""
FURTHER = 10
"""Rows after those: moment about the foot (3), load, groove, friction (3), edge angle, force on the sole, counted from
3 + k."""
MOMENT, LOAD, GROOVE, FRICTION, EDGE, SOLE = 0, 3, 4, 5, 8, 9
BY_TURN, BY_SLOPE, BY_LOAD, BY_GROOVE, BY_PLACE, BY_FORCE = 3, 6, 8, 9, 10, 12
"""First columns of ``SkiWork.foot`` after those of the foot's velocity: its turn (3), both slopes of the snow, load,
groove, place (2), and the friction along and across."""
ONES = np.eye(PATCH)
"""Patches of which one number is one."""


@njit(cache=True, error_model="numpy")
def ski_work(points, modes, parameters):
    """Make room for ``linearise_ski``."""
    return SkiWork(
        np.zeros((points, 9)), np.zeros((points, 15)), np.zeros((points, 2, 21)), np.zeros((points, 3, modes)),
        np.zeros((4, MODES + 2 * modes)), np.zeros((4, PATCH)), np.zeros((3, 7 + modes)), np.zeros((3, 7)),
        np.zeros((3, 2)), np.zeros((3, parameters)), np.zeros((7, 11)), np.zeros((2, 7)), np.zeros((5, 14)),
        np.zeros((2, 6)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def linearise_ski(parameters, contact, columns, t, foot, eta, rate, side, work, matrix):
    """Fill ``matrix`` (3 + k + 10, 12 + 2k + columns + 6) with the derivatives of a ski's forces.

    foot, eta, rate : as in ``pose_points``;  side : 1 on the left, −1 on the right
    columns : ``ParameterColumns``;  work : ``SkiWork``
    """
    at = foot[0]
    under = patch_under(contact.surface, at[0], at[1])
    patched = contact.surface.coefficients.shape[0] > 0
    curved = patched or uneven(parameters)
    matrix[:] = 0.0
    pose_points(parameters, contact, foot, eta, rate, work.posed)
    count, load, groove = touch(parameters, contact, foot, under, curved, work)
    for i in range(count):
        fill_slopes(work, i)
        fill_pulls(work, i)
        add_columns(matrix, work.slopes, 0, work, i)
        add_turning(matrix, work, i)
        if patched:
            fill_patch(work, i)
            add_columns(matrix, work.on_patch, matrix.shape[1] - PATCH, work, i)
        if columns.point.shape[0] > 0:
            add_laws(matrix, work, parameters, columns, i)
        if columns.terrain.shape[0] > 0:
            add_terrain(matrix, work, parameters, columns, at, i)
    arm, velocity = risen_boot(contact, foot, eta, rate)
    boot = at, velocity, foot[2], foot[3]
    friction = linearise_foot(parameters, columns, t, boot, (load, groove, side), under, work, matrix)
    if contact.rise != 0.0:
        slide_boot(contact, foot, arm, rate, work, matrix)
    if patched:
        move_patch(matrix, work, contact.surface, at)
    if contact.rise != 0.0:
        push_boot(contact, foot, arm, friction, matrix)


@inlined
def touch(parameters, contact, foot, under, curved, work):
    """Fill ``work`` with the points in the snow; their number, load (N) and groove (m²).

    curved : whether the snow's slopes change from place to place
    """
    at, velocity, frame, spin = foot
    shape, length = contact.shape, contact.length
    posed, touching, point, reach = work.posed, work.touching, work.point, work.reach
    ground, by_parameter = work.by_ground, work.by_parameter
    count = 0
    load, groove = 0.0, 0.0
    for i in range(posed.shape[0]):
        if posed[i, GAP] <= 0.0:
            continue
        m, edge = i // 2, i % 2
        arm, bending, over = three_of(posed, i, 0), three_of(posed, i, 3), three_of(posed, i, GAP)
        normal = snow_normal(over[1], over[2])
        depth = penetration(over[0], normal)
        sinking = sinking_rate(point_velocity(velocity, spin, arm, bending), normal)
        push, by_depth, by_rate = point_derivatives(parameters, depth, sinking, length[m])
        load += push
        groove += depth * length[m]
        curvature = (0.0, 0.0, 0.0)
        if curved:
            linearise_ground(parameters, under, at[0] + arm[0], at[1] + arm[1], ground, by_parameter)
            curvature = (ground[1, 0], ground[1, 1], ground[2, 1])
        point_in_snow_linearisation(over, curvature, velocity, spin, arm, bending, point[count])
        for j in range(point.shape[2]):
            point[count, PUSH, j] = by_depth * point[count, DEPTH, j] + by_rate * point[count, PUSH, j]
        for j in range(3):
            touching[count, ARM + j], touching[count, NORMAL + j] = arm[j], normal[j]
            touching[count, CURVATURE + j] = curvature[j]
        touching[count, SLOPES], touching[count, SLOPES + 1] = over[1], over[2]
        touching[count, STATE], touching[count, STATE + 1], touching[count, STATE + 2] = depth, sinking, length[m]
        touching[count, FORCE] = push
        for k in range(reach.shape[2]):
            w = out_of(frame, (shape[m, edge, 0, k], shape[m, edge, 1, k], shape[m, edge, 2, k]))
            reach[count, 0, k], reach[count, 1, k], reach[count, 2, k] = w
        count += 1
    return count, load, groove


@inlined
def fill_slopes(work, i):
    """Fill ``work.slopes``: depth and force of the i-th point, and the slopes of the snow under it, by the ski's
    columns.
    """
    slopes, point, reach, touching = work.slopes, work.point, work.reach, work.touching
    modes = reach.shape[2]
    for row in range(2):
        for column in range(MODES):
            slopes[row, column] = point[i, row, column]
        for k in range(modes):
            a, b, c = reach[i, 0, k], reach[i, 1, k], reach[i, 2, k]
            slopes[row, MODES + k] = (
                a * point[i, row, REACH] + b * point[i, row, REACH + 1] + c * point[i, row, REACH + 2]
            )
            slopes[row, MODES + modes + k] = (
                a * point[i, row, BENDING] + b * point[i, row, BENDING + 1] + c * point[i, row, BENDING + 2]
            )
    _, (by_turn, _) = point_arm_derivatives(three_of(touching, i, ARM))
    for e in range(2):
        along, across = touching[i, CURVATURE + e], touching[i, CURVATURE + e + 1]
        slopes[TILT + e, PLACE], slopes[TILT + e, PLACE + 1] = along, across
        for j in range(3):
            slopes[TILT + e, TURN + j] = along * by_turn[0][j] + across * by_turn[1][j]
        for k in range(modes):
            slopes[TILT + e, MODES + k] = along * reach[i, 0, k] + across * reach[i, 1, k]


@inlined
def fill_pulls(work, i):
    """Fill ``work.pulls`` with what a newton on the i-th point, along the snow's normal, does to the pelvis, the modes,
    the moment about the foot and the load, and with what the force there does as the snow's two slopes grow.
    """
    touching, reach, pulls = work.touching, work.reach, work.pulls
    arm, normal, push = three_of(touching, i, ARM), three_of(touching, i, NORMAL), touching[i, FORCE]
    _, (by_f, by_l) = snow_normal_derivatives(touching[i, SLOPES], touching[i, SLOPES + 1])
    modes = reach.shape[2]
    for row, (size, direction) in enumerate(((1.0, normal), (push, by_f), (push, by_l))):
        force, moment = point_wrench(size, direction, arm)
        for j in range(3):
            pulls[row, j], pulls[row, MODAL + modes + MOMENT + j] = force[j], moment[j]
        for k in range(modes):
            pulls[row, MODAL + k] = reach[i, 0, k] * force[0] + reach[i, 1, k] * force[1] + reach[i, 2, k] * force[2]
    pulls[0, MODAL + modes + LOAD] = 1.0


@inlined
def add_columns(matrix, slopes, first, work, i):
    """Add what changes of the force on the i-th point to the columns from ``first`` on, by their ``slopes`` (4, c)."""
    pulls = work.pulls
    groove, length = pulls.shape[1], work.touching[i, STATE + 2]
    for row in range(pulls.shape[1]):
        push, by_f, by_l = pulls[0, row], pulls[1, row], pulls[2, row]
        for column in range(slopes.shape[1]):
            matrix[row, first + column] += (
                push * slopes[PUSH, column] + by_f * slopes[TILT, column] + by_l * slopes[TILT + 1, column]
            )
    for column in range(slopes.shape[1]):
        matrix[groove, first + column] += length * slopes[DEPTH, column]


@inlined
def fill_patch(work, i):
    """Fill ``work.on_patch``: the same as ``fill_slopes`` by the numbers of the patch under the ski."""
    touching, point, slopes = work.touching, work.point, work.on_patch
    for number in range(PATCH):
        change = on_change(ONES[number], touching[i, ARM], touching[i, ARM + 1])
        for row in range(2):
            slopes[row, number] = dot(change, three_of(point[i], row, RAISED))
        slopes[TILT, number], slopes[TILT + 1, number] = change[1], change[2]


@inlined
def add_turning(matrix, work, i):
    """Add what the force on the i-th point, as it is, does on an arm and on modes that turn and bend."""
    touching, reach = work.touching, work.reach
    modes = reach.shape[2]
    arm, normal = three_of(touching, i, ARM), three_of(touching, i, NORMAL)
    (force, _), (by_turn, by_reach) = point_wrench_derivatives(touching[i, FORCE], normal, arm)
    moment = MODAL + modes + MOMENT
    for row in range(3):
        for j in range(3):
            matrix[moment + row, TURN + j] += by_turn[1][row][j]
    for j in range(3):
        a, b, c = by_reach[1][j]
        for k in range(modes):
            matrix[moment + j, MODES + k] += a * reach[i, 0, k] + b * reach[i, 1, k] + c * reach[i, 2, k]
    for k in range(modes):
        _, by_mode = mode_force_derivatives(force, (reach[i, 0, k], reach[i, 1, k], reach[i, 2, k]))
        for j in range(3):
            matrix[MODAL + k, TURN + j] += by_mode[0][j]


@inlined
def add_laws(matrix, work, parameters, columns, i):
    """Add what the parameters of the laws at points change of the force on the i-th point."""
    touching, pulls, by_parameter = work.touching, work.pulls, work.by_parameter
    fixed = work.slopes.shape[1]
    depth, sinking, length = three_of(touching, i, STATE)
    point_linearisation(parameters, depth, sinking, length, work.by_state, by_parameter)
    row_of_values = -1
    for column in columns.point:
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            point_linearisation(others, depth, sinking, length, work.by_state, by_parameter)
        slope = by_parameter[0, columns.index[column]]
        for row in range(pulls.shape[1]):
            matrix[row, fixed + column] += pulls[0, row] * slope


@inlined
def add_terrain(matrix, work, parameters, columns, at, i):
    """Add what the parameters of the terrain change of the force on the i-th point."""
    touching, point, pulls, by_parameter = work.touching, work.point, work.pulls, work.by_parameter
    fixed, groove, length = work.slopes.shape[1], pulls.shape[1], touching[i, STATE + 2]
    f, l = at[0] + touching[i, ARM], at[1] + touching[i, ARM + 1]
    terrain_linearisation(parameters, f, l, work.by_state, by_parameter)
    row_of_values = -1
    for column in columns.terrain:
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            terrain_linearisation(others, f, l, work.by_state, by_parameter)
        p = columns.index[column]
        change = by_parameter[0, p], by_parameter[1, p], by_parameter[2, p]
        push = dot(change, three_of(point[i], PUSH, RAISED))
        for row in range(pulls.shape[1]):
            matrix[row, fixed + column] += push * pulls[0, row] + change[1] * pulls[1, row] + change[2] * pulls[2, row]
        matrix[groove, fixed + column] += length * dot(change, three_of(point[i], DEPTH, RAISED))


@inlined
def linearise_foot(parameters, columns, t, foot, carried, under, work, matrix):
    """Fill the rows of friction, edge angle and the sole, from those of load and groove; return the friction (N).

    foot : with the velocity of the boot;  carried : load (N), groove (m²) and the side
    under : the patch under the foot
    """
    at, velocity, frame, _spin = foot
    load, groove, side = carried
    _, h_f, h_l = heights(parameters, under, at[0], at[1])
    along, across, edge = ski_axes(snow_normal(h_f, h_l), frame)
    v_t, v_n = dot(velocity, along), dot(velocity, across)
    forces = foot_derivatives(parameters, load, v_t, v_n, edge, groove, t, at[0], at[1], side)
    by_parameter = work.by_parameter
    linearise_ground(parameters, under, at[0], at[1], work.by_ground, by_parameter)
    foot_linearisation(parameters, load, v_t, v_n, edge, groove, t, at[0], at[1], side, work.foot_law, by_parameter)
    foot_on_snow_linearisation(velocity, h_f, h_l, (load, forces[0], forces[1]), frame, work.foot_state)
    chain_foot(work)
    add_foot_motion(matrix, work)
    first, fixed = MODAL + work.reach.shape[2] + FRICTION, work.slopes.shape[1]
    row_of_values = -1
    for i in range(columns.foot.shape[0]):
        column = columns.foot[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            foot_linearisation(others, load, v_t, v_n, edge, groove, t, at[0], at[1], side, work.by_state, by_parameter)
        p = columns.index[column]
        for row in range(5):
            slope = work.foot[row]
            matrix[first + row, fixed + column] += (
                slope[BY_FORCE] * by_parameter[0, p] + slope[BY_FORCE + 1] * by_parameter[1, p]
            )
    row_of_values = -1
    for i in range(columns.terrain.shape[0]):
        column = columns.terrain[i]
        if columns.row[column] != row_of_values:
            row_of_values = columns.row[column]
            others = with_values(parameters, columns.values[row_of_values])
            terrain_linearisation(others, at[0], at[1], work.by_state, by_parameter)
        p = columns.index[column]
        for row in range(5):
            slope = work.foot[row]
            matrix[first + row, fixed + column] += (
                slope[BY_SLOPE] * by_parameter[1, p] + slope[BY_SLOPE + 1] * by_parameter[2, p]
            )
    return plus(times(forces[0], along), times(forces[1], across))


@inlined
def slide_boot(contact, foot, arm, rate, work, matrix):
    """Add to the foot's rows what the velocity of a boot that rises, v + ω × u h + u ḣ, has beyond the foot's own."""
    _, _, frame, spin = foot
    modes, rise = rate.shape[0], contact.rise
    up = (frame[0, 2], frame[1, 2], frame[2, 2])
    swing, rising = cross(spin, up), rise * rate[modes - 1]
    for row in range(5):
        slope, line = three_of(work.foot, row, 0), matrix[MODAL + modes + FRICTION + row]
        by_spin = cross(arm, slope)
        by_turn = plus(cross(arm, cross(slope, spin)), times(rising, cross(up, slope)))
        for j in range(3):
            line[SPIN + j] += by_spin[j]
            line[TURN + j] += by_turn[j]
        line[MODES + modes - 1] += rise * dot(slope, swing)
        line[MODES + 2 * modes - 1] += rise * dot(slope, up)


@inlined
def push_boot(contact, foot, arm, friction, matrix):
    """Add what the ``friction`` (N) on a boot that rises does to its mode, and its moment about the foot."""
    frame, rise = foot[2], contact.rise
    modes = contact.omega.shape[0]
    further, last = MODAL + modes, MODAL + modes - 1
    up = (frame[0, 2], frame[1, 2], frame[2, 2])
    for column in range(matrix.shape[1]):
        change = (
            matrix[further + FRICTION, column], matrix[further + FRICTION + 1, column],
            matrix[further + FRICTION + 2, column],
        )  # fmt: skip
        turning = cross(arm, change)
        matrix[last, column] += rise * dot(up, change)
        for j in range(3):
            matrix[further + MOMENT + j, column] += turning[j]
    by_turn, by_rise = cross(up, friction), cross(up, friction)
    for j in range(3):
        matrix[last, TURN + j] += rise * by_turn[j]
        matrix[further + MOMENT + j, MODES + modes - 1] += rise * by_rise[j]
        unit = (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2))
        moved = cross(cross(unit, arm), friction)
        for i in range(3):
            matrix[further + MOMENT + i, TURN + j] += moved[i]


@inlined
def chain_foot(work):
    """Fill ``work.foot``: from velocity, turn and slopes to sliding velocities and edge angle, from these by the laws
    to the friction's parts, and from them to the force on the foot.
    """
    state, law, foot = work.foot_state, work.foot_law, work.foot
    foot[:] = 0.0
    for row in range(5):
        if row == EDGE - FRICTION:
            for column in range(8):
                foot[row, column] = state[2, column]
            continue
        slopes = state[3 + min(row, 3)]
        for column in range(8):
            foot[row, column] = slopes[column]
        foot[row, BY_LOAD] = slopes[8]
        for i in range(2):
            by_force = slopes[9 + i]
            foot[row, BY_FORCE + i] = by_force
            foot[row, BY_LOAD] += by_force * law[i, 0]
            foot[row, BY_GROOVE] += by_force * law[i, 4]
            foot[row, BY_PLACE] += by_force * law[i, 5]
            foot[row, BY_PLACE + 1] += by_force * law[i, 6]
            for j in range(3):
                for column in range(8):
                    foot[row, column] += by_force * law[i, 1 + j] * state[j, column]


@inlined
def add_foot_motion(matrix, work):
    """Fill the foot's rows by ``work.foot`` in the columns of load and groove, motion, place and patch."""
    further = MODAL + work.reach.shape[2]
    load, groove, ground = matrix[further + LOAD], matrix[further + GROOVE], work.by_ground
    patch = matrix.shape[1] - PATCH
    for row in range(5):
        slope, line = work.foot[row], matrix[further + FRICTION + row]
        for column in range(line.shape[0]):
            line[column] = slope[BY_LOAD] * load[column] + slope[BY_GROOVE] * groove[column]
        for j in range(3):
            line[VELOCITY + j] += slope[j]
            line[TURN + j] += slope[BY_TURN + j]
        for j in range(2):
            tilting = slope[BY_SLOPE] * ground[1, j] + slope[BY_SLOPE + 1] * ground[2, j]
            line[PLACE + j] += slope[BY_PLACE + j] + tilting
            line[patch + 1 + j] += slope[BY_SLOPE + j]


@inlined
def move_patch(matrix, work, surface, at):
    """Add what changes as the patch under the ski goes with the foot."""
    patch = matrix.shape[1] - PATCH
    patch_changes(surface, at[0], at[1], work.patches)
    for row in range(matrix.shape[0]):
        for i in range(PATCH):
            for j in range(2):
                matrix[row, PLACE + j] += matrix[row, patch + i] * work.patches[j, i]
