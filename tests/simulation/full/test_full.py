"""The full model where the answer is known: straight glides, side slip, drag, flight, mirror images, energy."""

from dataclasses import replace

import numpy as np
import pytest
from bundled import bundled, coarse
from gliding import INCLINATION, model, standing

from sssi_exudyn.bodies.skier.chain import PRESCRIBED
from sssi_exudyn.contact.terms.air import AirDrag, FrontalAreas
from sssi_exudyn.contact.terms.friction import AnisotropicFriction
from sssi_exudyn.contact.terms.penetration import HuntCrossley
from sssi_exudyn.core.errors import SimulationDiverged
from sssi_exudyn.core.frames import GRAVITY
from sssi_exudyn.core.quantity import quantities
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult

SNOW = HuntCrossley()
NO_SIGN = 1e-3
"""m/s; so narrow a regularisation that at 1 m/s and more friction is Coulomb's to a millionth."""


def slope_of(time: np.ndarray, values: np.ndarray) -> float:
    return float(np.polyfit(time, values, 1)[0])


def test_block_on_a_slope() -> None:
    friction = AnisotropicFriction(mu_t=0.1, mu_n=0.5, eps=NO_SIGN)
    run = simulate(model((SNOW, friction)), standing(0.6))
    expected = GRAVITY * (np.sin(INCLINATION) - 0.1 * np.cos(INCLINATION))
    # the start settles in the first tenth of a second: the load is within a percent of the weight's share after it
    later = run.time > 0.2
    # 0.1 %: what is left of that settling, times the friction's share of the acceleration
    assert slope_of(run.time[later], run.com_velocity[later, 0]) == pytest.approx(expected, rel=1e-3)
    assert np.all(np.abs(run.com[:, 1] - run.com[0, 1]) < 1e-9)


def test_side_slip() -> None:
    """Skis across the fall line slide sideways with the friction across them."""
    turned = float(np.radians(90.0))
    # standing on a slope with the skis across it: the body leans into the hill so that the soles lie on the snow
    motion = standing(0.6, heading=turned, pelvis_tilt=0.0, pelvis_list=float(INCLINATION))
    friction = AnisotropicFriction(mu_t=0.05, mu_n=0.15, eps=NO_SIGN)
    run = simulate(model((SNOW, friction), speed=1.5), motion)
    assert np.degrees(np.abs(run.edge_angle)).max() < 1e-6
    later = run.time > 0.2
    expected = GRAVITY * (np.sin(INCLINATION) - 0.15 * np.cos(INCLINATION))
    # one foot stands higher up the hill: the load is not shared evenly, but its sum is the weight's share all the same
    assert slope_of(run.time[later], run.com_velocity[later, 0]) == pytest.approx(expected, rel=2e-3)


def test_terminal_speed_under_drag() -> None:
    """At m g (sin α − μ cos α) = ½ ρ C_D A v² the acceleration is nought."""
    start = model()
    mass = start.skier.mass + 2.0 * (start.equipment.boot_mass + start.equipment.ski_mass)
    air, friction = AirDrag(), AnisotropicFriction(mu_t=0.1, mu_n=0.5, eps=NO_SIGN)
    area = sum(FrontalAreas().of_height(start.skier.height).values())
    drive = mass * GRAVITY * (np.sin(INCLINATION) - 0.1 * np.cos(INCLINATION))
    terminal = float(np.sqrt(2.0 * drive / (air.rho * air.c_d * area)))
    run = simulate(model((SNOW, friction, air), speed=terminal), standing(0.5))
    later = run.time > 0.2
    # a thousandth of the acceleration without air, as for the block
    assert abs(slope_of(run.time[later], run.com_velocity[later, 0])) < 1e-3 * drive / mass


def test_snow_that_cannot_carry_is_said() -> None:
    soft = HuntCrossley(k=1e-6 * quantities(HuntCrossley)["k"].low, c=0.0)
    with pytest.raises(SimulationDiverged, match="come to rest"):
        simulate(model((soft, AnisotropicFriction())), standing(0.1))


def test_a_run_that_stops_says_when_and_what_and_keeps_the_rest() -> None:
    motion = standing(1.0)
    broken = motion.coefficients.copy()
    broken[len(broken) // 2 :, PRESCRIBED.index("pelvis_rotation")] = 40.0  # six turns of the body within a frame
    with pytest.raises(SimulationDiverged, match=r"diverged at 0\.\d+ s: .* pelvis_rotation turning at") as raised:
        simulate(model(), replace(motion, coefficients=broken))
    partial = raised.value.partial
    assert isinstance(partial, SimulationResult)
    assert 0.4 < partial.time[-1] < 0.6
    assert np.all(np.isfinite(partial.com))


def mirrored(run: SimulationResult, other: SimulationResult) -> float:
    """Largest difference of loads, left against right, in shares of the largest load."""
    return float(np.max(np.abs(run.foot_load - other.foot_load[:, ::-1])) / np.max(run.foot_load))


@pytest.mark.long
def test_mirror_image() -> None:
    """A posture and its mirror image load left and right the other way round."""
    edged = {"hip_adduction_l": 0.05, "hip_adduction_r": -0.08, "pelvis_list": 0.03}
    swapped = {"hip_adduction_r": 0.05, "hip_adduction_l": -0.08, "pelvis_list": -0.03}
    runs = [simulate(model(across=side), standing(0.3, **angles)) for side, angles in ((0.3, edged), (-0.3, swapped))]
    # Newton's tolerance (1e-4 of each step's first residual) is met by different roundings on the two sides
    assert mirrored(*runs) < 1e-3
    names = [name.replace("_l", "_?").replace("_r", "_l").replace("_?", "_r") for name in PRESCRIBED]
    names = [name if name in PRESCRIBED else PRESCRIBED[i] for i, name in enumerate(names)]
    order = [PRESCRIBED.index(name) for name in names]
    knee = PRESCRIBED.index("knee_angle_l")
    moments, others = runs[0].joint_moments, runs[1].joint_moments
    peak = np.max(np.abs(moments[:, knee]))
    assert np.max(np.abs(moments[:, knee] - others[:, order[knee]])) < 1e-3 * peak


def test_energy_balance() -> None:
    run = simulate(model(across=0.5), standing(0.6, hip_adduction_l=0.05))
    # what gravity gave is kinetic, elastic or lost to a term; 1 % is asked, trapezoids over 7 ms do far better
    assert run.closure_percent < 0.1
    assert run.energy["friction"][-1] < 0.0
    assert run.energy["air"][-1] < 0.0
    assert run.energy["gravity"][-1] > 0.0


@pytest.mark.parametrize(
    "snow",
    [SNOW, HuntCrossley(m1=1.2), HuntCrossley(k=5349.0, c=3708.0, m1=1.2, m3=1.58)],
    ids=["usual", "hard", "light"],
)
def test_no_jolt_at_the_start(snow: HuntCrossley) -> None:
    run = simulate(model((snow, AnisotropicFriction(), AirDrag())), standing(0.4))
    total = run.foot_load.sum(axis=1)
    carried = model()
    mass = carried.skier.mass + 2.0 * (carried.equipment.boot_mass + carried.equipment.ski_mass)
    weight = mass * GRAVITY * np.cos(INCLINATION)
    # 5 %: what the skis still have to settle by when the holding load gives way to gravity
    assert np.max(np.abs(total - weight)) < 0.05 * weight


@pytest.mark.parametrize(
    ("numbers", "apart"),
    [
        ({"penetration.m1": 1.2}, 30.0),  # a skier who still bounces begins with 290 N more
        ({"start.height": 0.004, "start.velocity_n": -0.15}, 50.0),
    ],
    ids=["snow that damps little", "not at rest"],
)
def test_it_starts_as_the_reduced_model_does(numbers: dict[str, float], apart: float) -> None:
    recording, motion = bundled("intermediate")
    motion = replace(motion, stop=motion.start + 0.3)
    usual = coarse(model_of(recording, motion))
    other = usual.with_values(numbers)
    reduced, full = simulate_reduced(other, prepare(other, motion)), simulate(other, motion)
    loads = [np.interp(full.time, run.time, run.sole_force.sum(axis=1)) for run in (reduced, full)]
    np.testing.assert_allclose(*loads, atol=apart)  # of some 900 N
    before = simulate_reduced(usual, prepare(usual, motion)).sole_force.sum(axis=1)
    assert np.max(np.abs(reduced.sole_force.sum(axis=1) - before)) > 2.0 * apart  # and it matters
