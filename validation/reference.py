"""The whole model once more, flat, in one file: the paper's equations in order, in plain NumPy.

It is here to be read, and to be held against the assembled model: it shares data with it (the recorded posture,
masses, the ski's widths and stiffnesses, the terms' numbers) and no mechanics.  Each ski is a straight Euler-Bernoulli
beam held at its middle, with twist, in finite elements of its own; nothing is compiled, the step explicit and short.

1   Posture is prescribed: where the feet are relative to the pelvis, how they turn, where the centre of mass is.
2   Skis bend and twist: M q̈ + D q̇ + K q = f, one lumped mass and one lumped moment of inertia a node.
3   The snow pushes on each edge point: F = k δ^m1 + c sign(δ̇)|δ̇|^m2 δ^m3, never below zero, along its normal.
4   Friction acts on the foot: μ_t ΣF along the ski, μ_n ΣF across it, each against its own smoothed sign.
5   The air drags on each segment: ½ C_D ρ A |v| v.
6   The pelvis' three translations follow: m ẍ = Σ forces − what the posture's own accelerations take.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from sssi_exudyn.contact.air import AirDrag
from sssi_exudyn.contact.penetration import POINT_LENGTH, HuntCrossley
from sssi_exudyn.frames import GRAVITY, Array
from sssi_exudyn.model import Model
from sssi_exudyn.motion import Motion
from sssi_exudyn.parts import Parts, as_worn

STEP = 2e-4
"""s; the stiffest mode kept turns 1/10 of a radian in it."""
MODES = 8
"""Vibrations of each ski that are kept, bending and twisting together: the eighth is above 100 Hz."""
_NODES = 67
"""Lumped masses along a ski; an odd number, so that one is in the middle."""


@dataclass(frozen=True)
class FlatSki:
    """A ski's vibrations with its middle held: ω (rad/s) and shapes at the contact points, up (m) and twist (rad).

    x, half_width, height : (p,) of the contact points, m, ski's frame;  length : (p,) m of edge
    up, twist : (p, k) of each mode of modal mass 1 kg
    carried_up, carried_turn : (k, 2), (k,) coupling with the boot's acceleration normal to the ski and angular
        acceleration about its y axis, and about its x axis
    """

    omega: Array
    damping: Array
    x: Array
    half_width: Array
    height: Array
    length: Array
    up: Array
    twist: Array
    carried_up: Array
    carried_turn: Array


def flat_ski(model: Model) -> FlatSki:
    """Bend and twist of the model's ski from its widths, thicknesses and stiffnesses."""
    ski, boot = model.ski, float(model.ski.s_of_x(0.0))
    s = np.linspace(0.0, 1.0, _NODES)
    x, n = ski.x_of_s(s), len(s)
    gap = np.diff(x)
    middle = 0.5 * (s[1:] + s[:-1])
    # bending by Hermite elements: nodal (w, w'); w' is the slope, the rotation about y is its negative
    bend, twist = np.zeros((2 * n, 2 * n)), np.zeros((n, n))
    for e, (long, ei, gj) in enumerate(
        zip(gap, ski.bending_stiffness(middle), ski.torsional_stiffness(middle), strict=True)
    ):
        a, b = 6.0 * long, long * long
        part = (
            ei / long**3 * np.array([[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]])
        )
        bend[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += part
        twist[e : e + 2, e : e + 2] += gj / long * np.array([[1.0, -1.0], [-1.0, 1.0]])
    half = 0.5 * ski.mass_per_length(middle) * gap
    mass = np.zeros(n)
    mass[:-1] += half
    mass[1:] += half
    width, raised = ski.width(s), ski.height(s) - ski.height(boot)
    about_x = mass * (width**2 / 12.0 + raised**2)
    about_y = mass * np.append(gap, gap[-1]) ** 2 / 12.0
    held = n // 2  # the middle node is the foot's
    free_w = np.delete(np.arange(2 * n), [2 * held, 2 * held + 1])
    free_t = np.delete(np.arange(n), held)
    inertia = np.empty(2 * n)
    inertia[0::2], inertia[1::2] = mass, about_y
    square_w, shape_w = eigh(bend[np.ix_(free_w, free_w)], np.diag(inertia[free_w]))
    square_t, shape_t = eigh(twist[np.ix_(free_t, free_t)], np.diag(about_x[free_t]))
    modes = sorted([(v, 0, i) for i, v in enumerate(square_w)] + [(v, 1, i) for i, v in enumerate(square_t)])[:MODES]
    p = (np.arange(50) + 0.5) / 50.0
    at = ski.x_of_s(p)
    up, turn = np.zeros((50, MODES)), np.zeros((50, MODES))
    carried_up, carried_turn = np.zeros((MODES, 2)), np.zeros(MODES)
    for k, (_, kind, i) in enumerate(modes):
        if kind == 0:
            nodal = np.zeros(2 * n)
            nodal[free_w] = shape_w[:, i]
            up[:, k] = np.interp(at, x, nodal[0::2])
            carried_up[k] = [mass @ nodal[0::2], -(mass * x) @ nodal[0::2]]
        else:
            nodal = np.zeros(n)
            nodal[free_t] = shape_t[:, i]
            turn[:, k] = np.interp(at, x, nodal)
            carried_turn[k] = about_x @ nodal
    omega = np.sqrt([v for v, _, _ in modes])
    return FlatSki(
        omega, ski.damping_ratio * omega / omega[0], at, 0.5 * ski.width(p), ski.height(p),
        np.full(50, ski.length / 50.0), up, turn, carried_up, carried_turn,
    )  # fmt: skip


def simulate_flat(
    model: Model, motion: Motion, start: float, stop: float, pelvis: Array, velocity: Array
) -> dict[str, Array]:
    """Run from ``start`` to ``stop`` (s) with the pelvis at ``pelvis`` (3,) m and ``velocity`` (3,) m/s, skis at rest.

    Gives time (n,), pelvis (n, 3), foot_load (n, 2) N, friction (n, 2, 3) N.  Terms beyond the paper's are not known.
    """
    parts = Parts(model, as_worn(model, motion))
    time = start + STEP * np.arange(round((stop - start) / STEP) + 1, dtype=np.float64)
    posture = parts.posture(time)
    snow, friction, air = model.term("penetration"), model.friction, model.term("air")
    assert isinstance(snow, HuntCrossley)
    assert isinstance(air, AirDrag)
    ski = flat_ski(model)
    gravity = GRAVITY * np.array([np.sin(model.inclination), 0.0, -np.cos(model.inclination)])
    area = np.array(list(parts.areas.values()))
    ski_mass = 0.5 * (parts.mass - parts.body_mass)
    boot = float(model.ski.height(model.ski.s_of_x(0.0)))
    x, v = pelvis.astype(float).copy(), velocity.astype(float).copy()
    q, rate = np.zeros((2, MODES)), np.zeros((2, MODES))
    out: dict[str, list[Array]] = {"pelvis": [], "foot_load": [], "friction": []}

    def pushes(i: int, side: int, x: Array, v: Array) -> tuple[float, Array, Array]:
        """Step 3: load (N), force (3,) and generalised forces (k,) of the snow on one ski."""
        frame, spin = posture.foot_rotation[i, side], posture.foot_spin[i, side]
        load, force, general = 0.0, np.zeros(3), np.zeros(MODES)
        for edge in (1.0, -1.0):
            y = edge * ski.half_width
            w, w_t = ski.up @ q[side] + y * (ski.twist @ q[side]), ski.up @ rate[side] + y * (ski.twist @ rate[side])
            arm = np.stack([ski.x, y, ski.height - boot + w], axis=1) @ frame.T
            place = x + posture.foot_place[i, side] + arm
            moving = v + posture.foot_velocity[i, side] + np.cross(spin, arm) + np.outer(w_t, frame[:, 2])
            depth, sinking = -place[:, 2], -moving[:, 2]
            deep = np.maximum(depth, 0.0)
            press = snow.k * deep**snow.m1 + snow.c * np.sign(sinking) * np.abs(sinking) ** snow.m2 * deep**snow.m3
            press = np.where(depth > 0.0, np.maximum(press, 0.0), 0.0) * ski.length / POINT_LENGTH
            load += float(press.sum())
            force[2] += press.sum()
            square = press * frame[2, 2]  # what of the normal force is square to the ski
            general += square @ ski.up + (square * y) @ ski.twist
        return load, force, general

    def modal(i: int, side: int, general: Array, carrying: Array) -> Array:
        """Step 2: accelerations (k,) of one ski's vibrations; ``carrying`` is the boot's acceleration less gravity."""
        frame = posture.foot_rotation[i, side]
        up = frame[:, 2] @ carrying
        turn = frame.T @ posture.foot_spin_rate[i, side]
        pull = ski.carried_up @ [up, turn[1]] + ski.carried_turn * turn[0]
        return np.asarray(general - 2.0 * ski.damping * ski.omega * rate[side] - ski.omega**2 * q[side] - pull)

    for _ in range(400):  # the skis' rest under the snow's pressure, the pelvis held: half-way each time
        for side in range(2):
            _, _, general = pushes(0, side, x, np.zeros(3) - posture.foot_velocity[0, side])
            rest = (general - ski.carried_up[:, 0] * (posture.foot_rotation[0, side][:, 2] @ -gravity)) / ski.omega**2
            q[side] += 0.2 * (rest - q[side])
    for i in range(len(time)):
        total = parts.mass * gravity - parts.body_mass * posture.com_acceleration[i]  # step 6
        generals, loads, rubs = [], np.zeros(2), np.zeros((2, 3))
        for side in range(2):
            load, force, general = pushes(i, side, x, v)
            forward = posture.foot_rotation[i, side][:, 0] * [1.0, 1.0, 0.0]  # step 4, on the plane
            along = forward / np.linalg.norm(forward)
            across = np.array([-along[1], along[0], 0.0])
            moving = v + posture.foot_velocity[i, side]
            for axis, mu in ((along, friction.mu_t), (across, friction.mu_n)):
                slip = float(moving @ axis)
                rubs[side] -= mu * load * slip / np.sqrt(slip**2 + friction.eps**2) * axis
            total = total + force + rubs[side] - ski_mass * posture.foot_acceleration[i, side]
            loads[side] = load
            generals.append(general)
        moving = v + posture.exposed_velocity[i]  # step 5
        pace = np.linalg.norm(moving, axis=1, keepdims=True)
        total = total - np.sum(0.5 * air.c_d * air.rho * area[:, None] * pace * moving, axis=0)
        out["pelvis"].append(x.copy())
        out["foot_load"].append(loads)
        out["friction"].append(rubs)
        acceleration = total / parts.mass
        for side in range(2):  # symplectic: rates first, then places
            carrying = acceleration + posture.foot_acceleration[i, side] - gravity
            rate[side] += STEP * modal(i, side, generals[side], carrying)
            q[side] += STEP * rate[side]
        v = v + STEP * acceleration
        x = x + STEP * v
    return {"time": time, **{name: np.array(rows) for name, rows in out.items()}}
