"""The compiled pass over all forces against plain NumPy at random states, and what contact alone must do."""

from typing import Any

import numpy as np
import pytest
from gliding import model, standing
from random_states import TREE, forces_of, random_state
from scipy.integrate import solve_ivp
from scipy.linalg import expm, logm

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.term import PointState
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.forces_kernel import LOAD, NODE
from sssi_exudyn.simulation.ski_on_snow.structs import Instant

SNOW = HuntCrossley()
FRICTION = AnisotropicFriction()


@pytest.fixture(scope="module")
def parts() -> Parts:
    return Parts(model((SNOW, FRICTION)), standing(0.5, heading=0.4, pelvis_list=0.2, hip_adduction_l=0.2))


def rotation(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def to_spin(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    return np.array([[-x, w, -z, y], [-y, z, w, -x], [-z, -y, x, w]])


def reference(parts: Parts, q: np.ndarray, v: np.ndarray, at: Instant) -> tuple[np.ndarray, np.ndarray, Any]:
    """The snow's force on the pelvis (3,), force and torque on every node in the foot's frame (2, n, 6), loads (2,)."""
    cut, sections = parts.mesh, parts.sections
    nodes, rates = q[TREE:].reshape(2, -1, NODE), v[TREE:].reshape(2, -1, NODE)
    on_nodes, on_pelvis, loads = np.zeros((2, len(cut.node_s), 6)), np.zeros(3), np.zeros(2)
    for side in range(2):
        frame = at.foot_rotation[side]
        for m, e in enumerate(sections.element):
            xi = sections.share[m]
            poses = []
            for node in nodes[side, e : e + 2]:
                pose = np.eye(4)
                pose[:3, :3], pose[:3, 3] = rotation(node[3:]), node[:3]
                poses.append(pose)
            middle = np.real(poses[0] @ expm(xi * logm(np.linalg.inv(poses[0]) @ poses[1])))
            spins = [2.0 * to_spin(nodes[side, e + k, 3:]) @ rates[side, e + k, 3:] for k in range(2)]
            moving = (1 - xi) * rates[side, e, :3] + xi * rates[side, e + 1, :3]
            omega = (1 - xi) * spins[0] + xi * spins[1]
            for edge in range(2):
                arm = middle[:3, :3] @ sections.offset[m, edge]
                out = frame @ (middle[:3, 3] + arm)
                depth = -(q[2] + at.foot_place[side, 2] + out[2])
                if depth <= 0.0:
                    continue
                speed = v[:3] + at.foot_velocity[side] + np.cross(at.foot_spin[side], out)
                speed = speed + frame @ (moving + np.cross(omega, arm))
                push = SNOW.force(FloatMath(), PointState(depth, -speed[2], sections.length[m]))
                loads[side] += push
                on_pelvis += [0.0, 0.0, push]
                local = frame.T @ [0.0, 0.0, push]
                for k, share in enumerate((1 - xi, xi)):
                    on_nodes[side, e + k] += share * np.concatenate([local, np.cross(arm, local)])
    return on_pelvis, on_nodes, loads


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.long
def test_snow_on_the_skis(parts: Parts, seed: int) -> None:
    forces = forces_of(parts, (SNOW, FRICTION))
    q, v, at = random_state(parts, seed)
    # the same state at rest in the air has all forces but the snow's: damping and weight
    full = forces.evaluate(q, v, at).copy()
    loads = forces.seen[:, LOAD].copy()
    friction = np.zeros(3)
    for side in range(2):
        along, across, _ = forces.foot_axes(q[:3] + at.foot_place[side], at.foot_rotation[side])
        friction += forces.seen[side, 3] * along + forces.seen[side, 4] * across
    lifted = q.copy()
    lifted[2] += 5.0
    rest = forces.evaluate(lifted, v, at).copy()
    assert np.all(forces.seen[:, LOAD] == 0.0)  # nothing off the snow
    on_pelvis, on_nodes, expected = reference(parts, q, v, at)
    assert loads.min() > 0.0
    largest = loads.max()
    # 1e-9 of the load: rounding in a sum of a hundred points
    np.testing.assert_allclose(loads, expected, rtol=1e-9)
    np.testing.assert_allclose((full - rest)[:3] - friction, on_pelvis, atol=1e-9 * largest)
    general = (full - rest)[TREE:].reshape(2, -1, NODE)
    np.testing.assert_allclose(general[..., :3], on_nodes[..., :3], atol=1e-9 * largest)
    quaternions = q[TREE:].reshape(2, -1, NODE)[..., 3:]
    for side in range(2):
        for node, (g, quaternion) in enumerate(zip(general[side, :, 3:], quaternions[side], strict=True)):
            torque = 0.5 * to_spin(quaternion) @ g
            np.testing.assert_allclose(torque, on_nodes[side, node, 3:], atol=1e-9 * largest)
    # Newton's third law: what the nodes are given, turned outwards, is what the pelvis carries
    given = sum(at.foot_rotation[side] @ general[side, :, :3].sum(axis=0) for side in range(2))
    np.testing.assert_allclose(given, on_pelvis, atol=1e-9 * largest)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.long
def test_jacobian_against_differences(parts: Parts, seed: int) -> None:
    forces = forces_of(parts, (SNOW, FRICTION))
    q, v, at = random_state(parts, seed)
    size = len(q)
    forces.evaluate(q, v, at)
    jacobian = np.zeros((size, size))
    entries = forces.triplets(q, v, at, 0.0, 1.0)
    np.add.at(jacobian, (entries[:, 0].astype(int), entries[:, 1].astype(int)), entries[:, 2])
    generator = np.random.default_rng(seed)
    for _ in range(5):
        shift = generator.normal(size=size)
        step = 1e-6
        ends = [forces.evaluate(q, v + sign * step * shift, at).copy() for sign in (1.0, -1.0)]
        exact = -(ends[0] - ends[1]) / (2.0 * step)
        # rows of the skis: all of the derivative by rate is there but the gyroscopic part, small beside the dampers
        error = np.abs((jacobian @ shift - exact)[TREE:])
        assert error.max() < 0.01 * np.abs(exact[TREE:]).max()


def test_number_of_contact_points() -> None:
    """Points scale with the length they stand for: twice as many carry the same load at the same place."""
    start = model()
    loads = []
    for contacts in (50, 100, 200):
        cut = mesh(start.ski, 50, contacts)
        places = cut.contact_positions(cut.node_position, cut.node_rotation)
        depth = 0.02 - places[..., 2] + 0.3 * places[..., 1]
        push = sum(
            SNOW.force(FloatMath(), PointState(float(d), 0.0, float(length)))
            for d, length in zip(depth.reshape(-1), np.repeat(cut.contact_length, 2), strict=True)
            if d > 0.0
        )
        loads.append(push)
    # 0.3 %: the error of the midpoint rule where the shovel leaves the snow
    assert loads[0] == pytest.approx(loads[2], rel=3e-3)
    assert loads[1] == pytest.approx(loads[2], rel=1e-3)


def test_rebound_of_a_dropped_mass() -> None:
    """One point, 0.5 kg, 1 m/s, without weight: the speed it leaves with, integrated twice in different ways."""
    mass, begin = 0.5, 1.0

    def push(depth: float, rate: float) -> float:
        return SNOW.force(FloatMath(), PointState(depth, rate, 0.033)) if depth > 0.0 else 0.0

    def law(depth: float, rate: float) -> float:
        return max(5e3 * depth**1.5 + 5e3 * rate * depth**1.5, 0.0) if depth > 0.0 else 0.0

    def leaves(_: float, state: np.ndarray) -> float:
        return float(state[0])

    leaves.terminal = True  # type: ignore[attr-defined]
    leaves.direction = -1.0  # type: ignore[attr-defined]
    solution = solve_ivp(
        lambda _, s: [s[1], -law(s[0], s[1]) / mass], (0.0, 1.0), [1e-12, begin], events=leaves, rtol=1e-10, atol=1e-14
    )
    depth, rate, step = 0.0, begin, 1e-6
    for _ in range(1_000_000):
        middle_rate = rate - 0.5 * step * push(depth, rate) / mass
        middle = depth + 0.5 * step * rate
        rate -= step * push(middle, middle_rate) / mass
        depth += step * middle_rate
        if depth < 0.0:
            break
    # 1e-4: the midpoint rule's step of a microsecond
    assert rate == pytest.approx(float(solution.y[1, -1]), rel=1e-4)
    assert -begin < rate < 0.0  # it leaves slower than it came
