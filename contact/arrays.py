"""The force pass of ``kernel`` once more, over whole arrays: all sections of a ski at once, the laws over any ``Math``.

Two back ends share it: ``numpy`` gives the laws NumPy's arithmetic, ``symbolic`` Exudyn's, recorded once and then
evaluated without the interpreter.  Neither needs a compiler.  Formulas and names are those of ``kernel``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from sssi_exudyn.contact import kernel
from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.maths import ArrayMath
from sssi_exudyn.contact.term import Term
from sssi_exudyn.contact.vectors import ski_axes
from sssi_exudyn.frames import Array

_TINY = 1e-7
"""rad; neighbours turned by less against each other are taken for parallel, as in ``vectors.between``."""


class Laws(Protocol):
    """The force laws of a model, each over arrays of one shape or over numbers."""

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        """(m,) normal forces (N) of points in the snow."""

    def foot(self, *state: float) -> tuple[float, float]:
        """Along and across (N); arguments as ``FootState`` has them."""

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array) -> Array:  # noqa: E741
        """(k, 3) N on segments of velocity (k, 3) and area (k,)."""

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        """(3,) N."""

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        """Height (m) and slopes at places, each of the places' shape."""


class ArrayLaws:
    """The terms as they are written, over NumPy's arrays."""

    def __init__(self, terms: Sequence[Term]) -> None:
        self._terms = terms
        self._math = ArrayMath()

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        return np.asarray(places.point_force(self._math, self._terms, places.PointState(depth, rate, length)))

    def foot(self, *state: float) -> tuple[float, float]:
        along, across = places.foot_force(self._math, self._terms, places.FootState(*map(np.float64, state)))
        return float(along), float(across)

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array) -> Array:  # noqa: E741
        wind = places.air_velocity(self._math, self._terms, places.PlaceState(t, f, l))
        state = places.SegmentState(tuple(velocity.T), tuple(wind), area)
        force = places.segment_force(self._math, self._terms, state)
        return np.stack([np.broadcast_to(part, area.shape) for part in force], axis=1)

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        state = places.BodyState(np.float64(t), f, l, tuple(velocity))
        return np.array([float(part) for part in places.body_force(self._math, self._terms, state)])

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        found = places.terrain_height(self._math, self._terms, f, l)
        height, by_f, by_l = (np.broadcast_to(np.asarray(part, dtype=np.float64), np.shape(f)) for part in found)
        return height, by_f, by_l


class ArrayKernel:
    """The functions that ``backend.Forces`` calls of a kernel, for some laws.

    jacobian : of the same terms by the interpreter; it steers Newton's method, not the result
    """

    def __init__(self, laws: Laws, jacobian: Any) -> None:
        self._laws = laws
        self.jacobian = jacobian

    def ground(self, f: Array, l: Array) -> tuple[Array, Array]:  # noqa: E741
        """Height (…) and unit normal (…, 3) of the snow at places (…)."""
        height, by_f, by_l = self._laws.terrain(f, l)
        s = 1.0 / np.sqrt(1.0 + by_f * by_f + by_l * by_l)
        return height, np.stack([-by_f * s, -by_l * s, s], axis=-1)

    def foot_axes(self, _parameters: Array, place: Array, rotation: Array) -> tuple[Array, Array, float]:
        """As ``kernel.foot_axes``."""
        _, normal = self.ground(np.asarray(place[0]), np.asarray(place[1]))
        along, across, edge = ski_axes(normal, rotation)
        return np.array(along), np.array(across), float(edge)

    def forces(
        self, parameters: Array, q: Array, v: Array, ref: Array, t: float,
        element: Any, share: Array, offset: Array, length: Array, damping: Array, node_mass: Array, node_moment: Array,
        gravity: Array, sign: Array, foot_place: Array, foot_velocity: Array, foot_acceleration: Array,
        foot_rotation: Array, foot_spin: Array, foot_spin_rate: Array, foot_jacobian: Array,
        com_place: Array, com_velocity: Array, com_jacobian: Array, area: Array, exposed_velocity: Array,
        exposed_jacobian: Array, out: Array, seen: Array, drag: Array, body: Array,
    ) -> None:  # fmt: skip
        """As ``kernel.forces``."""
        out[:] = 0.0
        seen[:] = 0.0
        head = len(sign)
        total = q + ref
        pelvis, speed = total[:3], v[:3]
        nodes = total[head:].reshape(2, -1, kernel.NODE)
        rates = v[head:].reshape(2, -1, kernel.NODE)
        wrench = np.zeros_like(nodes)  # force (3) and the quaternion's generalised force (4) of every node
        spins = _spin(nodes[..., 3:], rates[..., 3:])
        for ski in range(2):
            frame, turning = foot_rotation[ski], foot_spin[ski]
            place, velocity = pelvis + foot_place[ski], speed + foot_velocity[ski]
            on_pelvis = self._contact(
                seen[ski], nodes[ski], rates[ski], spins[ski], wrench[ski], frame, turning, place, velocity,
                element, share, offset, length,
            )  # fmt: skip
            _damp(seen[ski], nodes[ski, :, 3:], spins[ski], wrench[ski], damping)
            inertia = _inertia(
                nodes[ski], rates[ski], wrench[ski], frame, frame.T @ foot_spin[ski], frame.T @ foot_spin_rate[ski],
                frame.T @ (gravity - foot_acceleration[ski]), node_mass, node_moment,
            )  # fmt: skip
            out[:3] += frame @ (on_pelvis + inertia)
            along, across, edge = self.foot_axes(parameters, place, frame)
            v_t, v_n = float(velocity @ along), float(velocity @ across)
            f_t, f_n = self._laws.foot(
                seen[ski, kernel.LOAD], v_t, v_n, edge, seen[ski, kernel.GROOVE], t, place[0], place[1],
                1.0 - 2.0 * ski,
            )  # fmt: skip
            _add_to_tree(out, sign, f_t * along + f_n * across, foot_jacobian[ski])
            seen[ski, kernel.ALONG : kernel.V_N + 1] = f_t, f_n, edge, v_t, v_n
            seen[ski, kernel.FRICTION_POWER] = f_t * v_t + f_n * v_n
        out[head:] = wrench.ravel()
        moving = speed + exposed_velocity
        drag[:, :3] = self._laws.segments(t, pelvis[0], pelvis[1], moving, area)
        drag[:, 3] = np.sum(drag[:, :3] * moving, axis=1)
        for k in range(len(area)):
            _add_to_tree(out, sign, drag[k, :3], exposed_jacobian[k])
        place, velocity = pelvis + com_place, speed + com_velocity
        body[:] = self._laws.body(t, place[0], place[1], velocity)
        _add_to_tree(out, sign, body, com_jacobian)

    def _contact(
        self, seen: Array, nodes: Array, rates: Array, spins: Array, wrench: Array, frame: Array, turning: Array,
        place: Array, velocity: Array, element: Any, share: Array, offset: Array, length: Array,
    ) -> Array:  # fmt: skip
        """Add the snow's forces on one ski's nodes; their sum (3,) in the foot's frame."""
        first, second, xi = nodes[element], nodes[element + 1], share[:, None]
        p, r = _between(first, second, share)
        moving = (1.0 - xi) * rates[element, :3] + xi * rates[element + 1, :3]
        omega = (1.0 - xi) * spins[element] + xi * spins[element + 1]
        arm = _turned(r[:, None, :], offset)
        out = (p[:, None, :] + arm) @ frame.T
        point = place + out
        height, normal = self.ground(point[..., 0], point[..., 1])
        depth = (height - point[..., 2]) * normal[..., 2]
        pressed = depth > 0.0
        if not np.any(pressed):
            return np.zeros(3)
        local = moving[:, None, :] + np.cross(omega[:, None, :], arm)
        pace = velocity + np.cross(turning, out) + local @ frame.T
        rate = -np.sum(pace * normal, axis=-1)
        long = np.broadcast_to(length[:, None], depth.shape)
        push = np.zeros_like(depth)
        push[pressed] = self._laws.point(depth[pressed], rate[pressed], long[pressed])
        seen[kernel.LOAD] = push.sum()
        seen[kernel.GROOVE] = np.sum(depth[pressed] * long[pressed])
        seen[kernel.DEPTH] = depth.max()
        seen[kernel.CONTACT_POWER] = -np.sum(push[pressed] * rate[pressed])
        pushed = push[..., None] * (normal @ frame)
        force, torque = pushed.sum(axis=1), np.cross(arm, pushed).sum(axis=1)
        for at, node, part in ((element, first, 1.0 - xi), (element + 1, second, xi)):
            np.add.at(wrench, at, part * np.hstack([force, _on_quaternion(node[:, 3:], torque)]))
        return np.asarray(force.sum(axis=0))


def _damp(seen: Array, turns: Array, spins: Array, wrench: Array, damping: Array) -> None:
    """Add the structural damping of one ski's elements against relative spin about their own axes."""
    middle = turns[:-1] + turns[1:]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    back = middle * [1.0, -1.0, -1.0, -1.0]
    local = _turned(back, spins[1:] - spins[:-1])
    torque = damping * local
    seen[kernel.DAMPING_POWER] = -np.sum(local * torque)
    torque = _turned(middle, torque)
    wrench[:-1, 3:] += _on_quaternion(turns[:-1], torque)
    wrench[1:, 3:] -= _on_quaternion(turns[1:], torque)


def _inertia(
    nodes: Array, rates: Array, wrench: Array, frame: Array, spin_in: Array, spin_rate: Array, fall: Array,
    mass: Array, moment: Array,
) -> Array:  # fmt: skip
    """Add weight and forces of inertia of one ski's nodes; their sum (3,) in the foot's frame."""
    swing = np.cross(spin_in, np.cross(spin_in, nodes[:, :3]) + 2.0 * rates[:, :3])
    force = mass[:, None] * (fall - np.cross(spin_rate, nodes[:, :3]) - swing)
    torque = -moment * spin_rate - np.cross(spin_in, moment * spin_in)
    wrench[:, :3] += force
    wrench[:, 3:] += _on_quaternion(nodes[:, 3:], torque)
    return np.asarray(force.sum(axis=0))


def _add_to_tree(out: Array, sign: Array, force: Array, jacobian: Array) -> None:
    """As ``kernel.add_to_tree``."""
    out[:3] += force
    count = len(sign) - 3
    if count:
        out[3 : len(sign)] += sign[3:] * (force @ jacobian[:, :count])


def _turned(q: Array, v: Array) -> Array:
    """Vectors (…, 3) turned by quaternions (…, 4)."""
    u = q[..., 1:]
    once = np.cross(u, v)
    return np.asarray(v + 2.0 * (q[..., :1] * once + np.cross(u, once)))


def _spin(q: Array, rate: Array) -> Array:
    """(…, 3) 2 E(q) q̇."""
    scalar, vector = q[..., :1], q[..., 1:]
    return np.asarray(2.0 * (scalar * rate[..., 1:] - rate[..., :1] * vector + np.cross(vector, rate[..., 1:])))


def _on_quaternion(q: Array, torque: Array) -> Array:
    """(…, 4) 2 E(q)ᵀ τ."""
    scalar, vector = q[..., :1], q[..., 1:]
    first = -np.sum(vector * torque, axis=-1, keepdims=True)
    return np.asarray(2.0 * np.concatenate([first, scalar * torque - np.cross(vector, torque)], axis=-1))


def _product(a: Array, b: Array) -> Array:
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def _between(first: Array, second: Array, share: Array) -> tuple[Array, Array]:
    """Places (m, 3) and quaternions (m, 4) at shares (m,) of the screw motions from one node (m, 7) to the other."""
    p0, q0, p1, q1 = first[:, :3], first[:, 3:], second[:, :3], second[:, 3:]
    back = q0 * [1.0, -1.0, -1.0, -1.0]
    relative = _product(back, q1)
    apart = p1 - p0
    sine = np.linalg.norm(relative[:, 1:], axis=1)
    theta = 2.0 * np.arctan2(sine, relative[:, 0])
    straight = theta < _TINY
    safe_sine, safe = np.where(straight, 1.0, sine), np.where(straight, 1.0, theta)
    axis = relative[:, 1:] / safe_sine[:, None]
    half = 0.5 * safe
    d = _turned(back, apart)
    once = np.cross(axis, d)
    rho = d - half[:, None] * once + (1.0 - half / np.tan(half))[:, None] * np.cross(axis, once)
    part = share * safe
    once = np.cross(axis, rho)
    bow = ((1.0 - np.cos(part)) / safe)[:, None] * once
    bow += ((part - np.sin(part)) / safe)[:, None] * np.cross(axis, once)
    xi = share[:, None]
    screw = p0 + _turned(q0, xi * rho + bow)
    turn = np.concatenate([np.cos(0.5 * part)[:, None], np.sin(0.5 * part)[:, None] * axis], axis=1)
    bent = ~straight[:, None]
    place = np.where(bent, screw, p0 + xi * apart)
    return place, np.where(bent, _product(q0, turn), (1.0 - xi) * q0 + xi * q1)
