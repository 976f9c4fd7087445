"""The reduced model's loop over time on snow that edges cut: a template that ``compiled`` joins with the laws and the
kernels of ``ski_on_snow``.

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
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.terrain.surface import patch_under

segment_derivatives: Callable[..., tuple[float, ...]]
body_force: Callable[..., tuple[float, float, float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
press_edges: Callable[..., None]
SkiPose: Callable[..., Any]
time_step: Callable[..., Any]
next_place: Callable[..., float]
next_rate: Callable[..., float]
backward: Callable[..., Any]
next_value: Callable[..., float]
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
LOOSE = 1.0
"""m/s²: where two branches of the law alternate, what may be left of it."""


class Joint(NamedTuple):
    """How a ski turns against its foot.

    stiffness, damping, inertia : (2,) N m/rad, N m s/rad, kg m² in yaw and roll;  rest : (2, 2) rad by ski
    slowing : (2,) N s/m, N m s/rad of the dampers of heave and pitch in addition to the vibrations' own damping
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


class CarvedSystem(NamedTuple):
    """What does not change along a run.

    parameters : ``LawParameters``;  ski : ``EdgeSki``, the same for both;  motion : ``PrescribedMotion``
    surface : ``SnowGrid``;  order : of the skis' steps, 1 or 2
    """

    parameters: Any
    ski: Any
    coupling: Coupling
    joint: Joint
    motion: Any
    surface: Any
    order: int


class CarvedState(NamedTuple):
    """The unknowns at one instant, and those that a step tries.

    place, velocity, acceleration : (3,) m, m/s, m/s² of the pelvis
    bent, bending : (2, 2 + k) yaw, roll and bend of the skis, and their rates;  old_bent, old_bending : a step before
    trial : (7 + 2k,) accelerations of the pelvis, then of what bends each ski, that a step tries
    next_bent, next_bending : (2, 2 + k) what these lead to
    """

    place: Array
    velocity: Array
    acceleration: Array
    bent: Array
    bending: Array
    old_bent: Array
    old_bending: Array
    trial: Array
    next_bent: Array
    next_bending: Array

    @classmethod
    def begin(cls, place: Array, velocity: Array, bent: Array) -> CarvedState:
        """Return the state at the start, which keeps none of these arrays."""
        still = np.zeros_like(bent)
        return cls(
            place.copy(), velocity.copy(), np.zeros(3), bent.copy(), still, bent.copy(), still.copy(),
            np.zeros(3 + bent.size), bent.copy(), still.copy(),
        )  # fmt: skip


class CarvedWork(NamedTuple):
    """Arrays in which a step is solved for.

    edges : ``EdgeWork``;  snow, frame, local : (3, 3) the snow's axes, a ski's rotation, and that on the snow
    columns : (6 + k, 5 + k) how a ski's snow coordinates follow from what is sought of pelvis and ski
    matrix, residual : (7 + 2k, 7 + 2k), (7 + 2k,) of Newton's method
    drag : (4,) N of the air on all segments, and N m on the heading
    """

    edges: Any
    snow: Array
    frame: Array
    local: Array
    columns: Array
    matrix: Array
    residual: Array
    drag: Array

    @classmethod
    def room(cls, edges: Any, modes: int) -> CarvedWork:
        """Make room for a ski of so many vibrations, whose edges have ``EdgeWork``."""
        axes, size = np.zeros((3, 3, 3)), 7 + 2 * modes
        columns = np.zeros((6 + modes, 5 + modes))
        return cls(edges, axes[0], axes[1], axes[2], columns, np.zeros((size, size)), np.zeros(size), np.zeros(4))


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
def standing_on(parameters, at, surface, frame):
    """Return the height of a place over the snow along its normal; fill ``frame`` with the snow's axes, rows, the
    normal last.
    """
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
    """Return heave (m) and pitch (rad) of a ski with modal amplitudes ``eta``, or with their rates its rates."""
    heave, pitch = 0.0, 0.0
    for k in range(eta.shape[0]):
        heave += ski.give[0, k] * eta[k]
        pitch += ski.give[1, k] * eta[k]
    return heave, pitch


@njit(cache=True, error_model="numpy")
def place_ski(system, n, side, x, bent, work):
    """Return a ski's place at an instant, the pelvis at x (tuple), the ski turned and bent (2 + k,): its boot centre's
    place and height over the snow, its heave (m), and the axes that it yaws and heaves, rolls and pitches about.  The
    axes of ``work`` are filled.
    """
    foot_frame, snow, frame, local = system.motion.foot_rotation[n, side], work.snow, work.frame, work.local
    heave, pitch = given_by(system.ski, bent[2:])
    long = turn_ski(foot_frame, bent[0], bent[1], pitch, frame)
    upright = (foot_frame[0, 2], foot_frame[1, 2], foot_frame[2, 2])
    at = plus(plus(x, three(system.motion.foot_place[n, side], 0)), times(heave, upright))
    height = standing_on(system.parameters, at, system.surface, snow)
    turn_into(snow, frame, local)
    return at, height, heave, upright, long, (frame[0, 1], frame[1, 1], frame[2, 1])


@njit(cache=True, error_model="numpy")
def pose_ski(system, n, side, x, v, bent, bending, work):
    """Pose a ski at an instant, the pelvis at a place with a velocity (tuples), the ski turned and bent (2 + k,).

    Returns the ski as ``press_edges`` takes it; place, velocity and spin of the boot centre in the slope's frame; the
    axes that the ski yaws and heaves, rolls and pitches about; its heave and the rates of heave and pitch.
    """
    motion, snow = system.motion, work.snow
    at, height, heave, upright, long, left = place_ski(system, n, side, x, bent, work)
    heaving, pitching = given_by(system.ski, bending[2:])
    turning = three(motion.foot_spin[n, side], 0)
    spin = plus(plus(turning, times(bending[0], upright)), plus(times(bending[1], long), times(pitching, left)))
    moving = plus(plus(v, three(motion.foot_velocity[n, side], 0)), times(heaving, upright))
    moving = plus(moving, times(heave, cross(turning, upright)))
    pose = SkiPose(
        height, out_of(snow, moving), work.local, out_of(snow, spin), out_of(snow, upright), out_of(snow, left),
        bent[2:], bending[2:],
    )  # fmt: skip
    return pose, (at, moving, spin), (upright, long, left), (heave, heaving, pitching)


@njit(cache=True, error_model="numpy")
def turn_into(snow, frame, local):
    """Fill ``local`` with a ski's rotation on the snow, whose axes are the rows of ``snow``."""
    for i in range(3):
        for j in range(3):
            local[i, j] = snow[i, 0] * frame[0, j] + snow[i, 1] * frame[1, j] + snow[i, 2] * frame[2, j]


@njit(cache=True, error_model="numpy")
def press_ski(system, memory, pose, long, h, work):
    """Press a ski into the snow; the force (5 + k,) on pelvis, yaw, roll and bend, and its derivatives by these, the
    sign turned.

    memory : of the ski;  long : (3,) its long axis on the snow
    """
    columns, edges = work.columns, work.edges
    press_edges(system.parameters, system.ski, memory, pose, h, edges)
    columns[:] = 0.0
    for c in range(3):
        for d in range(3):
            columns[c, d] = work.snow[c, d]
        columns[3 + c, 3], columns[3 + c, 4] = pose.heave_axis[c], long[c]
    for k in range(columns.shape[0] - 6):
        columns[6 + k, 5 + k] = 1.0
    return np.dot(columns.T, edges.force), np.dot(columns.T, np.dot(edges.matrix, columns))


@njit(cache=True, nogil=True, error_model="numpy")
def run_carved(system, heading, state, memory, work, series):
    """Integrate a run from its start; fills series.  The number of instants that were reached.

    heading : ``SolvedHeading``; where solved, the tables of the system's motion and its own are turned in place
    state : ``CarvedState``;  memory : ``Groove`` with a first axis for the skis;  work : ``CarvedWork``
    """
    for n in range(system.motion.time.shape[0]):
        if not advance(system, heading, n, state, memory, work, series):
            return n
    return system.motion.time.shape[0]


@inlined
def advance(system, heading, n, state, memory, work, series):
    """Bring the state from the instant before to the n-th; at the first, find the accelerations.  False where Newton's
    method fails.
    """
    step, rule = time_step(n, system.motion.step), backward(n, system.motion.step, system.order)
    if heading.solved:
        turn_heading(heading, system.motion, n, step.length)
    for side in range(2):
        advect(system.ski, of_ski(memory, side), step.length)
    for c in range(work.edges.by_place.shape[0]):
        work.edges.by_place[c] = step.by_place if c < 3 else rule.share * rule.share
        work.edges.by_rate[c] = step.by_rate if c < 3 else rule.share
    largest = np.inf
    for iteration in range(ITERATIONS):
        x, v = predict(state, step, rule)
        begin_equations(system, n, state, work)
        for side in range(2):
            add_ski(system, n, side, (x, v), (step, rule), state, of_ski(memory, side), work, series)
        body = add_surroundings(system, heading, n, x, v, step.by_rate, work)
        if not eliminate(work.matrix, work.residual):
            return False
        share = 1.0 if iteration < 12 else 0.5
        largest = 0.0
        for i in range(state.trial.shape[0]):
            state.trial[i] -= share * work.residual[i]
            largest = max(largest, abs(work.residual[i]))
        if not largest < 1e9:
            return False
        if largest < SMALL:
            break
    if largest >= SMALL and largest * max(step.length, 1e-3) ** 2 > LOOSE:
        return False
    take(state, x, v, n, series)
    for side in range(2):
        accept(of_ski(memory, side))
    if heading.solved:
        heading.moment[n] = moment_on_heading(
            heading, system.motion, n, series.force[n], series.moment[n], work.drag, body
        )  # fmt: skip
    return True


@inlined
def predict(state, step, rule):
    """Return place and velocity (tuples) of the pelvis by the accelerations that are tried; fill those of the skis.

    step : ``TimeStep`` of the pelvis;  rule : ``Backward`` of the skis
    """
    x, v, pull = state.place, state.velocity, plus(three(state.acceleration, 0), three(state.trial, 0))
    new_x = (
        next_place(step, x[0], v[0], pull[0]), next_place(step, x[1], v[1], pull[1]),
        next_place(step, x[2], v[2], pull[2]),
    )  # fmt: skip
    new_v = next_rate(step, v[0], pull[0]), next_rate(step, v[1], pull[1]), next_rate(step, v[2], pull[2])
    own = state.bent.shape[1]
    for side in range(2):
        for k in range(own):
            bending = next_value(
                rule, state.bending[side, k], state.old_bending[side, k], state.trial[3 + side * own + k]
            )  # fmt: skip
            state.next_bending[side, k] = bending
            state.next_bent[side, k] = next_value(rule, state.bent[side, k], state.old_bent[side, k], bending)
    return new_x, new_v


@inlined
def take(state, x, v, n, series):
    """Take what a step tried as what it led to."""
    for c in range(3):
        state.place[c], state.velocity[c], state.acceleration[c] = x[c], v[c], state.trial[c]
        series.place[n, c], series.velocity[n, c] = x[c], v[c]
    for i in range(state.trial.shape[0]):
        series.acceleration[n, i] = state.trial[i]
    for side in range(2):
        for k in range(state.bent.shape[1]):
            state.old_bent[side, k], state.old_bending[side, k] = state.bent[side, k], state.bending[side, k]
            bent, bending = state.next_bent[side, k], state.next_bending[side, k]
            state.bent[side, k], state.bending[side, k] = bent, bending
            series.bent[n, side, k], series.bending[n, side, k] = bent, bending


@inlined
def begin_equations(system, n, state, work):
    """Begin the equations of an instant with the pelvis' own: all masses, their weight, and what the posture does."""
    motion, matrix, residual = system.motion, work.matrix, work.residual
    matrix[:] = 0.0
    residual[:] = 0.0
    for c in range(3):
        residual[c] = motion.mass * (state.trial[c] - motion.gravity[c]) + motion.carried[n, c]
        matrix[c, c] = motion.mass


@inlined
def add_ski(system, n, side, pelvis, steps, state, memory, work, series):
    """Add to the equations of an instant those of a ski, and what it does to the pelvis; record it.

    pelvis : its place and velocity (tuples);  steps : ``TimeStep`` of it and ``Backward`` of the skis
    memory : of the ski
    """
    (x, v), (step, rule) = pelvis, steps
    own, matrix, residual = state.bent.shape[1], work.matrix, work.residual
    base = 3 + side * own
    bent, bending = state.next_bent[side], state.next_bending[side]
    pose, _, axes, given = pose_ski(system, n, side, x, v, bent, bending, work)
    force, slopes = press_ski(system, memory, pose, out_of(work.snow, axes[1]), step.length, work)
    for i in range(3 + own):
        row = i if i < 3 else base + i - 3
        residual[row] -= force[i]
        for j in range(3 + own):
            matrix[row, j if j < 3 else base + j - 3] += slopes[i, j]
    add_joint(system, side, (bent, bending, state.trial), rule.share, work)
    add_modes(system, n, side, (bent, bending, state.trial), given, rule.share, work)
    record_ski(system, n, side, three(force, 0), axes[0], given[0], work, series)


@inlined
def add_joint(system, side, moved, share, work):
    """Add what holds a ski against its foot in yaw and roll, and its inertia.

    moved : how the ski is turned and bent, the rates of that, and all accelerations;  share : s of the skis' steps
    """
    (bent, bending, trial), joint = moved, system.joint
    base = 3 + side * bent.shape[0]
    for i in range(2):
        work.residual[base + i] += (
            joint.inertia[i] * trial[base + i]
            + joint.damping[i] * bending[i]
            + joint.stiffness[i] * (bent[i] - joint.rest[side, i])
        )
        work.matrix[base + i, base + i] += (
            joint.inertia[i] + joint.damping[i] * share + joint.stiffness[i] * share * share
        )


@inlined
def add_modes(system, n, side, moved, given, share, work):
    """Add inertia, stiffness and damping of a ski's vibrations, and what they and the pelvis do to each other.

    moved, share : as in ``add_joint``;  given : heave, and the rates of heave and pitch
    """
    bent, bending, trial = moved
    base = 3 + side * bent.shape[0]
    ski, coupling, joint, motion = system.ski, system.coupling, system.joint, system.motion
    matrix, residual, frame, modes = work.matrix, work.residual, work.frame, ski.omega.shape[0]
    felt = plus(into(frame, three(trial, 0)), three(motion.ski_acceleration[n, side], 0))
    turning = three(motion.ski_turning[n, side], 0)
    for k in range(modes):
        i = base + 2 + k
        p, w, ratio = three(coupling.translation[k], 0), ski.omega[k], ski.ratio[k]
        residual[i] += (
            trial[i] + 2.0 * ratio * w * bending[2 + k] + w * w * bent[2 + k]
            + dot(p, felt) + dot(three(coupling.rotation[k], 0), turning)
        )  # fmt: skip
        matrix[i, i] += 1.0 + 2.0 * ratio * w * share + w * w * share * share
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
                matrix[base + 2 + k, base + 2 + j] += slowed * ski.give[i, j] * share


@inlined
def record_ski(system, n, side, force, upright, heave, work, series):
    """Fill a ski's places in the series at the instant n.

    force : N of the snow, in the slope's frame;  upright, heave : along which axis its boot centre heaves, and how far
    """
    snow, frame, pressed, seen = work.snow, work.frame, work.edges.force, work.edges.seen
    normal, load = (snow[2, 0], snow[2, 1], snow[2, 2]), pressed[2]
    left, up = (frame[0, 1], frame[1, 1], frame[2, 1]), (frame[0, 2], frame[1, 2], frame[2, 2])
    moment = plus(into(snow, three(pressed, 3)), times(heave, cross(upright, force)))
    sole = system.motion.foot_rotation[n, side]
    series.loads[n, side] = load
    series.edges[n, side] = math.atan2(dot(left, normal), dot(up, normal))
    series.sole[n, side] = sole[0, 2] * force[0] + sole[1, 2] * force[1] + sole[2, 2] * force[2]
    for c in range(3):
        series.force[n, side, c] = force[c]
        series.friction[n, side, c] = force[c] - load * normal[c]
        series.moment[n, side, c] = moment[c]
    if side == 0:
        series.power[n, :] = 0.0
    series.reserve[n, side, :] = 0.0
    for i in range(seen.shape[0]):
        series.power[n, 0] -= seen[i, 1] * seen[i, 7]
        series.power[n, 1] -= seen[i, 2] * seen[i, 8]
        series.power[n, 2] += seen[i, 0] * seen[i, 11]
        series.reserve[n, side, 0] += seen[i, 3]
        series.reserve[n, side, 1] += seen[i, 12]


@inlined
def add_surroundings(system, heading, n, x, v, by_rate, work):
    """Add the air's force on every segment, which fills ``work.drag``, and what acts on the centre of mass; this force
    (N).
    """
    parameters, motion, matrix, residual, drag = system.parameters, system.motion, work.matrix, work.residual, work.drag
    drag[:] = 0.0
    for k in range(motion.area.shape[0]):
        moving = plus(v, three(motion.exposed_velocity[n, k], 0))
        facing = motion.exposed_facing[n, k]
        pushed = segment_derivatives(
            parameters, motion.time[n], x[0], x[1], moving[0], moving[1], moving[2], motion.area[k],
            facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        )  # fmt: skip
        for c in range(3):
            residual[c] -= pushed[c]
            drag[c] += pushed[c]
            drag[3] += pushed[c] * heading.exposed_swing[n, k, c]
            for d in range(3):
                matrix[c, d] -= by_rate * pushed[3 + 3 * c + d]
    at, moving = plus(x, three(motion.com_place[n], 0)), plus(v, three(motion.com_velocity[n], 0))
    body = body_force(parameters, motion.time[n], at[0], at[1], moving[0], moving[1], moving[2])
    for c in range(3):
        residual[c] -= body[c]
    return body
