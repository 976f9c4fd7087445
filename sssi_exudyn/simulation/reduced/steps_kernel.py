"""The reduced model's loop over time: a template that ``compiled`` joins with the laws.

Unknowns are the pelvis' place x (3) and the amplitudes η of both skis' vibrations; the posture is prescribed.  With a
ski's contact points at X + Σ φ η in the frame of its foot, and p the modes' mass coupling with that frame,

    M ẍ + Σ R p η̈ = snow + friction + air + body + M g − (masses times the posture's own accelerations)
    η̈ + 2ζω η̇ + ω² η + pᵀ Rᵀ ẍ = Σ φ·F − pᵀ (what the foot's prescribed motion and gravity make the ski feel)

Steps are Newmark's average acceleration, solved by Newton's method with the derivatives that the laws give.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import cross, dot, into, out_of, plus, three, times
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.simulation.ski_on_snow.structs import InitialState, NewtonWork, ReducedSeries, ReducedState, TimeStep
from sssi_exudyn.terrain.surface import on_patch, patch_under

point_force: Callable[..., float]
point_derivatives: Callable[..., tuple[float, float, float]]
foot_force: Callable[..., tuple[float, float]]
foot_derivatives: Callable[..., tuple[float, ...]]
segment_force: Callable[..., tuple[float, float, float]]
segment_derivatives: Callable[..., tuple[float, ...]]
body_force: Callable[..., tuple[float, float, float]]
terrain_height: Callable[..., tuple[float, float, float]]
with_values: Callable[..., LawParameters]
uneven: Callable[..., bool]
upright: Callable[..., tuple[float, float, float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
foot_axes: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float], float]]

time_step: Callable[..., TimeStep]
next_place: Callable[..., float]
next_rate: Callable[..., float]

ITERATIONS = 12
"""Newton iterations at most."""
RESTING = 1e-9
"""Of the load, the force that is left over at rest."""
SMALL = 1e-5
"""m/s²; a change of the accelerations that moves the skier by 10⁻¹⁰ m in a step."""


@njit(cache=True, error_model="numpy")
def snow(parameters, contact, x, v, eta, rate, foot, ski, residual, matrix, scratch, by_place, by_rate):
    """Add one ski's contact to residual (3 + 2k,) and matrix; the load, the area pressed into the snow, the snow's
    force square to it, and its moment about the foot's place.

    contact : ``ModalContact``;  x, v : place and velocity of the pelvis;  eta, rate : (2, k) of the modes
    foot : place, velocity (tuples), rotation (3, 3) and spin (tuple) relative to the pelvis
    by_place, by_rate : derivatives of place and rate by the acceleration sought
    scratch : (4 + k, 3 + k), overwritten
    """
    place, moving, frame, spin = foot
    shape, points, length = contact.shape, contact.points, contact.length
    modes = shape.shape[3]
    base = 3 + ski * modes
    size = 3 + modes
    load = 0.0
    groove = 0.0
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    scratch[:] = 0.0
    slope = scratch[size]
    under = patch_under(contact.surface, x[0] + place[0], x[1] + place[1])
    # asked once: at every point the laws' own call would cost more than a point off the snow
    shaped = uneven(parameters)
    for m in range(points.shape[0]):
        for edge in range(2):
            a, b, c = points[m, edge, 0], points[m, edge, 1], points[m, edge, 2]
            for k in range(modes):
                a += shape[m, edge, 0, k] * eta[ski, k]
                b += shape[m, edge, 1, k] * eta[ski, k]
                c += shape[m, edge, 2, k] * eta[ski, k]
            arm = out_of(frame, (a, b, c))
            point = plus(plus(x, place), arm)
            height, h_f, h_l = on_patch(under, point[0], point[1])
            if shaped:
                more = terrain_height(parameters, point[0], point[1])
                height, h_f, h_l = height + more[0], h_f + more[1], h_l + more[2]
            normal = upright(h_f, h_l)
            depth = (height - point[2]) * normal[2]
            if depth <= 0.0:
                continue
            a, b, c = 0.0, 0.0, 0.0
            for k in range(modes):
                a += shape[m, edge, 0, k] * rate[ski, k]
                b += shape[m, edge, 1, k] * rate[ski, k]
                c += shape[m, edge, 2, k] * rate[ski, k]
            bending = out_of(frame, (a, b, c))
            speed = plus(plus(v, moving), plus(cross(spin, arm), bending))
            push, by_depth, by_sinking = point_derivatives(parameters, depth, -dot(speed, normal), length[m])
            load += push
            groove += depth * length[m]
            pushed = times(push, normal)
            force, moment = plus(force, pushed), plus(moment, cross(arm, pushed))
            inside = into(frame, normal)
            for d in range(3):
                slope[d] = normal[d]
                residual[d] -= push * normal[d]
            for k in range(modes):
                slope[3 + k] = (
                    shape[m, edge, 0, k] * inside[0]
                    + shape[m, edge, 1, k] * inside[1]
                    + shape[m, edge, 2, k] * inside[2]
                )
                residual[base + k] -= push * slope[3 + k]
            stiffness = by_place * by_depth + by_rate * by_sinking
            for row in range(size):
                factor = stiffness * slope[row]
                for column in range(row, size):
                    scratch[row, column] += factor * slope[column]
    for row in range(size):
        to_row = row if row < 3 else base + row - 3
        for column in range(row, size):
            to_column = column if column < 3 else base + column - 3
            matrix[to_row, to_column] += scratch[row, column]
            if row != column:
                matrix[to_column, to_row] += scratch[row, column]
    return load, groove, force, moment


@njit(cache=True, error_model="numpy")
def solve(matrix, right):
    """Solve a symmetric-pattern system in place of its right side (n,), by elimination without pivoting: its diagonal
    dominates by inertia.
    """
    n = right.shape[0]
    for i in range(n):
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in range(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                right[r] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for c in range(i + 1, n):
            total -= matrix[i, c] * right[c]
        right[i] = total / matrix[i, i]


@njit(cache=True, error_model="numpy")
def settle(parameters, contact, x, foot_place, foot_rotation, load, eta):
    """Height of the pelvis at which both skis at rest carry ``load`` (N); fills eta (2, k).  Negative infinity if
    none is found.

    x : (3,) m, of which the height is the first guess;  foot_place (2, 3), foot_rotation (2, 3, 3) at the start

    Newton's method from a height at which the ski is well in the snow, every step limited to a few millimetres.
    """
    omega = contact.omega
    modes = omega.shape[0]
    size = 3 + 2 * modes
    matrix, residual, scratch = np.zeros((size, size)), np.zeros(size), np.zeros((4 + modes, 3 + modes))
    still = (0.0, 0.0, 0.0)
    rest = np.zeros((2, modes))
    height = x[2]
    for _ in range(200):
        matrix[:] = 0.0
        residual[:] = 0.0
        carried = 0.0
        for ski in range(2):
            foot = (three(foot_place[ski], 0), still, foot_rotation[ski], still)
            found, _area, _force, _moment = snow(
                parameters, contact, (x[0], x[1], height), still, eta, rest, foot, ski,
                residual, matrix, scratch, 1.0, 0.0,
            )  # fmt: skip
            carried += found
            for k in range(modes):
                residual[3 + ski * modes + k] += omega[k] ** 2 * eta[ski, k]
                matrix[3 + ski * modes + k, 3 + ski * modes + k] += omega[k] ** 2
        residual[2] += load
        largest = abs(residual[2])
        for i in range(3, size):
            largest = max(largest, abs(residual[i]))
        if largest < RESTING * load:
            return height
        if carried <= 0.0:
            height -= 2e-3
            continue
        for c in range(2):  # held
            matrix[c, :] = 0.0
            matrix[:, c] = 0.0
            matrix[c, c] = 1.0
            residual[c] = 0.0
        solve(matrix, residual)
        share = min(1.0, 4e-3 / max(abs(residual[2]), 1e-12))
        height -= share * residual[2]
        for ski in range(2):
            for k in range(modes):
                eta[ski, k] -= share * residual[3 + ski * modes + k]
    return -np.inf


@njit(cache=True, error_model="numpy")
def advance(parameters, contact, motion, n, state, work, series):
    """Bring the state from the instant before to the n-th; at the first, find the accelerations.  False if Newton's
    method fails.

    state : ``ReducedState``;  work : ``NewtonWork``;  the others as in ``run``
    """
    step, time, mass, gravity, area = time_step(n, motion.step), motion.time, motion.mass, motion.gravity, motion.area
    omega, ratio = contact.omega, contact.ratio
    modes = omega.shape[0]
    size = 3 + 2 * modes
    x, v = three(state.place, 0), three(state.velocity, 0)
    eta, rate, acceleration = state.eta, state.rate, state.acceleration
    trial, next_eta, next_speed, push = work.trial, work.eta, work.rate, work.push
    matrix, residual, scratch = work.matrix, work.residual, work.scratch
    by_place, by_rate = step.by_place, step.by_rate
    for i in range(size):
        trial[i] = acceleration[i]
    done = False
    for _ in range(ITERATIONS):
        pull = plus(three(acceleration, 0), three(trial, 0))
        new_x = (
            next_place(step, x[0], v[0], pull[0]),
            next_place(step, x[1], v[1], pull[1]),
            next_place(step, x[2], v[2], pull[2]),
        )
        new_v = next_rate(step, v[0], pull[0]), next_rate(step, v[1], pull[1]), next_rate(step, v[2], pull[2])
        for ski in range(2):
            for k in range(modes):
                both = acceleration[3 + ski * modes + k] + trial[3 + ski * modes + k]
                next_eta[ski, k] = next_place(step, eta[ski, k], rate[ski, k], both)
                next_speed[ski, k] = next_rate(step, rate[ski, k], both)
        matrix[:] = 0.0
        for c in range(3):
            residual[c] = mass * (trial[c] - gravity[c]) + motion.carried[n, c]
            matrix[c, c] = mass
        for ski in range(2):
            frame = motion.foot_rotation[n, ski]
            pulled = into(frame, (trial[0], trial[1], trial[2]))
            for k in range(modes):
                i = 3 + ski * modes + k
                p, w = three(contact.coupling[k], 0), omega[k]
                residual[i] = (
                    trial[i] + 2.0 * ratio[k] * w * next_speed[ski, k] + w * w * next_eta[ski, k]
                    + dot(p, plus(pulled, three(motion.ski_acceleration[n, ski], 0)))
                    + dot(three(contact.spinning[k], 0), three(motion.ski_turning[n, ski], 0))
                )  # fmt: skip
                matrix[i, i] = 1.0 + by_rate * 2.0 * ratio[k] * w + by_place * w * w
                outwards = out_of(frame, p)
                for c in range(3):
                    residual[c] += outwards[c] * trial[i]
                    matrix[c, i] += outwards[c]
                    matrix[i, c] += outwards[c]
            foot = (
                three(motion.foot_place[n, ski], 0),
                three(motion.foot_velocity[n, ski], 0),
                frame,
                three(motion.foot_spin[n, ski], 0),
            )
            load, groove, force, moment = snow(
                parameters, contact, new_x, new_v, next_eta, next_speed, foot, ski,
                residual, matrix, scratch, by_place, by_rate,
            )  # fmt: skip
            at, moving = plus(new_x, foot[0]), plus(new_v, foot[1])
            along, across, edge = foot_axes(parameters, contact.surface, at, frame)
            found = foot_derivatives(
                parameters, load, dot(moving, along), dot(moving, across), edge, groove, time[n], at[0], at[1],
                1.0 - 2.0 * ski,
            )  # fmt: skip
            pushed = plus(times(found[0], along), times(found[1], across))
            series.loads[n, ski], series.edges[n, ski] = load, edge
            for c in range(3):
                residual[c] -= pushed[c]
                push[ski, c] = pushed[c]
                series.force[n, ski, c], series.moment[n, ski, c] = force[c] + pushed[c], moment[c]
                for d in range(3):
                    matrix[c, d] -= by_rate * (
                        along[c] * (found[3] * along[d] + found[4] * across[d])
                        + across[c] * (found[6] * along[d] + found[7] * across[d])
                    )
        for k in range(area.shape[0]):
            moving = plus(new_v, three(motion.exposed_velocity[n, k], 0))
            facing = motion.exposed_facing[n, k]
            found = segment_derivatives(
                parameters, time[n], new_x[0], new_x[1], moving[0], moving[1], moving[2], area[k],
                facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
            )  # fmt: skip
            for c in range(3):
                residual[c] -= found[c]
                for d in range(3):
                    matrix[c, d] -= by_rate * found[3 + 3 * c + d]
        at, moving = plus(new_x, three(motion.com_place[n], 0)), plus(new_v, three(motion.com_velocity[n], 0))
        body = body_force(parameters, time[n], at[0], at[1], moving[0], moving[1], moving[2])
        for c in range(3):
            residual[c] -= body[c]
        largest = 0.0
        solve(matrix, residual)
        for i in range(size):
            trial[i] -= residual[i]
            largest = max(largest, abs(residual[i]))
        if not largest < 1e9:
            return False
        if largest < SMALL:
            done = True
            break
    if not done and largest > 1e-2:
        return False
    # arrays element by element: an assignment of the whole compiles its error messages, 4 s of them
    for i in range(size):
        acceleration[i] = trial[i]
    for ski in range(2):
        for k in range(modes):
            eta[ski, k], rate[ski, k] = next_eta[ski, k], next_speed[ski, k]
    for c in range(3):
        state.place[c], state.velocity[c] = new_x[c], new_v[c]
        series.place[n, c], series.velocity[n, c] = new_x[c], new_v[c]
    for ski in range(2):
        frame = motion.foot_rotation[n, ski]
        at = plus(new_x, three(motion.foot_place[n, ski], 0))
        _, normal = ground(parameters, patch_under(contact.surface, at[0], at[1]), at[0], at[1])
        total = plus(times(series.loads[n, ski], normal), three(push[ski], 0))
        series.sole[n, ski] = frame[0, 2] * total[0] + frame[1, 2] * total[1] + frame[2, 2] * total[2]
        for c in range(3):
            series.friction[n, ski, c] = push[ski, c]
    return True


@njit(cache=True, error_model="numpy")
def first_state(start):
    """The state before the first instant, and the arrays that steps are found in."""
    modes = start.eta.shape[1]
    size = 3 + 2 * modes
    state = ReducedState(
        start.place.copy(), start.velocity.copy(), start.eta.copy(), np.zeros((2, modes)), np.zeros(size)
    )
    work = NewtonWork(
        np.zeros(size), np.zeros((2, modes)), np.zeros((2, modes)), np.zeros((2, 3)), np.zeros((size, size)),
        np.zeros(size), np.zeros((4 + modes, 3 + modes)),
    )  # fmt: skip
    return state, work


@njit(cache=True, nogil=True, error_model="numpy")
def run_batch(parameters, contact, motion, start, series, done):
    """Integrate b runs from their starts to the end of the motion.

    parameters : ``LawParameters`` whose values are (b, p);  contact : ``ModalContact``;  motion : ``PrescribedMotion``
    start : ``InitialState`` and series : ``ReducedSeries``, which is filled, each with a first axis (b,)
    done : (b,) is filled with the instants of each run that were reached, all of them unless it diverged
    """
    for i in range(parameters.values.shape[0]):
        own = with_values(parameters, parameters.values[i])
        state, work = first_state(InitialState(start.place[i], start.velocity[i], start.eta[i]))
        one = ReducedSeries(
            series.place[i], series.velocity[i], series.loads[i], series.sole[i], series.friction[i], series.edges[i],
            series.force[i], series.moment[i],
        )  # fmt: skip
        done[i] = motion.time.shape[0]
        for n in range(motion.time.shape[0]):
            if not advance(own, contact, motion, n, state, work, one):
                done[i] = n
                break
