"""Derivatives of a run of the reduced model by any numbers, carried along with it: a template that ``compiled`` joins
with ``newmark``, ``steps_kernel``, ``air_tangents``, ``ski_tangents`` and the laws.

At an instant the residual r(a, q, q̇, p) = 0 gives the accelerations a, and with them q and q̇ by Newmark's rule
(``newmark``).  Its tangents by a number p follow from the same equations, linearised where the step has converged:

    (∂r/∂a + h²/4 ∂r/∂q + h/2 ∂r/∂q̇) da = −∂r/∂q dq* − ∂r/∂q̇ dq̇* − ∂r/∂p dp

with dq* and dq̇* what the instant before gives.  All numbers share one matrix, and one pass over the contact points: a
ski's forces are linearised by what moves it (the foot's place, velocity, turn and spin, the modes) and by the laws'
parameters (``ski_tangents``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, indices, out_of, plus, three, times
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.simulation.ski_on_snow.structs import NewtonWork, ReducedState, SkiWork, TangentState, TimeStep
from sssi_exudyn.terrain.surface import PATCH

advance: Callable[..., bool]
collect_patch: Callable[..., None]
first_state: Callable[..., tuple[ReducedState, NewtonWork]]
foot_at: Callable[..., Any]
linearise_air: Callable[..., None]
next_place: Callable[..., float]
next_rate: Callable[..., float]
time_step: Callable[..., TimeStep]
PelvisEquations: Callable[..., Any]
linearise_ski: Callable[..., None]
ski_work: Callable[..., SkiWork]
PLACE: int
VELOCITY: int
TURN: int
SPIN: int
MODES: int
MODAL: int
FURTHER: int
MOMENT: int
LOAD: int
FRICTION: int
EDGE: int
SOLE: int


@njit(cache=True, error_model="numpy")
def add_row(out, factors, inputs, first, last, begun):
    """Add the row ``factors`` (c,) times ``inputs`` (c, d) to ``out`` (d,); row c of the inputs is zero but from first
    to last, and each before ``begun``.
    """
    for column in range(factors.shape[0]):
        factor = factors[column]
        if factor != 0.0:
            for k in indices(max(first[column], begun), last[column]):
                out[k] += factor * inputs[column, k]


@njit(cache=True, error_model="numpy")
def solve_many(matrix, right, begun):
    """Solve a system for d right-hand sides (n, d), in their place: elimination as in ``solve``; those before ``begun``
    are zero.
    """
    n, many = right.shape
    for i in range(n):
        inverse = 1.0 / matrix[i, i]
        for r in range(i + 1, n):
            factor = matrix[r, i] * inverse
            if factor != 0.0:
                for c in indices(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                for k in indices(begun, many):
                    right[r, k] -= factor * right[i, k]
    for i in range(n - 1, -1, -1):
        for c in range(i + 1, n):
            factor = matrix[i, c]
            if factor != 0.0:
                for k in indices(begun, many):
                    right[i, k] -= factor * right[c, k]
        inverse = 1.0 / matrix[i, i]
        for k in indices(begun, many):
            right[i, k] *= inverse


@njit(cache=True, error_model="numpy")
def collect_inputs(z, zq, zv, feet, ski, modes, begun):
    """Fill the rows of ``z`` with the tangents of what moves a ski, from ``begun`` on."""
    many, with_tables = z.shape[1], feet.shape[1]
    for j in range(3):
        for k in indices(begun, many):
            z[PLACE + j, k] = zq[j, k]
            z[VELOCITY + j, k] = zv[j, k]
        for k in indices(begun, with_tables):
            z[PLACE + j, k] += feet[j, k]
            z[VELOCITY + j, k] += feet[3 + j, k]
            z[TURN + j, k] = feet[6 + j, k]
            z[SPIN + j, k] = feet[9 + j, k]
    base = 3 + ski * modes
    for j in range(modes):
        for k in indices(begun, many):
            z[MODES + j, k] = zq[base + j, k]
            z[MODES + modes + j, k] = zv[base + j, k]


@njit(cache=True, error_model="numpy")
def first_tangents(modes, inputs):
    """Return the tangents before the first instant, and the arrays that later ones are computed in.

    inputs : ``TangentInputs``
    """
    many, fixed, count = inputs.mass.shape[0], MODES + 2 * modes, inputs.columns.index.shape[0]
    size, inputs_of_ski = 3 + 2 * modes, fixed + count + PATCH
    tangent = TangentState(
        np.zeros((size, many)), np.zeros((size, many)), np.zeros((size, many)), np.zeros((size, size)),
        np.zeros((size, many)), np.zeros((2, MODAL + modes + FURTHER, inputs_of_ski)),
        np.zeros((2, inputs_of_ski, many)),
        np.zeros(inputs_of_ski, np.int64), np.full(inputs_of_ski, many),
    )  # fmt: skip
    for column in range(TURN, MODES):
        tangent.last[column] = inputs.feet.shape[3]
    for column in range(count):
        for k in range(many):
            for ski in range(2):
                tangent.inputs[ski, fixed + column, k] = inputs.parameters[column, k]
            if inputs.parameters[column, k] != 0.0:
                tangent.last[fixed + column] = k + 1
        while (
            tangent.first[fixed + column] < tangent.last[fixed + column]
            and inputs.parameters[column, tangent.first[fixed + column]] == 0.0
        ):
            tangent.first[fixed + column] += 1
    for column in range(fixed + count, inputs_of_ski):
        tangent.first[column], tangent.last[column] = many, 0
        for number in inputs.shaping:
            tangent.first[column] = min(tangent.first[column], number)
            tangent.last[column] = max(tangent.last[column], number + 1)
    for k in range(many):
        for c in range(3):
            tangent.place[c, k], tangent.rate[c, k] = inputs.place[c, k], inputs.velocity[c, k]
        for i in range(2 * modes):
            tangent.place[3 + i, k] = inputs.eta[i, k]
    return tangent


@njit(cache=True, nogil=True, error_model="numpy")
def run_tangents(parameters, contact, motion, start, inputs, run_series, series):
    """Run as in ``run_batch``, with the tangents of what it fills; return the number of instants that were reached.

    inputs : ``TangentInputs``;  series : ``TangentSeries`` of zeros, which is filled
    """
    modes = contact.omega.shape[0]
    points = 2 * contact.length.shape[0]
    state, newton = first_state(start, points)
    work, tangent = ski_work(points, modes, parameters.values.shape[0]), first_tangents(modes, inputs)
    begun = inputs.mass.shape[0]
    for n in range(motion.time.shape[0]):
        if not advance(parameters, contact, motion, n, state, newton, run_series):
            return n
        while begun > 0 and inputs.begins[begun - 1] <= n:
            begun -= 1
        step, x, v = time_step(n, motion.step), three(state.place, 0), three(state.velocity, 0)
        predict(motion, inputs, state, n, step, begun, tangent)
        for ski in range(2):
            foot, linear = foot_at(motion, n, ski, x, v), tangent.skis[ski]
            linearise_ski(
                parameters, contact, inputs.columns, motion.time[n], foot, state.eta[ski], state.rate[ski],
                1.0 - 2.0 * ski, work, linear,
            )  # fmt: skip
            for row in range(3):
                for column in range(linear.shape[1]):
                    linear[row, column] += linear[MODAL + modes + FRICTION + row, column]
            swing_tangents(contact, motion, inputs, state, n, ski, step, begun, tangent)
            collect_inputs(tangent.inputs[ski], tangent.place, tangent.rate, inputs.feet[n, ski], ski, modes, begun)
            collect_patch(tangent.inputs[ski], inputs, contact.surface, foot[0][0], foot[0][1])
            add_ski(linear, ski, step, begun, tangent)
        linearise_air(
            parameters, motion, inputs, n, (x, v),
            PelvisEquations(step, tangent.place, tangent.rate, begun, tangent.matrix, tangent.right),
            (work.by_state, work.by_parameter),
        )  # fmt: skip
        solve_many(tangent.matrix, tangent.right, begun)
        correct(n, step, begun, tangent, series)
        for ski in range(2):
            collect_inputs(tangent.inputs[ski], tangent.place, tangent.rate, inputs.feet[n, ski], ski, modes, begun)
            fill_series(tangent.skis[ski], n, ski, modes, begun, tangent, series)
    return motion.time.shape[0]


@inlined
def predict(motion, inputs, state, n, step, begun, tangent):
    """Begin an instant: the tangents that the accelerations before lead to, and the pelvis' equations."""
    q, rate, acceleration, matrix, right = (
        tangent.place, tangent.rate, tangent.acceleration, tangent.matrix, tangent.right
    )  # fmt: skip
    many, with_tables = right.shape[1], inputs.feet.shape[3]
    for i in range(q.shape[0]):
        for k in indices(begun, many):
            q[i, k] = next_place(step, q[i, k], rate[i, k], acceleration[i, k])
            rate[i, k] = next_rate(step, rate[i, k], acceleration[i, k])
    matrix[:] = 0.0
    right[:] = 0.0
    for c in range(3):
        matrix[c, c] = motion.mass
        pull = state.acceleration[c] - motion.gravity[c]
        for k in indices(begun, many):
            right[c, k] = motion.mass * inputs.gravity[c, k] - inputs.mass[k] * pull
        for k in indices(begun, with_tables):
            right[c, k] -= inputs.inertia[n, c, k]


@inlined
def swing_tangents(contact, motion, inputs, state, n, ski, step, begun, tangent):
    """Add the equations of a ski's modes, but for the snow, and what their inertia does to the pelvis."""
    q, rate, matrix, right = tangent.place, tangent.rate, tangent.matrix, tangent.right
    modes, many, with_tables = contact.omega.shape[0], right.shape[1], inputs.feet.shape[3]
    frame, feet, pull = motion.foot_rotation[n, ski], inputs.feet[n, ski], three(state.acceleration, 0)
    swinging = (0.0, 0.0, 0.0)
    for j in range(modes):
        i = 3 + ski * modes + j
        outwards = out_of(frame, three(contact.coupling[j], 0))
        swinging = plus(swinging, times(state.acceleration[i], outwards))
        turn = cross(outwards, pull)
        damping, stiffness = 2.0 * contact.ratio[j] * contact.omega[j], contact.omega[j] * contact.omega[j]
        matrix[i, i] += 1.0 + step.by_rate * damping + step.by_place * stiffness
        for c in range(3):
            matrix[c, i] += outwards[c]
            matrix[i, c] += outwards[c]
        for k in indices(begun, many):
            right[i, k] -= damping * rate[i, k] + stiffness * q[i, k]
        for c in range(3):
            for k in indices(begun, with_tables):
                right[i, k] -= (
                    turn[c] * feet[6 + c, k] + contact.coupling[j, c] * feet[12 + c, k]
                    + contact.spinning[j, c] * feet[15 + c, k]
                )  # fmt: skip
    if contact.rise != 0.0:
        last = 3 + ski * modes + modes - 1
        for j in range(modes - 1):
            matrix[3 + ski * modes + j, last] += contact.mixed[j]
            matrix[last, 3 + ski * modes + j] += contact.mixed[j]
        risen, rising = state.eta[ski, modes - 1], state.rate[ski, modes - 1]
        for k in indices(begun, many):
            right[last, k] -= inputs.leg[0, k] * risen + inputs.leg[1, k] * rising
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        for k in indices(begun, with_tables):
            right[c, k] -= feet[6 + d, k] * swinging[e] - feet[6 + e, k] * swinging[d]


@inlined
def add_ski(linear, ski, step, begun, tangent):
    """Add a ski's linearised forces to the equations of the pelvis and of its modes."""
    modes = (tangent.matrix.shape[0] - 3) // 2
    for row in range(MODAL + modes):
        i = row if row < 3 else 3 + ski * modes + row - MODAL
        add_row(tangent.right[i], linear[row], tangent.inputs[ski], tangent.first, tangent.last, begun)
        for c in range(3):
            tangent.matrix[i, c] -= step.by_place * linear[row, PLACE + c] + step.by_rate * linear[row, VELOCITY + c]
        for j in range(modes):
            tangent.matrix[i, 3 + ski * modes + j] -= (
                step.by_place * linear[row, MODES + j] + step.by_rate * linear[row, MODES + modes + j]
            )


@inlined
def correct(n, step, begun, tangent, series):
    """Take the accelerations that were found; the pelvis' tangents go into the series."""
    many = tangent.right.shape[1]
    for i in range(tangent.right.shape[0]):
        for k in indices(begun, many):
            tangent.acceleration[i, k] = tangent.right[i, k]
            tangent.place[i, k] += step.by_place * tangent.right[i, k]
            tangent.rate[i, k] += step.by_rate * tangent.right[i, k]
    for c in range(3):
        for k in indices(begun, many):
            series.place[n, c, k] = tangent.place[c, k]
            series.velocity[n, c, k] = tangent.rate[c, k]


@inlined
def fill_series(linear, n, ski, modes, begun, tangent, series):
    """Fill the series of one ski at an instant from its linearised forces."""
    z, first, last, further = tangent.inputs[ski], tangent.first, tangent.last, MODAL + modes
    add_row(series.loads[n, ski], linear[further + LOAD], z, first, last, begun)
    add_row(series.sole[n, ski], linear[further + SOLE], z, first, last, begun)
    add_row(series.edges[n, ski], linear[further + EDGE], z, first, last, begun)
    for c in range(3):
        add_row(series.friction[n, ski, c], linear[further + FRICTION + c], z, first, last, begun)
        add_row(series.force[n, ski, c], linear[c], z, first, last, begun)
        add_row(series.moment[n, ski, c], linear[further + MOMENT + c], z, first, last, begun)
