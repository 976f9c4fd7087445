"""The contact as a first draft: lists, loops and a matrix for every rotation.  A baseline for speed alone."""

from __future__ import annotations

import math
from typing import TypeAlias

from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import PointState
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.ski_on_snow.structs import Instant, Sections

Vector: TypeAlias = list[float]
Matrix: TypeAlias = list[list[float]]


def add(*vectors: Vector) -> Vector:
    return [sum(parts) for parts in zip(*vectors, strict=True)]


def scale(s: float, a: Vector) -> Vector:
    return [s * x for x in a]


def dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def transpose(a: Matrix) -> Matrix:
    return [list(column) for column in zip(*a, strict=True)]


def apply(a: Matrix, v: Vector) -> Vector:
    return [dot(row, v) for row in a]


def multiply(a: Matrix, b: Matrix) -> Matrix:
    columns = transpose(b)
    return [[dot(row, column) for column in columns] for row in a]


def matrix(q: Vector) -> Matrix:
    """Return the rotation matrix of a unit quaternion."""
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def to_spin(q: Vector) -> Matrix:
    """Return E(q), with which the angular velocity is 2 E q̇."""
    w, x, y, z = q
    return [[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]]


def screw(p0: Vector, r0: Matrix, p1: Vector, r1: Matrix, xi: float) -> tuple[Vector, Matrix]:
    """Return place and rotation at a share of the screw motion from one frame to the other."""
    turn = multiply(transpose(r0), r1)
    twist = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]]
    apart = add(p1, scale(-1.0, p0))
    angle = math.atan2(math.sqrt(dot(twist, twist)), turn[0][0] + turn[1][1] + turn[2][2] - 1.0)
    if angle < 1e-7:
        return add(p0, scale(xi, apart)), r0
    axis = scale(1.0 / math.sqrt(dot(twist, twist)), twist)
    half, part = 0.5 * angle, xi * angle
    d = apply(transpose(r0), apart)
    rho = add(d, scale(-half, cross(axis, d)))
    rho = add(rho, scale(1.0 - half / math.tan(half), cross(axis, cross(axis, d))))
    move = add(scale(xi, rho), scale((1.0 - math.cos(part)) / angle, cross(axis, rho)))
    move = add(move, scale((part - math.sin(part)) / angle, cross(axis, cross(axis, rho))))
    rotation = matrix([math.cos(0.5 * part), *scale(math.sin(0.5 * part), axis)])
    return add(p0, apply(r0, move)), multiply(r0, rotation)


def contact(law: HuntCrossley, sections: Sections, q: Array, v: Array, head: int, at: Instant) -> list[Matrix]:
    """Return generalised forces of the snow on flat ground on the nodes: one list a ski of lists of seven.

    q, v : coordinates with their reference and rates, of which the skis' begin at ``head``
    """
    forces = []
    count = len(sections.node_mass)
    for ski in range(2):
        frame = at.foot_rotation[ski].tolist()
        first = head + ski * NODE * count
        nodes = [q[first + NODE * n : first + NODE * (n + 1)].tolist() for n in range(count)]
        rates = [v[first + NODE * n : first + NODE * (n + 1)].tolist() for n in range(count)]
        on_nodes = [[0.0] * NODE for _ in range(count)]
        for m in range(len(sections.share)):
            element, xi = int(sections.element[m]), float(sections.share[m])
            ends, speeds = nodes[element : element + 2], rates[element : element + 2]
            rotations = [matrix(end[3:]) for end in ends]
            spins = [scale(2.0, apply(to_spin(end[3:]), rate[3:])) for end, rate in zip(ends, speeds, strict=True)]
            place, turn = screw(ends[0][:3], rotations[0], ends[1][:3], rotations[1], xi)
            moving = add(scale(1.0 - xi, speeds[0][:3]), scale(xi, speeds[1][:3]))
            omega = add(scale(1.0 - xi, spins[0]), scale(xi, spins[1]))
            for edge in range(2):
                arm = apply(turn, sections.offset[m][edge].tolist())
                out = apply(frame, add(place, arm))
                point = add(q[:3].tolist(), at.foot_place[ski].tolist(), out)
                local = apply(frame, add(moving, cross(omega, arm)))
                carried = cross(at.foot_spin[ski].tolist(), out)
                pace = add(v[:3].tolist(), at.foot_velocity[ski].tolist(), carried, local)
                if point[2] >= 0.0:
                    continue
                push = law.force(FloatMath(), PointState(-point[2], -pace[2], float(sections.length[m])))
                pushed = apply(transpose(frame), [0.0, 0.0, push])
                torque = cross(arm, pushed)
                for k, part in enumerate((1.0 - xi, xi)):
                    on_quaternion = scale(2.0, apply(transpose(to_spin(ends[k][3:])), torque))
                    on_nodes[element + k] = add(on_nodes[element + k], scale(part, pushed + on_quaternion))
        forces.append(on_nodes)
    return forces
