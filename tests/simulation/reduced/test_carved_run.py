"""Runs on snow that edges cut: gliding, symmetry, steps, energy, and where such snow is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bundled import bundled
from gliding import INCLINATION, model, standing

from sssi_exudyn.bodies.ski.ski import read_ski
from sssi_exudyn.contact.registry import combine_terms
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.core.errors import InputError, SimulationDiverged
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.simulation.assembly import CARVED_STEP
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.carved_run import CarvedRun, simulate_carved
from sssi_exudyn.simulation.reduced.prepared import Prepared, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult

pytestmark = pytest.mark.long
GLIDING = model((Carving(mu=0.05),), speed=8.0)


@cache
def gliding() -> CarvedRun:
    return simulate_carved(GLIDING, prepare(GLIDING, standing(2.0)))


@cache
def carved(step: float) -> tuple[CarvedRun, Prepared]:
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    tried = replace(paper, terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    prepared = prepare(tried, motion, stop=motion.start + 2.0, step=step)
    return simulate_carved(tried, prepared), prepared


def test_a_flat_ski_glides_with_its_friction() -> None:
    run = gliding().run
    settled = run.time > 0.5
    gained = np.polyfit(run.time[settled], run.com_velocity[settled, 0], 1)[0]
    expected = GRAVITY * (np.sin(INCLINATION) - 0.05 * np.cos(INCLINATION))
    # ε of 0.1 m/s takes 10⁻⁴ off; what the shovels press in is a tenth of a millimetre
    assert gained == pytest.approx(expected, rel=5e-3)
    weight = GLIDING.skier.mass + 2.0 * (GLIDING.equipment.ski_mass + GLIDING.equipment.boot_mass)
    assert run.foot_load[settled].sum(axis=1).mean() == pytest.approx(weight * GRAVITY * np.cos(INCLINATION), rel=5e-3)


def test_left_and_right_are_alike() -> None:
    symmetric = gliding()
    np.testing.assert_allclose(symmetric.run.foot_load[:, 0], symmetric.run.foot_load[:, 1], rtol=1e-3)
    # friction acts at the deeper edge, which rounding chooses where a ski is flat: 17 N on 33 mm turn it by 0.6 mrad
    assert np.abs(symmetric.yaw).max() < 1e-3
    assert np.abs(symmetric.run.com[:, 1] - symmetric.run.com[0, 1]).max() < 0.01


def test_the_step_matters_little() -> None:
    half, usual = carved(0.5 * CARVED_STEP)[0].run, carved(CARVED_STEP)[0].run
    apart = np.linalg.norm(half.com[::2] - usual.com, axis=1)
    assert apart.max() < 0.05  # m, of 24: 0.02, of second order; of first order it was twice that


def test_the_snow_takes_what_the_skis_give() -> None:
    series, prepared = carved(CARVED_STEP)
    run, time = series.run, series.run.time
    into_snow = np.trapezoid(series.friction + series.skid + series.pressing, time)
    angles = series.yaw, series.roll, series.pitch
    against_feet = np.stack([np.gradient(angle, time, axis=0) for angle in angles], axis=-1)
    up, forward = prepared.foot_rotation[..., 2], run.foot_forward
    axes = np.stack([up, forward, np.cross(up, forward)], axis=-2)
    spin = prepared.foot_spin + np.einsum("nsa,nsai->nsi", against_feet, axes)
    lifted = series.heave[..., None] * up
    velocity = run.foot_velocity + np.gradient(series.heave, time, axis=0)[..., None] * up
    velocity = velocity + np.cross(prepared.foot_spin, lifted)
    moment = run.snow_moment - np.cross(lifted, run.snow_force)  # about the boot centre, which heaves
    by_skis = np.sum(run.snow_force * velocity, axis=(1, 2)) + np.sum(moment * spin, axis=(1, 2))
    # what is bent into the skis, and that of the other edge where a ski lies flat, is left out
    assert into_snow == pytest.approx(-np.trapezoid(by_skis, time), rel=0.02)
    assert series.friction.min() >= 0.0
    # what the snow that is thrown aside resists is not the wall's
    assert series.side_reserve.min() >= 0.0
    assert series.side_reserve.max() <= 1.0


def test_skis_turn_little_below_the_feet_and_another_ski_runs_another_way() -> None:
    series, _ = carved(CARVED_STEP)
    assert np.degrees(np.sqrt(np.mean(series.yaw**2))) < 8.0
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    other = replace(paper, ski=read_ski("giant_slalom_183", "."), terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    run = simulate_carved(other, prepare(other, motion, stop=motion.start + 2.0)).run
    assert 0.05 < np.linalg.norm(run.com[-1] - series.run.com[-1]) < 5.0  # m


def test_a_model_with_edges_is_run_as_such() -> None:
    run = simulate_reduced(GLIDING, prepare(GLIDING, standing(0.2)))
    assert len(run.time) == round(0.2 / CARVED_STEP) + 1


@pytest.mark.parametrize("lean", [0.0, 2e-5, 1e-4, 5e-4])  # rad: exactly flat, and the edges 1 to 30 µm apart in depth
def test_the_full_model_solves_skis_that_lie_flat(lean: float) -> None:
    run = simulate(GLIDING, standing(0.3, pelvis_list=lean))
    gained = np.polyfit(run.time[run.time > 0.1], run.com_velocity[run.time > 0.1, 0], 1)[0]
    # as of the reduced model, whose skis have longer to settle
    assert gained == pytest.approx(GRAVITY * (np.sin(INCLINATION) - 0.05 * np.cos(INCLINATION)), rel=0.01)
    assert run.closure_percent < 0.01


@cache
def full() -> SimulationResult:
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    tried = replace(paper, terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    return simulate(tried, motion, stop=motion.start + 1.0)


def test_the_full_model_carves_as_the_reduced_one() -> None:
    whole, reduced = full(), carved(CARVED_STEP)[0].run
    at = [np.argmin(np.abs(reduced.time - time)) for time in whole.time[::80]]
    # 0.013 m of 12 m: 0.007 are the vibrations that are left out, 0.005 how the start shares the load between the feet
    assert whole.antenna is not None
    ways = (whole.antenna - whole.antenna[0])[::80], (reduced.antenna - reduced.antenna[0])[at]
    assert np.linalg.norm(ways[0] - ways[1], axis=1).max() < 0.03
    loaded = whole.foot_load[::80].max(axis=1) > 300.0
    # a ski that bends on the groove's floor rings by 70 N rms, in either model with phases of its own
    np.testing.assert_allclose(whole.foot_load[::80][loaded], reduced.foot_load[at][loaded], atol=150.0)
    assert whole.edges is not None
    assert np.degrees(np.abs(whole.edges.yaw[::80] - carved(CARVED_STEP)[0].yaw[at])).max() < 1.5  # of 8


def test_both_models_start_with_their_skis_alike() -> None:
    """On one ski of 820 N, heaved by 15 mm, edged by 42 degrees: about a foot that stays it would roll by 0.75 degrees
    more.
    """
    whole, reduced = full().edges, carved(CARVED_STEP)[0]
    assert whole is not None
    assert whole.heave[0].max() > 0.01
    for name in ("yaw", "roll", "pitch"):
        apart = np.degrees(getattr(whole, name)[0] - getattr(reduced, name)[0])
        assert np.abs(apart).max() < 0.1, name  # the full model is let down upon the snow, which keeps 0.04 of that
    np.testing.assert_allclose(whole.heave[0], reduced.heave[0], atol=6e-4)  # 0.4 mm: 15 N of load


def test_the_full_models_energy_balances() -> None:
    whole = full()
    # what is bent into the skis and stored in the joints at the boots is counted; 2e-3 is the integration's
    assert whole.closure_percent < 0.05
    assert np.all(np.diff(whole.energy["friction"]) <= 0.0)
    assert whole.energy["skid"][-1] < 0.0


def test_inverse_dynamics_and_the_tree_give_the_same_moments() -> None:
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    tried = replace(paper, terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    by_tree = simulate(tried, motion, stop=motion.start + 0.1)
    without = simulate(tried, motion, stop=motion.start + 0.1)
    # the two integrate different coordinates: the paths are as near as Newton's tolerance leaves them
    np.testing.assert_allclose(by_tree.antenna, without.antenna, atol=1e-4)
    np.testing.assert_allclose(by_tree.joint_moments[4:], without.joint_moments[4:], atol=2.0)


def test_edges_that_cut_want_the_compiled_pass() -> None:
    with pytest.raises(InputError, match="backend: numpy: edges that cut are compiled alone"):
        simulate(GLIDING, standing(0.1), backend="numpy")


def test_snow_of_no_strength_under_a_run_that_flies_is_one_clear_error() -> None:
    flying: Model = replace(GLIDING, start=replace(GLIDING.start, velocity_f=float("nan")))
    with pytest.raises(SimulationDiverged, match="snow that edges cut"):
        simulate_carved(flying, prepare(flying, standing(0.1)))
