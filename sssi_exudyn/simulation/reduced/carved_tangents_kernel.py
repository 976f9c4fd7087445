"""Tangents of a run on snow that edges cut: a template that ``compiled`` joins with ``carved_steps_kernel``,
``air_tangents``, ``heading_tangents``, their own templates and the laws.

The run is known.  Its instants are gone through again, as what the snow remembers is not kept of it, and each instant's
equations are linearised where the run met them (``tangents_kernel`` has the equations).  The tangents of groove and
offset go along with the snow, towards the tail, as groove and offset do.

Each ski's forces are differentiated by the accelerations that are sought, the first 5 + k columns of its tables, and by
the d numbers, the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import cross, dot, into, out_of, plus, three, times
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.terrain.surface import patch_under

press_edges: Callable[..., None]
pose_ski: Callable[..., Any]
time_step: Callable[..., Any]
next_place: Callable[..., float]
next_rate: Callable[..., float]
backward: Callable[..., Any]
next_value: Callable[..., float]
given_by: Callable[..., tuple[float, float]]
advect: Callable[..., None]
accept: Callable[..., None]
of_ski: Callable[..., Any]
heights: Callable[..., tuple[float, float, float]]
snow_normal_derivatives: Callable[..., Any]
linearise_edges: Callable[..., None]
advect_tangents: Callable[..., None]
leave_tangents: Callable[..., None]
linearise_ground: Callable[..., None]
collect_patch: Callable[..., None]
PelvisEquations: Callable[..., Any]
linearise_air: Callable[..., None]
next_heading_tangents: Callable[..., None]
through_heading: Callable[..., None]
moment_tangents: Callable[..., None]
OF_HEADING: int
ON_HEIGHT: int
ON_VELOCITY: int
ON_TURN: int
ON_SPIN: int
ON_MODES: int

AT, MOVING, TILTED, WHIRLING, BENT = 0, 3, 6, 9, 12
"""First rows of the tangents of a ski: its foot's place, velocity, turn and spin, then yaw, roll and bend (2 + k), and
their rates."""
TURNED, SNOW_TURNED = 0, 3
"""First rows of the turns (rotation vectors) of the ski and of the snow's axes."""
LOAD, EDGE, SOLE, FORCE, FRICTION, MOMENT, FORWARD, SEEN = 0, 1, 2, 3, 6, 9, 12, 15
"""First rows of what is found of a ski, and their count."""


class CarvedTangents(NamedTuple):
    """Tangents of ``CarvedSeries``, each with a last axis (d,) for the numbers; forward : (t, 2, 3, d) of the skis'
    long axes; angle : (t, 3, d) of the heading, its rate and acceleration.
    """

    place: Array
    velocity: Array
    loads: Array
    sole: Array
    friction: Array
    edges: Array
    force: Array
    moment: Array
    forward: Array
    angle: Array


class SoughtTangents(NamedTuple):
    """Tangents of what is sought by d numbers, and the linear system that an instant's follow from.

    z, zv : (7 + 2k, d) of pelvis, yaw, roll and bend of the skis, and of their rates;  old_z, old_zv : a step before
    acceleration : (3, d) of the pelvis;  turned : (3, d) of the heading, its rate and acceleration
    moment : (d,) of the moment on the heading
    matrix, right : (7 + 2k, 7 + 2k), (7 + 2k, d)
    """

    z: Array
    zv: Array
    old_z: Array
    old_zv: Array
    acceleration: Array
    turned: Array
    moment: Array
    matrix: Array
    right: Array

    @classmethod
    def begin(cls, z: Array, zv: Array) -> SoughtTangents:
        """Return the tangents at the start."""
        size, many = z.shape
        return cls(
            z, zv, z.copy(), zv.copy(), np.zeros((3, many)), np.zeros((3, many)), np.zeros(many),
            np.zeros((size, size)), np.zeros((size, many)),
        )  # fmt: skip


class CarvedRoom(NamedTuple):
    """Arrays in which both skis' tangents are found, w = 5 + k + d columns.

    moved : (2, 16 + 2k, w) of the ski;  on_snow : (2, 10 + 2k + c, w) of what ``EdgeLines`` linearises by
    turns : (2, 6, w);  pressed : (2, 6 + k, w) of the snow's forces;  under : (2, 3, w) of the snow's height and slopes
    under a place that stays
    equations : (2, 5 + k, w) of the pelvis' and the ski's own;  seen : (2, 15, w)
    arrived : (2, 4m, d), held : (2, 6m, d) of the memory
    patch : (6, d);  ground, by_ground : (3, 2), (3, p);  air, by_air : (3, 5), (3, p) of the laws
    """

    moved: Array
    on_snow: Array
    turns: Array
    pressed: Array
    under: Array
    equations: Array
    seen: Array
    arrived: Array
    held: Array
    patch: Array
    ground: Array
    by_ground: Array
    air: Array
    by_air: Array

    @classmethod
    def room(cls, lines: Any, many: int) -> CarvedRoom:
        """Make room for the tangents by so many numbers, for skis that have ``EdgeLines``."""
        modes, points, parameters = len(lines.reach), len(lines.towards) // 4, lines.parameter.shape[1]
        width, own = 5 + modes + many, 2 + modes
        return cls(
            np.zeros((2, BENT + 2 * own, width)), np.zeros((2, lines.force.shape[2], width)), np.zeros((2, 6, width)),
            np.zeros((2, 6 + modes, width)), np.zeros((2, 3, width)), np.zeros((2, 3 + own, width)),
            np.zeros((2, SEEN, width)), np.zeros((2, 4 * points, many)), np.zeros((2, 6 * points, many)),
            np.zeros((6, many)), np.zeros((3, 2)), np.zeros((3, parameters)), np.zeros((3, 5)),
            np.zeros((3, parameters)),
        )  # fmt: skip


@njit(cache=True, error_model="numpy")
def axes_turn(normal, frame, dn):
    """Return the rotation vector by which the snow's axes, rows of ``frame``, turn with a change of the normal."""
    first = (frame[0, 0], frame[0, 1], frame[0, 2])
    flat = plus((1.0, 0.0, 0.0), times(-normal[0], normal))
    change = plus(times(-dn[0], normal), times(-normal[0], dn))
    change = times(1.0 / np.sqrt(dot(flat, flat)), plus(change, times(-dot(first, change), first)))
    second = cross(normal, first)
    second_change = plus(cross(dn, first), cross(normal, change))
    return times(0.5, plus(cross(first, change), plus(cross(second, second_change), cross(normal, dn))))


@njit(cache=True, error_model="numpy")
def collect_moved(moved, z, zv, feet, side, own):
    """Fill the numbers' columns of a ski's tangents from those of what is sought, (3 + 2·own, d), and the tables'."""
    first = 3 + own
    base = 3 + side * own
    many, with_tables = z.shape[1], feet.shape[1]
    for k in range(many):
        for c in range(3):
            moved[AT + c, first + k], moved[MOVING + c, first + k] = z[c, k], zv[c, k]
            moved[TILTED + c, first + k], moved[WHIRLING + c, first + k] = 0.0, 0.0
        for j in range(own):
            moved[BENT + j, first + k], moved[BENT + own + j, first + k] = z[base + j, k], zv[base + j, k]
    for c in range(12):
        for k in range(with_tables):
            moved[c, first + k] += feet[c, k]


@inlined
def collect_under(parameters, surface, inputs, at, room, side):
    """Fill what the snow's height and slopes under a foot change by its place, and by numbers where it stays."""
    linearise_ground(parameters, patch_under(surface, at[0], at[1]), at[0], at[1], room.ground, room.by_ground)
    under, many = room.under[side], room.patch.shape[1]
    first = under.shape[1] - many
    collect_patch(room.patch, inputs, surface, at[0], at[1])
    for row in range(3):
        for k in range(many):
            under[row, first + k] = room.patch[row, k]
        for column in inputs.columns.terrain:
            factor = room.by_ground[row, inputs.columns.index[column]]
            for k in range(many):
                under[row, first + k] += factor * inputs.parameters[column, k]


@inlined
def turn_onto_snow(system, pose, foot_spin, snow, room, side, rates, inputs):
    """Fill ``room.on_snow`` and ``room.turns`` of a ski from ``room.moved``.

    pose : as ``pose_ski`` gives it;  foot_spin : (3,) rad/s of the captured foot
    """
    foot, (at, moving, spin), (axis, long, left), (heave, heaving, pitching) = pose
    parameters, ski, surface = system.parameters, system.ski, system.surface
    own = 2 + ski.omega.shape[0]
    moved, on_snow, turns, under, ground = (
        room.moved[side], room.on_snow[side], room.turns[side], room.under[side], room.ground
    )  # fmt: skip
    collect_under(parameters, surface, inputs, at, room, side)
    _, h_f, h_l = heights(parameters, patch_under(surface, at[0], at[1]), at[0], at[1])
    normal, (by_f, by_l) = snow_normal_derivatives(h_f, h_l)
    by_f, by_l = axes_turn(normal, snow, by_f), axes_turn(normal, snow, by_l)
    over, modes = foot.height / normal[2], own - 2
    width, many = moved.shape[1], room.patch.shape[1]
    swept = cross(foot_spin, axis)
    for k in range(width):
        tilted = moved[TILTED, k], moved[TILTED + 1, k], moved[TILTED + 2, k]
        whirling = moved[WHIRLING, k], moved[WHIRLING + 1, k], moved[WHIRLING + 2, k]
        higher, tipped = given_by(ski, moved[BENT + 2 : BENT + own, k])
        rising, tipping = given_by(ski, moved[BENT + own + 2 : BENT + 2 * own, k])
        leaning = cross(tilted, axis)
        place = plus(plus(three(moved[:, k], AT), times(higher, axis)), times(heave, leaning))
        f, l = place[0], place[1]
        rise = under[0, k] + ground[0, 0] * f + ground[0, 1] * l
        tip = under[1, k] + ground[1, 0] * f + ground[1, 1] * l
        bank = under[2, k] + ground[2, 0] * f + ground[2, 1] * l
        rolled = plus(times(tip, by_f), times(bank, by_l))
        speed = plus(three(moved[:, k], MOVING), plus(times(rising, axis), times(heaving, leaning)))
        speed = plus(speed, times(heave, plus(cross(whirling, axis), cross(foot_spin, leaning))))
        speed = plus(speed, times(higher, swept))
        turned = plus(tilted, plus(times(moved[BENT, k], axis), times(moved[BENT + 1, k], long)))
        whirling = plus(whirling, plus(times(moved[BENT + own, k], axis), times(moved[BENT + own + 1, k], long)))
        whirling = plus(whirling, plus(times(rates[0], leaning), times(rates[1], cross(turned, long))))
        whirling = plus(whirling, plus(times(tipping, left), times(pitching, cross(turned, left))))
        turned = plus(turned, times(tipped, left))
        on_snow[ON_HEIGHT, k] = normal[2] * (place[2] - rise) + over * cross(rolled, normal)[2]
        speed = out_of(snow, plus(speed, times(-1.0, cross(rolled, moving))))
        apart = out_of(snow, plus(turned, times(-1.0, rolled)))
        whirling = out_of(snow, plus(whirling, times(-1.0, cross(rolled, spin))))
        for c in range(3):
            turns[TURNED + c, k], turns[SNOW_TURNED + c, k] = turned[c], rolled[c]
            on_snow[ON_VELOCITY + c, k], on_snow[ON_TURN + c, k] = speed[c], apart[c]
            on_snow[ON_SPIN + c, k] = whirling[c]
        for j in range(modes):
            on_snow[ON_MODES + j, k] = moved[BENT + 2 + j, k]
            on_snow[ON_MODES + modes + j, k] = moved[BENT + own + 2 + j, k]
    for column in range(inputs.parameters.shape[0]):
        for k in range(many):
            on_snow[ON_MODES + 2 * modes + column, width - many + k] = inputs.parameters[column, k]


@inlined
def fill_equations(system, pose, work, foot_frame, trial, base, room, side):
    """Fill ``room.equations`` and ``room.seen`` of a ski from the tangents of what presses it, its accelerations apart.

    trial : (7 + 2k,) accelerations, those of the ski from ``base`` on
    """
    ski, coupling, joint = system.ski, system.coupling, system.joint
    pressed, snow, frame = work.edges.force, work.snow, work.frame
    (axis, long, _), heave = pose[2], pose[3][0]
    modes = ski.omega.shape[0]
    own = 2 + modes
    moved, turns, changes = room.moved[side], room.turns[side], room.pressed[side]
    equations, seen = room.equations[side], room.seen[side]
    force, moment = into(snow, three(pressed, 0)), into(snow, three(pressed, 3))
    normal, load = (snow[2, 0], snow[2, 1], snow[2, 2]), pressed[2]
    left, up = (frame[0, 1], frame[1, 1], frame[2, 1]), (frame[0, 2], frame[1, 2], frame[2, 2])
    sine, cosine = dot(left, normal), dot(up, normal)
    sole = (foot_frame[0, 2], foot_frame[1, 2], foot_frame[2, 2])
    pull, levered = three(trial, 0), cross(axis, force)
    swinging = (0.0, 0.0, 0.0)
    for j in range(modes):
        swinging = plus(swinging, times(trial[base + 2 + j], out_of(frame, three(coupling.translation[j], 0))))
    for k in range(moved.shape[1]):
        turned = turns[TURNED, k], turns[TURNED + 1, k], turns[TURNED + 2, k]
        rolled = turns[SNOW_TURNED, k], turns[SNOW_TURNED + 1, k], turns[SNOW_TURNED + 2, k]
        tilted = moved[TILTED, k], moved[TILTED + 1, k], moved[TILTED + 2, k]
        more = plus(into(snow, (changes[0, k], changes[1, k], changes[2, k])), cross(rolled, force))
        turning = plus(into(snow, (changes[3, k], changes[4, k], changes[5, k])), cross(rolled, moment))
        swung = cross(turned, swinging)
        for c in range(3):
            equations[c, k] = swung[c] - more[c]
        leaning = cross(tilted, axis)
        swinging_long = cross(plus(tilted, times(moved[BENT, k], axis)), long)
        lifting = dot(more, axis) + dot(force, leaning)
        tipping = dot(turning, left) + dot(moment, cross(turned, left))
        equations[3, k] = -dot(turning, axis) - dot(moment, leaning)
        equations[4, k] = -dot(turning, long) - dot(moment, swinging_long)
        for i in range(2):
            equations[3 + i, k] += joint.damping[i] * moved[BENT + own + i, k] + joint.stiffness[i] * moved[BENT + i, k]
        back = cross(pull, turned)
        for j in range(modes):
            w = ski.omega[j]
            outwards = out_of(frame, three(coupling.translation[j], 0))
            equations[5 + j, k] = (
                2.0 * ski.ratio[j] * w * moved[BENT + own + 2 + j, k] + w * w * moved[BENT + 2 + j, k]
                - changes[6 + j, k] - ski.give[0, j] * lifting - ski.give[1, j] * tipping + dot(outwards, back)
            )  # fmt: skip
        for i in range(2):
            slowed = 0.0
            for j in range(modes):
                slowed += ski.give[i, j] * moved[BENT + own + 2 + j, k]
            for j in range(modes):
                equations[5 + j, k] += joint.slowing[i] * ski.give[i, j] * slowed
        apart = plus(turned, times(-1.0, rolled))
        d_sine, d_cosine = dot(cross(apart, left), normal), dot(cross(apart, up), normal)
        d_normal = cross(rolled, normal)
        seen[LOAD, k] = changes[2, k]
        seen[EDGE, k] = (cosine * d_sine - sine * d_cosine) / (sine * sine + cosine * cosine)
        seen[SOLE, k] = dot(sole, more) + dot(cross(tilted, sole), force)
        higher, _ = given_by(ski, moved[BENT + 2 : BENT + own, k])
        turning = plus(turning, times(higher, levered))
        turning = plus(turning, times(heave, plus(cross(leaning, force), cross(axis, more))))
        for c in range(3):
            seen[FORCE + c, k] = more[c]
            seen[FRICTION + c, k] = more[c] - changes[2, k] * normal[c] - load * d_normal[c]
            seen[MOMENT + c, k] = turning[c]
            seen[FORWARD + c, k] = swinging_long[c]


@njit(cache=True, error_model="numpy")
def linearise_ski(system, inputs, n, side, h, known, memory, work, lines, room):
    """Fill ``room`` with the equations of one ski at an instant, from its tangents ``room.moved``; the memory advected,
    what it becomes is found.

    known : place and velocity of the pelvis (tuples), accelerations, and what turns and bends both skis with its rates
    """
    x, v, trial, bent, bending = known
    own, of_side = bent.shape[1], of_ski(memory, side)
    pose = pose_ski(system, n, side, x, v, bent[side], bending[side], work)
    press_edges(system.parameters, system.ski, of_side, pose[0], h, work.edges)
    linearise_edges(system.parameters, system.ski, of_side, pose[0], h, inputs.columns, lines, side)
    foot_spin = three(system.motion.foot_spin[n, side], 0)
    turn_onto_snow(system, pose, foot_spin, work.snow, room, side, bending[side], inputs)
    np.dot(lines.force[side], room.on_snow[side], room.pressed[side])
    room.pressed[side, :, 3 + own :] += np.dot(lines.by_memory[side], room.arrived[side])
    fill_equations(system, pose, work, system.motion.foot_rotation[n, side], trial, 3 + side * own, room, side)


@njit(cache=True, error_model="numpy")
def feel_tables(coupling, feet, base, right):
    """Subtract from the right side (7 + 2k, d) what the foot's motion in the tables makes the ski's modes feel."""
    for j in range(coupling.translation.shape[0]):
        for c in range(3):
            for k in range(feet.shape[1]):
                right[base + 2 + j, k] -= (
                    coupling.translation[j, c] * feet[12 + c, k] + coupling.rotation[j, c] * feet[15 + c, k]
                )


@njit(cache=True, nogil=True, error_model="numpy")
def carved_tangents(system, heading, inputs, slopes, state, memory, work, lines, room, series):
    """Fill the tangents of a run.

    inputs : ``TangentInputs``;  slopes : ``HeadingSlopes``; where a heading was found the first three numbers are its
    state : ``SoughtTangents`` at the start, which is changed;  memory : as at the start of the run
    series : the run's ``CarvedSeries``, and ``CarvedTangents``, which are filled
    """
    for n in range(system.motion.time.shape[0]):
        advance_tangents(system, heading, inputs, slopes, n, state, memory, (work, lines, room), series)


@inlined
def advance_tangents(system, heading, inputs, slopes, n, state, memory, rooms, series):
    """Bring the tangents from the instant before to the n-th; the others as in ``carved_tangents``.

    rooms : ``CarvedWork``, ``EdgeLines``, ``CarvedRoom``
    """
    (run, tangents), (work, lines, room) = series, rooms
    step, rule = time_step(n, system.motion.step), backward(n, system.motion.step, system.order)
    predict_tangents(state, step, rule, OF_HEADING if heading.solved else 0)
    if heading.solved and n > 0:
        next_heading_tangents(heading, slopes, n, step.length, state.moment, state.turned)
    x, v, trial = three(run.place[n], 0), three(run.velocity[n], 0), run.acceleration[n]
    begin_tangents(system, inputs, n, trial, state)
    for side in range(2):
        of_memory = of_ski(memory, side)
        collect_sought(room.moved[side], step, rule)
        collect_moved(room.moved[side], state.z, state.zv, inputs.feet[n, side], side, run.bent.shape[2])
        advect_tangents(system.ski, of_memory, step.length, room.held[side], room.arrived[side])
        advect(system.ski, of_memory, step.length)
        linearise_ski(
            system, inputs, n, side, step.length, (x, v, trial, run.bent[n], run.bending[n]), memory, work, lines, room
        )  # fmt: skip
        accept(of_memory)
        add_ski_tangents(system, inputs, n, side, work.frame, room.equations[side], state)
    linearise_air(
        system.parameters, system.motion, inputs, n, (x, v),
        PelvisEquations(step, state.z, state.zv, 0, state.matrix, state.right), (room.air, room.by_air),
    )  # fmt: skip
    if heading.solved:
        through_heading(state.right, state.turned)
        for side in range(2):
            through_heading(room.seen[side, :, 3 + run.bent.shape[2] :], state.turned)
            through_heading(room.on_snow[side, :, 3 + run.bent.shape[2] :], state.turned)
    solved = np.linalg.solve(state.matrix, state.right)
    take_tangents(state, solved, (step, rule), n, tangents)
    for side in range(2):
        take_ski_tangents(solved, n, side, lines, room, tangents)
    if heading.solved:
        tangents.angle[n] = state.turned
        room.held[:, :, :OF_HEADING] = 0.0
        moment_tangents(system, heading, slopes, inputs, n, (x, v), state, series, room)


@inlined
def predict_tangents(state, step, rule, beginning):
    """Bring the tangents to the end of a step, its accelerations apart; those of the first ``beginning`` numbers, the
    heading's, begin again at every instant.
    """
    z, zv, old_z, old_zv = state.z, state.zv, state.old_z, state.old_zv
    for k in range(z.shape[1]):
        for c in range(3):
            z[c, k] = next_place(step, z[c, k], zv[c, k], state.acceleration[c, k])
            zv[c, k] = next_rate(step, zv[c, k], state.acceleration[c, k])
        for i in range(3, z.shape[0]):
            place, rate = z[i, k], zv[i, k]
            zv[i, k] = next_value(rule, rate, old_zv[i, k], 0.0)
            z[i, k] = next_value(rule, place, old_z[i, k], zv[i, k])
            old_z[i, k], old_zv[i, k] = place, rate
    z[:, :beginning] = 0.0
    zv[:, :beginning] = 0.0


@inlined
def begin_tangents(system, inputs, n, trial, state):
    """Begin the linear system of an instant with the pelvis' own equations.

    trial : (7 + 2k,) m/s² and so on, the accelerations of the run
    """
    mass, gravity = system.motion.mass, system.motion.gravity
    state.matrix[:] = 0.0
    state.right[:] = 0.0
    for c in range(3):
        state.matrix[c, c] = mass
        for k in range(state.z.shape[1]):
            state.right[c, k] = mass * inputs.gravity[c, k] - inputs.mass[k] * (trial[c] - gravity[c])
        for k in range(inputs.feet.shape[3]):
            state.right[c, k] -= inputs.inertia[n, c, k]


@inlined
def collect_sought(moved, step, rule):
    """Fill the columns of a ski's tangents by the accelerations that are sought."""
    own = (moved.shape[0] - BENT) // 2
    moved[:, : 3 + own] = 0.0
    for c in range(3):
        moved[AT + c, c], moved[MOVING + c, c] = step.by_place, step.by_rate
    for j in range(own):
        moved[BENT + j, 3 + j], moved[BENT + own + j, 3 + j] = rule.share * rule.share, rule.share


@inlined
def add_ski_tangents(system, inputs, n, side, frame, equations, state):
    """Add a ski's equations (5 + k, w), its accelerations apart, and then these to the linear system."""
    coupling, modes = system.coupling, system.ski.omega.shape[0]
    first, base, matrix, right = 5 + modes, 3 + side * (2 + modes), state.matrix, state.right
    for i in range(first):
        row = i if i < 3 else base + i - 3
        for j in range(first):
            matrix[row, j if j < 3 else base + j - 3] += equations[i, j]
        for k in range(right.shape[1]):
            right[row, k] -= equations[i, first + k]
    for i in range(2):
        matrix[base + i, base + i] += system.joint.inertia[i]
    for j in range(modes):
        i = base + 2 + j
        matrix[i, i] += 1.0
        outwards = out_of(frame, three(coupling.translation[j], 0))
        for c in range(3):
            matrix[c, i] += outwards[c]
            matrix[i, c] += outwards[c]
    feel_tables(coupling, inputs.feet[n, side], base, right)


@inlined
def take_tangents(state, solved, steps, n, tangents):
    """Take the accelerations' tangents ``solved`` (7 + 2k, d) into those of pelvis and skis."""
    z, zv, (step, rule) = state.z, state.zv, steps
    for k in range(z.shape[1]):
        for c in range(3):
            state.acceleration[c, k] = solved[c, k]
            z[c, k] += step.by_place * solved[c, k]
            zv[c, k] += step.by_rate * solved[c, k]
            tangents.place[n, c, k], tangents.velocity[n, c, k] = z[c, k], zv[c, k]
        for i in range(3, z.shape[0]):
            z[i, k] += rule.share * rule.share * solved[i, k]
            zv[i, k] += rule.share * solved[i, k]


@inlined
def take_ski_tangents(solved, n, side, lines, room, tangents):
    """Fill the series of a ski and what the snow remembers of it from the accelerations' tangents."""
    own = room.equations.shape[1] - 3
    first, base = 3 + own, 3 + side * own
    of_side = np.concatenate((solved[:3], solved[base : base + own]))
    seen = room.seen[side, :, first:] + np.dot(np.ascontiguousarray(room.seen[side, :, :first]), of_side)
    on_snow = room.on_snow[side]
    moved = on_snow[:, first:] + np.dot(np.ascontiguousarray(on_snow[:, :first]), of_side)
    leave_tangents(lines.left[side], lines.kept[side], moved, room.arrived[side], room.held[side])
    tangents.loads[n, side], tangents.edges[n, side], tangents.sole[n, side] = seen[LOAD], seen[EDGE], seen[SOLE]
    tangents.force[n, side] = seen[FORCE : FORCE + 3]
    tangents.friction[n, side] = seen[FRICTION : FRICTION + 3]
    tangents.moment[n, side] = seen[MOMENT : MOMENT + 3]
    tangents.forward[n, side] = seen[FORWARD : FORWARD + 3]
