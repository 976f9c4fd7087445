"""All forces of the full model in one pass over its coordinates: a template that ``compiled`` joins with the laws.

Coordinates are the skeleton's 31, then the left and the right ski's nodes of seven each: place (3) and quaternion
(w, x, y, z).  ``ref`` is the reference that Exudyn keeps apart from its coordinates.  A contact section lies at the share ξ
of its element; its frame is interpolated on SE(3) and its velocities linearly, as Exudyn's body markers do, so that
connectors on such markers give the same forces.  A section's force goes to its two nodes by the shares 1 − ξ and ξ.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit

point_force: Callable[..., float]
point_derivatives: Callable[..., tuple[float, float, float]]
foot_force: Callable[..., tuple[float, float]]
foot_derivatives: Callable[..., tuple[float, ...]]
segment_force: Callable[..., tuple[float, float, float]]
segment_derivatives: Callable[..., tuple[float, ...]]
body_force: Callable[..., tuple[float, float, float]]
body_derivatives: Callable[..., tuple[float, ...]]
terrain_height: Callable[..., tuple[float, float, float]]

TREE = 31
"""Coordinates of the skeleton; its first three are the pelvis' place."""
NODE = 7
"""Coordinates of a ski's node."""

LOAD, GROOVE, DEPTH, ALONG, ACROSS, EDGE, V_T, V_N, CONTACT_POWER, FRICTION_POWER, DAMPING_POWER = range(11)
"""Columns of ``seen``, one row a ski: what the pass saw, in N, m², m, N, N, rad, m/s, m/s, W, W, W."""
SEEN = 11


@njit(cache=True)
def turned(q, v):
    """v (3) turned by the quaternion q (w, x, y, z): v + 2 w (u × v) + 2 u × (u × v)."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    x = 2.0 * (c * v[2] - d * v[1])
    y = 2.0 * (d * v[0] - b * v[2])
    z = 2.0 * (b * v[1] - c * v[0])
    return np.array((v[0] + a * x + c * z - d * y, v[1] + a * y + d * x - b * z, v[2] + a * z + b * y - c * x))


@njit(cache=True)
def cross(a, b):
    return np.array((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))


@njit(cache=True)
def spin(q, rate):
    """Angular velocity (3) in the outer frame of a quaternion and its rate: 2 E(q) q̇."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    return np.array(
        (
            2.0 * (-b * rate[0] + a * rate[1] - d * rate[2] + c * rate[3]),
            2.0 * (-c * rate[0] + d * rate[1] + a * rate[2] - b * rate[3]),
            2.0 * (-d * rate[0] - c * rate[1] + b * rate[2] + a * rate[3]),
        )
    )


@njit(cache=True)
def on_quaternion(q, torque):
    """Generalised force (4) on a quaternion of a torque (3) in the outer frame: 2 E(q)ᵀ τ."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    x, y, z = torque[0], torque[1], torque[2]
    return np.array(
        (
            2.0 * (-b * x - c * y - d * z),
            2.0 * (a * x + d * y - c * z),
            2.0 * (-d * x + a * y + b * z),
            2.0 * (c * x - b * y + a * z),
        )
    )


@njit(cache=True)
def between(p0, q0, p1, q1, xi):
    """Place (3) and quaternion (4) at the share ``xi`` of the screw motion that leads from one node to the other."""
    w = q0[0] * q1[0] + q0[1] * q1[1] + q0[2] * q1[2] + q0[3] * q1[3]
    x = q0[0] * q1[1] - q0[1] * q1[0] - q0[2] * q1[3] + q0[3] * q1[2]
    y = q0[0] * q1[2] + q0[1] * q1[3] - q0[2] * q1[0] - q0[3] * q1[1]
    z = q0[0] * q1[3] - q0[1] * q1[2] + q0[2] * q1[1] - q0[3] * q1[0]
    back = np.array((q0[0], -q0[1], -q0[2], -q0[3]))
    d = turned(back, p1 - p0)
    sine = math.sqrt(x * x + y * y + z * z)
    theta = 2.0 * math.atan2(sine, w)
    if theta < 1e-7:
        return p0 + xi * (p1 - p0), q0 + xi * (q1 - q0)
    axis = np.array((x / sine, y / sine, z / sine))
    half = 0.5 * theta
    first = cross(axis, d)
    second = cross(axis, first)
    rho = d - half * first + (1.0 - half / math.tan(half)) * second
    part = xi * theta
    first = cross(axis, rho)
    second = cross(axis, first)
    move = xi * rho + ((1.0 - math.cos(part)) * first + (part - math.sin(part)) * second) / theta
    s, c = math.sin(0.5 * part), math.cos(0.5 * part)
    b, e, g = s * axis[0], s * axis[1], s * axis[2]
    q = np.array(
        (
            q0[0] * c - q0[1] * b - q0[2] * e - q0[3] * g,
            q0[0] * b + q0[1] * c + q0[2] * g - q0[3] * e,
            q0[0] * e - q0[1] * g + q0[2] * c + q0[3] * b,
            q0[0] * g + q0[1] * e - q0[2] * b + q0[3] * c,
        )
    )
    return p0 + turned(q0, move), q


@njit(cache=True)
def ground(parameters, f, l):
    """Height of the snow over the slope's plane (m) and its unit normal (3) at a place."""
    h, h_f, h_l = terrain_height(parameters, f, l)
    s = 1.0 / math.sqrt(1.0 + h_f * h_f + h_l * h_l)
    return h, np.array((-h_f * s, -h_l * s, s))


@njit(cache=True)
def section(q, v, ref, base, element, xi):
    """Frame (place, quaternion) and velocities (linear, angular) at a share of an element of the ski that starts at ``base``."""
    i = base + NODE * element
    j = i + NODE
    p0, p1 = q[i : i + 3] + ref[i : i + 3], q[j : j + 3] + ref[j : j + 3]
    q0, q1 = q[i + 3 : i + 7] + ref[i + 3 : i + 7], q[j + 3 : j + 7] + ref[j + 3 : j + 7]
    p, r = between(p0, q0, p1, q1, xi)
    velocity = (1.0 - xi) * v[i : i + 3] + xi * v[j : j + 3]
    omega = (1.0 - xi) * spin(q0, v[i + 3 : i + 7]) + xi * spin(q1, v[j + 3 : j + 7])
    return p, r, velocity, omega, q0, q1


@njit(cache=True)
def foot_axes(parameters, place, rotation):
    """Forward and left axes of a foot in the snow's tangent plane, the normal there, and the ski's edge angle."""
    _, normal = ground(parameters, place[0], place[1])
    forward = rotation[:, 0].copy()
    along = forward - (forward @ normal) * normal
    along /= math.sqrt(along @ along)
    across = cross(normal, along)
    edge = math.atan2(rotation[:, 1].copy() @ normal, rotation[:, 2].copy() @ normal)
    return along, across, edge


@njit(cache=True)
def add_to_tree(out, sign, force, jacobian):
    """A force (3) on the point whose velocity is the pelvis' plus jacobian (3, 28) times the angles' rates."""
    for k in range(3):
        out[k] += force[k]
    for i in range(TREE - 3):
        out[3 + i] += sign[3 + i] * (jacobian[0, i] * force[0] + jacobian[1, i] * force[1] + jacobian[2, i] * force[2])


@njit(cache=True)
def forces(
    parameters, q, v, ref, t,
    element, share, offset, length, damping,
    sign, foot_place, foot_velocity, foot_rotation, foot_jacobian,
    com_place, com_velocity, com_jacobian, area, exposed_velocity, exposed_jacobian,
    out, seen, drag, body,
):  # fmt: skip
    """Generalised forces of all terms and of the skis' structural damping.

    q, v, ref, out : (31 + 2·7·(n + 1),);  t : s
    element, share, length : (m,) element, ξ and length of edge of each contact section; offset : (m, 2, 3) of its edges
    damping : (n, 3) N m s of each element against relative spin about its own axes
    sign : (31,) tree's coordinate / chain's coordinate; foot_…, com_…, exposed_… : one row of ``Posture``; area : (k,) m²
    seen : (2, 11) is filled as its columns say; drag : (4,) with the air's force (N) and its power (W);
    body : (3,) with the force of the body terms (N)
    """
    out[:] = 0.0
    seen[:] = 0.0
    drag[:] = 0.0
    elements = damping.shape[0]
    per_ski = NODE * (elements + 1)
    for ski in range(2):
        base = TREE + ski * per_ski
        for m in range(element.shape[0]):
            xi = share[m]
            i = base + NODE * element[m]
            p, r, velocity, omega, q0, q1 = section(q, v, ref, base, element[m], xi)
            force = np.zeros(3)
            torque = np.zeros(3)
            touched = False
            for edge in range(2):
                arm = turned(r, offset[m, edge])
                point = p + arm
                height, normal = ground(parameters, point[0], point[1])
                depth = (height - point[2]) * normal[2]
                if depth <= 0.0:
                    continue
                speed = (velocity + cross(omega, arm)) @ normal
                push = point_force(parameters, depth, -speed, length[m])
                seen[ski, LOAD] += push
                seen[ski, GROOVE] += depth * length[m]
                seen[ski, DEPTH] = max(seen[ski, DEPTH], depth)
                seen[ski, CONTACT_POWER] += push * speed
                force += push * normal
                torque += cross(arm, push * normal)
                touched = True
            if touched:
                out[i : i + 3] += (1.0 - xi) * force
                out[i + 7 : i + 10] += xi * force
                out[i + 3 : i + 7] += (1.0 - xi) * on_quaternion(q0, torque)
                out[i + 10 : i + 14] += xi * on_quaternion(q1, torque)
        for e in range(elements):
            i = base + NODE * e
            j = i + NODE
            q0, q1 = q[i + 3 : i + 7] + ref[i + 3 : i + 7], q[j + 3 : j + 7] + ref[j + 3 : j + 7]
            relative = spin(q1, v[j + 3 : j + 7]) - spin(q0, v[i + 3 : i + 7])
            middle = 0.5 * (q0 + q1)
            middle /= math.sqrt(middle @ middle)
            local = turned(np.array((middle[0], -middle[1], -middle[2], -middle[3])), relative)
            torque = turned(middle, damping[e] * local)
            out[i + 3 : i + 7] += on_quaternion(q0, torque)
            out[j + 3 : j + 7] -= on_quaternion(q1, torque)
            seen[ski, DAMPING_POWER] -= local @ (damping[e] * local)
    pelvis, speed = q[:3] + ref[:3], v[:3]
    for ski in range(2):
        place, velocity = pelvis + foot_place[ski], speed + foot_velocity[ski]
        along, across, edge = foot_axes(parameters, place, foot_rotation[ski])
        v_t, v_n = velocity @ along, velocity @ across
        side = 1.0 - 2.0 * ski
        f_t, f_n = foot_force(
            parameters, seen[ski, LOAD], v_t, v_n, edge, seen[ski, GROOVE], t, place[0], place[1], side
        )
        add_to_tree(out, sign, f_t * along + f_n * across, foot_jacobian[ski])
        seen[ski, ALONG], seen[ski, ACROSS], seen[ski, EDGE] = f_t, f_n, edge
        seen[ski, V_T], seen[ski, V_N] = v_t, v_n
        seen[ski, FRICTION_POWER] = f_t * v_t + f_n * v_n
    for k in range(area.shape[0]):
        velocity = speed + exposed_velocity[k]
        force = np.array(
            segment_force(parameters, t, pelvis[0], pelvis[1], velocity[0], velocity[1], velocity[2], area[k])
        )
        add_to_tree(out, sign, force, exposed_jacobian[k])
        drag[:3] += force
        drag[3] += force @ velocity
    place, velocity = pelvis + com_place, speed + com_velocity
    force = np.array(body_force(parameters, t, place[0], place[1], velocity[0], velocity[1], velocity[2]))
    add_to_tree(out, sign, force, com_jacobian)
    body[:] = force


@njit(cache=True)
def put(rows, columns, values, count, row, column, value):
    """Append a triplet unless it is zero, which Exudyn's sparse matrices do not take; the new count."""
    if value != 0.0:
        rows[count], columns[count], values[count] = row, column, value
        return count + 1
    return count


@njit(cache=True)
def jacobian(
    parameters, q, v, ref, t, by_place, by_rate,
    element, share, offset, length, damping,
    sign, foot_place, foot_velocity, foot_rotation, foot_jacobian, seen,
    area, exposed_velocity, exposed_jacobian,
    rows, columns, values,
):  # fmt: skip
    """Triplets of −(by_place ∂out/∂q + by_rate ∂out/∂v) for Newton's method; returns their number.

    Kept: contact stiffness and damping along the normal, structural damping, friction and drag by velocity.  Left out, as they
    only cost iterations: the turning of the contact's arms, and friction's dependence on the load.
    """
    count = 0
    elements = damping.shape[0]
    per_ski = NODE * (elements + 1)
    slope = np.zeros(14)
    block = np.zeros((14, 14))
    for ski in range(2):
        base = TREE + ski * per_ski
        for m in range(element.shape[0]):
            xi = share[m]
            i = base + NODE * element[m]
            p, r, velocity, omega, q0, q1 = section(q, v, ref, base, element[m], xi)
            touched = False
            for edge in range(2):
                arm = turned(r, offset[m, edge])
                point = p + arm
                height, normal = ground(parameters, point[0], point[1])
                depth = (height - point[2]) * normal[2]
                if depth <= 0.0:
                    continue
                rate = -((velocity + cross(omega, arm)) @ normal)
                _, by_depth, by_sinking = point_derivatives(parameters, depth, rate, length[m])
                stiffness = by_place * by_depth + by_rate * by_sinking
                if stiffness == 0.0:
                    continue
                if not touched:
                    block[:] = 0.0
                    touched = True
                turn = cross(arm, normal)
                slope[0:3] = (1.0 - xi) * normal
                slope[3:7] = (1.0 - xi) * on_quaternion(q0, turn)
                slope[7:10] = xi * normal
                slope[10:14] = xi * on_quaternion(q1, turn)
                for a in range(14):
                    for b in range(14):
                        block[a, b] += stiffness * slope[a] * slope[b]
            if touched:
                for a in range(14):
                    for b in range(14):
                        count = put(rows, columns, values, count, i + a, i + b, block[a, b])
        for e in range(elements):
            i = base + NODE * e
            q0, q1 = q[i + 3 : i + 7] + ref[i + 3 : i + 7], q[i + 10 : i + 14] + ref[i + 10 : i + 14]
            middle = 0.5 * (q0 + q1)
            middle /= math.sqrt(middle @ middle)
            block[:8, :8] = 0.0
            for k in range(3):
                axis = np.zeros(3)
                axis[k] = 1.0
                axis = turned(middle, axis)
                slope[0:4] = on_quaternion(q0, axis)
                slope[4:8] = -on_quaternion(q1, axis)
                for a in range(8):
                    for b in range(8):
                        block[a, b] += by_rate * damping[e, k] * slope[a] * slope[b]
            for a in range(8):
                for b in range(8):
                    row, column = i + 3 + a + 3 * (a // 4), i + 3 + b + 3 * (b // 4)
                    count = put(rows, columns, values, count, row, column, block[a, b])
    pelvis, speed = q[:3] + ref[:3], v[:3]
    tree = np.zeros((TREE, 3))
    for ski in range(2):
        place, velocity = pelvis + foot_place[ski], speed + foot_velocity[ski]
        along, across, edge = foot_axes(parameters, place, foot_rotation[ski])
        side = 1.0 - 2.0 * ski
        found = foot_derivatives(
            parameters, seen[ski, LOAD], velocity @ along, velocity @ across, edge, seen[ski, GROOVE], t,
            place[0], place[1], side,
        )  # fmt: skip
        for k in range(3):
            column = (found[3] * along[k] + found[4] * across[k]) * along
            column = column + (found[6] * along[k] + found[7] * across[k]) * across
            add_to_tree(tree[:, k], sign, column, foot_jacobian[ski])
    for k in range(area.shape[0]):
        velocity = speed + exposed_velocity[k]
        found = segment_derivatives(parameters, t, pelvis[0], pelvis[1], velocity[0], velocity[1], velocity[2], area[k])
        for c in range(3):
            add_to_tree(tree[:, c], sign, np.array((found[3 + c], found[6 + c], found[9 + c])), exposed_jacobian[k])
    for row in range(TREE):
        for c in range(3):
            count = put(rows, columns, values, count, row, c, -by_rate * tree[row, c])
    return count
