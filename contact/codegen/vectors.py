"""Vectors (3), quaternions (w, x, y, z) and rotations in compiled loops: tuples of floats, which cost no memory."""

from __future__ import annotations

import math

import numpy as np

from sssi_exudyn.contact import maths
from sssi_exudyn.runtime.jit import njit

_compiled = njit(cache=True, error_model="numpy")
plus, times, dot, cross = _compiled(maths.plus), _compiled(maths.times), _compiled(maths.dot), _compiled(maths.cross)


@njit(cache=True, error_model="numpy")
def indices(first, last):
    """Return the indices from ``first`` to before ``last``, none of them negative.

    A signed index may count from an array's end, so that a loop over it takes one number at a time.
    """
    return range(np.uint64(first), np.uint64(last))


@njit(cache=True, error_model="numpy")
def three(a, i):
    return a[i], a[i + 1], a[i + 2]


@njit(cache=True, error_model="numpy")
def three_of(a, i, j):
    """Return three numbers of a row of a table, from column j on."""
    return a[i, j], a[i, j + 1], a[i, j + 2]


@njit(cache=True, error_model="numpy")
def four(a, b, i):
    return a[i] + b[i], a[i + 1] + b[i + 1], a[i + 2] + b[i + 2], a[i + 3] + b[i + 3]


@njit(cache=True, error_model="numpy")
def out_of(frame, v):
    """Turn v (3) from the frame outwards."""
    return (
        frame[0, 0] * v[0] + frame[0, 1] * v[1] + frame[0, 2] * v[2],
        frame[1, 0] * v[0] + frame[1, 1] * v[1] + frame[1, 2] * v[2],
        frame[2, 0] * v[0] + frame[2, 1] * v[1] + frame[2, 2] * v[2],
    )


@njit(cache=True, error_model="numpy")
def into(frame, v):
    """Turn v (3) into the frame."""
    return (
        frame[0, 0] * v[0] + frame[1, 0] * v[1] + frame[2, 0] * v[2],
        frame[0, 1] * v[0] + frame[1, 1] * v[1] + frame[2, 1] * v[2],
        frame[0, 2] * v[0] + frame[1, 2] * v[1] + frame[2, 2] * v[2],
    )


@njit(cache=True, error_model="numpy")
def conjugate(q):
    return q[0], -q[1], -q[2], -q[3]


@njit(cache=True, error_model="numpy")
def product(a, b):
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@njit(cache=True, error_model="numpy")
def rotate(q, v):
    """Turn v (3) by the quaternion q (w, x, y, z): v + 2 w (u × v) + 2 u × (u × v)."""
    u = (q[1], q[2], q[3])
    once = cross(u, v)
    twice = cross(u, once)
    return (
        v[0] + 2.0 * (q[0] * once[0] + twice[0]),
        v[1] + 2.0 * (q[0] * once[1] + twice[1]),
        v[2] + 2.0 * (q[0] * once[2] + twice[2]),
    )


@njit(cache=True, error_model="numpy")
def spin(q, rate, i):
    """Return the angular velocity (3) in the outer frame of a quaternion and its rate, which begins at ``i``: 2 E(q)
    q̇.
    """
    a, b, c, d = q
    w, x, y, z = rate[i], rate[i + 1], rate[i + 2], rate[i + 3]
    return (
        2.0 * (-b * w + a * x - d * y + c * z),
        2.0 * (-c * w + d * x + a * y - b * z),
        2.0 * (-d * w - c * x + b * y + a * z),
    )


@njit(cache=True, error_model="numpy")
def on_quaternion(q, torque):
    """Return the generalised force (4) on a quaternion of a torque (3) in the outer frame: 2 E(q)ᵀ τ."""
    a, b, c, d = q
    x, y, z = torque
    return (
        2.0 * (-b * x - c * y - d * z),
        2.0 * (a * x + d * y - c * z),
        2.0 * (-d * x + a * y + b * z),
        2.0 * (c * x - b * y + a * z),
    )


@njit(cache=True, error_model="numpy")
def between(p0, q0, p1, q1, xi):
    """Return place (3) and quaternion (4) at the share ``xi`` of the screw motion that leads from one node to the
    other.
    """
    w, x, y, z = product(conjugate(q0), q1)
    apart = (p1[0] - p0[0], p1[1] - p0[1], p1[2] - p0[2])
    sine = math.sqrt(x * x + y * y + z * z)
    theta = 2.0 * math.atan2(sine, w)
    if theta < 1e-7:
        mean = (1.0 - xi) * q0[0] + xi * q1[0], (1.0 - xi) * q0[1] + xi * q1[1]
        return plus(p0, times(xi, apart)), (*mean, (1.0 - xi) * q0[2] + xi * q1[2], (1.0 - xi) * q0[3] + xi * q1[3])
    axis = (x / sine, y / sine, z / sine)
    half = 0.5 * theta
    d = rotate(conjugate(q0), apart)
    once = cross(axis, d)
    twice = cross(axis, once)
    rho = plus(plus(d, times(-half, once)), times(1.0 - half / math.tan(half), twice))
    part = xi * theta
    once = cross(axis, rho)
    twice = cross(axis, once)
    bow = plus(times((1.0 - math.cos(part)) / theta, once), times((part - math.sin(part)) / theta, twice))
    move = plus(times(xi, rho), bow)
    s = math.sin(0.5 * part)
    return plus(p0, rotate(q0, move)), product(q0, (math.cos(0.5 * part), s * axis[0], s * axis[1], s * axis[2]))


@njit(cache=True, error_model="numpy")
def middle_of(a, b):
    """Return the quaternion half-way between two neighbours."""
    w, x, y, z = a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]
    s = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return s * w, s * x, s * y, s * z
