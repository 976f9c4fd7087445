"""All forces of the full model on snow that edges cut: a template that ``compiled`` joins with the laws,
``ground_kernel``, ``groove_kernel`` and ``full_kernel``, whose coordinates, frames and inertia these are.

A section presses with its deeper edge, and where it lies flat with both: its forces act at the edges' points, along the
snow's normal there, along the edge's own tangent and across it, and go to the nodes as those of the paper's law do.
The node at the boot gives against the foot in heave, yaw, roll and pitch, one after the other as in
``carved_run_kernel``: a spring and a damper hold each.
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
from sssi_exudyn.runtime.jit import njit
from sssi_exudyn.terrain.surface import patch_under

section_angle: Callable[..., float]
angle_by_depths: Callable[..., float]
edge_force: Callable[..., tuple[float, float, float, float]]
edge_derivatives: Callable[..., tuple[float, ...]]
edge_memory: Callable[..., tuple[float, float]]
edge_capacity: Callable[..., tuple[float, float]]
ground: Callable[..., tuple[float, tuple[float, float, float]]]
foot_axes: Callable[..., Any]
penetration: Callable[..., float]
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
"""As in ``full_kernel``."""
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
"""Steps, 10 ms, after which a section is not just rolling through: nobody changes edges at 2 degrees a second."""
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


@njit(cache=True, error_model="numpy")
def keep_flat(flat):
    """For the step to come keep the deeper edge of sections that lie flat and go on doing so, by the last pass."""
    for ski in range(2):
        for m in range(flat.apart.shape[1]):
            if abs(flat.apart[ski, m]) < LEVEL:
                flat.steps[ski, m] += 1
            else:
                flat.steps[ski, m], flat.kept[ski, m] = 0, EITHER
            if flat.steps[ski, m] > LASTING and flat.kept[ski, m] == EITHER:
                flat.kept[ski, m] = 1 if flat.apart[ski, m] < 0.0 else 0


@njit(cache=True, error_model="numpy")
def edge_on_snow(parameters, place, velocity, turning, frame, under, body, offset):
    """An edge's point in the snow: its arm in the foot's frame, depth, velocity and the snow's normal.

    body : place, quaternion, velocity and spin of its section in the foot's frame
    """
    p, r, moving, omega = body
    arm, reach = edge_arms(frame, p, r, offset)
    point = plus(place, reach)
    height, normal = ground(parameters, under, point[0], point[1])
    bending = out_of(frame, plus(moving, cross(omega, arm)))
    speed = point_velocity(velocity, turning, reach, bending)
    return arm, penetration(height - point[2], normal), speed, normal


@njit(cache=True, error_model="numpy")
def edges_on_snow(parameters, place, velocity, turning, frame, under, body, offsets, width, kept):
    """Which edge of a section is the deeper one (0 left, 1 right), this one and the other as ``edge_on_snow`` gives
    them, and the angle (rad) at which the section stands on the snow, positive on its right edge.

    offsets : (2, 3) m of both edges in the section's frame
    kept : the edge that counts as the deeper one whatever rounding makes of it, EITHER where it is looked at
    """
    left = edge_on_snow(parameters, place, velocity, turning, frame, under, body, three(offsets[0], 0))
    right = edge_on_snow(parameters, place, velocity, turning, frame, under, body, three(offsets[1], 0))
    low = kept if kept != EITHER else (1 if right[1] > left[1] else 0)
    deep, other = (right, left) if low == 1 else (left, right)
    return low, deep, other, section_angle(left[1], right[1], width)


@njit(cache=True, error_model="numpy")
def edge_frame(tangent, normal):
    """Axes t, n of an edge in the snow's tangent plane, what is left of its tangent there, and how it climbs."""
    rise = dot(tangent, normal)
    along = plus(tangent, times(-rise, normal))
    flat = math.sqrt(dot(along, along))
    along = times(1.0 / flat, along)
    return along, cross(normal, along), flat, rise


@njit(cache=True, error_model="numpy")
def bent_tangent(edges, sections, m, low, r, q0, q1):
    """An edge's tangent in the foot's frame, and what a twist of the ski adds to it, a unit of rad/m: an edge that lies
    aside of the axis rises or falls along a ski that twists.

    r, q0, q1 : quaternions of the section and of its element's nodes
    """
    twist = 2.0 * (q0[0] * q1[1] - q0[1] * q1[0] - q0[2] * q1[3] + q0[3] * q1[2]) / edges.element_length[m]
    by_twist = rotate(r, (0.0, 0.0, sections.offset[m, low, 1]))
    return plus(rotate(r, three(edges.tangent[m, low], 0)), times(twist, by_twist)), by_twist


@njit(cache=True, error_model="numpy")
def boot_angles(turn, pitched):
    """Yaw, roll and pitch (rad), in this order, that turn the foot's axes into a quaternion's, and the vectors by which
    a spin makes the rates of each: that about which one turns where the other two keep.

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
def carved_forces(parameters, q, v, ref, sections, edges, carrier, at, memory, lying, step, found):
    """Generalised forces of all terms, of the skis' structural damping, of their weight and inertia and of what holds
    them at the boot.

    edges : ``CuttingEdges``;  memory : ``Groove`` with a first axis for the skis, what the step would leave is written
    lying : ``FlatSections``;  step : s since the memory was brought here; all else as in ``full_kernel``
    """
    element, share, length = sections.element, sections.share, sections.length
    sign = carrier.sign
    out, seen = found.out, found.seen
    out[:] = 0.0
    seen[:] = 0.0
    per_ski = NODE * (sections.damping.shape[0] + 1)
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    for ski in range(2):
        base = len(sign) + ski * per_ski
        own = of_ski(memory, ski)
        frame = at.foot_rotation[ski]
        place, velocity = plus(pelvis, at.foot_place[ski]), plus(speed, at.foot_velocity[ski])
        turning = three(at.foot_spin[ski], 0)
        under = patch_under(sections.surface, place[0], place[1])
        total, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for m in range(element.shape[0]):
            xi = share[m]
            i = base + NODE * element[m]
            p, r, moving, omega, q0, q1 = section(q, v, ref, base, element[m], xi)
            low, deep, other, angle = edges_on_snow(
                parameters, place, velocity, turning, frame, under, (p, r, moving, omega), sections.offset[m],
                edges.width[m], lying.kept[ski, m],
            )  # fmt: skip
            arm, lower, moving_edge, normal = deep
            upper = other[1]
            lying.apart[ski, m] = (1.0 - 2.0 * low) * (lower - upper)
            tangent, _ = bent_tangent(edges, sections, m, low, r, q0, q1)
            t, n, _, rise = edge_frame(out_of(frame, tangent), normal)
            v_t, v_n, sinking = dot(moving_edge, t), dot(moving_edge, n), -dot(moving_edge, normal)
            own.next_groove[low, m], own.next_offset[low, m], own.next_speed[low, m] = 0.0, 0.0, v_t
            # the other edge presses too where the ski is flat, and has no wall
            own.next_groove[1 - low, m] = max(upper, own.arrived_groove[1 - low, m]) if upper > 0.0 else 0.0
            own.next_offset[1 - low, m], own.next_speed[1 - low, m] = 0.0, v_t
            own.next_drift[low, m], own.next_drift[1 - low, m] = v_n, v_n
            if lower <= 0.0:
                continue
            width, groove, offset = edges.width[m], own.arrived_groove[low, m], own.arrived_offset[low, m]
            push, along, across, at_upper = edge_force(
                parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, angle, length[m]
            )
            own.next_groove[low, m], own.next_offset[low, m] = edge_memory(
                parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, angle, length[m]
            )
            most, borne = edge_capacity(
                parameters, lower, upper, sinking, width, groove, offset, step, v_t, v_n, rise, angle, length[m]
            )
            seen[ski, MOST] += most
            seen[ski, BORNE] += borne
            seen[ski, USED] += abs(across)
            seen[ski, DRAGGED] += abs(along)
            seen[ski, DEPTH] = max(seen[ski, DEPTH], lower)
            force = plus(times(push - at_upper, normal), plus(times(along, t), times(across, n)))
            pressed = times(at_upper, other[3])
            seen[ski, FRICTION_POWER] += along * v_t
            seen[ski, SKID_POWER] += across * v_n
            seen[ski, CONTACT_POWER] += dot(pressed, other[2]) - (push - at_upper) * sinking
            total = plus(total, plus(force, pressed))
            force, pressed = into(frame, force), into(frame, pressed)
            torque = plus(cross(arm, force), cross(other[0], pressed))
            force = plus(force, pressed)
            moment = plus(moment, plus(cross(p, force), torque))
            add_wrench(out, i, 1.0 - xi, q0, force, torque)
            add_wrench(out, i + NODE, xi, q1, force, torque)
        moment = out_of(frame, moment)
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
        along, across, _ = foot_axes(parameters, sections.surface, place, frame)
        upright = cross(along, across)
        seen[ski, LOAD], seen[ski, ALONG], seen[ski, ACROSS] = (
            dot(total, upright),
            dot(total, along),
            dot(total, across),
        )
        seen[ski, V_T], seen[ski, V_N] = dot(velocity, along), dot(velocity, across)
        turn = four(q, ref, boot + 3)
        left_axis, up_axis = rotate(turn, (0.0, 1.0, 0.0)), rotate(turn, (0.0, 0.0, 1.0))
        on_snow = into(frame, upright)
        seen[ski, EDGE] = math.atan2(dot(left_axis, on_snow), dot(up_axis, on_snow))
    push_skier(parameters, carrier, at, pelvis, speed, found)


@njit(cache=True, error_model="numpy")
def spread(line, force, torque, xi, q0, q1, frame):
    """What of the coordinates of a section's nodes and of the pelvis a force and torque in the foot's frame move.

    line : (17,) the first node's seven, the second's, the pelvis' place; filled
    """
    turn0, turn1, outwards = on_quaternion(q0, torque), on_quaternion(q1, torque), out_of(frame, force)
    for k in range(3):
        line[k], line[7 + k], line[14 + k] = (1.0 - xi) * force[k], xi * force[k], outwards[k]
    for k in range(4):
        line[3 + k], line[10 + k] = (1.0 - xi) * turn0[k], xi * turn1[k]


@njit(cache=True, error_model="numpy")
def carved_jacobian(
    parameters, q, v, ref, sections, edges, carrier, at, memory, lying, step, by_place, by_rate, triplets
):  # fmt: skip
    """Triplets of −(by_place ∂out/∂q + by_rate ∂out/∂v) for Newton's method; returns their number.

    Left out, as they only cost iterations: how the directions of the forces turn, those of the joints at the boots too,
    the change of the tangents' rise, and the forces of inertia.
    """
    element, share, length = sections.element, sections.share, sections.length
    sign = carrier.sign
    rows, columns, values = triplets
    count = 0
    per_ski = NODE * (sections.damping.shape[0] + 1)
    lines, by, block = np.zeros((4, 17)), np.zeros((5, 17)), np.zeros((17, 17))
    swing, slopes = np.zeros(17), np.zeros(17)
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    nothing = (0.0, 0.0, 0.0)
    for ski in range(2):
        base = len(sign) + ski * per_ski
        own = of_ski(memory, ski)
        frame = at.foot_rotation[ski]
        place, velocity = plus(pelvis, at.foot_place[ski]), plus(speed, at.foot_velocity[ski])
        turning = three(at.foot_spin[ski], 0)
        under = patch_under(sections.surface, place[0], place[1])
        for m in range(element.shape[0]):
            xi = share[m]
            i = base + NODE * element[m]
            p, r, moving, omega, q0, q1 = section(q, v, ref, base, element[m], xi)
            low, deep, other, angle = edges_on_snow(
                parameters, place, velocity, turning, frame, under, (p, r, moving, omega), sections.offset[m],
                edges.width[m], lying.kept[ski, m],
            )  # fmt: skip
            arm, lower, moving_edge, normal = deep
            if lower <= 0.0:
                continue
            tangent, by_twist = bent_tangent(edges, sections, m, low, r, q0, q1)
            t, n, flat, rise = edge_frame(out_of(frame, tangent), normal)
            v_t, v_n = dot(moving_edge, t), dot(moving_edge, n)
            found = edge_derivatives(
                parameters, lower, other[1], -dot(moving_edge, normal), edges.width[m], own.arrived_groove[low, m],
                own.arrived_offset[low, m], step, v_t, v_n, rise, angle, length[m],
            )  # fmt: skip
            by_depths = angle_by_depths(low, angle, edges.width[m])
            inwards, upwards = into(frame, normal), into(frame, other[3])
            t_in, n_in = into(frame, t), into(frame, n)
            spread(lines[0], inwards, cross(arm, inwards), xi, q0, q1, frame)
            spread(lines[1], t_in, cross(arm, t_in), xi, q0, q1, frame)
            spread(lines[2], n_in, cross(arm, n_in), xi, q0, q1, frame)
            spread(lines[3], upwards, cross(other[0], upwards), xi, q0, q1, frame)
            spread(swing, nothing, cross(tangent, n_in), xi, q0, q1, frame)
            apart = times(dot(by_twist, n_in) / edges.element_length[m], rotate(r, (1.0, 0.0, 0.0)))
            turn0, turn1 = on_quaternion(q0, apart), on_quaternion(q1, apart)
            for k in range(4):
                swing[3 + k] -= turn0[k]
                swing[10 + k] += turn1[k]
            for c in range(17):
                turned = swing[c] * by_place / flat
                by[0, c], by[1, c], by[2, c] = -by_place * lines[0, c], -by_place * lines[3, c], -by_rate * lines[0, c]
                by[3, c] = by_rate * lines[1, c] + v_n * turned
                by[4, c] = by_rate * lines[2, c] - v_t * turned
                lines[3, c] -= lines[0, c]
            block[:] = 0.0
            for part in range(4):
                k = 4 + 6 * part
                tilting = found[k + 5] * by_depths
                for c in range(17):
                    slopes[c] = (
                        (found[k] + tilting) * by[0, c]
                        + (found[k + 1] - tilting) * by[1, c]
                        + found[k + 2] * by[2, c]
                        + found[k + 3] * by[3, c]
                        + found[k + 4] * by[4, c]
                    )
                for a in range(17):
                    for b in range(17):
                        block[a, b] -= lines[part, a] * slopes[b]
            for a in range(17):
                row = i + a if a < 14 else a - 14
                for b in range(17):
                    column = i + b if b < 14 else b - 14
                    count = put(rows, columns, values, count, row, column, block[a, b])
        count = damping_triplets(q, ref, base, sections.damping, by_rate, triplets, count)
        boot = base + NODE * edges.clamped
        turn = four(q, ref, boot + 3)
        _, by_spin = boot_angles(turn, edges.pitched)
        held = by_place * edges.stiffness + by_rate * edges.damping
        count = put(rows, columns, values, count, boot + 2, boot + 2, held[2])
        for k in range(3):
            line = on_quaternion(turn, by_spin[k])
            for a in range(4):
                for b in range(4):
                    each = held[k if k < 2 else 3] * line[a] * line[b]
                    count = put(rows, columns, values, count, boot + 3 + a, boot + 3 + b, each)
    tree = np.zeros((3, len(sign)))
    return skier_triplets(parameters, carrier, at, pelvis, speed, tree, by_rate, triplets, count)
