"""All forces of the full model on snow that edges cut: a template that ``compiled`` joins with the laws,
the kernels of ``ski_on_snow`` and ``forces_kernel``, whose coordinates, frames and inertia these are.

A section presses with its deeper edge, and where it lies flat with both: its forces act at the edges' points, along the
snow's normal there, along the edge's own tangent and across it, and go to the nodes as those of the paper's law do.
The node at the boot gives against the foot in heave, yaw, roll and pitch, one after the other as in
``carved_steps_kernel``: a spring and a damper hold each.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np

from sssi_exudyn.contact.codegen.vectors import (
    cross,
    dot,
    into,
    on_quaternion,
    out_of,
    plus,
    rotate,
    spin,
    three,
    times,
)
from sssi_exudyn.core.frames import Array
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.terrain.surface import patch_under

edge_axes: Callable[..., Any]
edge_state: Callable[..., tuple[float, ...]]
edge_state_linearisation: Callable[..., None]
force_on_deeper: Callable[..., tuple[float, float, float]]
steer: Callable[..., None]
pass_over: Callable[..., None]
law_section: Callable[..., tuple[float, ...]]
edge_force: Callable[..., tuple[float, float, float, float]]
edge_derivatives: Callable[..., tuple[float, ...]]
edge_memory: Callable[..., tuple[float, float]]
edge_capacity: Callable[..., tuple[float, float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
foot_axes: Callable[..., Any]
point_velocity: Callable[..., Any]
of_ski: Callable[..., Any]
section: Callable[..., Any]
four: Callable[..., Any]
edge_arms: Callable[..., Any]
add_wrench: Callable[..., None]
ski_inertia: Callable[..., None]
bend_damping: Callable[..., float]
push_skier: Callable[..., None]
put: Callable[..., int]
damping_triplets: Callable[..., int]
skier_triplets: Callable[..., int]
NODE: Final = 7
LOAD, DEPTH, ALONG, ACROSS, EDGE, V_T, V_N, CONTACT_POWER, FRICTION_POWER, DAMPING_POWER = 0, 2, 3, 4, 5, 6, 7, 8, 9, 10
"""As in ``forces_kernel``."""
SKID_POWER, MOST, USED, BORNE, DRAGGED, YAW, ROLL, HEAVE, PITCH, LIFTED, TURNED = range(11, 22)
PUSHED, TWISTED = 24, 27
"""Further columns of ``seen``: W; N that the wall bears at most, N across the edges, and what of it is the wall's; N of
friction along the edges; rad and m of the ski against its foot; N and three of N m, in the foot's frame, by which its
joint moves it; three of N and of N m, in the slope's, of the snow on the ski about the foot's place."""
CARVED_SEEN = 30
EITHER: Final = -1
LEVEL: Final = 1e-5
"""m; a section whose edges are less apart in depth lies flat."""
LASTING: Final = 8
"""Steps, 10 ms, after which a section is not just rolling through: no skier changes edges at 2 degrees a second."""
JOINTS: Final = 4
"""Ways in which a ski gives against its foot: yaw, roll, heave, pitch."""
GIVING: Final = (2, 4, 5, 6)
"""The coordinates of the node at the boot that are free for it."""


class FlatSections(NamedTuple):
    """Sections that lie flat, each (2, m) by ski: which of their edges is the deeper one is rounding, and Newton's
    method would go to and fro between them.

    kept : 0 or 1, the edge that counts as the deeper one for a step;  EITHER where it is looked at
    apart : m by which the left edge was deeper in the last pass
    steps : that it has lain flat, ``LASTING`` at the start
    """

    kept: Any
    apart: Array
    steps: Any


class CarvedSkis(NamedTuple):
    """What snow that edges cut needs of both skis in addition to ``Sections``.

    edges : ``CuttingEdges``;  memory : ``Groove`` with a first axis for the skis;  lying : ``FlatSections``
    step : s since the memory was brought to where it arrives
    """

    edges: Any
    memory: Any
    lying: FlatSections
    step: float


class MovingFoot(NamedTuple):
    """A captured foot in the slope's frame: place (m), velocity, rotation (3, 3) and spin, the vectors as tuples, and
    the patch of snow under it.
    """

    place: Any
    velocity: Any
    frame: Array
    spin: Any
    under: Any


class BlockRoom(NamedTuple):
    """Arrays in which a section's part of the Jacobian is found, by the coordinates of its nodes and of the pelvis.

    state, pull : (7, 12), (4, 12) derivatives of what the law depends on and of the forces, as ``edge_state`` has them
    direction : (12,) of a force;  line, slopes : (17,) a force's direction and its derivatives;  block : (17, 17)
    """

    state: Array
    pull: Array
    direction: Array
    line: Array
    slopes: Array
    block: Array


@njit(cache=True, error_model="numpy")
def keep_flat(flat):
    """Keep for the next step the deeper edge, by the last pass, of sections that lie flat and go on doing so."""
    for ski in range(2):
        for m in range(flat.apart.shape[1]):
            if abs(flat.apart[ski, m]) < LEVEL:
                flat.steps[ski, m] += 1
            else:
                flat.steps[ski, m], flat.kept[ski, m] = 0, EITHER
            if flat.steps[ski, m] > LASTING and flat.kept[ski, m] == EITHER:
                flat.kept[ski, m] = 1 if flat.apart[ski, m] < 0.0 else 0


@njit(cache=True, error_model="numpy")
def edge_on_snow(parameters, foot, body, offset):
    """Return an edge's point on the snow, in the foot's frame: its arm from the section, its place from the snow
    straight below, its velocity and the snow's normal; and its depth (m).

    body : place, quaternion, velocity and spin of its section in the foot's frame
    """
    p, r, moving, omega = body
    arm, reach = edge_arms(foot.frame, p, r, offset)
    point = plus(foot.place, reach)
    height, normal = ground(parameters, foot.under, point[0], point[1])
    bending = out_of(foot.frame, plus(moving, cross(omega, arm)))
    speed = into(foot.frame, point_velocity(foot.velocity, foot.spin, reach, bending))
    above = point[2] - height
    return (arm, into(foot.frame, (0.0, 0.0, above)), speed, into(foot.frame, normal)), -above * normal[2]


@njit(cache=True, error_model="numpy")
def meet_snow(parameters, sections, edges, foot, bent, m, kept):
    """Return how a section meets the snow, in the foot's frame: which edge is the deeper one (0 left, 1 right), this
    one and the other as ``edge_on_snow`` gives them, the deeper one's tangent, what a twist adds to it, and what
    ``edge_state`` takes.

    bent : as ``section`` gives it;  kept : the edge that counts as the deeper one whatever rounding makes of it, EITHER
        where it is looked at
    """
    p, r, moving, omega, q0, q1 = bent
    body = p, r, moving, omega
    left, left_depth = edge_on_snow(parameters, foot, body, three(sections.offset[m, 0], 0))
    right, right_depth = edge_on_snow(parameters, foot, body, three(sections.offset[m, 1], 0))
    low = kept if kept != EITHER else (1 if right_depth > left_depth else 0)
    deep, other = (right, left) if low == 1 else (left, right)
    tangent, by_twist = bent_tangent(edges, sections, m, low, r, q0, q1)
    given = deep[1], other[1], tangent, deep[2], deep[3], other[3], edges.width[m], 2.0 * low - 1.0
    return low, deep, other, tangent, by_twist, given


@njit(cache=True, error_model="numpy")
def bent_tangent(edges, sections, m, low, r, q0, q1):
    """Return an edge's tangent in the foot's frame, and what a twist of the ski adds to it, a unit of rad/m.  An edge
    that lies off the axis rises or falls along a ski that twists.

    r, q0, q1 : quaternions of the section and of its element's nodes
    """
    twist = 2.0 * (q0[0] * q1[1] - q0[1] * q1[0] - q0[2] * q1[3] + q0[3] * q1[2]) / edges.element_length[m]
    by_twist = rotate(r, (0.0, 0.0, sections.offset[m, low, 1]))
    return plus(rotate(r, three(edges.tangent[m, low], 0)), times(twist, by_twist)), by_twist


@njit(cache=True, error_model="numpy")
def boot_angles(turn, pitched):
    """Return yaw, roll and pitch (rad), in this order, that turn the foot's axes into a quaternion's, and one vector
    for each: a spin times it is the angle's rate.

    pitched : rad of pitch that the unloaded ski has
    """
    first, second = rotate(turn, (1.0, 0.0, 0.0)), rotate(turn, (0.0, 1.0, 0.0))
    third = rotate(turn, (0.0, 0.0, 1.0))
    yaw, pitch = math.atan2(-second[0], second[1]), math.atan2(-first[2], third[2])
    cosine = math.sqrt(second[0] * second[0] + second[1] * second[1])
    roll = math.atan2(second[2], cosine)
    long = (math.cos(yaw), math.sin(yaw), 0.0)
    side = (-long[1], long[0], 0.0)
    upright = cross(long, second)
    return (yaw, roll, pitch - pitched), (times(1.0 / cosine, upright), long, times(1.0 / cosine, side))


@njit(cache=True, error_model="numpy")
def hold_boot(q, v, ref, boot, edges, out, seen):
    """Add to ``out`` what holds a ski at the node whose coordinates begin at ``boot``; fills its row of ``seen``."""
    turn = four(q, ref, boot + 3)
    angles, by_spin = boot_angles(turn, edges.pitched)
    turning = spin(turn, v, boot + 3)
    torque = (0.0, 0.0, 0.0)
    for k in range(3):
        joint = k if k < 2 else 3
        rate = dot(by_spin[k], turning)
        moment = -edges.stiffness[joint] * angles[k] - edges.damping[joint] * rate
        torque = plus(torque, times(moment, by_spin[k]))
        seen[DAMPING_POWER] -= edges.damping[joint] * rate * rate
        seen[YAW + joint] = angles[k]
    heave, rate = q[boot + 2], v[boot + 2]
    force = -edges.stiffness[2] * heave - edges.damping[2] * rate
    seen[DAMPING_POWER] -= edges.damping[2] * rate * rate
    seen[HEAVE], seen[LIFTED] = heave, force
    seen[TURNED], seen[TURNED + 1], seen[TURNED + 2] = torque
    add_wrench(out, boot, 1.0, turn, (0.0, 0.0, force), torque)


@njit(cache=True, error_model="numpy")
def moving_foot(sections, at, pelvis, speed, ski):
    """Return how a captured foot moves, in the slope's frame, and the snow under it.

    pelvis, speed : (tuples) m, m/s of the pelvis
    """
    place, velocity = plus(pelvis, at.foot_place[ski]), plus(speed, at.foot_velocity[ski])
    under = patch_under(sections.surface, place[0], place[1])
    return MovingFoot(place, velocity, at.foot_rotation[ski], three(at.foot_spin[ski], 0), under)


@njit(cache=True, error_model="numpy")
def carved_forces(parameters, q, v, ref, sections, carved, carrier, at, filled):
    """Fill in the generalised forces of all terms, of the skis' damping, weight and inertia, and of what holds them at
    the boot.

    carved : ``CarvedSkis``, of which what the step would leave is written;  all else as in ``forces_kernel``
    """
    sign, out, seen, edges = carrier.sign, filled.out, filled.seen, carved.edges
    out[:] = 0.0
    seen[:] = 0.0
    per_ski = NODE * (sections.damping.shape[0] + 1)
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    for ski in range(2):
        base = len(sign) + ski * per_ski
        foot = moving_foot(sections, at, pelvis, speed, ski)
        frame = foot.frame
        total, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for m in range(sections.element.shape[0]):
            bent = section(q, v, ref, base, sections.element[m], sections.share[m])
            force, torque = press_section(parameters, sections, carved, foot, bent, ski, m, seen[ski])
            if force[0] != 0.0 or force[1] != 0.0 or force[2] != 0.0:
                i, xi = base + NODE * sections.element[m], sections.share[m]
                add_wrench(out, i, 1.0 - xi, bent[4], force, torque)
                add_wrench(out, i + NODE, xi, bent[5], force, torque)
                total, moment = plus(total, force), plus(moment, plus(cross(bent[0], force), torque))
        total, moment = out_of(frame, total), out_of(frame, moment)
        for k in range(3):
            out[k] += total[k]
            seen[ski, PUSHED + k], seen[ski, TWISTED + k] = total[k], moment[k]
        seen[ski, DAMPING_POWER] -= bend_damping(q, v, ref, base, sections.damping, out)
        boot = base + NODE * edges.clamped
        hold_boot(q, v, ref, boot, edges, out, seen[ski])
        spin_in, spin_rate = into(frame, at.foot_spin[ski]), into(frame, at.foot_spin_rate[ski])
        ski_inertia(
            q, v, ref, base, sections, carrier.gravity, frame, spin_in, spin_rate, at.foot_acceleration[ski], out
        )
        see_foot(parameters, sections, foot, four(q, ref, boot + 3), total, seen[ski])
    push_skier(parameters, carrier, at, pelvis, speed, filled)


@inlined
def press_section(parameters, sections, carved, foot, bent, ski, m, seen):
    """Return the snow's force on a section and its torque about the section's place, in the foot's frame; adds to a
    ski's row of ``seen``, and writes what the snow would remember.
    """
    memory, lying, none = of_ski(carved.memory, ski), carved.lying, (0.0, 0.0, 0.0)
    low, deep, other, tangent, _, given = meet_snow(
        parameters, sections, carved.edges, foot, bent, m, lying.kept[ski, m]
    )  # fmt: skip
    state = edge_state(*given)
    lower, upper, sinking, v_t, v_n = state[0], state[1], state[2], state[3], state[4]
    lying.apart[ski, m] = (1.0 - 2.0 * low) * (lower - upper)
    pass_over(memory, low, m, upper, v_t, v_n)
    if lower <= 0.0:
        return none, none
    law = law_section(state, memory, low, m, carved.edges.width[m], sections.length[m], carved.step)
    push, along, across, at_upper = edge_force(parameters, *law)
    memory.next_groove[low, m], memory.next_offset[low, m] = edge_memory(parameters, *law)
    most, borne = edge_capacity(parameters, *law)
    seen[MOST] += most
    seen[BORNE] += borne
    seen[USED] += abs(across)
    seen[DRAGGED] += abs(along)
    seen[DEPTH] = max(seen[DEPTH], lower)
    t, n = edge_axes(tangent, deep[3])
    force, pressed = force_on_deeper(push, along, across, at_upper, t, n, deep[3]), times(at_upper, other[3])
    seen[FRICTION_POWER] += along * v_t
    seen[SKID_POWER] += across * v_n
    seen[CONTACT_POWER] += dot(pressed, other[2]) - (push - at_upper) * sinking
    return plus(force, pressed), plus(cross(deep[0], force), cross(other[0], pressed))


@inlined
def see_foot(parameters, sections, foot, turn, total, seen):
    """Fill what a ski's row of ``seen`` holds of it as a whole.

    turn : quaternion of the node at the boot;  total : N of the snow, in the slope's frame
    """
    along, across, _ = foot_axes(parameters, sections.surface, foot.place, foot.frame)
    upright = cross(along, across)
    seen[LOAD], seen[ALONG], seen[ACROSS] = dot(total, upright), dot(total, along), dot(total, across)
    seen[V_T], seen[V_N] = dot(foot.velocity, along), dot(foot.velocity, across)
    left_axis, up_axis = rotate(turn, (0.0, 1.0, 0.0)), rotate(turn, (0.0, 0.0, 1.0))
    on_snow = into(foot.frame, upright)
    seen[EDGE] = math.atan2(dot(left_axis, on_snow), dot(up_axis, on_snow))


@njit(cache=True, error_model="numpy")
def spread(line, force, torque, xi, q0, q1, frame):
    """Fill in how a force and torque in the foot's frame move the coordinates of a section's nodes and of the pelvis.

    line : (17,) the first node's seven, the second's, the pelvis' place; filled
    """
    turn0, turn1, outwards = on_quaternion(q0, torque), on_quaternion(q1, torque), out_of(frame, force)
    for k in range(3):
        line[k], line[7 + k], line[14 + k] = (1.0 - xi) * force[k], xi * force[k], outwards[k]
    for k in range(4):
        line[3 + k], line[10 + k] = (1.0 - xi) * turn0[k], xi * turn1[k]


@njit(cache=True, error_model="numpy")
def spread_point(line, pulls, point, bent, xi, frame):
    """Fill a line as ``spread`` does, for what a section's edges and its tangent are moved by.

    pulls : (12,) by places of the deeper and of the other edge, by the tangent, and by the deeper edge's velocity, as
        far as it is its place's rate
    point : the arms of both edges, the tangent, what a twist adds to it, and the element's length
    """
    (arm, other, tangent, by_twist, length), (_, r, _, _, q0, q1) = point, bent
    at_low, at_other = plus(three(pulls, 0), three(pulls, 9)), three(pulls, 3)
    turning = three(pulls, 6)
    torque = plus(plus(cross(arm, at_low), cross(other, at_other)), cross(tangent, turning))
    spread(line, plus(at_low, at_other), torque, xi, q0, q1, frame)
    apart = times(dot(by_twist, turning) / length, rotate(r, (1.0, 0.0, 0.0)))
    turn0, turn1 = on_quaternion(q0, apart), on_quaternion(q1, apart)
    for k in range(4):
        line[3 + k] -= turn0[k]
        line[10 + k] += turn1[k]


@inlined
def section_block(parameters, sections, carved, foot, bent, ski, m, by, room):
    """Fill ``room.block`` with a section's part of the Jacobian; False where it is out of the snow.

    by : by_place, by_rate
    """
    edges, memory, xi = carved.edges, of_ski(carved.memory, ski), sections.share[m]
    low, deep, other, tangent, by_twist, given = meet_snow(
        parameters, sections, edges, foot, bent, m, carved.lying.kept[ski, m]
    )  # fmt: skip
    state = edge_state(*given)
    if state[0] <= 0.0:
        return False
    law = law_section(state, memory, low, m, edges.width[m], sections.length[m], carved.step)
    t, n = edge_axes(tangent, deep[3])
    edge_state_linearisation(*given, room.state)
    steer(room.pull, room.state, edge_derivatives(parameters, *law), (t, n, deep[3]))
    point = deep[0], other[0], tangent, by_twist, edges.element_length[m]
    room.block[:] = 0.0
    for part in range(4):
        for c in range(12):
            room.pull[part, c] *= by[0] if c < 9 else by[1]
            room.direction[c] = 0.0
        for c in range(3):
            room.direction[3 + c if part == 3 else c] = other[3][c] if part == 3 else (1.0 if c == part else 0.0)
        spread_point(room.slopes, room.pull[part], point, bent, xi, foot.frame)
        spread_point(room.line, room.direction, point, bent, xi, foot.frame)
        for a in range(17):
            for b in range(17):
                room.block[a, b] -= room.line[a] * room.slopes[b]
    return True


@njit(cache=True, error_model="numpy")
def carved_jacobian(parameters, q, v, ref, sections, carved, carrier, at, by, triplets):
    """Fill in triplets of −(by_place ∂out/∂q + by_rate ∂out/∂v) for Newton's method; return their number.

    carved : ``CarvedSkis``;  by : by_place, by_rate

    Left out, as they only cost iterations: how the directions of the forces turn, those of the joints at the boots too,
    the change of the tangents' rise, and the forces of inertia.
    """
    (rows, columns, values), edges, sign = triplets, carved.edges, carrier.sign
    room = BlockRoom(
        np.zeros((7, 12)), np.zeros((4, 12)), np.zeros(12), np.zeros(17), np.zeros(17), np.zeros((17, 17))
    )  # fmt: skip
    count = 0
    per_ski = NODE * (sections.damping.shape[0] + 1)
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    for ski in range(2):
        base = len(sign) + ski * per_ski
        foot = moving_foot(sections, at, pelvis, speed, ski)
        for m in range(sections.element.shape[0]):
            bent = section(q, v, ref, base, sections.element[m], sections.share[m])
            if not section_block(parameters, sections, carved, foot, bent, ski, m, by, room):
                continue
            i = base + NODE * sections.element[m]
            for a in range(17):
                row = i + a if a < 14 else a - 14
                for b in range(17):
                    column = i + b if b < 14 else b - 14
                    count = put(rows, columns, values, count, row, column, room.block[a, b])
        count = damping_triplets(q, ref, base, sections.damping, by[1], triplets, count)
        boot = base + NODE * edges.clamped
        turn = four(q, ref, boot + 3)
        _, by_spin = boot_angles(turn, edges.pitched)
        held = by[0] * edges.stiffness + by[1] * edges.damping
        count = put(rows, columns, values, count, boot + 2, boot + 2, held[2])
        for k in range(3):
            line = on_quaternion(turn, by_spin[k])
            for a in range(4):
                for b in range(4):
                    stiff = held[k if k < 2 else 3] * line[a] * line[b]
                    count = put(rows, columns, values, count, boot + 3 + a, boot + 3 + b, stiff)
    tree = np.zeros((3, len(sign)))
    return skier_triplets(parameters, carrier, at, pelvis, speed, tree, by[1], triplets, count)
