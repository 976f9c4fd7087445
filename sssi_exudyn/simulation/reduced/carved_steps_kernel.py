"""The reduced model's loop over time on snow that edges cut: a template that ``compiled`` joins with the laws,
``ground_kernel``, ``groove_kernel``, ``heading_kernel`` and ``carving_kernel``.

Unknowns are the pelvis' place x (3) and, of each ski, its yaw ψ and roll φ against the foot and the amplitudes η of its
vibrations; all else of the posture is prescribed.  With the ski's snow force F and moment about the foot's place

    M ẍ + Σ R p η̈ = Σ F + air + body + M g − (masses times the posture's own accelerations)
    I ψ̈ + 2ζ√(kI) ψ̇ + k ψ = moment about the foot's z axis, and so φ about the ski's long axis
    η̈ + 2ζω η̇ + gᵀ c g η̇ + ω² η + pᵀ Rᵀ ẍ = Σ shape·F − pᵀ (what the foot's prescribed motion and gravity make the
                                                               ski feel)

Heave and pitch against the foot, g η, are in the vibrations: they are those of a ski whose boot centre is on springs.
The boot centre heaves along the foot's z axis and yaws about it; there the ski rolls about its long axis, and pitches
about its own y axis, by an angle that need not be small; what else is in the vibrations bends the ski there.

The pelvis' steps are Newmark's average acceleration.  Those of the ski against the foot are backward differences',
which damp what is faster than a step: of second order, or of first order, backward Euler's, which damp slower movement
too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, dot, into, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.terrain.surface import patch_under

segment_derivatives: Callable[..., tuple[float, ...]]
body_force: Callable[..., tuple[float, float, float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
press_edges: Callable[..., None]
advect: Callable[..., None]
accept: Callable[..., None]
of_ski: Callable[..., Any]
eliminate: Callable[..., bool]
turn_heading: Callable[..., None]
moment_on_heading: Callable[..., float]

ITERATIONS = 30
"""Newton iterations at most."""
SMALL = 1e-5
"""m/s²: a change of the accelerations that moves the skier by 10⁻¹⁰ m in a step."""
REST_ITERATIONS = 200
REST = 1e-7
"""m by which the height of a skier at rest is known."""
LOOSE = 1.0
"""m/s²: where two branches of the law alternate, what may be left of it."""


class Joint(NamedTuple):
    """How a ski turns against its foot.

    stiffness, damping, inertia : (2,) N m/rad, N m s/rad, kg m² in yaw and roll;  rest : (2, 2) rad by ski
    slowing : (2,) N s/m, N m s/rad of the dampers of heave and pitch beside the vibrations' own damping
    """

    stiffness: Array
    damping: Array
    inertia: Array
    rest: Array
    slowing: Array


class Coupling(NamedTuple):
    """translation, rotation : (k, 3) the modes' participation in the foot's acceleration (kg) and turning (kg m)"""

    translation: Array
    rotation: Array


class CarvedSeries(NamedTuple):
    """What a run fills at t instants.

    place, velocity : (t, 3) m, m/s of the pelvis
    bent, bending : (t, 2, 2 + k) rad and m, yaw, roll and bend of the skis, and their rates
    acceleration : (t, 7 + 2k) of the pelvis, then of what bends each ski
    loads, sole, edges : (t, 2) N, N, rad;  friction, force, moment : (t, 2, 3) N, N, N m as in ``ReducedSeries``
    power : (t, 3) W that the snow takes from both skis by friction along and across the edges and by pressing
    reserve : (t, 2, 2) N by ski, what the walls bear at most, and what they do bear
    """

    place: Array
    velocity: Array
    bent: Array
    bending: Array
    acceleration: Array
    loads: Array
    sole: Array
    edges: Array
    friction: Array
    force: Array
    moment: Array
    power: Array
    reserve: Array


@njit(cache=True, error_model="numpy")
def backward(n, step, order):
    """What of a value at the instants n − 1 and n − 2 is predicted at n, and what its rate at n adds (s)."""
    if n < order:
        return 1.0, 0.0, step if n > 0 else 0.0
    return (1.0, 0.0, step) if order == 1 else (4.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0 * step)


@njit(cache=True, error_model="numpy")
def standing_on(parameters, at, surface, frame):
    """Height of a place over the snow along its normal; fills ``frame`` with the snow's axes, rows, the normal last."""
    height, normal = ground(parameters, patch_under(surface, at[0], at[1]), at[0], at[1])
    first = plus((1.0, 0.0, 0.0), times(-normal[0], normal))
    first = times(1.0 / math.sqrt(dot(first, first)), first)
    second = cross(normal, first)
    for c in range(3):
        frame[0, c], frame[1, c], frame[2, c] = first[c], second[c], normal[c]
    return (at[2] - height) * normal[2]


@njit(cache=True, error_model="numpy")
def turn_ski(foot, psi, phi, theta, frame):
    """Fill ``frame`` with a foot's rotation (3, 3) turned by ψ about its z axis, then by φ about its x axis, and then
    by θ about its y axis; the axis that it rolls about.
    """
    a, b, c, s = math.cos(psi), math.sin(psi), math.cos(phi), math.sin(phi)
    cosine, sine = math.cos(theta), math.sin(theta)
    for row in range(3):
        x, y, z = foot[row, 0], foot[row, 1], foot[row, 2]
        long, side = a * x + b * y, -b * x + a * y
        frame[row, 1] = c * side + s * z
        up = -s * side + c * z
        frame[row, 0], frame[row, 2] = cosine * long - sine * up, sine * long + cosine * up
    return (
        a * foot[0, 0] + b * foot[0, 1],
        a * foot[1, 0] + b * foot[1, 1],
        a * foot[2, 0] + b * foot[2, 1],
    )


@njit(cache=True, error_model="numpy")
def given_by(ski, eta):
    """Heave (m) and pitch (rad) of a ski whose modes have the amplitudes ``eta``, or with their rates its rates."""
    heave, pitch = 0.0, 0.0
    for k in range(eta.shape[0]):
        heave += ski.give[0, k] * eta[k]
        pitch += ski.give[1, k] * eta[k]
    return heave, pitch


@njit(cache=True, error_model="numpy")
def place_ski(parameters, ski, motion, surface, n, side, x, q, snow, frame):
    """A ski at an instant, the pelvis at a place x (tuple), the ski turned and bent by q (2 + k,): its boot centre's
    place and height over the snow, its heave (m), and the axes that it yaws and heaves, rolls and pitches about.

    snow, frame : (3, 3) are filled with the snow's axes and the ski's rotation
    """
    foot_frame = motion.foot_rotation[n, side]
    heave, pitch = given_by(ski, q[2:])
    long = turn_ski(foot_frame, q[0], q[1], pitch, frame)
    upright = (foot_frame[0, 2], foot_frame[1, 2], foot_frame[2, 2])
    at = plus(plus(x, three(motion.foot_place[n, side], 0)), times(heave, upright))
    height = standing_on(parameters, at, surface, snow)
    return at, height, heave, upright, long, (frame[0, 1], frame[1, 1], frame[2, 1])


@njit(cache=True, error_model="numpy")
def pose_ski(parameters, ski, motion, surface, n, side, x, v, q, rate, snow, frame, local):
    """A ski at an instant, the pelvis at a place with a velocity (tuples), the ski turned and bent by q (2 + k,): the
    foot as ``press_edges`` takes it; place, velocity and spin of the boot centre in the slope's frame; the axes that
    the ski yaws and heaves, rolls and pitches about; its heave and the rates of heave and pitch.

    snow, frame, local : (3, 3) are filled with the snow's axes, the ski's rotation, and that on the snow
    """
    at, height, heave, upright, long, left = place_ski(
        parameters, ski, motion, surface, n, side, x, q, snow, frame
    )  # fmt: skip
    heaving, pitching = given_by(ski, rate[2:])
    local[:] = np.dot(snow, frame)
    turning = three(motion.foot_spin[n, side], 0)
    spin = plus(plus(turning, times(rate[0], upright)), plus(times(rate[1], long), times(pitching, left)))
    moving = plus(plus(v, three(motion.foot_velocity[n, side], 0)), times(heaving, upright))
    moving = plus(moving, times(heave, cross(turning, upright)))
    foot = (
        height, out_of(snow, moving), local, out_of(snow, spin), out_of(snow, upright), out_of(snow, left)
    )  # fmt: skip
    return foot, (at, moving, spin), (upright, long, left), (heave, heaving, pitching)


@njit(cache=True, error_model="numpy")
def rest_height(parameters, ski, motion, surface, place, load, memory, work):
    """Height of the pelvis (m) at which both unbent skis at the first instant carry ``load`` (N) in fresh snow.

    Negative infinity where none is found.
    """
    modes = ski.omega.shape[0]
    size = 6 + modes
    still, nothing, ones = np.zeros(modes), np.zeros(size), np.ones(size)
    snow, turned, matrix = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((size, size))
    low, high = place[2] - 0.3, place[2] + 0.3
    for _ in range(50):
        middle = 0.5 * (low + high)
        carried = 0.0
        for side in range(2):
            at = plus((place[0], place[1], middle), three(motion.foot_place[0, side], 0))
            height = standing_on(parameters, at, surface, snow)
            turned[:] = np.dot(snow, motion.foot_rotation[0, side])
            nothing[:] = 0.0
            foot = (height, (0.0, 0.0, 0.0), turned, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            press_edges(
                parameters,
                ski,
                of_ski(memory, side),
                foot,
                still,
                still,
                0.0,
                ones,
                ones,
                nothing,
                matrix,
                work,
            )
            carried += nothing[2]
        if carried > load:
            low = middle
        else:
            high = middle
    return middle if high < place[2] + 0.3 else -np.inf


@njit(cache=True, error_model="numpy")
def bend_at_rest(parameters, ski, coupling, joint, motion, surface, place, load, q, memory, work):
    """Find yaw, roll and bend ``q`` (2, 2 + k) of both skis at rest in fresh snow at the first instant, and the height
    ``place[2]`` (m) at which they carry ``load`` (N) then.  False where Newton's method finds none.
    """
    modes = ski.omega.shape[0]
    own, of_snow = 2 + modes, 6 + modes
    size = 1 + 2 * own
    still, pressed, ones, zeros = np.zeros(modes), np.zeros(of_snow), np.ones(of_snow), np.zeros(of_snow)
    snow, frame, stiff = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((of_snow, of_snow))
    columns = np.zeros((of_snow, 1 + own))  # how a ski's snow coordinates follow from what is sought
    matrix, residual = np.zeros((size, size)), np.zeros(size)
    q[:] = 0.0
    for _ in range(REST_ITERATIONS):
        matrix[:] = 0.0
        residual[:] = 0.0
        residual[0] = load
        for side in range(2):
            base = 1 + side * own
            _, height, _, upright, long, left = place_ski(
                parameters, ski, motion, surface, 0, side, three(place, 0), q[side], snow, frame
            )  # fmt: skip
            turned = out_of(snow, upright), out_of(snow, long)
            pressed[:] = 0.0
            stiff[:] = 0.0
            foot = (
                height, (0.0, 0.0, 0.0), np.dot(snow, frame), (0.0, 0.0, 0.0), turned[0], out_of(snow, left)
            )  # fmt: skip
            press_edges(
                parameters, ski, of_ski(memory, side), foot, q[side, 2:], still, 0.0, ones, zeros, pressed, stiff, work
            )
            columns[:] = 0.0
            for c in range(3):
                columns[c, 0] = snow[c, 2]
                columns[3 + c, 1], columns[3 + c, 2] = turned[0][c], turned[1][c]
            for k in range(modes):
                columns[6 + k, 3 + k] = 1.0
            force, slopes = np.dot(columns.T, pressed), np.dot(columns.T, np.dot(stiff, columns))
            for i in range(1 + own):
                row = 0 if i == 0 else base + i - 1
                residual[row] -= force[i]
                for j in range(1 + own):
                    matrix[row, 0 if j == 0 else base + j - 1] += slopes[i, j]
            for i in range(own):
                held = joint.stiffness[i] if i < 2 else ski.omega[i - 2] ** 2
                rest = joint.rest[side, i] if i < 2 else 0.0
                residual[base + i] += held * (q[side, i] - rest)
                matrix[base + i, base + i] += held
            for k in range(modes):
                felt = three(motion.ski_acceleration[0, side], 0), three(motion.ski_turning[0, side], 0)
                residual[base + 2 + k] += dot(three(coupling.translation[k], 0), felt[0])
                residual[base + 2 + k] += dot(three(coupling.rotation[k], 0), felt[1])
        if not eliminate(matrix, residual):
            return False
        # a ski that is let down by more than it sinks leaves the snow
        share = min(1.0, 2e-3 / max(abs(residual[0]), 1e-12))
        place[2] -= share * residual[0]
        for side in range(2):
            for i in range(own):
                q[side, i] -= share * residual[1 + side * own + i]
        if not abs(residual[0]) < 1.0:
            return False
        if abs(residual[0]) < REST:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def run_carved(
    parameters, ski, coupling, joint, heading, motion, surface, place, velocity, bent, memory, work, order, series
):  # fmt: skip
    """Integrate a run from its start; fills series.  The number of instants that were reached.

    heading : ``FoundHeading``; where it is found the tables of ``motion`` and its own are turned in place

    place, velocity : (3,) m, m/s of the pelvis at the start;  bent : (2, 2 + k) yaw, roll and bend of the skis then
    memory : ``Groove`` with a first axis for the skis;  order : of the skis' steps, 1 or 2
    """
    modes = ski.omega.shape[0]
    own = 2 + modes
    size, of_snow = 3 + 2 * own, 6 + modes
    step, mass, gravity = motion.step, motion.mass, motion.gravity
    x, v, acceleration = place.copy(), velocity.copy(), np.zeros(3)
    q, rate = bent.copy(), np.zeros((2, own))
    new_q, new_rate, old_q, old_rate = q.copy(), rate.copy(), q.copy(), rate.copy()
    trial = np.zeros(size)
    matrix, residual = np.zeros((size, size)), np.zeros(size)
    by_place, by_rate = np.ones(of_snow), np.ones(of_snow)
    pressed, stiff = np.zeros(of_snow), np.zeros((of_snow, of_snow))
    columns = np.zeros((of_snow, 3 + own))  # how a ski's snow coordinates follow from what is sought
    snow, frame, local = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    drag = np.zeros(4)
    for n in range(motion.time.shape[0]):
        # the first instant finds the accelerations of the start
        h = step if n > 0 else 0.0
        last, before, own_rate = backward(n, step, order)
        pelvis_place, pelvis_rate, own_place = 0.25 * h * h, 0.5 * h, own_rate * own_rate
        if heading.found:
            turn_heading(heading, motion, n, h)
        for side in range(2):
            advect(ski, of_ski(memory, side), h)
        done = False
        for iteration in range(ITERATIONS):
            new_x = (
                x[0] + h * v[0] + pelvis_place * (acceleration[0] + trial[0]),
                x[1] + h * v[1] + pelvis_place * (acceleration[1] + trial[1]),
                x[2] + h * v[2] + pelvis_place * (acceleration[2] + trial[2]),
            )
            new_v = (
                v[0] + pelvis_rate * (acceleration[0] + trial[0]),
                v[1] + pelvis_rate * (acceleration[1] + trial[1]),
                v[2] + pelvis_rate * (acceleration[2] + trial[2]),
            )
            for side in range(2):
                for k in range(own):
                    moved = last * rate[side, k] + before * old_rate[side, k]
                    new_rate[side, k] = moved + own_rate * trial[3 + side * own + k]
                    new_q[side, k] = last * q[side, k] + before * old_q[side, k] + own_rate * new_rate[side, k]
            matrix[:] = 0.0
            for c in range(3):
                residual[c] = mass * (trial[c] - gravity[c]) + motion.carried[n, c]
                matrix[c, c] = mass
            series.power[n, :] = 0.0
            series.reserve[n, :, :] = 0.0
            for side in range(2):
                base = 3 + side * own
                foot_frame = motion.foot_rotation[n, side]
                foot, _, axes, given = pose_ski(
                    parameters, ski, motion, surface, n, side, new_x, new_v, new_q[side], new_rate[side], snow, frame,
                    local,
                )  # fmt: skip
                upright, long = axes[0], axes[1]
                pressed[:] = 0.0
                stiff[:] = 0.0
                for c in range(of_snow):
                    by_place[c] = pelvis_place if c < 3 else own_place
                    by_rate[c] = pelvis_rate if c < 3 else own_rate
                press_edges(
                    parameters, ski, of_ski(memory, side), foot, new_q[side, 2:], new_rate[side, 2:], h,
                    by_place, by_rate, pressed, stiff, work,
                )  # fmt: skip
                columns[:] = 0.0
                turned = out_of(snow, upright), out_of(snow, long)
                for c in range(3):
                    for d in range(3):
                        columns[c, d] = snow[c, d]
                    columns[3 + c, 3], columns[3 + c, 4] = turned[0][c], turned[1][c]
                for k in range(modes):
                    columns[6 + k, 5 + k] = 1.0
                force = np.dot(columns.T, pressed)
                slopes = np.dot(columns.T, np.dot(stiff, columns))
                for i in range(3 + own):
                    row = i if i < 3 else base + i - 3
                    if i < 3:
                        residual[row] -= force[i]
                    else:
                        residual[row] = -force[i]
                    for j in range(3 + own):
                        matrix[row, j if j < 3 else base + j - 3] += slopes[i, j]
                for i in range(2):
                    residual[base + i] += (
                        joint.inertia[i] * trial[base + i]
                        + joint.damping[i] * new_rate[side, i]
                        + joint.stiffness[i] * (new_q[side, i] - joint.rest[side, i])
                    )
                    matrix[base + i, base + i] += (
                        joint.inertia[i] + joint.damping[i] * own_rate + joint.stiffness[i] * own_place
                    )
                pulled = into(frame, (trial[0], trial[1], trial[2]))
                for k in range(modes):
                    i = base + 2 + k
                    p, w, ratio = three(coupling.translation[k], 0), ski.omega[k], ski.ratio[k]
                    residual[i] += (
                        trial[i] + 2.0 * ratio * w * new_rate[side, 2 + k] + w * w * new_q[side, 2 + k]
                        + dot(p, plus(pulled, three(motion.ski_acceleration[n, side], 0)))
                        + dot(three(coupling.rotation[k], 0), three(motion.ski_turning[n, side], 0))
                    )  # fmt: skip
                    matrix[i, i] += 1.0 + 2.0 * ratio * w * own_rate + w * w * own_place
                    outwards = out_of(frame, p)
                    for c in range(3):
                        residual[c] += outwards[c] * trial[i]
                        matrix[c, i] += outwards[c]
                        matrix[i, c] += outwards[c]
                for i in range(2):
                    for k in range(modes):
                        slowed = joint.slowing[i] * ski.give[i, k]
                        residual[base + 2 + k] += slowed * given[1 + i]
                        for j in range(modes):
                            matrix[base + 2 + k, base + 2 + j] += slowed * ski.give[i, j] * own_rate
                normal = (snow[2, 0], snow[2, 1], snow[2, 2])
                load = pressed[2]
                series.loads[n, side] = load
                left, up = (frame[0, 1], frame[1, 1], frame[2, 1]), (frame[0, 2], frame[1, 2], frame[2, 2])
                series.edges[n, side] = math.atan2(dot(left, normal), dot(up, normal))
                moment = into(snow, (pressed[3], pressed[4], pressed[5]))
                moment = plus(moment, times(given[0], cross(upright, three(force, 0))))
                for c in range(3):
                    series.force[n, side, c] = force[c]
                    series.friction[n, side, c] = force[c] - load * normal[c]
                    series.moment[n, side, c] = moment[c]
                series.sole[n, side] = (
                    foot_frame[0, 2] * force[0] + foot_frame[1, 2] * force[1] + foot_frame[2, 2] * force[2]
                )
                for i in range(ski.width.shape[0]):
                    series.power[n, 0] -= work.seen[i, 1] * work.seen[i, 7]
                    series.power[n, 1] -= work.seen[i, 2] * work.seen[i, 8]
                    series.power[n, 2] += work.seen[i, 0] * work.seen[i, 11]
                    series.reserve[n, side, 0] += work.seen[i, 3]
                    series.reserve[n, side, 1] += work.seen[i, 12]
            drag[:] = 0.0
            for k in range(motion.area.shape[0]):
                moving = plus(new_v, three(motion.exposed_velocity[n, k], 0))
                facing = motion.exposed_facing[n, k]
                found = segment_derivatives(
                    parameters, motion.time[n], new_x[0], new_x[1], moving[0], moving[1], moving[2], motion.area[k],
                    facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
                )  # fmt: skip
                for c in range(3):
                    residual[c] -= found[c]
                    drag[c] += found[c]
                    drag[3] += found[c] * heading.exposed_swing[n, k, c]
                    for d in range(3):
                        matrix[c, d] -= pelvis_rate * found[3 + 3 * c + d]
            at = plus(new_x, three(motion.com_place[n], 0))
            moving = plus(new_v, three(motion.com_velocity[n], 0))
            body = body_force(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2])
            for c in range(3):
                residual[c] -= body[c]
            if not eliminate(matrix, residual):
                return n
            share = 1.0 if iteration < 12 else 0.5
            largest = 0.0
            for i in range(size):
                trial[i] -= share * residual[i]
                largest = max(largest, abs(residual[i]))
            if not largest < 1e9:
                return n
            if largest < SMALL:
                done = True
                break
        if not done and largest * max(h, 1e-3) ** 2 > LOOSE:
            return n
        for c in range(3):
            x[c], v[c], acceleration[c] = new_x[c], new_v[c], trial[c]
            series.place[n, c], series.velocity[n, c] = new_x[c], new_v[c]
        for i in range(size):
            series.acceleration[n, i] = trial[i]
        for side in range(2):
            for k in range(own):
                old_q[side, k], old_rate[side, k] = q[side, k], rate[side, k]
                q[side, k], rate[side, k] = new_q[side, k], new_rate[side, k]
                series.bent[n, side, k], series.bending[n, side, k] = q[side, k], rate[side, k]
            accept(of_ski(memory, side))
        if heading.found:
            heading.moment[n] = moment_on_heading(
                heading, motion, n, series.force[n], series.moment[n], drag, body
            )  # fmt: skip
    return motion.time.shape[0]
