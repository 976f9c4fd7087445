"""Losses and the lateral force that a path needs, on runs whose figures are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from a_run import INCLINATION, MASS, a_result, a_run
from flat_snow import flat_snow

from sssi_exudyn.analysis.biomechanics import biomechanics
from sssi_exudyn.analysis.losses import AT_LIMIT, at_limit_share, loss_columns, loss_figures, losses
from sssi_exudyn.core.frames import GRAVITY, Array
from sssi_exudyn.reports.sections.losses import MU_N
from sssi_exudyn.reports.sections.losses import losses as section
from sssi_exudyn.results.summary import summary_from_dict
from sssi_exudyn.simulation.result import SimulationResult

MU, AIR = 0.08, 12.0
SPEED, RADIUS = 9.0, 14.0


def run_of(com: Array, velocity: Array, force: Array, energy: dict[str, Array]) -> SimulationResult:
    """Return a run over 4 s on that path, with the snow's force (n, 3) N shared by both skis, which point along it."""
    blank = a_result(4.0)
    forward = velocity / np.linalg.norm(velocity, axis=1, keepdims=True)
    load = np.repeat(0.5 * force[:, 2:], 2, axis=1)
    within = force * [1.0, 1.0, 0.0]
    both = np.stack([0.5 * within, 0.5 * within], axis=1)
    return replace(
        blank,
        com=com,
        com_velocity=velocity,
        foot_velocity=np.stack([velocity, velocity], axis=1),
        foot_forward=np.stack([forward, forward], axis=1),
        foot_load=load,
        snow=flat_snow(load, both),
        energy=energy,
    )


def block() -> SimulationResult:
    """Return a block that slides down the fall line against friction and a steady force of the air."""
    time = a_result(4.0).time
    load = MASS * GRAVITY * np.cos(INCLINATION)
    rate = GRAVITY * np.sin(INCLINATION) - (MU * load + AIR) / MASS
    way, speed = 5.0 * time + 0.5 * rate * time**2, 5.0 + rate * time
    none = np.zeros_like(time)
    force = np.column_stack([none - MU * load, none, none + load])
    energy = {"friction": -MU * load * way, "air": -AIR * way}
    return run_of(np.column_stack([way, none, none]), np.column_stack([speed, none, none]), force, energy)


def circle() -> SimulationResult:
    """Return a body on a circle on level snow, which the snow alone turns, without friction."""
    time = a_result(4.0).time
    angle = SPEED * time / RADIUS
    out = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    along = np.column_stack([-np.sin(angle), np.cos(angle), 0.0 * angle])
    force = -MASS * SPEED**2 / RADIUS * out + [0.0, 0.0, MASS * GRAVITY]
    return run_of(RADIUS * out, SPEED * along, force, {"friction": 0.0 * time})


def whole(run: SimulationResult, inclination: float) -> dict[str, float]:
    return loss_columns(losses(run, inclination), np.ones(len(run.time), dtype=bool))


def test_a_block_loses_what_friction_and_air_take() -> None:
    figures = whole(block(), float(INCLINATION))
    weight = MASS * GRAVITY
    braking = MU * weight * np.cos(INCLINATION)
    assert figures["effective_friction"] == pytest.approx(MU, rel=1e-3)  # trapezoids of a speed that rises evenly
    assert figures["air_share_of_losses"] == pytest.approx(AIR / (AIR + braking), rel=1e-12)
    lost = (braking + AIR) / (MASS * np.sin(INCLINATION))
    assert figures["energy_lost_J_per_kg_m"] == pytest.approx(lost, rel=1e-12)
    assert figures["lateral_ratio_p90"] == pytest.approx(0.0, abs=1e-12)


def test_a_circle_needs_the_centripetal_force_and_loses_nothing() -> None:
    figures = whole(circle(), 0.0)
    assert figures["lateral_ratio_p90"] == pytest.approx(SPEED**2 / (GRAVITY * RADIUS), rel=1e-12)
    assert figures["energy_lost_J_per_kg"] == pytest.approx(0.0, abs=1e-9)
    assert figures["effective_friction"] == 0.0
    assert np.isnan(figures["energy_lost_J_per_kg_m"])  # no drop to count by
    assert np.isnan(figures["air_share_of_losses"])


def test_what_a_turn_needs_is_not_the_coefficient() -> None:
    """The ratio is the path's, whatever μ_n; at the limit a ski is where its law's force is spent."""
    run, needed = circle(), SPEED**2 / (GRAVITY * RADIUS)
    assert at_limit_share(run, needed) == 1.0
    assert at_limit_share(run, 1.01 * needed / AT_LIMIT) == 0.0


def test_a_ski_that_does_not_press_needs_nothing() -> None:
    run = circle()
    lifted = replace(run, snow=flat_snow(0.0 * run.foot_load, 0.0 * run.foot_friction))
    assert np.all(np.isnan(losses(lifted, 0.0).lateral_ratio))
    assert np.isnan(at_limit_share(lifted, 0.5))


def test_phases_add_up_to_their_turn() -> None:
    table = biomechanics(a_result(), MASS, float(INCLINATION)).table
    for _, rows in table.groupby("turn"):
        by_phase = rows.set_index("phase")
        parts = by_phase.loc[["initiation", "control", "completion"]]
        for name in ("drop_m", "energy_lost_J_per_kg"):
            # phases end at the last sample before the next begins: two of 20 ms of some 2 s are in none
            assert parts[name].sum() == pytest.approx(by_phase.loc["turn", name], rel=0.03, abs=0.3)


def test_figures_of_a_run_by_phase() -> None:
    run = a_result()
    table = biomechanics(run, MASS, float(INCLINATION)).table
    figures = loss_figures(run, table, float(INCLINATION))
    assert figures.lateral_at_limit_share is None  # edges that cut have no μ_n
    assert figures.effective_friction is not None
    # its energies say 90 J/s of friction, its loads one body weight on the path of both feet
    speed = float(np.mean(np.linalg.norm(run.com_velocity, axis=1)))
    assert figures.effective_friction == pytest.approx(90.0 / (MASS * 9.81 * speed), rel=1e-3)  # means of samples
    assert set(figures.energy_lost_J_per_kg_m or {}) == {"turn", "initiation", "control", "completion"}
    assert loss_figures(replace_time(run), table, 0.0).effective_friction is None


def replace_time(run: SimulationResult) -> SimulationResult:
    """Return the first sample alone: a run that stopped at once."""
    first = {name: value[:1] for name, value in vars(run).items() if isinstance(value, np.ndarray)}
    snow = flat_snow(run.foot_load[:1], run.foot_friction[:1])
    return replace(run, **first, snow=snow, energy={name: work[:1] for name, work in run.energy.items()})


def test_the_report_says_what_mu_n_is() -> None:
    shown = section([a_run()])
    words = " ".join(str(block) for block in shown.blocks)
    assert MU_N in words
    assert "effective friction" in words
    old = replace(a_run(), summary=summary_from_dict({"recording": "of an older version"}))
    assert section([old]).blocks == ()
