"""The model without the skeleton's tree is the same model: path, forces, joint moments and energies."""

from dataclasses import fields, replace

import numpy as np
import pytest
from bundled import bundled
from coarse_skis import in_less_detail

from sssi_exudyn.contact.terms.body_forces import PolePlant
from sssi_exudyn.contact.terms.wind import Gust
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.full.run import antenna_path, simulate
from sssi_exudyn.simulation.result import SimulationResult


@pytest.fixture(scope="module", params=[("beginner", 0.0), ("intermediate", 0.0), ("intermediate", 4e-5)], ids=str)
def both(request: pytest.FixtureRequest) -> tuple[SimulationResult, SimulationResult]:
    """1 s with the tree and without, with a force on every place: a gust, a pole, snow, friction and air; on legs of a
    compliance (m/N).
    """
    name, compliance = request.param
    recording, motion = bundled(name)
    model = model_of(recording, motion).with_values({"legs.compliance": compliance})
    middle = motion.start + 0.5
    gust = Gust(w_f=-4.0, w_l=5.0, t0=middle, t1=middle + 0.4)
    pushes = PolePlant(forward=-20.0, up=15.0, t=middle), gust
    # steps and tolerance at which both have converged: what is left is how the tree integrates the 28 angles
    solver = replace(model.solver, step=0.0025, relative_tolerance=1e-7)
    model = replace(model, solver=solver, terms=(*model.terms, *pushes))
    with in_less_detail():
        whole = simulate(model, motion, stop=motion.start + 1.0, tree=True)
        return whole, simulate(model, motion, stop=motion.start + 1.0)


@pytest.mark.long
def test_path(both: tuple[SimulationResult, SimulationResult]) -> None:
    tree, carried = both
    # m, over 5 m and more: the tree's angular accelerations are the integrator's, of second order in the step
    # (11 µm at 5 ms, 1 µm at 2.5 ms), the carried mass takes the splines'
    np.testing.assert_allclose(carried.pelvis, tree.pelvis, atol=1e-5)
    np.testing.assert_allclose(carried.foot_load, tree.foot_load, atol=1e-3 * tree.foot_load.max())
    np.testing.assert_allclose(carried.drag, tree.drag, atol=1e-3 * np.abs(tree.drag).max())


@pytest.mark.long
def test_every_joint_moment(both: tuple[SimulationResult, SimulationResult]) -> None:
    tree, carried = both
    peak = np.max(np.abs(tree.joint_moments), axis=0)
    error = np.max(np.abs(carried.joint_moments - tree.joint_moments)[1:], axis=0)  # the first state has no multipliers
    assert np.all(peak > 0.0)
    # 1 % of each joint's peak is asked; multipliers swing about their value by 0.2 % for the first tenth of a second
    assert np.max(error / peak) < 0.005


@pytest.mark.long
def test_energies(both: tuple[SimulationResult, SimulationResult]) -> None:
    tree, carried = both
    scale = np.abs(tree.energy["gravity"]).max()
    for name, expected in tree.energy.items():
        # 1e-4 of the fall's energy: the integral of the posture's power takes the moments' difference
        np.testing.assert_allclose(carried.energy[name], expected, atol=1e-4 * scale, err_msg=name)
    assert carried.closure_percent < 0.1  # as of the tree


@pytest.mark.long
def test_the_same_series(both: tuple[SimulationResult, SimulationResult]) -> None:
    tree, carried = both
    for field in fields(SimulationResult):
        expected, without = getattr(tree, field.name), getattr(carried, field.name)
        if isinstance(expected, np.ndarray):
            assert without.shape == expected.shape
            assert np.all(np.isfinite(without))


@pytest.mark.long
def test_antenna_path() -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=motion.start + 0.5)
    model = model_of(recording, motion)
    run = simulate(model, motion)
    time, antenna = antenna_path(model, motion)
    np.testing.assert_array_equal(time, run.time)
    np.testing.assert_array_equal(antenna, run.antenna)
