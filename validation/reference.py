"""A second, flat form of the whole model in one file: the paper's equations in order, in plain NumPy.

It is here to be read, and to be compared with the assembled model.  It shares data with that model (the recorded
posture, masses, the mesh's numbers, the terms' parameters) and no mechanics.  A ski is a shallow Euler-Bernoulli beam
with twist, held at the boot centre.  It has its own finite elements, of which the slowest vibrations are kept; the
steps are explicit.

Every point of a ski, of mass or of contact, is at

    p = x + b + R (X + U q)            x pelvis, b and R place and rotation of the foot, X place on the unloaded ski,
                                       U shapes of the vibrations, q their amplitudes

and the rest is Newton's law for these points (paper 2.2):

1   Posture is prescribed: b, R, the centre of mass and the segments' velocities relative to the pelvis are given.
2   Skis bend and twist: q̈ + 2ζω q̇ + ω² q = Uᵀ Rᵀ (forces − what it takes to carry the masses along).
3   The snow pushes on each edge point: F = k δ^m1 + c sign(δ̇)|δ̇|^m2 δ^m3, never below zero, along its normal.
4   Friction acts on the foot: μ_t ΣF along the ski, μ_n ΣF across it, each against its own smoothed sign.
5   The air drags on each segment: ½ C_D ρ A |v| v.
6   The pelvis' three translations follow: m ẍ = Σ forces − what the posture's own accelerations take.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import POINT_LENGTH, HuntCrossley
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.assembly import Parts, correct_motion

MODES = 8
"""Number of vibrations of each ski that are kept, bending and twisting together: the eighth is above 100 Hz."""
STEP = 1e-3
"""s; the eighth vibration turns by a radian in it.  More vibrations, or stiffer skis, need shorter steps."""


@dataclass(frozen=True)
class FlatSki:
    """A ski's k slowest vibrations, held at the boot centre, each of modal mass 1 kg; places in the foot's frame.

    omega, damping : (k,) rad/s, share of critical
    mass, place, shape : (n,) kg, (n, 3) m, (n, 3, k) of its lumped masses
    twist, turning_mass : (n, k) rotation about the ski's long axis, (n,) kg m²
    edge_place, edge_shape, edge_length : (p, 3) m, (p, 3, k), (p,) m of its contact points, those of both edges
    """

    omega: Array
    damping: Array
    mass: Array
    place: Array
    shape: Array
    twist: Array
    turning_mass: Array
    edge_place: Array
    edge_shape: Array
    edge_length: Array


def flat_ski(parts: Parts, modes: int = MODES) -> FlatSki:
    """Compute bend and twist of the model's ski, from its mesh's masses and stiffnesses."""
    mesh, ski = parts.mesh, parts.model.ski
    x, raised = mesh.node_position[:, 0], mesh.node_position[:, 2]
    n, held = len(x), int(np.argmin(np.abs(x)))
    bend, twist = np.zeros((2 * n, 2 * n)), np.zeros((n, n))
    for e, (length, ei, gj) in enumerate(
        zip(mesh.element_length, mesh.stiffness[:, 4], mesh.stiffness[:, 3], strict=True)
    ):
        a, b = 6.0 * length, length * length  # Hermite's cubics in (w, w')
        rows = [[12.0, a, -12.0, a], [a, 4 * b, -a, 2 * b], [-12.0, -a, 12.0, -a], [a, 2 * b, -a, 4 * b]]
        bend[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += ei / length**3 * np.array(rows)
        twist[e : e + 2, e : e + 2] += gj / length * np.array([[1.0, -1.0], [-1.0, 1.0]])

    def at_nodes(of_elements: Array) -> Array:
        """Put half of each element's share at each of its ends."""
        both: Array = 0.5 * (np.append(of_elements, 0.0) + np.append(0.0, of_elements))
        return both

    def from_boot(slope: Array) -> Array:
        """Integrate ∫ slope dx from the held node on."""
        integral = np.append(0.0, np.cumsum(0.5 * np.diff(x) * (slope[1:] + slope[:-1])))
        return np.asarray(integral - integral[held], dtype=np.float64)

    mass = at_nodes(mesh.element_mass)
    rotation_about_x, about_y = (at_nodes(mesh.section_inertia[:, axis] * mesh.element_length) for axis in range(2))
    rising = np.gradient(raised, x)
    inertia_w, inertia_t = np.empty(2 * n), np.diag(rotation_about_x)
    inertia_w[0::2], inertia_w[1::2] = mass, about_y
    aside = np.apply_along_axis(from_boot, 0, np.diag(-rising))  # where the ski rises, twist moves it sideways
    inertia_t += aside.T @ (mass[:, None] * aside)
    free_w, free_t = np.delete(np.arange(2 * n), [2 * held, 2 * held + 1]), np.delete(np.arange(n), held)
    square_w, shape_w = eigh(bend[np.ix_(free_w, free_w)], np.diag(inertia_w[free_w]))
    square_t, shape_t = eigh(twist[np.ix_(free_t, free_t)], inertia_t[np.ix_(free_t, free_t)])
    slowest = sorted([(v, 0, i) for i, v in enumerate(square_w)] + [(v, 1, i) for i, v in enumerate(square_t)])[:modes]
    shape, turn = np.zeros((n, 3, modes)), np.zeros((n, modes))
    for k, (_, kind, i) in enumerate(slowest):
        nodal = np.zeros((n, 2))
        if kind == 0:
            nodal.reshape(-1)[free_w] = shape_w[:, i]
            shape[:, 0, k], shape[:, 2, k] = from_boot(-rising * nodal[:, 1]), nodal[:, 0]
        else:
            turn[free_t, k] = shape_t[:, i]
            shape[:, 1, k] = aside @ turn[:, k]
    omega = np.sqrt([v for v, _, _ in slowest])

    s = np.tile(mesh.contact_s, 2)
    at, half = ski.x_of_s(s), 0.5 * ski.width(s) * np.repeat([1.0, -1.0], len(mesh.contact_s))

    def at_edges(of_nodes: Array) -> Array:
        flat = of_nodes.reshape(n, -1)
        return np.stack([np.interp(at, x, column) for column in flat.T], axis=1).reshape(len(at), *of_nodes.shape[1:])

    edge_shape = at_edges(shape)
    edge_shape[:, 2] += half[:, None] * at_edges(turn)
    return FlatSki(
        omega=omega,
        damping=ski.damping_ratio * omega / np.mean(omega[:2]),
        mass=mass,
        place=mesh.node_position + parts.ski_in_foot,
        shape=shape,
        twist=turn,
        turning_mass=rotation_about_x,
        edge_place=np.stack([at, half, ski.height(s)], axis=1) + parts.ski_in_foot,
        edge_shape=edge_shape,
        edge_length=np.tile(mesh.contact_length, 2),
    )


def _turning(spin: Array) -> Array:
    """Return the matrix (3, 3) by which rows of vectors r are multiplied to ω × r."""
    x, y, z = spin
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


class FlatModel:
    """The right-hand side of the equations of motion for the state (x (3), q (2, k)) and its rates.

    Raises ValueError for a model with other terms than the paper's three.
    """

    def __init__(self, model: Model, motion: Motion, modes: int = MODES) -> None:
        names = sorted(term.name for term in model.terms)
        snow, friction, air = (model.term(name) for name in ("penetration", "friction", "air"))
        if len(names) != 3:
            raise ValueError(f"only the paper's terms are here, not {', '.join(names)}")
        assert isinstance(snow, HuntCrossley)
        assert isinstance(friction, AnisotropicFriction)
        assert isinstance(air, AirDrag)
        self.snow, self.friction, self.air = snow, friction, air
        self.parts = Parts(model, correct_motion(model, motion))
        self.ski = flat_ski(self.parts, modes)
        self.area = np.array(list(self.parts.areas.values()))
        self.gravity = GRAVITY * np.array([np.sin(model.inclination), 0.0, -np.cos(model.inclination)])

    def posture(self, time: Array) -> list[Any]:
        """Do step 1: return the posture at each of ``time`` (n,), as ``Posture`` names it."""
        table = self.parts.posture(time)
        return [SimpleNamespace(**{f.name: getattr(table, f.name)[i] for f in fields(table)}) for i in range(len(time))]

    def snow_on(self, at: Any, side: int, x: Array, v: Array, q: Array, rate: Array) -> tuple[float, Array, Array]:
        """Do step 3: return a ski's load (N), the snow's force on it (3,) and on its vibrations (k,)."""
        ski, snow, frame = self.ski, self.snow, at.foot_rotation[side]
        arm = (ski.edge_place + ski.edge_shape @ q) @ frame.T
        place = x + at.foot_place[side] + arm
        moving = v + at.foot_velocity[side] + arm @ _turning(at.foot_spin[side]) + (ski.edge_shape @ rate) @ frame.T
        depth, sinking = np.maximum(-place[:, 2], 0.0), -moving[:, 2]
        press = snow.k * depth**snow.m1 + snow.c * np.sign(sinking) * np.abs(sinking) ** snow.m2 * depth**snow.m3
        press = np.maximum(press, 0.0) * ski.edge_length / POINT_LENGTH
        force = press[:, None] * np.array([0.0, 0.0, 1.0])
        return float(press.sum()), force.sum(axis=0), np.einsum("pi,pik->k", force @ frame, ski.edge_shape)

    def friction_on(self, at: Any, side: int, v: Array, load: float) -> Array:
        """Do step 4: return the friction (3,) N on a foot, along its axes in the snow's plane."""
        forward = at.foot_rotation[side][:, 0] * [1.0, 1.0, 0.0]
        along = forward / np.linalg.norm(forward)
        across = np.array([-along[1], along[0], 0.0])
        moving, law = v + at.foot_velocity[side], self.friction
        v_t, v_n = moving @ along, moving @ across
        onset, p = np.hypot(law.eps, law.slip * v_t), law.sharpness
        force_t = -law.mu_t * load * v_t / np.hypot(v_t, law.eps)
        force_n = -law.mu_n * load * v_n / (abs(v_n) ** p + onset**p) ** (1.0 / p)
        return np.asarray(force_t * along + force_n * across)

    def drag(self, at: Any, v: Array) -> Array:
        """Do step 5: return the drag (3,) N on all segments together."""
        moving = v + at.exposed_velocity
        pace = np.linalg.norm(moving, axis=1)
        return np.asarray(-0.5 * self.air.c_d * self.air.rho * (self.area * pace) @ moving)

    def inertia_of(self, at: Any, side: int, q: Array, rate: Array) -> tuple[Array, Array]:
        """Return weight and forces of inertia on a ski's masses (n, 3) and about its long axis (n,).

        Those of ẍ and q̈ are not included.
        """
        ski, frame, spin = self.ski, at.foot_rotation[side], at.foot_spin[side]
        arm, going = (ski.place + ski.shape @ q) @ frame.T, (ski.shape @ rate) @ frame.T
        turning = _turning(spin)
        swing = arm @ _turning(at.foot_spin_rate[side]) + (arm @ turning + 2.0 * going) @ turning
        push = ski.mass[:, None] * (self.gravity - at.foot_acceleration[side] - swing)
        return push, -ski.turning_mass * (frame[:, 0] @ at.foot_spin_rate[side])

    def pushes(self, at: Any, x: Array, v: Array, q: Array, rate: Array) -> tuple[Array, Array, Array, Array]:
        """Return loads (2,) N, friction (2, 3) N, and forces on skis and segments (3,) N and on vibrations (2, k)."""
        loads, rubs, general = np.zeros(2), np.zeros((2, 3)), np.zeros_like(q)
        total = self.drag(at, v)
        for side in range(2):
            loads[side], force, snow = self.snow_on(at, side, x, v, q[side], rate[side])
            rubs[side] = self.friction_on(at, side, v, loads[side])
            push, turn = self.inertia_of(at, side, q[side], rate[side])
            inner = np.einsum("ni,nik->k", push @ at.foot_rotation[side], self.ski.shape) + turn @ self.ski.twist
            total = total + force + rubs[side] + push.sum(axis=0)
            general[side] = snow + inner - 2.0 * self.ski.damping * self.ski.omega * rate[side]
            general[side] -= self.ski.omega**2 * q[side]  # step 2
        return loads, rubs, total, general

    def slope(self, at: Any, state: Array) -> Array:
        """Return the rate of the state (6 + 4k,): x, q of both skis, and their rates.

        It does step 6 with step 2: ẍ and q̈ are coupled through the skis' masses.
        """
        half = len(state) // 2
        modes = len(self.ski.omega)
        _, _, total, general = self.pushes(at, *self.split_state(state))
        mass = np.eye(half)
        mass[:3, :3] *= self.parts.mass
        for side in range(2):
            rows = slice(3 + side * modes, 3 + (side + 1) * modes)
            pull = at.foot_rotation[side] @ np.tensordot(self.ski.mass, self.ski.shape, 1)
            mass[:3, rows], mass[rows, :3] = pull, pull.T
        force = total + self.parts.body_mass * (self.gravity - at.com_acceleration)
        return np.concatenate([state[half:], np.linalg.solve(mass, np.concatenate([force, general.ravel()]))])

    @staticmethod
    def split_state(state: Array) -> tuple[Array, Array, Array, Array]:
        """Return x and v (3,), q and its rate (2, k) of a state."""
        place, rate = np.split(state, 2)
        return place[:3], rate[:3], place[3:].reshape(2, -1), rate[3:].reshape(2, -1)

    def rest(self, at: Any, x: Array) -> Array:
        """Return amplitudes (2, k) at which the skis rest under the snow, the pelvis held and nothing moving."""
        q, still = np.zeros((2, len(self.ski.omega))), np.zeros(3)
        stands = SimpleNamespace(**vars(at) | dict.fromkeys(("foot_velocity", "foot_spin"), np.zeros((2, 3))))
        for _ in range(400):
            for side in range(2):
                _, _, snow = self.snow_on(stands, side, x, still, q[side], np.zeros_like(q[side]))
                q[side] += 0.2 * (snow / self.ski.omega**2 - q[side])  # a fifth of the change: the snow stiffens
        return q


def simulate_flat(
    model: Model,
    motion: Motion,
    start: float,
    stop: float,
    pelvis: Array,
    velocity: Array,
    *,
    modes: int = MODES,
    step: float = STEP,
) -> dict[str, Array]:
    """Simulate from ``start`` to ``stop`` (s), skis at rest, pelvis at ``pelvis`` (3,) m with ``velocity`` (3,) m/s.

    Returns time (n,), pelvis (n, 3) m, foot_load (n, 2) N, friction (n, 2, 3) N.
    """
    flat = FlatModel(model, motion, modes)
    count = round((stop - start) / step)
    time = start + step * np.arange(count + 1, dtype=np.float64)
    at = flat.posture(start + 0.5 * step * np.arange(2 * count + 1, dtype=np.float64))
    state = np.concatenate([pelvis, flat.rest(at[0], pelvis).ravel(), velocity, np.zeros(2 * modes)])
    columns: dict[str, list[Array]] = {"pelvis": [], "foot_load": [], "friction": []}
    for i in range(count + 1):
        loads, rubs, _, _ = flat.pushes(at[2 * i], *flat.split_state(state))
        for name, value in (("pelvis", state[:3]), ("foot_load", loads), ("friction", rubs)):
            columns[name].append(value)
        if i < count:  # Runge and Kutta's step
            one = flat.slope(at[2 * i], state)
            two = flat.slope(at[2 * i + 1], state + 0.5 * step * one)
            three = flat.slope(at[2 * i + 1], state + 0.5 * step * two)
            four = flat.slope(at[2 * i + 2], state + step * three)
            state = state + step / 6.0 * (one + 2.0 * two + 2.0 * three + four)
    return {"time": time, **{name: np.array(rows) for name, rows in columns.items()}}
