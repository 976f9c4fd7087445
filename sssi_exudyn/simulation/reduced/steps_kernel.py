"""The reduced model's loop over time: a template that ``compiled`` joins with the laws.

Unknowns are the pelvis' place x (3) and the amplitudes η of both skis' vibrations; the posture is prescribed.  With a
ski's contact points at X + Σ φ η in the frame of its foot, and p the modes' mass coupling with that frame,

    M ẍ + Σ R p η̈ = snow + friction + air + body + M g − (masses times the posture's own accelerations)
    η̈ + 2ζω η̇ + ω² η + pᵀ Rᵀ ẍ = Σ φ·F − pᵀ (what the foot's prescribed motion and gravity make the ski feel)

Where the leg gives, the last mode is the rise h = r η of the ski as one with its boot, along the foot's up axis u.  The
boot's friction f acts where it is then: it slides by v + ω × u h + u ḣ and pushes the mode by r u·f.  The other modes
are those of a ski held at the boot, so their masses are coupled with the rise (``ModalContact.mixed``).

Steps are Newmark's average acceleration, solved by Newton's method with the derivatives that the laws give.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.codegen.vectors import cross, dot, indices, into, out_of, plus, three, three_of, times
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.simulation.ski_on_snow.structs import InitialState, NewtonWork, ReducedSeries, ReducedState, TimeStep
from sssi_exudyn.terrain.surface import on_patch, patch_under

body_force: Callable[..., tuple[float, float, float]]
foot_derivatives: Callable[..., tuple[float, ...]]
foot_forces: Callable[..., tuple[tuple[float, float, float], float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
next_place: Callable[..., float]
next_rate: Callable[..., float]
penetration: Callable[..., float]
point_derivatives: Callable[..., tuple[float, float, float]]
point_velocity: Callable[..., tuple[float, float, float]]
point_wrench: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float]]]
segment_derivatives: Callable[..., tuple[float, ...]]
sinking_rate: Callable[..., float]
ski_axes: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float], float]]
snow_normal: Callable[..., tuple[float, float, float]]
terrain_height: Callable[..., tuple[float, float, float]]
time_step: Callable[..., TimeStep]
uneven: Callable[..., bool]
with_values: Callable[..., LawParameters]

GAP = 6
"""First of the last three columns of the table of points."""
ITERATIONS = 12
"""Newton iterations at most."""
RESTING = 1e-9
"""Of the load, the force that is left over at rest."""
SMALL = 1e-5
"""m/s²; a change of the accelerations that moves the skier by 10⁻¹⁰ m in a step."""


@njit(cache=True, error_model="numpy")
def foot_at(motion, n, ski, x, v):
    """Return place, velocity, rotation (3, 3) and spin of a foot at the n-th instant, with the pelvis at x, moving at
    v.
    """
    return (
        plus(x, three(motion.foot_place[n, ski], 0)), plus(v, three(motion.foot_velocity[n, ski], 0)),
        motion.foot_rotation[n, ski], three(motion.foot_spin[n, ski], 0),
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def pose_points(parameters, contact, foot, eta, rate, posed):
    """Fill ``posed`` (2m, 9) with the edge points of a bent ski: arm from the foot, velocity by bending (3 each), the
    gap of snow over the point along the slope's normal, and the snow's two slopes there.

    contact : ``ModalContact``;  foot : as of ``foot_at``;  eta, rate : (k,) of the modes
    """
    # one pass of its own: a call for every point would count the references to its arrays, which takes longer
    at, _, frame, _ = foot
    shape, points = contact.shape, contact.points
    under, shaped = patch_under(contact.surface, at[0], at[1]), uneven(parameters)
    for i in range(posed.shape[0]):
        m, edge = i // 2, i % 2
        a, b, c = points[m, edge, 0], points[m, edge, 1], points[m, edge, 2]
        d, e, f = 0.0, 0.0, 0.0
        for k in range(shape.shape[3]):
            a += shape[m, edge, 0, k] * eta[k]
            b += shape[m, edge, 1, k] * eta[k]
            c += shape[m, edge, 2, k] * eta[k]
            d += shape[m, edge, 0, k] * rate[k]
            e += shape[m, edge, 1, k] * rate[k]
            f += shape[m, edge, 2, k] * rate[k]
        arm, bending = out_of(frame, (a, b, c)), out_of(frame, (d, e, f))
        place = plus(at, arm)
        h, h_f, h_l = on_patch(under, place[0], place[1])
        if shaped:
            more, more_f, more_l = terrain_height(parameters, place[0], place[1])
            h, h_f, h_l = h + more, h_f + more_f, h_l + more_l
        for j in range(3):
            posed[i, j], posed[i, 3 + j] = arm[j], bending[j]
        posed[i, GAP], posed[i, GAP + 1], posed[i, GAP + 2] = h - place[2], h_f, h_l


@njit(cache=True, error_model="numpy")
def snow(parameters, contact, foot, posed, base, step, residual, matrix, scratch):
    """Add one ski's contact to residual (3 + 2k,) and matrix; the load, the area pressed into the snow, the snow's
    force square to it, and its moment about the foot's place.

    contact : ``ModalContact``, whose modes stand from ``base`` on;  posed : as of ``pose_points``
    step : ``TimeStep``, how place and rate follow from what is sought;  scratch : (4 + k, 3 + k), overwritten
    """
    _, velocity, frame, spin = foot
    shape, length = contact.shape, contact.length
    modes = shape.shape[3]
    size = 3 + modes
    load = 0.0
    groove = 0.0
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    scratch[:] = 0.0
    slope = scratch[size]
    for i in range(posed.shape[0]):
        if posed[i, GAP] <= 0.0:
            continue
        m, edge = i // 2, i % 2
        arm, bending, over = three_of(posed, i, 0), three_of(posed, i, 3), three_of(posed, i, GAP)
        normal = snow_normal(over[1], over[2])
        depth = penetration(over[0], normal)
        sinking = sinking_rate(point_velocity(velocity, spin, arm, bending), normal)
        push, by_depth, by_sinking = point_derivatives(parameters, depth, sinking, length[m])
        load += push
        groove += depth * length[m]
        pushed, turning = point_wrench(push, normal, arm)
        force, moment = plus(force, pushed), plus(moment, turning)
        inside = into(frame, normal)
        for d in range(3):
            slope[d] = normal[d]
            residual[d] -= push * normal[d]
        for k in range(modes):
            slope[3 + k] = (
                shape[m, edge, 0, k] * inside[0] + shape[m, edge, 1, k] * inside[1] + shape[m, edge, 2, k] * inside[2]
            )
            residual[base + k] -= push * slope[3 + k]
        stiffness = step.by_place * by_depth + step.by_rate * by_sinking
        for row in range(size):
            factor = stiffness * slope[row]
            for column in indices(row, size):
                scratch[row, column] += factor * slope[column]
    spread(matrix, scratch, base)
    return load, groove, force, moment


@inlined
def spread(matrix, upper, base):
    """Add one ski's symmetric matrix, of which the upper triangle (3 + k, 3 + k) is given, to that of both skis."""
    size = upper.shape[1]
    for row in range(size):
        to_row = row if row < 3 else base + row - 3
        for column in range(row, size):
            to_column = column if column < 3 else base + column - 3
            matrix[to_row, to_column] += upper[row, column]
            if row != column:
                matrix[to_column, to_row] += upper[row, column]


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
                for c in indices(i, n):
                    matrix[r, c] -= factor * matrix[i, c]
                right[r] -= factor * right[i]
    for i in range(n - 1, -1, -1):
        total = right[i]
        for c in range(i + 1, n):
            total -= matrix[i, c] * right[c]
        right[i] = total / matrix[i, i]


@njit(cache=True, error_model="numpy")
def settle(parameters, contact, x, foot_place, foot_rotation, load, eta):
    """Return the height of the pelvis at which both skis at rest carry ``load`` (N), or negative infinity; fill ``eta``
    (2, k).

    x : (3,) m, of which the height is the first guess;  foot_place (2, 3), foot_rotation (2, 3, 3) at the start

    Newton's method from a height at which the ski is well in the snow, every step limited to a few millimetres.
    """
    omega = contact.omega
    modes = omega.shape[0]
    size = 3 + 2 * modes
    matrix, residual, scratch = np.zeros((size, size)), np.zeros(size), np.zeros((4 + modes, 3 + modes))
    still = (0.0, 0.0, 0.0)
    rest, place, posed = np.zeros(modes), TimeStep(0.0, 1.0, 0.0), np.zeros((2 * contact.length.shape[0], 9))
    height = x[2]
    for _ in range(200):
        matrix[:] = 0.0
        residual[:] = 0.0
        carried = 0.0
        for ski in range(2):
            foot = (plus((x[0], x[1], height), three(foot_place[ski], 0)), still, foot_rotation[ski], still)
            pose_points(parameters, contact, foot, eta[ski], rest, posed)
            load_on_ski, _area, _force, _moment = snow(
                parameters, contact, foot, posed, 3 + ski * modes, place, residual, matrix, scratch
            )
            carried += load_on_ski
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
    step = time_step(n, motion.step)
    acceleration, trial, residual = state.acceleration, work.trial, work.residual
    size = acceleration.shape[0]
    for i in range(size):
        trial[i] = acceleration[i]
    done = False
    for _ in range(ITERATIONS):
        x, v = move_on(step, state, work)
        work.matrix[:] = 0.0
        for c in range(3):
            residual[c] = motion.mass * (trial[c] - motion.gravity[c]) + motion.carried[n, c]
            work.matrix[c, c] = motion.mass
        for ski in range(2):
            foot = foot_at(motion, n, ski, x, v)
            swing_modes(contact, motion, n, ski, step, work)
            pose_points(parameters, contact, foot, work.eta[ski], work.rate[ski], work.posed)
            load, groove, force, moment = snow(
                parameters, contact, foot, work.posed, 3 + ski * contact.omega.shape[0], step, residual, work.matrix,
                work.scratch,
            )  # fmt: skip
            series.loads[n, ski] = load
            for c in range(3):
                series.force[n, ski, c], series.moment[n, ski, c] = force[c], moment[c]
            add_friction(parameters, contact, foot, motion.time[n], ski, groove, step, n, series, work)
        push_body(parameters, motion, n, x, v, step, work)
        solve(work.matrix, residual)
        largest = 0.0
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
    keep(x, v, state, work, n, series)
    return True


@inlined
def move_on(step, state, work):
    """Return place and velocity of the pelvis after a step with the trial accelerations; the modes' go to ``work``."""
    x, v, before, after = state.place, state.velocity, state.acceleration, work.trial
    modes = work.eta.shape[1]
    for ski in range(2):
        for k in range(modes):
            both = before[3 + ski * modes + k] + after[3 + ski * modes + k]
            work.eta[ski, k] = next_place(step, state.eta[ski, k], state.rate[ski, k], both)
            work.rate[ski, k] = next_rate(step, state.rate[ski, k], both)
    pull = plus(three(before, 0), three(after, 0))
    place = (
        next_place(step, x[0], v[0], pull[0]), next_place(step, x[1], v[1], pull[1]),
        next_place(step, x[2], v[2], pull[2]),
    )  # fmt: skip
    return place, (next_rate(step, v[0], pull[0]), next_rate(step, v[1], pull[1]), next_rate(step, v[2], pull[2]))


@inlined
def swing_modes(contact, motion, n, ski, step, work):
    """Add the equations of a ski's modes, but for the snow, and what their inertia does to the pelvis."""
    trial, matrix, residual = work.trial, work.matrix, work.residual
    modes = contact.omega.shape[0]
    frame = motion.foot_rotation[n, ski]
    felt = plus(into(frame, three(trial, 0)), three(motion.ski_acceleration[n, ski], 0))
    for k in range(modes):
        i = 3 + ski * modes + k
        p, w = three(contact.coupling[k], 0), contact.omega[k]
        damping = 2.0 * contact.ratio[k] * w
        residual[i] = (
            trial[i] + damping * work.rate[ski, k] + w * w * work.eta[ski, k] + dot(p, felt)
            + dot(three(contact.spinning[k], 0), three(motion.ski_turning[n, ski], 0))
        )  # fmt: skip
        matrix[i, i] = 1.0 + step.by_rate * damping + step.by_place * w * w
        outwards = out_of(frame, p)
        for c in range(3):
            residual[c] += outwards[c] * trial[i]
            matrix[c, i] += outwards[c]
            matrix[i, c] += outwards[c]
    last = 3 + ski * modes + modes - 1
    for k in range(contact.mixed.shape[0]):
        i, share = 3 + ski * modes + k, contact.mixed[k]
        residual[i] += share * trial[last]
        residual[last] += share * trial[i]
        matrix[i, last] += share
        matrix[last, i] += share


@njit(cache=True, error_model="numpy")
def risen_boot(contact, foot, eta, rate):
    """Return the arm (m) from a captured foot to its boot, which the leg lets rise, and the boot's velocity (m/s)."""
    _, velocity, frame, spin = foot
    if contact.rise == 0.0:
        return (0.0, 0.0, 0.0), velocity
    last = eta.shape[0] - 1
    up = (frame[0, 2], frame[1, 2], frame[2, 2])
    arm = times(contact.rise * eta[last], up)
    return arm, point_velocity(velocity, spin, arm, times(contact.rise * rate[last], up))


@inlined
def add_friction(parameters, contact, foot, t, ski, groove, step, n, series, work):
    """Add the friction on a foot whose load the series has; the series gets it, the edge angle and the sole's force."""
    at, _, frame, _ = foot
    arm, velocity = risen_boot(contact, foot, work.eta[ski], work.rate[ski])
    _, normal = ground(parameters, patch_under(contact.surface, at[0], at[1]), at[0], at[1])
    along, across, edge = ski_axes(normal, frame)
    load = series.loads[n, ski]
    law = foot_derivatives(
        parameters, load, dot(velocity, along), dot(velocity, across), edge, groove, t, at[0], at[1], 1.0 - 2.0 * ski
    )
    friction, sole = foot_forces(load, law[0], law[1], normal, along, across, frame)
    series.edges[n, ski], series.sole[n, ski] = edge, sole
    for c in range(3):
        work.residual[c] -= friction[c]
        series.friction[n, ski, c] = friction[c]
        series.force[n, ski, c] += friction[c]
        for d in range(3):
            work.matrix[c, d] -= step.by_rate * (
                along[c] * (law[3] * along[d] + law[4] * across[d])
                + across[c] * (law[6] * along[d] + law[7] * across[d])
            )
    if contact.rise != 0.0:
        rub_boot(contact, (frame, arm), friction, (along, across, law), step, (n, ski), series, work)


@njit(cache=True, error_model="numpy")
def rub_boot(contact, boot, friction, sliding, step, at, series, work):
    """Add what the friction (N) on a boot that rises does to its mode, and its moment about the foot.

    boot : the foot's frame and the boot's arm;  sliding : axes along and across, and the law's derivatives
    at : instant and ski
    """
    (frame, arm), (along, across, law), (n, ski) = boot, sliding, at
    last = 3 + (ski + 1) * contact.omega.shape[0] - 1
    up, rise = (frame[0, 2], frame[1, 2], frame[2, 2]), contact.rise
    turning = cross(arm, friction)
    work.residual[last] -= rise * dot(up, friction)
    up_along, up_across = dot(up, along), dot(up, across)
    into_along, into_across = law[3] * up_along + law[6] * up_across, law[4] * up_along + law[7] * up_across
    from_along, from_across = law[3] * up_along + law[4] * up_across, law[6] * up_along + law[7] * up_across
    for c in range(3):
        series.moment[n, ski, c] += turning[c]
        work.matrix[last, c] -= step.by_rate * rise * (into_along * along[c] + into_across * across[c])
        work.matrix[c, last] -= step.by_rate * rise * (from_along * along[c] + from_across * across[c])
    work.matrix[last, last] -= step.by_rate * rise * rise * (into_along * up_along + into_across * up_across)


@inlined
def push_body(parameters, motion, n, x, v, step, work):
    """Add what the air does to all segments, and the forces on the centre of mass."""
    residual, matrix = work.residual, work.matrix
    for k in range(motion.area.shape[0]):
        moving = plus(v, three(motion.exposed_velocity[n, k], 0))
        facing = motion.exposed_facing[n, k]
        air = segment_derivatives(
            parameters, motion.time[n], x[0], x[1], moving[0], moving[1], moving[2], motion.area[k],
            facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        )  # fmt: skip
        for c in range(3):
            residual[c] -= air[c]
            for d in range(3):
                matrix[c, d] -= step.by_rate * air[3 + 3 * c + d]
    at, moving = plus(x, three(motion.com_place[n], 0)), plus(v, three(motion.com_velocity[n], 0))
    body = body_force(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2])
    for c in range(3):
        residual[c] -= body[c]


@inlined
def keep(x, v, state, work, n, series):
    """Keep the state that Newton's method has found."""
    # arrays element by element: an assignment of the whole compiles its error messages, 4 s of them
    for i in range(work.trial.shape[0]):
        state.acceleration[i] = work.trial[i]
    for ski in range(2):
        for k in range(work.eta.shape[1]):
            state.eta[ski, k], state.rate[ski, k] = work.eta[ski, k], work.rate[ski, k]
    for c in range(3):
        state.place[c], state.velocity[c] = x[c], v[c]
        series.place[n, c], series.velocity[n, c] = x[c], v[c]


@njit(cache=True, error_model="numpy")
def first_state(start, points):
    """Return the state before the first instant, and the arrays that steps of skis of so many points are solved in."""
    modes = start.eta.shape[1]
    size = 3 + 2 * modes
    state = ReducedState(
        start.place.copy(), start.velocity.copy(), start.eta.copy(), np.zeros((2, modes)), np.zeros(size)
    )
    work = NewtonWork(
        np.zeros(size), np.zeros((2, modes)), np.zeros((2, modes)), np.zeros((size, size)), np.zeros(size),
        np.zeros((4 + modes, 3 + modes)), np.zeros((points, 9)),
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
        state, work = first_state(
            InitialState(start.place[i], start.velocity[i], start.eta[i]), 2 * contact.length.shape[0]
        )
        one = ReducedSeries(
            series.place[i], series.velocity[i], series.loads[i], series.sole[i], series.friction[i], series.edges[i],
            series.force[i], series.moment[i],
        )  # fmt: skip
        done[i] = motion.time.shape[0]
        for n in range(motion.time.shape[0]):
            if not advance(own, contact, motion, n, state, work, one):
                done[i] = n
                break
