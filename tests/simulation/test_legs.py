"""Legs that give: springs in series with the snow, an energy balance, and the paper's run where they hold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from gliding import INCLINATION, model, standing

from sssi_exudyn.contact.terms.air import AirDrag
from sssi_exudyn.contact.terms.carving import Carving
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.contact.terms.terrain import TerrainBump
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.derivatives import run_tangents
from sssi_exudyn.simulation.reduced.prepared import ReducedRun, prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.validation.capture_error import CaptureError, with_error

COMPLIANCE = 4e-5
"""m/N: 25 kN/m."""
EDGED = {"hip_adduction_l": 0.25, "hip_adduction_r": -0.3}
"""rad; legs side by side that lean, each ski on its edge."""


def giving(start: Model, compliance: float = COMPLIANCE) -> Model:
    return start.with_values({"legs.compliance": compliance})


def at_rest(start: Model, raised: float = 0.0) -> ReducedRun:
    """Return the first instants of a skier who stands still, the left foot captured higher by ``raised`` (m)."""
    prepared = prepare(start, standing(0.1), step=0.01)
    return simulate_reduced(start, with_error(prepared, CaptureError("height", 0, None), raised))


@pytest.mark.parametrize("tier", ["full", "reduced"])
def test_legs_carry_the_skier_above_the_skis(tier: str) -> None:
    """Each leg of a skier who glides is shortened by what it carries, the ski apart, over its stiffness."""
    motion, heights = standing(0.9), []
    for start in (model(), giving(model())):
        prepared = prepare(start, motion)
        run = simulate(start, motion) if tier == "full" else simulate_reduced(start, prepared)
        heights.append(float(run.pelvis[-1, 2]))
    on_leg = 0.5 * prepared.body_mass * GRAVITY * np.cos(INCLINATION)
    # 0.1 %: what is left of settling from the start, whose rest leaves the skis' own weight aside
    assert heights[0] - heights[1] == pytest.approx(COMPLIANCE * on_leg, rel=1e-3)


def test_legs_and_snow_are_springs_in_series() -> None:
    """A foot that stands higher takes less load by 1/(1/k + compliance), where k is that of ski and snow."""
    still, raised = model(speed=0.0), 1e-4
    shifts = [at_rest(one, raised).foot_load[0] for one in (still, giving(still))]
    rigid, soft = (abs(loads[1] - loads[0]) / raised for loads in shifts)
    # rest is found to 1e-9 of the load, of which the shift is a hundredth; the snow's curvature acts on both feet alike
    assert soft == pytest.approx(1.0 / (1.0 / rigid + COMPLIANCE), rel=1e-4)


@pytest.mark.long
def test_energy_balance() -> None:
    """What a hollow puts into the legs they give back, but for what their dampers take."""
    snow = (*model().terms, TerrainBump(rise=-0.15, f0=3.0, width=1.0))
    held, soft = (simulate(one, standing(0.9, **EDGED)) for one in (model(snow), giving(model(snow))))
    # what gravity gave is kinetic, elastic or lost to a term; as for skis that are held
    assert soft.closure_percent < 0.1
    assert soft.energy["damping"][-1] < held.energy["damping"][-1] - 1.0  # J
    assert np.ptp(soft.energy["elastic"]) > np.ptp(held.energy["elastic"]) + 5.0


def test_both_models_agree_on_edges() -> None:
    """Friction loads the legs, and slides with their boots, alike in both."""
    start, motion = giving(model(across=0.5)), standing(0.8, **EDGED)
    full, reduced = simulate(start, motion), simulate_reduced(start, prepare(start, motion, step=start.solver.step))
    later = np.flatnonzero(full.time > 0.2)  # the start settles in the first tenth of a second
    # m, N, N m: those of skis that are held differ by 2e-4, 6 and 0.2; the friction's arm to the risen boot makes 2 N m
    for name, seen, allowed in (("pelvis", full.pelvis, 1e-4), ("foot_load", full.foot_load, 1.0)):
        np.testing.assert_allclose(seen[later], getattr(reduced, name)[later], atol=allowed, rtol=0.0, err_msg=name)
    np.testing.assert_allclose(full.snow.moment[later], reduced.snow_moment[later], atol=0.3, rtol=0.0)


def test_stiff_legs_are_the_papers_run() -> None:
    """The run differs from that of legs that hold in proportion to the compliance."""
    start, motion = model(across=0.5), standing(0.8, **EDGED)
    prepared = prepare(start, motion)
    held, stiff, stiffer = (simulate_reduced(giving(start, c), prepared) for c in (0.0, 2e-7, 1e-7))
    assert held.foot_load.shape == stiff.foot_load.shape
    # of two instants each: the stiff damper takes from one to the next the sign of what is left of the start
    one, two = ((run.foot_load - held.foot_load)[held.time > 0.2] for run in (stiffer, stiff))
    one, two = 0.5 * (one[1:] + one[:-1]), 0.5 * (two[1:] + two[:-1])
    assert np.abs(two).max() > 0.1  # N
    # 3 %: what is quadratic in a compliance of a hundredth of the snow's
    np.testing.assert_allclose(two, 2.0 * one, atol=0.03 * np.abs(two).max(), rtol=0.0)


def test_stiff_legs_end_where_legs_hold(tmp_path: Path) -> None:
    """Files of models whose legs hold say nothing of them; others are read as they were written."""
    start = model()
    assert "legs" not in model_to_dict(start)
    path = tmp_path / "model.toml"
    path.write_text(tomli_w.dumps(model_to_dict(giving(start))))
    assert read_model(path).legs == giving(start).legs


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("compliance = -1e-5", "[legs] compliance"),
        ("compliance = 1.0", "[legs] compliance"),
        ('compliance = "soft"', "[legs] compliance"),
        ("stiffness = 3e4", "[legs] stiffness"),
    ],
)
def test_what_no_leg_is_is_refused(tmp_path: Path, line: str, place: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(f"{tomli_w.dumps(model_to_dict(model()))}\n[legs]\n{line}\n")
    with pytest.raises(InputError) as raised:
        read_model(path)
    assert raised.value.place == place


def test_on_snow_that_edges_cut_the_boots_joints_give(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    cut = replace(giving(model()), terms=(Carving(),))
    path.write_text(tomli_w.dumps(model_to_dict(cut)))
    with pytest.raises(InputError, match="joint at the boot gives already"):
        read_model(path)


def test_legs_hold_once_edges_cut() -> None:
    soft = giving(model())
    assert soft.with_terms((Carving(), AirDrag())).legs.compliance == 0.0
    assert soft.with_terms((*soft.terms, TerrainBump())).legs.compliance == COMPLIANCE


def test_legs_that_hold_have_no_derivative() -> None:
    start = model((HuntCrossley(),))
    prepared = prepare(start, standing(0.1))
    with pytest.raises(InputError, match="above 0"):
        run_tangents(start, prepared, ["legs.compliance"])
