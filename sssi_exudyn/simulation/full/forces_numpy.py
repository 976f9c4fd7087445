"""The force pass of ``kernel`` once more, over whole arrays: all sections of both skis at once, the laws over any
``Math``.

Two back ends share it: ``numpy`` gives the laws NumPy's arithmetic, ``symbolic`` Exudyn's, recorded once and then
evaluated without the interpreter.  Neither needs a compiler.  Formulas and names are those of ``kernel``.

Arrays have the axes ski (2), component (3, or 4 of a quaternion), and node, element, section or point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np

from sssi_exudyn.contact import term as places
from sssi_exudyn.contact.codegen.law_parameters import LawParameters
from sssi_exudyn.contact.maths import ArrayMath, Vector, dot, plus, times
from sssi_exudyn.contact.term import Term
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.full import forces_kernel as kernel
from sssi_exudyn.simulation.ski_on_snow.point import (
    penetration,
    point_velocity,
    point_wrench,
    sinking_rate,
    ski_axes,
    snow_normal,
)
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier, ForcePass, Instant, Sections, SnowGrid
from sssi_exudyn.terrain.surface import on_change, patch_under

_on_change: Final = getattr(on_change, "py_func", on_change)
"""Over arrays, which would be compiled again, and for each of their shapes."""
_MATH: Final = ArrayMath()
_TINY: Final = 1e-7
"""rad; neighbours turned by less against each other are taken for parallel, as in ``vectors.between``."""
_CONJUGATE: Final = np.array([[1.0], [-1.0], [-1.0], [-1.0]])
_SIDES: Final = np.array([1.0, -1.0])


class Laws(Protocol):
    """The force laws of a model, each over arrays of one shape or over numbers."""

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        """Return the normal forces (m,) N of points in the snow."""

    def foot(self, *state: Array) -> tuple[Array, Array]:
        """Return friction along and across (N), each (2,); arguments (2,) as ``FootState`` has them."""

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array, facing: Array) -> Array:  # noqa: E741
        """Return the force (k, 3) N on segments of velocity (k, 3), area (k,) and facing (k, 3, 3)."""

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        """Return the force (3,) N on the centre of mass."""

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        """Return the height (m) and slopes at places, each of the places' shape."""


class ArrayLaws:
    """The terms as they are written, over NumPy's arrays."""

    def __init__(self, terms: Sequence[Term]) -> None:
        self._terms = terms
        self._math = ArrayMath()

    def point(self, depth: Array, rate: Array, length: Array) -> Array:
        return np.asarray(places.point_force(self._math, self._terms, places.PointState(depth, rate, length)))

    def foot(self, *state: Array) -> tuple[Array, Array]:
        friction = _columns(places.foot_force(self._math, self._terms, places.FootState(*state)), (2, 2))
        return friction[:, 0], friction[:, 1]

    def segments(self, t: float, f: float, l: float, velocity: Array, area: Array, facing: Array) -> Array:  # noqa: E741
        wind_f, wind_l, wind_n = places.air_velocity(self._math, self._terms, places.PlaceState(t, f, l))
        v_f, v_l, v_n = velocity.T
        state = places.SegmentState((v_f, v_l, v_n), (wind_f, wind_l, wind_n), area, six_of(facing))
        return _columns(places.segment_force(self._math, self._terms, state), velocity.shape)

    def body(self, t: float, f: float, l: float, velocity: Array) -> Array:  # noqa: E741
        state = places.BodyState(np.float64(t), f, l, tuple(velocity))
        return np.array([float(part) for part in places.body_force(self._math, self._terms, state)])

    def terrain(self, f: Array, l: Array) -> tuple[Array, Array, Array]:  # noqa: E741
        height_and_slopes = _columns(places.terrain_height(self._math, self._terms, f, l), (*f.shape, 3))
        return height_and_slopes[..., 0], height_and_slopes[..., 1], height_and_slopes[..., 2]


def six_of(facing: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Return the six numbers of symmetric matrices (…, 3, 3), as ``SegmentState`` has them."""
    rows, columns = np.triu_indices(3)
    ff, fl, fn, ll, ln, nn = np.moveaxis(facing[..., rows, columns], -1, 0)
    return ff, fl, fn, ll, ln, nn


def _columns(parts: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Put arrays and numbers, as a law gives them, on an array's last axis."""
    columns = np.empty(shape)
    for k, part in enumerate(parts):
        columns[..., k] = part
    return columns


@dataclass(frozen=True)
class Feet:
    """Place (m), velocity (m/s) and spin (rad/s) of both feet, each (2, 3), and rotation (2, 3, 3), on the slope."""

    place: Array
    velocity: Array
    rotation: Array
    spin: Array


class ArrayKernel:
    """The functions that ``backend.Forces`` calls of a kernel, for some laws.

    jacobian : ``kernel.jacobian`` for the same terms
    """

    def __init__(self, laws: Laws, jacobian: Any) -> None:
        self._laws = laws
        self.jacobian = jacobian

    def foot_axes(
        self, _parameters: LawParameters, surface: SnowGrid, place: Array, rotation: Array
    ) -> tuple[Array, Array, float]:
        """Return what ``kernel.foot_axes`` does."""
        under = np.array(patch_under(surface, place[0], place[1]))
        _, normal = self._ground(under, np.asarray(place[0]), np.asarray(place[1]))
        along, across, edge = ski_axes(_MATH, normal, rotation)
        return np.array(along), np.array(across), float(edge)

    def forces(
        self, _parameters: LawParameters, q: Array, v: Array, ref: Array, sections: Sections, carrier: Carrier,
        at: Instant, filled: ForcePass,
    ) -> None:  # fmt: skip
        """Fill what ``kernel.forces`` does."""
        out, seen, drag, body = filled
        sign = carrier.sign
        out[:] = 0.0
        seen[:] = 0.0
        head = len(sign)
        total = q + ref
        pelvis, speed = total[:3], v[:3]
        nodes = np.ascontiguousarray(total[head:].reshape(2, -1, kernel.NODE).swapaxes(1, 2))
        rates = np.ascontiguousarray(v[head:].reshape(2, -1, kernel.NODE).swapaxes(1, 2))
        spins = _spin(nodes[:, 3:], rates[:, 3:])
        force, torque = _inertia(
            nodes, rates, at.foot_rotation.swapaxes(1, 2), at.foot_spin, at.foot_spin_rate,
            carrier.gravity - at.foot_acceleration, sections.node_mass, sections.node_moment.T,
        )  # fmt: skip
        _damp(seen, nodes[:, 3:], spins, torque, sections.damping.T)
        feet = Feet(pelvis + at.foot_place, speed + at.foot_velocity, at.foot_rotation, at.foot_spin)
        under = np.array([patch_under(sections.surface, *place[:2]) for place in feet.place]).T[:, :, None]
        self._contact(seen, nodes, rates[:, :3], spins, force, torque, feet, under, sections)
        still = ref[head + kernel.NODE * sections.rising :][:3]
        friction = self._friction(seen, at.time, _risen(feet, nodes, rates, sections, still), under[:, :, 0])
        if sections.rising >= 0:
            pushed = (feet.rotation.swapaxes(1, 2) @ friction[:, :, None])[:, :, 0]
            _push_boot(force, torque, pushed, sections.rising, still)
        wrench = np.concatenate([force, _on_quaternion(nodes[:, 3:], torque)], axis=1)
        out[head:] = wrench.swapaxes(1, 2).ravel()
        out[:3] = (at.foot_rotation @ force.sum(axis=2, keepdims=True)).sum(axis=0)[:, 0]
        if sections.rising < 0:
            _add_to_tree(out, sign, friction, at.foot_jacobian)
        moving = speed + at.exposed_velocity
        drag[:, :3] = self._laws.segments(at.time, pelvis[0], pelvis[1], moving, carrier.area, at.exposed_facing)
        drag[:, 3] = np.sum(drag[:, :3] * moving, axis=1)
        _add_to_tree(out, sign, drag[:, :3], at.exposed_jacobian)
        place, velocity = pelvis + at.com_place, speed + at.com_velocity
        body[:] = self._laws.body(at.time, place[0], place[1], velocity)
        _add_to_tree(out, sign, body[None], at.com_jacobian[None])

    def _contact(
        self, seen: Array, nodes: Array, paces: Array, spins: Array, force: Array, torque: Array, feet: Feet,
        under: Array, sections: Sections,
    ) -> None:  # fmt: skip
        """Add the snow's forces and torques (2, 3, n) on the nodes.  A section's two edges stand side by side.

        under : (8, 2, 1) the surface's patches under the skis
        """
        element, share = sections.element, sections.share
        weights = np.zeros((len(share), nodes.shape[2]))
        rows = np.arange(len(share))
        weights[rows, element], weights[rows, element + 1] = 1.0 - share, share
        weights = np.repeat(weights, 2, axis=0)
        p, r = _between(nodes[:, :, element], nodes[:, :, element + 1], share)
        arm = _rotate(np.repeat(r, 2, axis=2), sections.offset.reshape(1, -1, 3).swapaxes(1, 2))
        reach = feet.rotation @ (np.repeat(p, 2, axis=2) + arm)
        point = feet.place[:, :, None] + reach
        height, normal = self._ground(under, point[:, 0], point[:, 1])
        depth = penetration(_MATH, height - point[:, 2], normal)
        pressed = depth > 0.0
        if not np.any(pressed):
            return
        local = paces @ weights.T + _cross(spins @ weights.T, arm)
        velocity, spin = feet.velocity.T[:, :, None], feet.spin.T[:, :, None]
        bending = (feet.rotation @ local).swapaxes(0, 1)
        rate = sinking_rate(_MATH, point_velocity(_MATH, velocity, spin, reach.swapaxes(0, 1), bending), normal)
        long = np.repeat(sections.length, 2)
        push = np.zeros_like(depth)
        push[pressed] = self._laws.point(depth[pressed], rate[pressed], np.broadcast_to(long, depth.shape)[pressed])
        sunk = np.maximum(depth, 0.0)
        seen[:, kernel.LOAD] = push.sum(axis=1)
        seen[:, kernel.GROOVE] = sunk @ long
        seen[:, kernel.DEPTH] = sunk.max(axis=1)
        seen[:, kernel.CONTACT_POWER] = -np.sum(push * rate, axis=1)
        inwards = feet.rotation.swapaxes(1, 2) @ np.stack(normal, axis=1)
        pushed, turning = point_wrench(_MATH, push, inwards.swapaxes(0, 1), arm.swapaxes(0, 1))
        force += np.stack(pushed, axis=1) @ weights
        torque += np.stack(turning, axis=1) @ weights

    def _friction(self, seen: Array, t: float, feet: Feet, under: Array) -> Array:
        """Return the friction (2, 3) N on the feet, over patches (8, 2)."""
        f, l = feet.place[:, 0], feet.place[:, 1]  # noqa: E741
        _, normal = self._ground(under, f, l)
        along, across, edge = ski_axes(_MATH, normal, np.moveaxis(feet.rotation, 0, -1))
        speed = (feet.velocity[:, 0], feet.velocity[:, 1], feet.velocity[:, 2])
        v_t, v_n = dot(speed, along), dot(speed, across)
        load, groove = seen[:, kernel.LOAD], seen[:, kernel.GROOVE]
        f_t, f_n = self._laws.foot(load, v_t, v_n, edge, groove, np.full(2, t), f, l, _SIDES)
        seen[:, kernel.ALONG : kernel.V_N + 1] = np.stack([f_t, f_n, edge, v_t, v_n], axis=1)
        seen[:, kernel.FRICTION_POWER] = f_t * v_t + f_n * v_n
        return np.stack(plus(times(f_t, along), times(f_n, across)), axis=1)

    def _ground(self, under: Array, f: Array, l: Array) -> tuple[Array, Vector]:  # noqa: E741
        """Return the height and the components of the unit normal of the snow at places, each of the places' shape.

        under : (8, …) patches near the places
        """
        on_surface = _on_change(under[2:], f - under[0], l - under[1])
        height, by_f, by_l = (a + b for a, b in zip(self._laws.terrain(f, l), on_surface, strict=True))
        return height, snow_normal(_MATH, by_f, by_l)


def _risen(feet: Feet, nodes: Array, rates: Array, sections: Sections, still: Array) -> Feet:
    """Return feet with the velocities of their boots, which may rise against them from where they are ``still`` (3,)
    m; places stay.
    """
    if sections.rising < 0:
        return feet
    height = nodes[:, 2, sections.rising, None] - still[2]
    arm = height * feet.rotation[:, :, 2]
    bending = (feet.rotation @ rates[:, :3, sections.rising, None])[:, :, 0]
    return replace(feet, velocity=feet.velocity + np.cross(feet.spin, arm) + bending)


def _push_boot(force: Array, torque: Array, pushed: Array, node: int, still: Array) -> None:
    """Add the force ``pushed`` (2, 3) N on the boots, in the feet's frames, to their nodes, which at rest are at
    ``still`` (3,) m.  About the feet's places it has no moment but for the boots' rise.
    """
    force[:, :, node] += pushed
    torque[:, :, node] += np.cross(pushed, still)


def _inertia(
    nodes: Array, rates: Array, back: Array, spin: Array, spin_rate: Array, fall: Array, mass: Array, moment: Array
) -> tuple[Array, Array]:
    """Return weight and forces of inertia of the skis' nodes: force and torque, each (2, 3, n), in the feet's frames.

    back : (2, 3, 3) turns into the feet's frames;  fall : (2, 3) gravity less the feet's acceleration
    """
    spin, spin_rate, fall = (back @ vector[:, :, None] for vector in (spin, spin_rate, fall))
    turning = _skew(spin[:, :, 0])
    felt = fall - (_skew(spin_rate[:, :, 0]) + turning @ turning) @ nodes[:, :3] - 2.0 * turning @ rates[:, :3]
    return mass * felt, -moment * spin_rate - turning @ (moment * spin)


def _damp(seen: Array, turns: Array, spins: Array, torque: Array, damping: Array) -> None:
    """Add the structural damping (3, n − 1) of the elements against relative spin about their own axes."""
    middle = turns[:, :, :-1] + turns[:, :, 1:]
    middle /= np.sqrt(np.sum(middle * middle, axis=1, keepdims=True))
    local = _rotate(_conjugate(middle), spins[:, :, 1:] - spins[:, :, :-1])
    resisting = damping * local
    seen[:, kernel.DAMPING_POWER] = -np.sum(local * resisting, axis=(1, 2))
    resisting = _rotate(middle, resisting)
    torque[:, :, :-1] += resisting
    torque[:, :, 1:] -= resisting


def _add_to_tree(out: Array, sign: Array, force: Array, jacobian: Array) -> None:
    """Add forces (k, 3) on points whose velocities are the pelvis' plus jacobian (k, 3, 28) times the angles' rates."""
    out[:3] += force.sum(axis=0)
    count = len(sign) - 3
    if count:
        out[3 : len(sign)] += sign[3:] * (force.ravel() @ jacobian[:, :, :count].reshape(-1, count))


def _skew(a: Array) -> Array:
    """Return matrices (k, 3, 3) that take the cross product from the left with vectors (k, 3)."""
    matrix = np.zeros((len(a), 3, 3))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        matrix[:, k, j], matrix[:, j, k] = a[:, i], -a[:, i]
    return matrix


def _cross(a: Array, b: Array) -> Array:
    """Return cross products (2, 3, k) of as many a and of b that broadcast to them; NumPy's own takes three times as
    long.
    """
    product: Array = np.empty_like(a)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        np.subtract(a[:, j] * b[:, k], a[:, k] * b[:, j], out=product[:, i])
    return product


def _conjugate(q: Array) -> Array:
    return np.asarray(q * _CONJUGATE)


def _rotate(q: Array, v: Array) -> Array:
    """Turn vectors (2, 3, k) by quaternions (2, 4, k)."""
    once = 2.0 * _cross(q[:, 1:], v)
    return np.asarray(v + q[:, :1] * once + _cross(q[:, 1:], once))


def _spin(q: Array, rate: Array) -> Array:
    """Return the spin (2, 3, k) 2 E(q) q̇."""
    swept = q[:, :1] * rate[:, 1:] - rate[:, :1] * q[:, 1:] + _cross(q[:, 1:], rate[:, 1:])
    return np.asarray(2.0 * swept)


def _on_quaternion(q: Array, torque: Array) -> Array:
    """Return the generalised force (2, 4, k) 2 E(q)ᵀ τ."""
    scalar = -np.sum(q[:, 1:] * torque, axis=1, keepdims=True)
    return np.asarray(2.0 * np.concatenate([scalar, q[:, :1] * torque - _cross(q[:, 1:], torque)], axis=1))


def _product(a: Array, b: Array) -> Array:
    scalar = a[:, :1] * b[:, :1] - np.sum(a[:, 1:] * b[:, 1:], axis=1, keepdims=True)
    vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + _cross(a[:, 1:], b[:, 1:])
    return np.concatenate([scalar, vector], axis=1)


def _between(first: Array, second: Array, share: Array) -> tuple[Array, Array]:
    """Return places (2, 3, m) and quaternions (2, 4, m) at shares (m,) of the screw motions from nodes (2, 7, m) to
    others.
    """
    q0 = first[:, 3:]
    apart = second[:, :3] - first[:, :3]
    back = _conjugate(q0)
    relative = _product(back, second[:, 3:])
    sine = np.sqrt(np.sum(relative[:, 1:] ** 2, axis=1, keepdims=True))
    theta = 2.0 * np.arctan2(sine, relative[:, :1])
    straight = theta < _TINY
    theta = np.where(straight, 1.0, theta)
    axis = relative[:, 1:] / np.where(straight, 1.0, sine)
    half, part = 0.5 * theta, share * theta
    d = _rotate(back, apart)
    once = _cross(axis, d)
    rho = d - half * once + (1.0 - half / np.tan(half)) * _cross(axis, once)
    once = _cross(axis, rho)
    bow = (1.0 - np.cos(part)) / theta * once + (part - np.sin(part)) / theta * _cross(axis, once)
    turn = np.concatenate([np.cos(0.5 * part), np.sin(0.5 * part) * axis], axis=1)
    move = np.where(straight, share * apart, _rotate(q0, share * rho + bow))
    mean = (1.0 - share) * q0 + share * second[:, 3:]
    return first[:, :3] + move, np.where(straight, mean, _product(q0, turn))
