"""Derivatives of a run of the reduced model by any numbers, carried along with it: a template that ``compiled`` joins
with ``newmark``, ``steps_kernel``, ``surroundings_tangents`` and the laws.

At an instant the residual r(a, q, q̇, p) = 0 gives the accelerations a, and with them q and q̇ by Newmark's rule
(``newmark``).  Its tangents by a number p follow from the same equations, linearised where the step has converged:

    (∂r/∂a + h²/4 ∂r/∂q + h/2 ∂r/∂q̇) da = −∂r/∂q dq* − ∂r/∂q̇ dq̇* − ∂r/∂p dp

with dq* and dq̇* what the instant before gives.  All numbers share one matrix, and one pass over the contact points: a
ski's forces are linearised by what moves it (the foot's place, velocity, turn and spin, the modes) and by the laws'
parameters.  A point that touches down or lifts off adds nothing, as its force begins from zero without a jump.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import cross, dot, out_of, plus, ski_axes, three, times
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.simulation.ski_on_snow.structs import NewtonWork, ReducedState, SkiWork, TangentState, TimeStep
from sssi_exudyn.terrain.surface import PATCH, on_change, on_patch, patch_changes, patch_under

advance: Callable[..., bool]
first_state: Callable[..., tuple[ReducedState, NewtonWork]]
heights: Callable[..., tuple[float, float, float]]
with_values: Callable[..., LawParameters]
point_force: Callable[..., float]
foot_force: Callable[..., tuple[float, float]]
point_linearisation: Callable[..., None]
foot_linearisation: Callable[..., None]
terrain_height: Callable[..., tuple[float, float, float]]
terrain_linearisation: Callable[..., None]
normal_tangent: Callable[..., tuple[float, float, float]]
linearise_ground: Callable[..., None]
linearise_patch: Callable[..., None]
collect_patch: Callable[..., None]
linearise_air: Callable[..., None]
uneven: Callable[..., bool]
time_step: Callable[..., TimeStep]
next_place: Callable[..., float]
next_rate: Callable[..., float]

PLACE, VELOCITY, TURN, SPIN, MODES = 0, 3, 6, 9, 12
"""First columns of a ski's linearisation: its foot's motion (3 each), then amplitudes and rates of the modes (k each),
then the parameters (c), then the six numbers of the snow surface's patch under the ski."""
MODAL = 3
"""First row of the forces on the modes; the rows before are the snow's normal force on the pelvis."""
FURTHER = 10
"""Rows after those: load, groove, friction (3), edge angle, force on the sole, moment about the foot (3), counted from
3 + k."""
LOAD, GROOVE, FRICTION, EDGE, SOLE, MOMENT = 0, 1, 2, 5, 6, 7
ONES = np.eye(PATCH)
"""Patches of which one number is one."""


@njit(cache=True, error_model="numpy")
def axes_tangent(normal, rotation, dn, turn):
    """Change of the axes along and across a ski and of its edge angle with the normal's and a turn (3) of the ski."""
    forward = (rotation[0, 0], rotation[1, 0], rotation[2, 0])
    left = (rotation[0, 1], rotation[1, 1], rotation[2, 1])
    up = (rotation[0, 2], rotation[1, 2], rotation[2, 2])
    d_forward = cross(turn, forward)
    level = dot(forward, normal)
    along = plus(forward, times(-level, normal))
    size = math.sqrt(dot(along, along))
    along = times(1.0 / size, along)
    d_level = dot(d_forward, normal) + dot(forward, dn)
    d_along = plus(d_forward, plus(times(-d_level, normal), times(-level, dn)))
    d_along = times(1.0 / size, plus(d_along, times(-dot(along, d_along), along)))
    d_across = plus(cross(dn, along), cross(normal, d_along))
    sine, cosine = dot(left, normal), dot(up, normal)
    d_sine = dot(cross(turn, left), normal) + dot(left, dn)
    d_cosine = dot(cross(turn, up), normal) + dot(up, dn)
    return d_along, d_across, (cosine * d_sine - sine * d_cosine) / (sine * sine + cosine * cosine)


@njit(cache=True, error_model="numpy")
def ski_work(modes, parameters):
    """Arrays for ``linearise_ski``."""
    size = MODES + 2 * modes
    step = np.zeros((2, size))
    step[0, PLACE], step[1, PLACE + 1] = 1.0, 1.0
    return SkiWork(
        np.zeros(size), np.zeros(size), np.zeros(size), np.zeros((modes, 3)), np.zeros((3, 8 + modes)), step,
        np.zeros((1, 2)), np.zeros((1, parameters)), np.zeros((3, 2)), np.zeros((3, parameters)),
        np.zeros((2, 7)), np.zeros((2, parameters)), np.zeros((2, 7)), np.zeros((3, 5)), np.zeros((3, parameters)),
        np.zeros((3, parameters)), np.zeros((2, 6)),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def fill_pull(pull, force, arm, reach):
    """Fill a row ``pull`` (6 + k or longer) with what a force (3) at a point does to the pelvis, the modes and the
    moment about the foot.

    arm : from the foot;  reach : (k, 3) the modes' displacements there
    """
    modes = reach.shape[0]
    turning = cross(arm, force)
    for j in range(3):
        pull[j], pull[MODAL + modes + j] = force[j], turning[j]
    for k in range(modes):
        pull[MODAL + k] = reach[k, 0] * force[0] + reach[k, 1] * force[1] + reach[k, 2] * force[2]


@njit(cache=True, error_model="numpy")
def fill_ground_pulls(pulls, point, reach):
    """Fill ``pulls`` (3, 8 + k) with what a point's force, load and groove gain where the snow is a metre higher, and
    where its slopes along f and l are one more.

    point : slopes and their factor s, gap, push, its derivatives by depth and rate, velocity, arm from the foot, and
    the edge's length;  reach : (k, 3) the modes' displacements there
    """
    h_f, h_l, s, gap, push, by_depth, by_sinking, speed, arm, length = point
    normal = (-h_f * s, -h_l * s, s)
    for i in range(3):
        dn = (0.0, 0.0, 0.0)
        deeper = s
        if i > 0:
            dn = normal_tangent(h_f, h_l, s, 1.0 * (i == 1), 1.0 * (i == 2))
            deeper = gap * dn[2]
        found = by_depth * deeper - by_sinking * dot(speed, dn)
        fill_pull(pulls[i], plus(times(found, normal), times(push, dn)), arm, reach)
        pulls[i, MODAL + reach.shape[0] + 3], pulls[i, MODAL + reach.shape[0] + 4] = found, length * deeper


@njit(cache=True, error_model="numpy")
def add_ground_change(matrix, column, change, pulls, further):
    """Add to a ski's linearisation what a point feels of snow whose height and slopes ``change`` under it."""
    for row in range(further):
        matrix[row, column] += pulls[0, row] * change[0] + pulls[1, row] * change[1] + pulls[2, row] * change[2]
    for i in range(5):
        row = further + (MOMENT + i if i < 3 else LOAD if i == 3 else GROOVE)
        i += further
        matrix[row, column] += pulls[0, i] * change[0] + pulls[1, i] * change[1] + pulls[2, i] * change[2]


@njit(cache=True, error_model="numpy")
def add_products(matrix, pull, slopes, further, last):
    """Add to the columns before ``last`` of a ski's linearisation a point's ``pull`` times ``slopes`` (last,)."""
    for row in range(further + 3):
        factor = pull[row]
        to_row = row if row < further else row + MOMENT
        for column in range(last):
            matrix[to_row, column] += factor * slopes[column]


@njit(cache=True, error_model="numpy")
def linearise_ski(parameters, contact, columns, t, x, v, eta, rate, foot, ski, work, matrix):
    """Fill ``matrix`` (3 + k + 10, 12 + 2k + columns + 6) with the derivatives of a ski's forces.

    columns : ``ParameterColumns``;  work : ``SkiWork``;  the others as in ``snow``
    """
    place, moving, frame, spin = foot
    surface = contact.surface
    middle_f, middle_l = x[0] + place[0], x[1] + place[1]
    under = patch_under(surface, middle_f, middle_l)
    curving = surface.coefficients.shape[0] > 0
    shape, points, length = contact.shape, contact.points, contact.length
    modes = shape.shape[3]
    fixed = MODES + 2 * modes
    patch = fixed + columns.index.shape[0]
    further = MODAL + modes
    d_depth, d_rate, d_push = work.depth, work.rate, work.push
    reach, pulls = work.reach, work.pulls
    matrix[:] = 0.0
    shaped = uneven(parameters)
    load = 0.0
    groove = 0.0
    for m in range(points.shape[0]):
        for edge in range(2):
            a, b, c = points[m, edge, 0], points[m, edge, 1], points[m, edge, 2]
            for k in range(modes):
                a += shape[m, edge, 0, k] * eta[ski, k]
                b += shape[m, edge, 1, k] * eta[ski, k]
                c += shape[m, edge, 2, k] * eta[ski, k]
            arm = out_of(frame, (a, b, c))
            point = plus(plus(x, place), arm)
            h, h_f, h_l = on_patch(under, point[0], point[1])
            if shaped:
                more = terrain_height(parameters, point[0], point[1])
                h, h_f, h_l = h + more[0], h_f + more[1], h_l + more[2]
            s = 1.0 / math.sqrt(1.0 + h_f * h_f + h_l * h_l)
            normal = (-h_f * s, -h_l * s, s)
            gap = h - point[2]
            depth = gap * s
            if depth <= 0.0:
                continue
            a, b, c = 0.0, 0.0, 0.0
            for k in range(modes):
                a += shape[m, edge, 0, k] * rate[ski, k]
                b += shape[m, edge, 1, k] * rate[ski, k]
                c += shape[m, edge, 2, k] * rate[ski, k]
            bending = out_of(frame, (a, b, c))
            speed = plus(plus(v, moving), plus(cross(spin, arm), bending))
            sinking = -dot(speed, normal)
            push = point_force(parameters, depth, sinking, length[m])
            point_linearisation(parameters, depth, sinking, length[m], work.point_state, work.point_parameter)
            if shaped:
                terrain_linearisation(parameters, point[0], point[1], work.ground_state, work.ground_parameter)
            else:
                work.ground_state[:] = 0.0
            linearise_patch(under, point[0], point[1], work.ground_state)
            by_depth, by_sinking = work.point_state[0, 0], work.point_state[0, 1]
            load += push
            groove += depth * length[m]
            by_f = normal_tangent(h_f, h_l, s, work.ground_state[1, 0], work.ground_state[2, 0])
            by_l = normal_tangent(h_f, h_l, s, work.ground_state[1, 1], work.ground_state[2, 1])
            curved = by_f[0] != 0.0 or by_f[1] != 0.0 or by_l[0] != 0.0 or by_l[1] != 0.0
            # depth and rate by the point's place, rate by its velocity
            to_depth = (
                work.ground_state[0, 0] * s + gap * by_f[2], work.ground_state[0, 1] * s + gap * by_l[2], -s
            )  # fmt: skip
            to_rate = (-dot(speed, by_f), -dot(speed, by_l), 0.0)
            whirl = cross(normal, spin)
            turn_depth = cross(arm, to_depth)
            turn_rate = plus(cross(arm, to_rate), times(-1.0, plus(cross(arm, whirl), cross(bending, normal))))
            spin_rate = cross(arm, normal)
            for j in range(3):
                d_depth[PLACE + j], d_rate[PLACE + j] = to_depth[j], to_rate[j]
                d_depth[TURN + j], d_rate[TURN + j] = turn_depth[j], turn_rate[j]
                d_rate[VELOCITY + j], d_rate[SPIN + j] = -normal[j], -spin_rate[j]
            for k in range(modes):
                w = out_of(frame, (shape[m, edge, 0, k], shape[m, edge, 1, k], shape[m, edge, 2, k]))
                reach[k, 0], reach[k, 1], reach[k, 2] = w
                d_depth[MODES + k] = dot(w, to_depth)
                d_rate[MODES + k] = dot(w, to_rate) - dot(whirl, w)
                d_rate[MODES + modes + k] = -dot(w, normal)
                twist = cross(w, times(push, normal))  # the force stays where it is while the ski's frame turns
                for j in range(3):
                    matrix[MODAL + k, TURN + j] += twist[j]
                    matrix[further + MOMENT + j, MODES + k] += twist[j]
            for column in range(fixed):
                d_push[column] = by_depth * d_depth[column] + by_sinking * d_rate[column]
            fill_pull(pulls[0], normal, arm, reach)
            add_products(matrix, pulls[0], d_push, further, fixed)
            for j in range(3):
                swing = cross((1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)), arm)
                turned = cross(swing, times(push, normal))
                for row in range(3):
                    matrix[further + MOMENT + row, TURN + j] += turned[row]
            for column in range(fixed):
                matrix[further + LOAD, column] += d_push[column]
                matrix[further + GROOVE, column] += length[m] * d_depth[column]
            if curved:
                work.step[0, TURN + 1], work.step[0, TURN + 2] = arm[2], -arm[1]
                work.step[1, TURN], work.step[1, TURN + 2] = -arm[2], arm[0]
                for k in range(modes):
                    work.step[0, MODES + k], work.step[1, MODES + k] = reach[k, 0], reach[k, 1]
                fill_pull(pulls[1], times(push, by_f), arm, reach)
                fill_pull(pulls[2], times(push, by_l), arm, reach)
                add_products(matrix, pulls[1], work.step[0], further, MODES + modes)
                add_products(matrix, pulls[2], work.step[1], further, MODES + modes)
            row_of_values = -1
            for i in range(columns.point.shape[0]):
                column = columns.point[i]
                if columns.row[column] != row_of_values:
                    row_of_values = columns.row[column]
                    others = with_values(parameters, columns.values[row_of_values])
                    point_linearisation(
                        others, depth, sinking, length[m], work.point_state, work.point_parameter
                    )  # fmt: skip
                found = work.point_parameter[0, columns.index[column]]
                column += fixed
                for row in range(further):
                    matrix[row, column] += pulls[0, row] * found
                for row in range(3):
                    matrix[further + MOMENT + row, column] += pulls[0, further + row] * found
                matrix[further + LOAD, column] += found
            if curving or columns.terrain.shape[0] > 0:
                felt = (h_f, h_l, s, gap, push, by_depth, by_sinking, speed, arm, length[m])
                fill_ground_pulls(pulls, felt, reach)
            row_of_values = -1
            for i in range(columns.terrain.shape[0]):
                column = columns.terrain[i]
                if columns.row[column] != row_of_values:
                    row_of_values = columns.row[column]
                    others = with_values(parameters, columns.values[row_of_values])
                    terrain_linearisation(
                        others, point[0], point[1], work.ground_state, work.ground_parameter
                    )  # fmt: skip
                p = columns.index[column]
                column += fixed
                change = (work.ground_parameter[0, p], work.ground_parameter[1, p], work.ground_parameter[2, p])
                add_ground_change(matrix, column, change, pulls, further)
            if curving:
                away_f, away_l = point[0] - middle_f, point[1] - middle_l
                for i in range(PATCH):
                    add_ground_change(matrix, patch + i, on_change(ONES[i], away_f, away_l), pulls, further)
    # friction, edge angle and the sole, at the foot's place
    at, speed = plus(x, place), plus(v, moving)
    _, h_f, h_l = heights(parameters, under, at[0], at[1])
    s = 1.0 / math.sqrt(1.0 + h_f * h_f + h_l * h_l)
    normal = (-h_f * s, -h_l * s, s)
    along, across, edge_angle = ski_axes(normal, frame)
    v_t, v_n = dot(speed, along), dot(speed, across)
    side = 1.0 - 2.0 * ski
    f_t, f_n = foot_force(parameters, load, v_t, v_n, edge_angle, groove, t, at[0], at[1], side)
    by, by_parameter = work.foot_state, work.foot_parameter
    foot_linearisation(parameters, load, v_t, v_n, edge_angle, groove, t, at[0], at[1], side, by, by_parameter)
    linearise_ground(parameters, under, at[0], at[1], work.ground_state, work.ground_parameter)
    total = plus(times(load, normal), plus(times(f_t, along), times(f_n, across)))
    up = (frame[0, 2], frame[1, 2], frame[2, 2])
    row_of_values = -1
    for column in range(matrix.shape[1]):
        if fixed <= column < patch:
            if not columns.ski[column - fixed]:
                continue
            if columns.row[column - fixed] != row_of_values:
                row_of_values = columns.row[column - fixed]
                others = with_values(parameters, columns.values[row_of_values])
                foot_linearisation(
                    others, load, v_t, v_n, edge_angle, groove, t, at[0], at[1], side, work.foot_other, by_parameter
                )  # fmt: skip
                terrain_linearisation(others, at[0], at[1], work.ground_state, work.ground_parameter)
        d_load, d_groove = matrix[further + LOAD, column], matrix[further + GROOVE, column]
        dn, turn, d_speed = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        step_f, step_l, d_t, d_n = 0.0, 0.0, 0.0, 0.0
        rigid = column < MODES or column >= fixed
        if column < VELOCITY:
            step_f, step_l = 1.0 * (column == 0), 1.0 * (column == 1)
            if column < 2:
                dn = normal_tangent(h_f, h_l, s, work.ground_state[1, column], work.ground_state[2, column])
        elif column < TURN:
            d_speed = (1.0 * (column == 3), 1.0 * (column == 4), 1.0 * (column == 5))
        elif column < SPIN:
            turn = (1.0 * (column == 6), 1.0 * (column == 7), 1.0 * (column == 8))
        elif column >= patch:
            dn = normal_tangent(h_f, h_l, s, 1.0 * (column == patch + 1), 1.0 * (column == patch + 2))
        elif column >= fixed:
            p = columns.index[column - fixed]
            dn = normal_tangent(h_f, h_l, s, work.ground_parameter[1, p], work.ground_parameter[2, p])
            d_t, d_n = by_parameter[0, p], by_parameter[1, p]
        d_along, d_across, d_edge = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        if rigid:
            d_along, d_across, d_edge = axes_tangent(normal, frame, dn, turn)
        d_v_t = dot(d_speed, along) + dot(speed, d_along)
        d_v_n = dot(d_speed, across) + dot(speed, d_across)
        d_t += by[0, 0] * d_load + by[0, 1] * d_v_t + by[0, 2] * d_v_n + by[0, 3] * d_edge + by[0, 4] * d_groove
        d_n += by[1, 0] * d_load + by[1, 1] * d_v_t + by[1, 2] * d_v_n + by[1, 3] * d_edge + by[1, 4] * d_groove
        d_t += by[0, 5] * step_f + by[0, 6] * step_l
        d_n += by[1, 5] * step_f + by[1, 6] * step_l
        friction = plus(
            plus(times(d_t, along), times(f_t, d_along)), plus(times(d_n, across), times(f_n, d_across))
        )  # fmt: skip
        for c in range(3):
            matrix[further + FRICTION + c, column] = friction[c]
        matrix[further + EDGE, column] = d_edge
        change = plus(friction, plus(times(d_load, normal), times(load, dn)))
        matrix[further + SOLE, column] = dot(up, change) + dot(cross(turn, up), total)
    if curving:  # the patch goes with the foot
        patch_changes(surface, middle_f, middle_l, work.patches)
        for row in range(matrix.shape[0]):
            for i in range(PATCH):
                matrix[row, PLACE] += matrix[row, patch + i] * work.patches[0, i]
                matrix[row, PLACE + 1] += matrix[row, patch + i] * work.patches[1, i]


@njit(cache=True, error_model="numpy")
def add_row(out, factors, inputs, first, last, begun):
    """Add the row ``factors`` (c,) times ``inputs`` (c, d) to ``out`` (d,); row c of the inputs is zero but from first
    to last, and each before ``begun``.
    """
    for column in range(factors.shape[0]):
        factor = factors[column]
        if factor != 0.0:
            for k in range(max(first[column], begun), last[column]):
                out[k] += factor * inputs[column, k]


@njit(cache=True, error_model="numpy")
def solve_many(matrix, right, begun):
    """The solutions (n, d) of a system for d right-hand sides, in their place: elimination as in ``solve``; those
    before ``begun`` are zero.
    """
    n, many = right.shape
    for i in range(n):
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in range(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                for k in range(begun, many):
                    right[r, k] -= factor * right[i, k]
    for i in range(n - 1, -1, -1):
        for c in range(i + 1, n):
            factor = matrix[i, c]
            if factor != 0.0:
                for k in range(begun, many):
                    right[i, k] -= factor * right[c, k]
        inverse = 1.0 / matrix[i, i]
        for k in range(begun, many):
            right[i, k] *= inverse


@njit(cache=True, error_model="numpy")
def collect_inputs(z, zq, zv, feet, ski, modes, begun):
    """Fill the rows of ``z`` with the tangents of what moves a ski, from ``begun`` on."""
    many, with_tables = z.shape[1], feet.shape[1]
    for j in range(3):
        for k in range(begun, many):
            z[PLACE + j, k] = zq[j, k]
            z[VELOCITY + j, k] = zv[j, k]
        for k in range(begun, with_tables):
            z[PLACE + j, k] += feet[j, k]
            z[VELOCITY + j, k] += feet[3 + j, k]
            z[TURN + j, k] = feet[6 + j, k]
            z[SPIN + j, k] = feet[9 + j, k]
    base = 3 + ski * modes
    for j in range(modes):
        for k in range(begun, many):
            z[MODES + j, k] = zq[base + j, k]
            z[MODES + modes + j, k] = zv[base + j, k]


@njit(cache=True, error_model="numpy")
def first_tangents(modes, inputs):
    """The tangents before the first instant, and the arrays that later ones are found in.

    inputs : ``TangentInputs``
    """
    many, fixed, count = inputs.mass.shape[0], MODES + 2 * modes, inputs.columns.index.shape[0]
    size, inputs_of_ski = 3 + 2 * modes, fixed + count + PATCH
    tangent = TangentState(
        np.zeros((size, many)), np.zeros((size, many)), np.zeros((size, many)), np.zeros((size, size)),
        np.zeros((size, many)), np.zeros((2, MODAL + modes + FURTHER, inputs_of_ski)), np.zeros((inputs_of_ski, many)),
        np.zeros(inputs_of_ski, np.int64), np.full(inputs_of_ski, many),
    )  # fmt: skip
    for column in range(TURN, MODES):
        tangent.last[column] = inputs.feet.shape[3]
    for column in range(count):
        for k in range(many):
            tangent.inputs[fixed + column, k] = inputs.parameters[column, k]
            if inputs.parameters[column, k] != 0.0:
                tangent.last[fixed + column] = k + 1
        while (
            tangent.first[fixed + column] < tangent.last[fixed + column]
            and inputs.parameters[column, tangent.first[fixed + column]] == 0.0
        ):
            tangent.first[fixed + column] += 1
    for k in range(many):
        for c in range(3):
            tangent.place[c, k], tangent.rate[c, k] = inputs.place[c, k], inputs.velocity[c, k]
        for i in range(2 * modes):
            tangent.place[3 + i, k] = inputs.eta[i, k]
    return tangent


@njit(cache=True, nogil=True, error_model="numpy")
def run_tangents(parameters, contact, motion, start, inputs, run_series, series):
    """One run as in ``run_batch``, and the tangents of what it fills; the instants that were reached.

    inputs : ``TangentInputs``;  series : ``TangentSeries`` of zeros, which is filled

    The equations of an instant stand within the loop: in a function of their own they would be compiled twice.
    """
    modes = contact.omega.shape[0]
    state, newton = first_state(start)
    work, tangent = ski_work(modes, parameters.values.shape[0]), first_tangents(modes, inputs)
    mass, gravity = motion.mass, motion.gravity
    omega, ratio = contact.omega, contact.ratio
    size, many, begun = 3 + 2 * modes, inputs.mass.shape[0], inputs.mass.shape[0]
    further = MODAL + modes
    columns = inputs.columns
    with_tables = inputs.feet.shape[3]
    q, rate, acceleration = tangent.place, tangent.rate, tangent.acceleration
    matrix, right, skis, z, first, last = (
        tangent.matrix, tangent.right, tangent.skis, tangent.inputs, tangent.first, tangent.last
    )  # fmt: skip
    for n in range(motion.time.shape[0]):
        if not advance(parameters, contact, motion, n, state, newton, run_series):
            return n
        while begun > 0 and inputs.begins[begun - 1] <= n:
            begun -= 1
        step = time_step(n, motion.step)
        by_place, by_rate = step.by_place, step.by_rate
        for i in range(size):
            for k in range(begun, many):
                q[i, k] = next_place(step, q[i, k], rate[i, k], acceleration[i, k])
                rate[i, k] = next_rate(step, rate[i, k], acceleration[i, k])
        x, v = three(state.place, 0), three(state.velocity, 0)
        trial = three(state.acceleration, 0)
        matrix[:] = 0.0
        right[:] = 0.0
        for c in range(3):
            matrix[c, c] = mass
            for k in range(begun, many):
                right[c, k] = mass * inputs.gravity[c, k] - inputs.mass[k] * (trial[c] - gravity[c])
            for k in range(begun, with_tables):
                right[c, k] -= inputs.inertia[n, c, k]
        for ski in range(2):
            frame = motion.foot_rotation[n, ski]
            foot = (
                three(motion.foot_place[n, ski], 0), three(motion.foot_velocity[n, ski], 0), frame,
                three(motion.foot_spin[n, ski], 0),
            )  # fmt: skip
            found, feet = skis[ski], inputs.feet[n, ski]
            linearise_ski(
                parameters, contact, columns, motion.time[n], x, v, state.eta, state.rate, foot, ski, work, found
            )  # fmt: skip
            for row in range(3):
                for column in range(found.shape[1]):
                    found[row, column] += found[further + FRICTION + row, column]
            collect_inputs(z, q, rate, feet, ski, modes, begun)
            collect_patch(z, inputs, contact.surface, x[0] + foot[0][0], x[1] + foot[0][1])
            swinging = (0.0, 0.0, 0.0)
            for j in range(modes):
                i = 3 + ski * modes + j
                outwards = out_of(frame, three(contact.coupling[j], 0))
                swinging = plus(swinging, times(state.acceleration[i], outwards))
                turn = cross(outwards, trial)
                damping, stiffness = 2.0 * ratio[j] * omega[j], omega[j] * omega[j]
                matrix[i, i] += 1.0 + by_rate * damping + by_place * stiffness
                for c in range(3):
                    matrix[c, i] += outwards[c]
                    matrix[i, c] += outwards[c]
                for k in range(begun, many):
                    right[i, k] -= damping * rate[i, k] + stiffness * q[i, k]
                for c in range(3):
                    for k in range(begun, with_tables):
                        right[i, k] -= (
                            turn[c] * feet[6 + c, k] + contact.coupling[j, c] * feet[12 + c, k]
                            + contact.spinning[j, c] * feet[15 + c, k]
                        )  # fmt: skip
            for c in range(3):
                d, e = (c + 1) % 3, (c + 2) % 3
                for k in range(begun, with_tables):
                    right[c, k] -= feet[6 + d, k] * swinging[e] - feet[6 + e, k] * swinging[d]
            for row in range(MODAL + modes):
                i = row if row < 3 else 3 + ski * modes + row - MODAL
                add_row(right[i], found[row], z, first, last, begun)
                for c in range(3):
                    matrix[i, c] -= by_place * found[row, PLACE + c] + by_rate * found[row, VELOCITY + c]
                for j in range(modes):
                    column = 3 + ski * modes + j
                    matrix[i, column] -= by_place * found[row, MODES + j] + by_rate * found[row, MODES + modes + j]
        linearise_air(
            parameters, motion, inputs, n, x, v, by_place, by_rate, q, rate, begun, work.air_state, work.air_parameter,
            work.body_parameter, matrix, right,
        )  # fmt: skip
        solve_many(matrix, right, begun)
        for i in range(size):
            for k in range(begun, many):
                acceleration[i, k] = right[i, k]
                q[i, k] += by_place * right[i, k]
                rate[i, k] += by_rate * right[i, k]
        for c in range(3):
            for k in range(begun, many):
                series.place[n, c, k] = q[c, k]
                series.velocity[n, c, k] = rate[c, k]
        for ski in range(2):
            collect_inputs(z, q, rate, inputs.feet[n, ski], ski, modes, begun)
            at_foot = plus(x, three(motion.foot_place[n, ski], 0))
            collect_patch(z, inputs, contact.surface, at_foot[0], at_foot[1])
            found = skis[ski]
            add_row(series.loads[n, ski], found[further + LOAD], z, first, last, begun)
            add_row(series.sole[n, ski], found[further + SOLE], z, first, last, begun)
            add_row(series.edges[n, ski], found[further + EDGE], z, first, last, begun)
            for c in range(3):
                add_row(series.friction[n, ski, c], found[further + FRICTION + c], z, first, last, begun)
                add_row(series.force[n, ski, c], found[c], z, first, last, begun)
                add_row(series.moment[n, ski, c], found[further + MOMENT + c], z, first, last, begun)
    return motion.time.shape[0]
