"""The contact as one writes it first: point by point, with NumPy's small vectors.  A baseline for speed alone."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sssi_exudyn.contact.backend import Forces, Instant
from sssi_exudyn.contact.kernel import NODE
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.penetration import HuntCrossley
from sssi_exudyn.contact.sections import Sections
from sssi_exudyn.contact.term import PointState
from sssi_exudyn.frames import Array


def screw(p0: Array, r0: Rotation, p1: Array, r1: Rotation, xi: float) -> tuple[Array, Rotation]:
    """Place and rotation at a share of the screw motion from one frame to the other."""
    turn = (r0.inv() * r1).as_rotvec()
    angle = float(np.linalg.norm(turn))
    d = r0.inv().apply(p1 - p0)
    if angle < 1e-7:
        return p0 + xi * (p1 - p0), r0
    axis = turn / angle
    half = 0.5 * angle
    rho = d - half * np.cross(axis, d) + (1.0 - half / np.tan(half)) * np.cross(axis, np.cross(axis, d))
    part = xi * angle
    move = xi * rho + (1.0 - np.cos(part)) / angle * np.cross(axis, rho)
    move = move + (part - np.sin(part)) / angle * np.cross(axis, np.cross(axis, rho))
    return p0 + r0.apply(move), r0 * Rotation.from_rotvec(part * axis)


def contact(law: HuntCrossley, sections: Sections, q: Array, v: Array, head: int, at: Instant) -> Array:
    """(2,) sum of the normal forces on each ski, and on the way every point's force and torque."""
    loads = np.zeros(2)
    for ski in range(2):
        nodes, rates = (x[head:].reshape(2, -1, NODE)[ski] for x in (q, v))
        frame = at.foot_rotation[ski]
        force, torque = np.zeros((len(nodes), 3)), np.zeros((len(nodes), 3))
        for m, element in enumerate(sections.element):
            xi = float(sections.share[m])
            ends, speeds = nodes[element : element + 2], rates[element : element + 2]
            turns = [Rotation.from_quat(end[3:], scalar_first=True) for end in ends]
            spins = []
            for end, speed in zip(ends, speeds, strict=True):
                w, x, y, z = end[3:]
                matrix = np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])
                spins.append(2.0 * matrix @ speed[3:])
            place, turn = screw(ends[0, :3], turns[0], ends[1, :3], turns[1], xi)
            moving = (1.0 - xi) * speeds[0, :3] + xi * speeds[1, :3]
            omega = (1.0 - xi) * spins[0] + xi * spins[1]
            for edge in range(2):
                arm = turn.apply(sections.offset[m, edge])
                out = frame @ (place + arm)
                point = q[:3] + at.foot_place[ski] + out
                pace = v[:3] + at.foot_velocity[ski] + np.cross(at.foot_spin[ski], out)
                pace = pace + frame @ (moving + np.cross(omega, arm))
                if point[2] >= 0.0:
                    continue
                state = PointState(-float(point[2]), -float(pace[2]), float(sections.length[m]))
                push = law.force(FloatMath(), state)
                pushed = frame.T @ np.array([0.0, 0.0, push])
                loads[ski] += push
                for node, part in ((element, 1.0 - xi), (element + 1, xi)):
                    force[node] += part * pushed
                    torque[node] += part * np.cross(arm, pushed)
    return loads


def microseconds(forces: Forces, sections: Sections, q: Array, v: Array, at: Instant, law: HuntCrossley) -> float:
    """Of one evaluation, the best of three; raises AssertionError when the loads are not the pass' own."""
    import time

    forces.evaluate(q, v, at)
    total = q + forces.ref
    walls = []
    for _ in range(3):
        begin = time.perf_counter()
        loads = contact(law, sections, total, v, len(forces.out) - 2 * NODE * len(sections.node_mass), at)
        walls.append(time.perf_counter() - begin)
    np.testing.assert_allclose(loads, forces.seen[:, 0], rtol=1e-9)
    return 1e6 * min(walls)
