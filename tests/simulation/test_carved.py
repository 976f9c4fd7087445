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
from sssi_exudyn.simulation.carved import CarvedRun, simulate_carved
from sssi_exudyn.simulation.full import simulate
from sssi_exudyn.simulation.reduced import CARVED_STEP, Prepared, prepare, reduced_module, simulate_reduced

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
    found = gliding()
    np.testing.assert_allclose(found.run.foot_load[:, 0], found.run.foot_load[:, 1], rtol=1e-3)
    # friction acts at the deeper edge, which rounding chooses where a ski is flat: 17 N on 33 mm turn it by 0.6 mrad
    assert np.abs(found.yaw).max() < 1e-3
    assert np.abs(found.run.com[:, 1] - found.run.com[0, 1]).max() < 0.01


def test_the_step_matters_little() -> None:
    half, usual = carved(0.5 * CARVED_STEP)[0].run, carved(CARVED_STEP)[0].run
    apart = np.linalg.norm(half.com[::2] - usual.com, axis=1)
    assert apart.max() < 0.1  # m, of 24: where the wall yields a step decides when


def test_the_snow_takes_what_the_skis_give() -> None:
    found, prepared = carved(CARVED_STEP)
    run, time = found.run, found.run.time
    into_snow = np.trapezoid(found.friction + found.skid + found.pressing, time)
    against_feet = np.stack([np.gradient(angle, time, axis=0) for angle in (found.yaw, found.roll)], axis=-1)
    axes = np.stack([prepared.foot_rotation[..., 2], run.foot_forward], axis=-2)
    spin = prepared.foot_spin + np.einsum("nsa,nsai->nsi", against_feet, axes)
    by_skis = np.sum(run.snow_force * run.foot_velocity, axis=(1, 2)) + np.sum(run.snow_moment * spin, axis=(1, 2))
    # what is bent into the skis, and that of the other edge where a ski lies flat, is left out
    assert into_snow == pytest.approx(-np.trapezoid(by_skis, time), rel=0.02)
    assert found.friction.min() >= 0.0
    assert np.all(found.side_reserve <= 1.0)


def test_skis_turn_little_below_the_feet_and_another_ski_runs_another_way() -> None:
    found, _ = carved(CARVED_STEP)
    assert np.degrees(np.sqrt(np.mean(found.yaw**2))) < 8.0
    recording, motion = bundled("intermediate")
    paper = model_of(recording, motion)
    other = replace(paper, ski=read_ski("giant_slalom_183", "."), terms=combine_terms(paper.terms, (Carving(mu=0.1),)))
    run = simulate_carved(other, prepare(other, motion, stop=motion.start + 2.0)).run
    assert 0.05 < np.linalg.norm(run.com[-1] - found.run.com[-1]) < 5.0  # m


def test_a_model_with_edges_is_run_here_and_nowhere_else() -> None:
    motion = standing(0.2)
    run = simulate_reduced(GLIDING, prepare(GLIDING, motion))
    assert len(run.time) == round(0.2 / CARVED_STEP) + 1
    with pytest.raises(InputError, match="carving acts in `sssi ski turn` and in"):
        reduced_module(GLIDING.terms)
    with pytest.raises(InputError, match="carving acts in `sssi ski turn` and in"):
        simulate(GLIDING, motion)


def test_snow_of_no_strength_under_a_run_that_flies_is_one_clear_error() -> None:
    flying: Model = replace(GLIDING, start=replace(GLIDING.start, velocity_f=float("nan")))
    with pytest.raises(SimulationDiverged, match="snow that edges cut"):
        simulate_carved(flying, prepare(flying, standing(0.1)))
