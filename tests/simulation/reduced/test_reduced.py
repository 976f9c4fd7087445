"""The reduced model against the full one and against answers that are known."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from bundled import bundled
from gliding import INCLINATION, model, standing

from sssi_exudyn.bodies.ski.mesh import CONTACTS
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.term import TerrainTerm
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import SlopeChange, TerrainBump
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.faults import HeadingDrift, LeverArm
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.assembly import correct_motion
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import (
    COARSE_CONTACTS,
    COARSE_MODES,
    COARSE_STEP,
    MODES,
    STEP,
    prepare,
)
from sssi_exudyn.simulation.reduced.run import simulate_reduced


@pytest.mark.parametrize("name", ["beginner", "intermediate"])
@pytest.mark.long
def test_path_and_loads_are_the_full_models(name: str) -> None:
    recording, motion = bundled(name)
    start = model_of(recording, motion)
    full = simulate(replace(start, solver=replace(start.solver, step=STEP)), motion, stop=3.0)
    reduced = simulate_reduced(start, prepare(start, motion, stop=3.0))
    assert full.antenna is not None
    apart = np.linalg.norm(reduced.antenna - full.antenna, axis=1)
    # 1 cm over 3 s: what linear bending makes of the skis' 4 cm of real bending; the GPS is sure to 2 cm
    assert apart.max() < 0.01
    # 3 % of the weight, at the edge changes where it is largest
    assert np.max(np.abs(reduced.foot_load - full.foot_load)) < 0.03 * full.foot_load.sum(axis=1).mean()
    np.testing.assert_allclose(reduced.edge_angle, full.edge_angle, atol=1e-9)  # prescribed in both


def test_block_on_a_slope() -> None:
    start = model((HuntCrossley(), AnisotropicFriction(mu_t=0.1, mu_n=0.5, eps=1e-3)))
    run = simulate_reduced(start, prepare(start, standing(0.6)))
    later = run.time > 0.2
    slope = np.polyfit(run.time[later], run.com_velocity[later, 0], 1)[0]
    # as for the full model: what is left of the settling
    assert slope == pytest.approx(GRAVITY * (np.sin(INCLINATION) - 0.1 * np.cos(INCLINATION)), rel=1e-3)


def test_faults_of_the_capture_are_the_same_on_tables_and_on_the_motion() -> None:
    recording, motion = bundled("beginner")
    motion = replace(motion, stop=2.0)
    start = model_of(recording, motion)
    faulty = replace(start, sensors=(HeadingDrift(rate=0.02, t_ref=0.4), LeverArm(0.1, -0.2, 0.05))).with_values(
        {"start.heading_offset": 0.05}
    )
    on_tables = simulate_reduced(faulty, prepare(faulty, motion))
    on_motion = simulate_reduced(start, prepare(start, correct_motion(faulty, motion)))
    # the drift's own share of the segments' speed in the air, up to 0.02 rad/s over 1 m, is left out on the tables:
    # 2 cm/s of 5 m/s on a drag of some 10 N, over 2 s less than 1 mm
    np.testing.assert_allclose(on_tables.antenna, on_motion.antenna, atol=1e-3)
    still = replace(faulty, sensors=faulty.sensors[1:])
    on_tables = simulate_reduced(still, prepare(still, motion))
    on_motion = simulate_reduced(start, prepare(start, correct_motion(still, motion)))
    np.testing.assert_allclose(on_tables.antenna, on_motion.antenna, atol=1e-9)  # the same numbers by another way


@pytest.mark.parametrize("name", ["beginner", "intermediate"])
def test_skis_in_less_detail_go_the_same_way_at_coarse_steps(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    recording, motion = bundled(name)
    start = model_of(recording, motion)
    coarse = prepare(start, motion, stop=4.0, step=COARSE_STEP)
    assert coarse.points.shape[0] == COARSE_CONTACTS
    assert coarse.ski.frequency.shape == (COARSE_MODES,)
    monkeypatch.setattr("sssi_exudyn.simulation.reduced.prepared.COARSE_CONTACTS", CONTACTS)
    monkeypatch.setattr("sssi_exudyn.simulation.reduced.prepared.COARSE_MODES", MODES)
    runs = [simulate_reduced(start, at) for at in (coarse, prepare(start, motion, stop=4.0, step=COARSE_STEP))]
    apart = np.linalg.norm(runs[0].antenna - runs[1].antenna, axis=1)
    assert apart.max() < 0.005  # m; the GPS is sure to 2 cm
    loads = np.abs(runs[0].foot_load - runs[1].foot_load)[len(coarse.time) // 10 :]  # without the first vibrations
    assert np.sqrt(np.mean(loads**2)) < 5.0  # N; insoles are sure to 10 N


@pytest.mark.long
def test_order_of_the_step() -> None:
    """Average acceleration is of second order; the snow's power law and the points' coming and going cost a little."""
    recording, motion = bundled("beginner")
    start = model_of(recording, motion)
    ends = [
        simulate_reduced(start, prepare(start, motion, stop=2.0, step=step)).pelvis[-1]
        for step in (0.01, 0.005, 0.0025, 0.00125)
    ]
    apart = [np.linalg.norm(a - b) for a, b in pairwise(ends)]
    assert apart[-1] < 0.002  # m
    assert np.log2(apart[0] / apart[-1]) / 2.0 > 1.5


@pytest.mark.parametrize(
    "hill",
    [TerrainBump(1.0, 2.0, 6.0), TerrainBump(-1.0, 2.0, 6.0), SlopeChange(0.1, -20.0)],
)
@pytest.mark.long
def test_a_run_starts_on_a_hill_as_on_the_plane(hill: TerrainTerm) -> None:
    """Both models rest on the snow at the start and go along it, however high it lies over the plane."""
    skier = model((*PAPER_TERMS, hill))
    motion = standing(0.3)
    full = simulate(skier, motion)
    reduced = simulate_reduced(skier, prepare(skier, motion))
    _, slopes = skier.snow(full.foot_position[0])
    for run in (full, reduced):
        assert run.com_velocity[0, 2] == pytest.approx(slopes[:, 0].mean() * 5.0, abs=0.02)
        # The hill bends the way by v²/36 m = 0.7 m/s², 7 % of g, and that swings once in;
        # falling from 1 m would give several times the weight.
        weight = run.foot_load[0].sum()
        assert run.foot_load.sum(axis=1) == pytest.approx(weight, rel=0.25)
    assert np.ptp(reduced.com, axis=0) == pytest.approx(np.ptp(full.com, axis=0), abs=0.005)
