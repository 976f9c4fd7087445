"""All forces of the full model in one pass over its coordinates: a template that ``compiled`` joins with the laws.

Coordinates are the skeleton's, then the left and the right ski's nodes of seven each: place (3) and quaternion
(w, x, y, z).  The skeleton has its tree's 31, or without a tree the pelvis' place alone: as many as ``sign``.  ``ref``
is the reference that Exudyn keeps apart from its coordinates.  A ski's nodes are given in the frame of its foot, which
moves as prescribed, carried by the pelvis: what a beam feels of that motion are forces of inertia, and the solver's
Jacobian, dominated by the beams' stiffness, keeps for many steps because nothing turns in that frame.

    place on the slope   p = x + b + R X         x pelvis, b and R place and rotation of the foot, X in the foot's frame
    velocity             v = ẋ + ḃ + ω × R X + R Ẋ
    inertia of a node    −m (R·(ẍ + b̈) + Ω̇ × X + Ω × (Ω × X) + 2 Ω × Ẋ)      R·: turned into the foot's frame

The part with ẍ stands in the mass matrix (``CoupledMass`` in ``backend``), all others are here.  Masses are lumped
at the nodes, as Exudyn's beams have them.

A contact section lies at the share ξ of its element; its frame is interpolated on SE(3) and its velocities linearly, as
Exudyn's body markers do.  Its force goes to its two nodes by the shares 1 − ξ and ξ.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sssi_exudyn.contact.codegen.vectors import (
    between,
    conjugate,
    cross,
    dot,
    four,
    into,
    middle_of,
    on_quaternion,
    out_of,
    plus,
    rotate,
    spin,
    three,
    times,
)
from sssi_exudyn.runtime.jit import inlined, njit
from sssi_exudyn.terrain.surface import patch_under

body_force: Callable[..., tuple[float, float, float]]
foot_axes: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float], float]]
foot_derivatives: Callable[..., tuple[float, ...]]
foot_force: Callable[..., tuple[float, float]]
penetration: Callable[..., float]
point_derivatives: Callable[..., tuple[float, float, float]]
point_force: Callable[..., float]
point_velocity: Callable[..., tuple[float, float, float]]
point_wrench: Callable[..., tuple[tuple[float, float, float], tuple[float, float, float]]]
segment_derivatives: Callable[..., tuple[float, ...]]
segment_force: Callable[..., tuple[float, float, float]]
sinking_rate: Callable[..., float]
snow_normal: Callable[..., tuple[float, float, float]]
snow_over: Callable[..., tuple[float, float, float]]
uneven: Callable[..., bool]

NODE = 7
"""Coordinates of a ski's node."""

LOAD, GROOVE, DEPTH, ALONG, ACROSS, EDGE, V_T, V_N, CONTACT_POWER, FRICTION_POWER, DAMPING_POWER = range(11)
"""Columns of ``seen``, one row a ski: what the pass saw, in N, m², m, N, N, rad, m/s, m/s, W, W, W."""
SEEN = 11


@njit(cache=True, error_model="numpy")
def add_wrench(out, i, share, q, force, torque):
    """Add a share of force and torque (outer frame) to the node whose coordinates begin at ``i`` and whose quaternion
    is q.
    """
    turn = on_quaternion(q, torque)
    for k in range(3):
        out[i + k] += share * force[k]
    for k in range(4):
        out[i + 3 + k] += share * turn[k]


@njit(cache=True, error_model="numpy")
def section(q, v, ref, base, element, xi):
    """Return frame (place, quaternion) and velocities (linear, angular) at a share of an element, with its nodes'
    quaternions.  The ski's coordinates start at ``base``.
    """
    i = base + NODE * element
    j = i + NODE
    p0 = (q[i] + ref[i], q[i + 1] + ref[i + 1], q[i + 2] + ref[i + 2])
    p1 = (q[j] + ref[j], q[j + 1] + ref[j + 1], q[j + 2] + ref[j + 2])
    q0, q1 = four(q, ref, i + 3), four(q, ref, j + 3)
    p, r = between(p0, q0, p1, q1, xi)
    velocity = plus(times(1.0 - xi, three(v, i)), times(xi, three(v, j)))
    omega = plus(times(1.0 - xi, spin(q0, v, i + 3)), times(xi, spin(q1, v, j + 3)))
    return p, r, velocity, omega, q0, q1


@njit(cache=True, error_model="numpy")
def edge_arms(frame, p, r, offset):
    """Return an edge's point: its arm from the section in the foot's frame, and from the foot in the slope's."""
    arm = rotate(r, offset)
    return arm, out_of(frame, plus(p, arm))


@inlined
def edge_in_snow(parameters, under, shaped, foot, posed, offset):
    """Return an edge's point: its arm from the section in the foot's frame and its depth; in the snow also the rate at
    which it sinks and the snow's normal.

    foot : place, velocity, rotation (3, 3) and spin;  posed : as ``section`` gives it;  shaped : as in ``snow_over``
    """
    at, velocity, frame, spinning = foot
    arm, reach = edge_arms(frame, posed[0], posed[1], offset)
    gap, h_f, h_l = snow_over(parameters, under, shaped, plus(at, reach))
    normal = snow_normal(h_f, h_l)
    depth = penetration(gap, normal)
    if depth <= 0.0:
        return arm, depth, 0.0, normal
    bending = out_of(frame, plus(posed[2], cross(posed[3], arm)))
    return arm, depth, sinking_rate(point_velocity(velocity, spinning, reach, bending), normal), normal


@njit(cache=True, error_model="numpy")
def foot_now(at, pelvis, speed, ski):
    """Return place, velocity, rotation (3, 3) and spin of a foot of a pelvis at a place, moving at ``speed``."""
    place, velocity = plus(pelvis, at.foot_place[ski]), plus(speed, at.foot_velocity[ski])
    return place, velocity, at.foot_rotation[ski], three(at.foot_spin[ski], 0)


@njit(cache=True, error_model="numpy")
def add_to_tree(out, sign, force, jacobian):
    """Add a force (3) on the point whose velocity is the pelvis' plus jacobian (3, 28) times the angles' rates."""
    for k in range(3):
        out[k] += force[k]
    for i in range(len(sign) - 3):
        out[3 + i] += sign[3 + i] * (jacobian[0, i] * force[0] + jacobian[1, i] * force[1] + jacobian[2, i] * force[2])


@njit(cache=True, error_model="numpy")
def ski_inertia(q, v, ref, base, sections, gravity, frame, spin_in, spin_rate, acceleration, out):
    """Add weight and forces of inertia of one ski's nodes, without the pelvis' own acceleration, and their sum on the
    pelvis.

    gravity (3,) and acceleration (3,) of the foot relative to the pelvis in the slope frame; spin_in, spin_rate in the
    foot's frame.
    """
    mass, moment = sections.node_mass, sections.node_moment
    fall = into(frame, (gravity[0] - acceleration[0], gravity[1] - acceleration[1], gravity[2] - acceleration[2]))
    total = (0.0, 0.0, 0.0)
    for node in range(mass.shape[0]):
        i = base + NODE * node
        place = (q[i] + ref[i], q[i + 1] + ref[i + 1], q[i + 2] + ref[i + 2])
        swing = cross(spin_in, plus(cross(spin_in, place), times(2.0, three(v, i))))
        felt = plus(fall, times(-1.0, plus(cross(spin_rate, place), swing)))
        force = times(mass[node], felt)
        momentum = (moment[node, 0] * spin_in[0], moment[node, 1] * spin_in[1], moment[node, 2] * spin_in[2])
        gyro = cross(spin_in, momentum)
        torque = (
            -moment[node, 0] * spin_rate[0] - gyro[0],
            -moment[node, 1] * spin_rate[1] - gyro[1],
            -moment[node, 2] * spin_rate[2] - gyro[2],
        )
        add_wrench(out, i, 1.0, four(q, ref, i + 3), force, torque)
        total = plus(total, force)
    on_pelvis = out_of(frame, total)
    for k in range(3):
        out[k] += on_pelvis[k]


@njit(cache=True, error_model="numpy")
def bend_damping(q, v, ref, base, damping, out):
    """Add the structural damping of one ski; the power (W) that it takes."""
    power = 0.0
    for e in range(damping.shape[0]):
        i = base + NODE * e
        j = i + NODE
        q0, q1 = four(q, ref, i + 3), four(q, ref, j + 3)
        relative = plus(spin(q1, v, j + 3), times(-1.0, spin(q0, v, i + 3)))
        middle = middle_of(q0, q1)
        local = rotate(conjugate(middle), relative)
        torque = (damping[e, 0] * local[0], damping[e, 1] * local[1], damping[e, 2] * local[2])
        power += dot(local, torque)
        torque = rotate(middle, torque)
        add_wrench(out, i, 1.0, q0, (0.0, 0.0, 0.0), torque)
        add_wrench(out, j, -1.0, q1, (0.0, 0.0, 0.0), torque)
    return power


@njit(cache=True, error_model="numpy")
def push_skier(parameters, carrier, at, pelvis, speed, filled):
    """Add what the air does to the skier's segments, and what else acts on the centre of mass."""
    out, sign, t = filled.out, carrier.sign, at.time
    for k in range(carrier.area.shape[0]):
        velocity = plus(speed, at.exposed_velocity[k])
        facing = at.exposed_facing[k]
        force = segment_force(
            parameters, t, pelvis[0], pelvis[1], velocity[0], velocity[1], velocity[2], carrier.area[k],
            facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        )  # fmt: skip
        add_to_tree(out, sign, force, at.exposed_jacobian[k])
        for c in range(3):
            filled.drag[k, c] = force[c]
        filled.drag[k, 3] = dot(force, velocity)
    place, velocity = plus(pelvis, at.com_place), plus(speed, at.com_velocity)
    force = body_force(parameters, t, place[0], place[1], velocity[0], velocity[1], velocity[2])
    add_to_tree(out, sign, force, at.com_jacobian)
    for c in range(3):
        filled.body[c] = force[c]


@njit(cache=True, error_model="numpy")
def forces(parameters, q, v, ref, sections, carrier, at, filled):
    """Fill in the generalised forces of all terms, of the skis' structural damping and of their weight and inertia.

    q, v, ref : (s + 2·7·(n + 1),);  sections : ``Sections``;  carrier : ``Carrier``;  at : ``Instant``
    filled : ``ForcePass``, which is filled
    """
    out, seen, damping = filled.out, filled.seen, sections.damping
    out[:] = 0.0
    seen[:] = 0.0
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    for ski in range(2):
        base = len(carrier.sign) + ski * NODE * (damping.shape[0] + 1)
        foot = foot_now(at, pelvis, speed, ski)
        frame = foot[2]
        press_sections(parameters, q, v, ref, base, sections, foot, out, seen[ski])
        seen[ski, DAMPING_POWER] -= bend_damping(q, v, ref, base, damping, out)
        spin_in, spin_rate = into(frame, at.foot_spin[ski]), into(frame, at.foot_spin_rate[ski])
        ski_inertia(
            q, v, ref, base, sections, carrier.gravity, frame, spin_in, spin_rate, at.foot_acceleration[ski], out
        )
        if sections.rising < 0:
            friction = rub(parameters, sections, foot, at.time, ski, seen[ski])
            add_to_tree(out, carrier.sign, friction, at.foot_jacobian[ski])
        else:
            i = base + NODE * sections.rising
            friction = rub(parameters, sections, risen(foot, q, v, i), at.time, ski, seen[ski])
            pushed = into(frame, friction)
            # about the foot's place it has no moment but for the rise
            add_wrench(out, i, 1.0, four(q, ref, i + 3), pushed, cross(pushed, three(ref, i)))
            for k in range(3):
                out[k] += friction[k]
    push_skier(parameters, carrier, at, pelvis, speed, filled)


@inlined
def press_sections(parameters, q, v, ref, base, sections, foot, out, seen):
    """Add the snow's forces on the sections of a ski whose nodes start at ``base``, to the nodes and the pelvis."""
    at, _, frame, _ = foot
    under, shaped = patch_under(sections.surface, at[0], at[1]), uneven(parameters)
    on_pelvis = (0.0, 0.0, 0.0)
    for m in range(sections.element.shape[0]):
        xi, length = sections.share[m], sections.length[m]
        i = base + NODE * sections.element[m]
        posed = section(q, v, ref, base, sections.element[m], xi)
        force = (0.0, 0.0, 0.0)
        torque = (0.0, 0.0, 0.0)
        for edge in range(2):
            offset = three(sections.offset[m, edge], 0)
            arm, depth, rate, normal = edge_in_snow(parameters, under, shaped, foot, posed, offset)
            if depth <= 0.0:
                continue
            push = point_force(parameters, depth, rate, length)
            seen[LOAD] += push
            seen[GROOVE] += depth * length
            seen[DEPTH] = max(seen[DEPTH], depth)
            seen[CONTACT_POWER] -= push * rate
            pushed, turning = point_wrench(push, into(frame, normal), arm)
            force, torque = plus(force, pushed), plus(torque, turning)
        if force[0] != 0.0 or force[1] != 0.0 or force[2] != 0.0:
            add_wrench(out, i, 1.0 - xi, posed[4], force, torque)
            add_wrench(out, i + NODE, xi, posed[5], force, torque)
            on_pelvis = plus(on_pelvis, force)
    on_pelvis = out_of(frame, on_pelvis)
    for k in range(3):
        out[k] += on_pelvis[k]


@njit(cache=True, error_model="numpy")
def risen(foot, q, v, i):
    """Return a foot with the velocity of its boot, whose node's coordinates begin at ``i`` and which rises against it.

    The place stays the foot's: it tells where on the slope snow and laws are looked up.
    """
    at, velocity, frame, spinning = foot
    arm = out_of(frame, (0.0, 0.0, q[i + 2]))
    return at, point_velocity(velocity, spinning, arm, out_of(frame, three(v, i))), frame, spinning


@inlined
def rub(parameters, sections, foot, t, ski, seen):
    """Return the friction (3) on a foot, in N, of whose ski ``seen`` (11,) has load and groove."""
    at, velocity, frame, _ = foot
    along, across, edge = foot_axes(parameters, sections.surface, at, frame)
    v_t, v_n = dot(velocity, along), dot(velocity, across)
    f_t, f_n = foot_force(parameters, seen[LOAD], v_t, v_n, edge, seen[GROOVE], t, at[0], at[1], 1.0 - 2.0 * ski)
    seen[ALONG], seen[ACROSS], seen[EDGE], seen[V_T], seen[V_N] = f_t, f_n, edge, v_t, v_n
    seen[FRICTION_POWER] = f_t * v_t + f_n * v_n
    return plus(times(f_t, along), times(f_n, across))


@njit(cache=True, error_model="numpy")
def put(rows, columns, values, count, row, column, value):
    """Append a triplet unless it is zero, which Exudyn's sparse matrices do not take; the new count."""
    if value != 0.0:
        rows[count], columns[count], values[count] = row, column, value
        return count + 1
    return count


@njit(cache=True, error_model="numpy")
def damping_triplets(q, ref, base, damping, by_rate, triplets, count):
    """Append what the structural damping of one ski gives; the new count."""
    rows, columns, values = triplets
    slope, block = np.zeros(8), np.zeros((8, 8))
    for e in range(damping.shape[0]):
        i = base + NODE * e
        q0, q1 = four(q, ref, i + 3), four(q, ref, i + NODE + 3)
        middle = middle_of(q0, q1)
        block[:] = 0.0
        for k in range(3):
            axis = rotate(middle, (1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)))
            turn0, turn1 = on_quaternion(q0, axis), on_quaternion(q1, axis)
            for c in range(4):
                slope[c], slope[4 + c] = turn0[c], -turn1[c]
            for a in range(8):
                for b in range(8):
                    block[a, b] += by_rate * damping[e, k] * slope[a] * slope[b]
        for a in range(8):
            for b in range(8):
                row, column = i + 3 + a + 3 * (a // 4), i + 3 + b + 3 * (b // 4)
                count = put(rows, columns, values, count, row, column, block[a, b])
    return count


@njit(cache=True, error_model="numpy")
def skier_triplets(parameters, carrier, at, pelvis, speed, tree, by_rate, triplets, count):
    """Append what acts on the skeleton by the pelvis' velocity: ``tree`` (3, s) and the air's forces; the new count."""
    rows, columns, values = triplets
    sign, t = carrier.sign, at.time
    for k in range(carrier.area.shape[0]):
        velocity = plus(speed, at.exposed_velocity[k])
        facing = at.exposed_facing[k]
        pushed = segment_derivatives(
            parameters, t, pelvis[0], pelvis[1], velocity[0], velocity[1], velocity[2], carrier.area[k],
            facing[0, 0], facing[0, 1], facing[0, 2], facing[1, 1], facing[1, 2], facing[2, 2],
        )  # fmt: skip
        for c in range(3):
            add_to_tree(tree[c], sign, (pushed[3 + c], pushed[6 + c], pushed[9 + c]), at.exposed_jacobian[k])
    for row in range(len(sign)):
        for c in range(3):
            count = put(rows, columns, values, count, row, c, -by_rate * tree[c, row])
    return count


@njit(cache=True, error_model="numpy")
def jacobian(parameters, q, v, ref, sections, carrier, at, seen, by_place, by_rate, triplets):
    """Fill in triplets of −(by_place ∂out/∂q + by_rate ∂out/∂v) for Newton's method; return their number.

    Kept: contact stiffness and damping along the normal between the nodes of a section and the pelvis, structural
    damping, friction and drag by velocity.  Left out, as they only cost iterations: the turning of the contact's
    arms, friction's dependence on the load, the forces of inertia.
    """
    sign, damping = carrier.sign, sections.damping
    count = 0
    tree = np.zeros((3, len(sign)))
    pelvis, speed = plus(three(q, 0), three(ref, 0)), three(v, 0)
    for ski in range(2):
        base = len(sign) + ski * NODE * (damping.shape[0] + 1)
        foot = foot_now(at, pelvis, speed, ski)
        count = contact_triplets(parameters, q, v, ref, base, sections, foot, by_place, by_rate, triplets, count)
        count = damping_triplets(q, ref, base, damping, by_rate, triplets, count)
        if sections.rising >= 0:
            foot = risen(foot, q, v, base + NODE * sections.rising)
        place, velocity, frame, _ = foot
        along, across, edge = foot_axes(parameters, sections.surface, place, frame)
        slopes = foot_derivatives(
            parameters, seen[ski, LOAD], dot(velocity, along), dot(velocity, across), edge, seen[ski, GROOVE], at.time,
            place[0], place[1], 1.0 - 2.0 * ski,
        )  # fmt: skip
        for k in range(3):
            column_t = slopes[3] * along[k] + slopes[4] * across[k]
            column_n = slopes[6] * along[k] + slopes[7] * across[k]
            column = plus(times(column_t, along), times(column_n, across))
            if sections.rising < 0:
                add_to_tree(tree[k], sign, column, at.foot_jacobian[ski])
            else:
                count = boot_triplets(frame, column, base + NODE * sections.rising, k, by_rate, tree, triplets, count)
    return skier_triplets(parameters, carrier, at, pelvis, speed, tree, by_rate, triplets, count)


@njit(cache=True, error_model="numpy")
def boot_triplets(frame, column, i, k, by_rate, tree, triplets, count):
    """Append what friction on a boot that rises, its node at ``i``, gains by its velocity along the k-th axis: the
    ``column`` (3) in N s/m; the new count.  On the pelvis by its own velocity goes to ``tree`` (3, s).
    """
    rows, columns, values = triplets
    up = (frame[0, 2], frame[1, 2], frame[2, 2])
    on_boot = dot(up, column)
    for c in range(3):
        tree[k, c] += column[c]
        count = put(rows, columns, values, count, c, i + 2, -by_rate * up[k] * column[c])
    count = put(rows, columns, values, count, i + 2, k, -by_rate * on_boot)
    return put(rows, columns, values, count, i + 2, i + 2, -by_rate * up[k] * on_boot)


@inlined
def contact_triplets(parameters, q, v, ref, base, sections, foot, by_place, by_rate, triplets, count):
    """Append what the contact of one ski gives along the snow's normals; the new count."""
    rows, columns, values = triplets
    at, _, frame, _ = foot
    under, shaped = patch_under(sections.surface, at[0], at[1]), uneven(parameters)
    slope, block = np.zeros(17), np.zeros((17, 17))
    for m in range(sections.element.shape[0]):
        xi = sections.share[m]
        i = base + NODE * sections.element[m]
        posed = section(q, v, ref, base, sections.element[m], xi)
        touched = False
        for edge in range(2):
            offset = three(sections.offset[m, edge], 0)
            arm, depth, rate, upwards = edge_in_snow(parameters, under, shaped, foot, posed, offset)
            if depth <= 0.0:
                continue
            _, by_depth, by_sinking = point_derivatives(parameters, depth, rate, sections.length[m])
            stiffness = by_place * by_depth + by_rate * by_sinking
            if stiffness == 0.0:
                continue
            if not touched:
                block[:] = 0.0
                touched = True
            normal, turn = point_wrench(1.0, into(frame, upwards), arm)
            turn0, turn1 = on_quaternion(posed[4], turn), on_quaternion(posed[5], turn)
            for k in range(3):
                slope[k], slope[7 + k], slope[14 + k] = (1.0 - xi) * normal[k], xi * normal[k], upwards[k]
            for k in range(4):
                slope[3 + k], slope[10 + k] = (1.0 - xi) * turn0[k], xi * turn1[k]
            for a in range(17):
                for b in range(17):
                    block[a, b] += stiffness * slope[a] * slope[b]
        if touched:
            for a in range(17):
                row = i + a if a < 14 else a - 14
                for b in range(17):
                    column = i + b if b < 14 else b - 14
                    count = put(rows, columns, values, count, row, column, block[a, b])
    return count
