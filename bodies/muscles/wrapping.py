"""Shortest paths around a cylinder, a sphere or an ellipsoid; compiled.

A line from a to b that meets a surface is led around it: straight to a tangent point r1, along the surface to r2,
straight to b.  Around a cylinder this is a helix (a straight line once the cylinder is unrolled), around a sphere a
great circle.  An ellipsoid's path is the shortest of those that lie in a plane through a and b.  SIMM and OpenSim take
a plane too, by other criteria.  OpenSim's rules decide whether a surface wraps, on which side (its ``quadrant``) and
between which points of a path, so that its models have the same meaning here.

Vectors are triples, so that nothing is allocated.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from sssi_exudyn.runtime.jit import njit

CYLINDER: Final = 0
ELLIPSOID: Final = 1
"""Kinds of surface; a sphere is an ellipsoid of equal axes."""

NONE, WRAPPED, MUST = 0, 1, 2
"""Actions for a line: leave it straight; lead it around if no other line calls for it more; lead it around."""
_PLANES: Final = 12
_GOLD: Final = 0.5 * (math.sqrt(5.0) - 1.0)
_STEP: Final = 1e-6
"""m, for differences of the length on an ellipsoid, which is correct to rounding."""

inner = njit(error_model="numpy")
_NODE, _WEIGHT = (0.5 * part for part in np.polynomial.legendre.leggauss(14))


@inner
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def minus(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@inner
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@inner
def unit(a):
    size = math.sqrt(dot(a, a))
    return (a[0] / size, a[1] / size, a[2] / size)


@inner
def along(a, b, t):
    return (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))


@inner
def distance(a, b):
    d = minus(a, b)
    return math.sqrt(dot(d, d))


@inner
def _on(point, axis, sign):
    """Tell whether a point is on the side of the surface where it is active."""
    return (point[axis] > 0.0) == (sign > 0.0)


@inner
def cylinder(a, b, radius, length, axis, sign):
    """Return action, r1, r2 and the length between them on a cylinder about z; ``sign`` 0: active all around."""
    nothing = (NONE, a, b, 0.0)
    da, db = math.hypot(a[0], a[1]), math.hypot(b[0], b[1])
    if da < radius or db < radius:
        return nothing
    dx, dy = b[0] - a[0], b[1] - a[1]
    flat = dx * dx + dy * dy
    t = -(a[0] * dx + a[1] * dy) / flat if flat > 0.0 else 0.0
    near = along(a, b, t)
    hit = math.hypot(near[0], near[1]) < radius and 0.0 < t < 1.0
    action = MUST if hit else WRAPPED
    if sign == 0.0 and not hit:
        return nothing
    if sign != 0.0 and not hit and (_on(a, axis, sign) or _on(b, axis, sign)):
        passes_behind = _on(a, axis, sign) != _on(b, axis, sign) and not _on(near, axis, sign)
        if not passes_behind:
            return nothing
    at_a, at_b = math.atan2(a[1], a[0]), math.atan2(b[1], b[0])
    open_a, open_b = math.acos(radius / da), math.acos(radius / db)
    # anticlockwise from a the tangent point is ahead of a, and b ahead of its own
    left = (at_b - open_b - at_a - open_a) % (2.0 * math.pi)
    right = (at_a - open_a - at_b - open_b) % (2.0 * math.pi)
    anticlockwise = left <= right
    if sign != 0.0:
        a_left = _on((math.cos(at_a + open_a), math.sin(at_a + open_a), 0.0), axis, sign)
        a_right = _on((math.cos(at_a - open_a), math.sin(at_a - open_a), 0.0), axis, sign)
        b_right = _on((math.cos(at_b + open_b), math.sin(at_b + open_b), 0.0), axis, sign)
        b_left = _on((math.cos(at_b - open_b), math.sin(at_b - open_b), 0.0), axis, sign)
        if a_left != a_right:
            anticlockwise = a_left
        elif b_left != b_right:
            anticlockwise = b_left
        else:
            anticlockwise = (left <= right) == a_left
    turn = left if anticlockwise else right
    direction = 1.0 if anticlockwise else -1.0
    first, last = at_a + direction * open_a, at_b - direction * open_b
    # unrolled, the path is one straight line: it climbs evenly
    approach, arc, departure = math.sqrt(da * da - radius * radius), radius * turn, math.sqrt(db * db - radius * radius)
    climb = (b[2] - a[2]) / (approach + arc + departure)
    r1 = (radius * math.cos(first), radius * math.sin(first), a[2] + climb * approach)
    r2 = (radius * math.cos(last), radius * math.sin(last), b[2] - climb * departure)
    if abs(r1[2]) > 0.5 * length and abs(r2[2]) > 0.5 * length:
        return nothing
    return action, r1, r2, arc * math.sqrt(1.0 + climb * climb)


@inner
def _on_circle(size, centre, radius, e1, e2, phi):
    """Return a point of the circle that a plane cuts, in unscaled axes."""
    u, v = radius * math.cos(phi), radius * math.sin(phi)
    return (
        size[0] * (centre[0] + u * e1[0] + v * e2[0]),
        size[1] * (centre[1] + u * e1[1] + v * e2[1]),
        size[2] * (centre[2] + u * e1[2] + v * e2[2]),
    )


@inner
def _section(a, b, size, angle, across, up):
    """Return the path from a to b in the plane that is turned by ``angle`` about their line.

    The result is its length, r1, r2, the middle of the arc, and the arc's length.  ``across`` and ``up`` are square to
    the line.  In axes divided by ``size`` the section is a circle.
    """
    c, s = math.cos(angle), math.sin(angle)
    lift = (c * across[0] + s * up[0], c * across[1] + s * up[1], c * across[2] + s * up[2])
    pa = (a[0] / size[0], a[1] / size[1], a[2] / size[2])
    pb = (b[0] / size[0], b[1] / size[1], b[2] / size[2])
    e1 = unit(minus(pb, pa))
    e2 = (lift[0] / size[0], lift[1] / size[1], lift[2] / size[2])
    along = dot(e2, e1)
    e2 = unit((e2[0] - along * e1[0], e2[1] - along * e1[1], e2[2] - along * e1[2]))
    normal = cross(e1, e2)
    off = dot(pa, normal)
    radius = math.sqrt(max(1.0 - off * off, 1e-12))
    xa, xb, y = dot(pa, e1), dot(pb, e1), dot(pa, e2)
    first = math.atan2(y, xa) - math.acos(min(radius / math.hypot(xa, y), 1.0))
    last = math.atan2(y, xb) + math.acos(min(radius / math.hypot(xb, y), 1.0))
    turn = (first - last) % (2.0 * math.pi)

    arc = 0.0
    for k in range(len(_NODE)):
        phi = first - turn * (0.5 + _NODE[k])
        u, v = -math.sin(phi), math.cos(phi)
        speed = (
            size[0] * (u * e1[0] + v * e2[0]),
            size[1] * (u * e1[1] + v * e2[1]),
            size[2] * (u * e1[2] + v * e2[2]),
        )
        arc += _WEIGHT[k] * math.sqrt(dot(speed, speed))
    arc *= radius * turn
    centre = (off * normal[0], off * normal[1], off * normal[2])
    r1 = _on_circle(size, centre, radius, e1, e2, first)
    r2 = _on_circle(size, centre, radius, e1, e2, first - turn)
    middle = _on_circle(size, centre, radius, e1, e2, first - 0.5 * turn)
    return distance(a, r1) + arc + distance(b, r2), r1, r2, middle, arc


@inner
def _square_to(a, b):
    """Return two unit vectors square to the line from a to b and to each other."""
    line = unit(minus(b, a))
    if abs(line[0]) <= abs(line[1]) and abs(line[0]) <= abs(line[2]):
        axis = (1.0, 0.0, 0.0)
    elif abs(line[1]) <= abs(line[2]):
        axis = (0.0, 1.0, 0.0)
    else:
        axis = (0.0, 0.0, 1.0)
    across = unit(cross(line, axis))
    return across, cross(line, across)


@inner
def ellipsoid(a, b, size, axis, sign):
    """Return action, r1, r2, the length between them, and the angle of the plane."""
    nothing = (NONE, a, b, 0.0, 0.0)
    pa = (a[0] / size[0], a[1] / size[1], a[2] / size[2])
    pb = (b[0] / size[0], b[1] / size[1], b[2] / size[2])
    if dot(pa, pa) < 1.0 or dot(pb, pb) < 1.0:
        return nothing
    line = minus(pb, pa)
    t = -dot(pa, line) / dot(line, line)
    near = along(pa, pb, t)
    if not 0.0 < t < 1.0 or dot(near, near) >= 1.0:
        return nothing
    across, up = _square_to(a, b)
    spacing = 2.0 * math.pi / _PLANES
    best, least, any_active = 0.0, math.inf, False
    for k in range(_PLANES):
        length, _, _, middle, _ = _section(a, b, size, k * spacing, across, up)
        active = sign == 0.0 or _on(middle, axis, sign)
        if (active and not any_active) or (active == any_active and length < least):
            best, least, any_active = k * spacing, length, active or any_active
    for step in (-spacing, spacing):  # downhill from there, until the least length lies between two planes
        for _ in range(_PLANES):
            length = _section(a, b, size, best + step, across, up)[0]
            if length >= least:
                break
            best, least = best + step, length
    low, high = best - spacing, best + spacing
    x1, x2 = high - _GOLD * (high - low), low + _GOLD * (high - low)
    f1, f2 = _section(a, b, size, x1, across, up)[0], _section(a, b, size, x2, across, up)[0]
    for _ in range(30):
        if f1 < f2:
            high, x2, f2 = x2, x1, f1
            x1 = high - _GOLD * (high - low)
            f1 = _section(a, b, size, x1, across, up)[0]
        else:
            low, x1, f1 = x1, x2, f2
            x2 = low + _GOLD * (high - low)
            f2 = _section(a, b, size, x2, across, up)[0]
    angle = 0.5 * (low + high)
    _, r1, r2, _, arc = _section(a, b, size, angle, across, up)
    return MUST, r1, r2, arc, angle


@inner
def ellipsoid_pull(a, b, size, angle):
    """Return the gradients of the path's length with respect to a and b.

    The length is least at the plane's angle.  So to first order it does not matter that the plane turns on its own when
    a or b moves.
    """
    across, up = _square_to(a, b)
    at_a, at_b = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    for k in range(3):
        x, y, z = (_STEP if k == 0 else 0.0), (_STEP if k == 1 else 0.0), (_STEP if k == 2 else 0.0)
        more = _section((a[0] + x, a[1] + y, a[2] + z), b, size, angle, across, up)[0]
        less = _section((a[0] - x, a[1] - y, a[2] - z), b, size, angle, across, up)[0]
        at_a[k] = (more - less) / (2.0 * _STEP)
        more = _section(a, (b[0] + x, b[1] + y, b[2] + z), size, angle, across, up)[0]
        less = _section(a, (b[0] - x, b[1] - y, b[2] - z), size, angle, across, up)[0]
        at_b[k] = (more - less) / (2.0 * _STEP)
    return (at_a[0], at_a[1], at_a[2]), (at_b[0], at_b[1], at_b[2])
