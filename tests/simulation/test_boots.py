"""Where boots put the skis under a skier, and what that does to his ankles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from gliding import INCLINATION, model, standing

from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.model.model import Model
from sssi_exudyn.model.toml import model_to_dict, read_model
from sssi_exudyn.simulation.assembly import Parts
from sssi_exudyn.simulation.full.run import simulate

AHEAD = 0.07
RAMP = np.radians(2.0)
INSTANTS = np.array([0.0, 0.2])


def in_boots(**fit: float) -> Model:
    start = model()
    return replace(start, equipment=replace(start.equipment, **fit))


def test_the_ski_stands_ahead_of_the_ankle_along_the_foot() -> None:
    under, ahead = (
        Parts(booted, standing(0.5)).posture(INSTANTS) for booted in (in_boots(), in_boots(boot_centre=AHEAD))
    )
    forward = under.foot_rotation[..., 0]
    np.testing.assert_allclose(ahead.foot_place - under.foot_place, AHEAD * forward, atol=1e-12)
    np.testing.assert_array_equal(ahead.foot_rotation, under.foot_rotation)
    # bindings, here without the ski, go along: 0.65 kg each of 80 kg
    moved = ahead.com_place - under.com_place
    parts = Parts(in_boots(), standing(0.5))
    binding = parts.model.equipment.ski_mass - parts.mesh.element_mass.sum()
    np.testing.assert_allclose(moved, 2.0 * binding / parts.body_mass * AHEAD * forward[:, 0], atol=1e-12)


def test_a_ramp_is_a_foot_that_points_down() -> None:
    """The ski of an ankle bent up by the ramp's angle lies as that of a foot on a ramp: a run cannot tell them."""
    on_ramp = Parts(in_boots(ramp_angle=RAMP, boot_centre=AHEAD), standing(0.5)).posture(INSTANTS)
    ankle = float(np.radians(10.0) + RAMP)
    bent = standing(0.5, ankle_angle_l=ankle, ankle_angle_r=ankle)
    level = Parts(in_boots(boot_centre=AHEAD), bent).posture(INSTANTS)
    for name in ("foot_place", "foot_rotation"):
        np.testing.assert_allclose(getattr(on_ramp, name), getattr(level, name), atol=1e-12)
    # toes down against the ski: the ski's tip is up against the foot
    flat = Parts(in_boots(), standing(0.5)).posture(INSTANTS)
    rise = np.einsum("nsi,nsi->ns", on_ramp.foot_rotation[..., 0], flat.foot_rotation[..., 2])
    np.testing.assert_allclose(rise, np.sin(RAMP), atol=1e-12)


@pytest.mark.long
def test_the_ankle_holds_what_presses_ahead_of_it() -> None:
    """Standing skiers who glide straight down: N presses farther ahead, less the weight of ski and binding there."""
    runs = [simulate(booted, standing(1.0), stop=0.6) for booted in (in_boots(), in_boots(boot_centre=AHEAD))]
    ankles = [runs[0].moment_names.index(f"ankle_angle_{side}") for side in "lr"]
    settled = runs[0].time > 0.3
    change = (runs[1].joint_moments - runs[0].joint_moments)[settled][:, ankles]
    load = runs[0].foot_load[settled]
    carried = runs[0].foot_load[settled].mean() - model().equipment.ski_mass * GRAVITY * np.cos(INCLINATION)
    assert load.mean() == pytest.approx(0.5 * Parts(model(), standing(1.0)).mass * GRAVITY * np.cos(INCLINATION), 0.01)
    # plantarflexion is negative; 2 %: friction, the same at both, is a little larger or smaller with the load
    assert change.mean() == pytest.approx(-carried * AHEAD, rel=0.02)
    tilt = runs[0].moment_names.index("pelvis_tilt")
    whole = (runs[1].joint_moments - runs[0].joint_moments)[settled, tilt]
    # both feet's change reaches the pelvis whole; it tilts backwards
    assert abs(whole.mean()) == pytest.approx(2.0 * carried * AHEAD, rel=0.02)


def test_a_models_file_keeps_its_boots(tmp_path: Path) -> None:
    start = in_boots(boot_centre=AHEAD, ramp_angle=RAMP, boot_sole_length=0.3, cuff_flexion=250.0)
    table = model_to_dict(start)
    (tmp_path / "model.toml").write_text(tomli_w.dumps(table))
    again = read_model(tmp_path / "model.toml").equipment
    assert (again.boot_centre, again.boot_sole_length) == (AHEAD, 0.3)
    assert again.cuff_flexion == pytest.approx(250.0, rel=1e-12)  # through N m/deg
    assert again.cuff_lean is None  # as nobody stated it
    assert again.ramp_angle == pytest.approx(RAMP, rel=1e-12)  # through degrees


def test_a_models_file_from_before_has_its_skis_under_the_ankles(tmp_path: Path) -> None:
    table = model_to_dict(in_boots(boot_centre=AHEAD))
    table["equipment"] = {
        name: table["equipment"][name] for name in ("skis", "ski_mass_kg", "boot_mass_kg", "ankle_to_ski_base_m")
    }
    (tmp_path / "model.toml").write_text(tomli_w.dumps(table))
    assert read_model(tmp_path / "model.toml").equipment.boot_centre == 0.0


@pytest.mark.long
def test_edging_by_hand() -> None:
    """Skiers who slide sideways, skis flat: friction at the base turns each foot about its long axis with 0.13 m · F,
    less what slows down ski, binding and boot below and above the ankle.
    """
    start = model(speed=0.0, across=3.0)
    start = replace(start, inclination=0.0)
    motion = replace(standing(0.6, pelvis_tilt=0.0), inclination=0.0)
    run = simulate(start, motion, stop=0.4)
    assert run.ankle_edging is not None
    later = run.time > 0.15
    slowing = np.gradient(run.com_velocity[:, 1], run.time)[later]
    parts = Parts(start, motion)
    gear = start.equipment
    for side, letter in enumerate("lr"):
        foot = parts.foot(letter)
        ski = float(parts.mesh.element_mass.sum())
        friction = run.foot_friction[later, side, 1]
        # moments about the ankle's forward axis, of forces to the left: −z F; F is negative here
        outer = gear.ankle_to_ski_base * friction - gear.ankle_to_ski_base * ski * slowing
        own = -foot.com[2] * foot.mass * slowing
        # 0.3 N m of 30: the ski's middle is a few millimetres above its base, and its load moves with its tilt
        np.testing.assert_allclose(run.ankle_edging[later, side].mean(), (own - outer).mean(), atol=0.5)
    assert abs(run.ankle_edging[later].mean()) > 20.0
