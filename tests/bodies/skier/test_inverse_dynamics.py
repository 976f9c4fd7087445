"""Joint moments from Lagrange multipliers against a recursive Newton-Euler that shares nothing with the solver.

The recursion takes the recorded movement as it happened (places and velocities of pelvis and ski nodes, accelerations
by differences).  It applies the law of the snow's force again to the places of the contact points, and goes from the
tips of the chain to the pelvis.
"""

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled

from sssi_exudyn.bodies.skier.chain import COORDINATE, FEET, JOINTS, PARENT, PRESCRIBED, forward_kinematics, rates
from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.core.frames import gravity_in_slope
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.run import FullRun, integrate
from sssi_exudyn.simulation.full.series import result_from_record
from sssi_exudyn.simulation.result import SimulationResult

STEP = 0.0025


@pytest.fixture(scope="module")
def run() -> tuple[FullRun, SimulationResult]:
    """Simulate 2 s of the beginner, with an edge change, in steps short enough to differentiate."""
    recording, motion = bundled("beginner")
    model = model_of(recording, motion)
    model = replace(model, solver=replace(model.solver, step=STEP))
    done, problem = integrate(model, motion, stop=2.0)
    assert not problem
    return done, result_from_record(done.parts, done.posture, done.system, done.record)


def ski_on_foot(run: FullRun, result: SimulationResult, gravity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return force (n, 2, 3) and moment about the foot's point (n, 2, 3) with which each ski acts on its foot."""
    posture, cut, parts = run.posture, run.parts.mesh, run.parts
    law = run.parts.model.term("penetration")
    assert isinstance(law, HuntCrossley)
    nodes = (run.record.q + run.system.ref)[:, run.system.first_node :].reshape(len(result.time), 2, -1, NODE)
    w, x, y, z = np.moveaxis(nodes[..., 3:], -1, 0)
    turn = np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        axis=-2,
    )
    force, moment = np.zeros((2, len(result.time), 2, 3))
    for side in range(2):
        frame, foot = posture.foot_rotation[:, side], result.foot_position[:, side]
        local = np.stack(
            [
                cut.contact_positions(place[:, :3] - parts.ski_in_foot, rotation) + parts.ski_in_foot
                for place, rotation in zip(nodes[:, side], turn[:, side], strict=True)
            ]
        )
        points = foot[:, None, None] + np.einsum("nij,nmej->nmei", frame, local)
        speed = np.gradient(points[..., 2], STEP, axis=0)
        depth = np.maximum(-points[..., 2], 0.0)
        push = np.maximum((law.k - law.c * speed) * depth**1.5, 0.0) * (cut.contact_length[0] / 0.033)
        snow = np.zeros_like(points)
        snow[..., 2] = push
        mass = parts.sections.node_mass
        where = foot[:, None] + np.einsum("nij,nkj->nki", frame, nodes[:, side, :, :3])
        inertia = mass[:, None] * (gravity - np.gradient(np.gradient(where, STEP, axis=0), STEP, axis=0))
        force[:, side] = snow.sum(axis=(1, 2)) + inertia.sum(axis=1)
        arm = points - foot[:, None, None]
        moment[:, side] = np.cross(arm, snow).sum(axis=(1, 2))
        moment[:, side] += np.cross(where - foot[:, None], inertia).sum(axis=1)
    return force, moment


def newton_euler(run: FullRun, result: SimulationResult) -> np.ndarray:
    """Return the joint moments (n, 28) N m."""
    parts, posture = run.parts, run.posture
    gravity = gravity_in_slope(parts.model.inclination)
    n = len(result.time)
    pull = np.gradient(result.pelvis_velocity, STEP, axis=0)
    q = np.hstack([result.pelvis, posture.angles])
    poses = forward_kinematics(parts.motion.geometry, q, parts.model.inclination)
    moving = rates(
        poses,
        np.hstack([result.pelvis_velocity, posture.rates]),
        np.hstack([pull, posture.accelerations]),
    )
    force, moment = np.zeros((2, len(JOINTS), n, 3))
    air = parts.model.term("air")
    assert isinstance(air, AirDrag)
    for i, body in enumerate(parts.inertias):
        arm = poses.rotation[:, i] @ body.com
        omega, alpha = moving.angular_velocity[:, i], moving.angular_acceleration[:, i]
        swing = np.cross(omega, arm)
        felt = body.mass * (moving.acceleration[:, i] + np.cross(alpha, arm) + np.cross(omega, swing) - gravity)
        turned = poses.rotation[:, i] @ body.inertia @ np.swapaxes(poses.rotation[:, i], 1, 2)
        spun = np.einsum("nij,nj->ni", turned, omega)
        outer = np.zeros((n, 3))
        if JOINTS[i].segment in parts.areas:
            velocity = moving.velocity[:, i] + swing
            speed = np.linalg.norm(velocity, axis=1, keepdims=True)
            outer = -0.5 * air.c_d * air.rho * parts.areas[JOINTS[i].segment] * speed * velocity
        force[i] = felt - outer
        moment[i] = np.einsum("nij,nj->ni", turned, alpha) + np.cross(omega, spun) + np.cross(arm, felt - outer)
    ski, torque = ski_on_foot(run, result, gravity)
    for side, foot in enumerate(FEET):
        pushed = ski[:, side] + result.foot_friction[:, side]
        force[foot] -= pushed
        moment[foot] -= torque[:, side] + np.cross(result.foot_position[:, side] - poses.origin[:, foot], pushed)
    joint_moments = np.zeros((n, len(PRESCRIBED)))
    for i in reversed(range(len(JOINTS))):
        for name, _ in JOINTS[i].rotations:
            c = COORDINATE[name]
            joint_moments[:, c - 3] = np.einsum("ni,ni->n", poses.axes[:, c], moment[i])
        if PARENT[i] >= 0:
            force[PARENT[i]] += force[i]
            moment[PARENT[i]] += moment[i] + np.cross(poses.origin[:, i] - poses.origin[:, PARENT[i]], force[i])
    return joint_moments


@pytest.mark.long
def test_every_joint_moment(run: tuple[FullRun, SimulationResult]) -> None:
    done, result = run
    expected = newton_euler(done, result)
    inside = slice(80, -4)  # the start settles within 0.2 s; differences have no neighbour at the ends
    peak = np.max(np.abs(expected[inside]), axis=0)
    error = np.max(np.abs(result.joint_moments[inside] - expected[inside]), axis=0)
    # 1 % of each joint's peak: what second differences over 2.5 ms leave of the skis' vibrations, and the two ways of
    # placing a contact point between two nodes
    worst = {name: round(float(e / p), 4) for name, e, p in zip(PRESCRIBED, error, peak, strict=True) if e > 0.01 * p}
    assert not worst
