"""How skis on snow that edges cut give against the feet: a spring's sinking, its stiff limit, mirror images, boots."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from gliding import INCLINATION, model, standing
from random_states import EXPOSED, TREE, random_state
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.recording.recording import Equipment
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.carved_forces_kernel import YAW
from sssi_exudyn.simulation.full.forces import CarvedForces
from sssi_exudyn.simulation.full.forces_kernel import NODE
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.carved_run import CarvedRun, simulate_carved
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.result import SimulationResult
from sssi_exudyn.simulation.ski_on_snow.boot_joint import BootJoint, boot_joint
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier

EDGED = {"hip_adduction_l": 0.25, "hip_adduction_r": -0.28, "pelvis_list": 0.03}
MIRRORED = {"hip_adduction_r": 0.25, "hip_adduction_l": -0.28, "pelvis_list": -0.03}
SKI = float(mesh(model().ski).element_mass.sum())
"""kg"""
SNOW = (Carving(mu=0.05),)


@cache
def whole(side: float) -> SimulationResult:
    angles = EDGED if side > 0.0 else MIRRORED
    return simulate(model(SNOW, across=side), standing(0.4, **angles))


@cache
def reduced(side: float, joint: BootJoint | None = None) -> CarvedRun:
    tried = model(SNOW, across=side)
    return simulate_carved(tried, prepare(tried, standing(0.4, **(EDGED if side > 0.0 else MIRRORED))), joint)


def test_cuffs_hold_skis_in_pitch_and_roll() -> None:
    usual = boot_joint(Equipment())
    assert usual == BootJoint()
    stiffer = boot_joint(Equipment(cuff_edging=800.0, cuff_flexion=500.0))
    assert stiffer == replace(usual, roll_stiffness=800.0, pitch_stiffness=800.0)


@pytest.mark.long
@pytest.mark.parametrize("joint", [BootJoint(), BootJoint(heave_stiffness=3e4, pitch_stiffness=2e3)])
def test_a_ski_at_rest_sinks_and_pitches_by_what_loads_it(joint: BootJoint) -> None:
    tried = model(SNOW, speed=0.0)
    prepared = prepare(tried, standing(0.1))
    resting = simulate_carved(tried, prepared, joint)
    weight = SKI * GRAVITY * np.cos(INCLINATION)
    arm = prepared.ski_com[0] - prepared.held[0]
    up = resting.run.snow_force[0, :, 2] - weight
    down = resting.run.snow_moment[0, :, 1] + weight * arm
    # at rest nothing but springs holds the ski; vibrations beyond the twentieth have 2e-3 of the static shape
    np.testing.assert_allclose(joint.heave_stiffness * resting.heave[0], up, rtol=5e-3)
    np.testing.assert_allclose(joint.pitch_stiffness * resting.pitch[0], down, rtol=5e-3, atol=0.01 * up.max() * 0.1)


@pytest.mark.long
def test_in_the_full_model_too() -> None:
    run = whole(0.3)
    assert run.edges is not None
    late = run.time > 0.2
    up = run.sole_force[late].mean(axis=0) - SKI * GRAVITY * np.cos(INCLINATION)
    # the soles are not quite parallel to the slope, and the skier still sinks and turns a little
    np.testing.assert_allclose(BootJoint().heave_stiffness * run.edges.heave[late].mean(axis=0), up, rtol=0.03)


@pytest.mark.long
def test_skis_that_hardly_give_run_as_those_that_do_not() -> None:
    firm, firmer = (reduced(0.3, BootJoint(heave_stiffness=k, pitch_stiffness=1e-2 * k)) for k in (1e8, 1e9))
    assert np.abs(firm.heave).max() < 2e-5  # m: 1 kN on 10⁸ N/m
    assert np.abs(firmer.heave).max() < 2e-6
    # of 2 m; a tenth of the give moves the skier by a tenth as much
    assert np.abs(firm.run.com - firmer.run.com).max() < 1e-3
    assert np.abs(reduced(0.3).run.com - firmer.run.com).max() > 1e-3


@pytest.mark.long
def test_mirror_images_give_alike() -> None:
    whole_runs, reduced_runs = [whole(side) for side in (0.3, -0.3)], [reduced(side) for side in (0.3, -0.3)]
    edges = [run.edges for run in whole_runs]
    for runs, loads, tolerance in (
        (edges, [run.foot_load for run in whole_runs], 0.01),  # Newton's tolerance is met by different roundings
        (reduced_runs, [run.run.foot_load for run in reduced_runs], 1e-6),
    ):
        here, there = runs
        assert here is not None
        assert there is not None
        for name, sign in (("yaw", -1.0), ("roll", -1.0), ("heave", 1.0), ("pitch", 1.0)):
            one, other = getattr(here, name), sign * getattr(there, name)[:, ::-1]
            np.testing.assert_allclose(one, other, atol=tolerance * np.abs(one).max(), err_msg=name)
        np.testing.assert_allclose(loads[0], loads[1][:, ::-1], atol=tolerance * loads[0].max())


def given_by(place: np.ndarray, pitched: float) -> np.ndarray:
    """(4,) yaw, roll, heave and pitch of a node with heave and quaternion (5,)."""
    yaw, roll, pitch = Rotation.from_quat(place[1:], scalar_first=True).as_euler("ZXY")
    return np.array([yaw, roll, place[0], pitch - pitched])


def test_springs_and_dampers_hold_the_node_at_the_boot() -> None:
    parts = Parts(model(SNOW), standing(0.5, pelvis_list=0.2))
    q, v, at = random_state(parts, 1)
    still = at._replace(foot_spin=np.zeros((2, 3)))
    q[2] += 5.0  # off the snow
    carrier = Carrier(np.ones(TREE), np.full(EXPOSED, 0.05), np.array([0.0, 0.0, -9.0]))
    boots = [TREE + NODE * (side * len(parts.mesh.node_s) + parts.mesh.clamped) for side in range(2)]
    loose = parts.edges._replace(stiffness=np.zeros(4), damping=np.zeros(4))
    passes = [
        CarvedForces(parts.model.terms, parts.sections, edges, carrier, np.zeros(len(q)))
        for edges in (parts.edges, loose)
    ]
    held, without = (forces.evaluate(q, v, still).copy() for forces in passes)
    expected = np.zeros(len(q))
    for boot, seen in zip(boots, passes[0].seen, strict=True):
        place = np.concatenate([q[boot + 2 : boot + 3], q[boot + 3 : boot + 7]])
        given, by_place = given_by(place, parts.edges.pitched), np.zeros((4, 5))
        for c in range(5):
            shift = 1e-6 * np.eye(5)[c]
            ends = [given_by(place + sign * shift, parts.edges.pitched) for sign in (1.0, -1.0)]
            by_place[:, c] = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(seen[YAW : YAW + 4], given, atol=1e-12)
        giving = by_place @ v[boot + 2 : boot + 7]
        expected[boot + 2 : boot + 7] = -(parts.edges.stiffness * given + parts.edges.damping * giving) @ by_place
    # differences over 1e-6 are good to 1e-9 of 1e4 N and N m
    np.testing.assert_allclose(held - without, expected, atol=1e-5)
    # of what turns the springs' own directions nothing is in the derivatives, and no angle here exceeds 0.06 rad
    shift = np.zeros(len(q))
    for boot in boots:
        shift[boot + 2 : boot + 7] = np.random.default_rng(2).normal(size=5)
        shift[boot + 3 : boot + 7] -= (shift[boot + 3 : boot + 7] @ q[boot + 3 : boot + 7]) * q[boot + 3 : boot + 7]
    for by_place, by_rate in ((1.0, 0.0), (0.0, 1.0)):
        change = np.zeros((2, len(q)))
        for side, sign in enumerate((1.0, -1.0)):
            ends = [
                forces.evaluate(q + sign * 1e-6 * by_place * shift, v + sign * 1e-6 * by_rate * shift, still).copy()
                for forces in passes
            ]
            change[side] = ends[0] - ends[1]
        exact = -(change[0] - change[1]) / 2e-6
        full = np.zeros((2, len(q), len(q)))
        for matrix, forces in zip(full, passes, strict=True):
            entries = forces.triplets(q, v, still, by_place, by_rate)
            np.add.at(matrix, (entries[:, 0].astype(int), entries[:, 1].astype(int)), entries[:, 2])
        np.testing.assert_allclose((full[0] - full[1]) @ shift, exact, atol=0.1 * np.abs(exact).max())
