"""Muscles that share moments, against closed forms, and those of a standing skier against a calculation by hand."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import gliding
import numpy as np
import pytest
import standing

from sssi_exudyn.bodies.muscles.force_curves import fibres, force_length, force_velocity
from sssi_exudyn.bodies.muscles.muscles import skier_muscles
from sssi_exudyn.bodies.muscles.paths import muscle_paths
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, forward_kinematics
from sssi_exudyn.contact.terms.body_forces import PolePlant, UnexplainedForce
from sssi_exudyn.core.frames import Array, slope_to_enu
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import spline_motion
from sssi_exudyn.muscle_forces import static_optimisation
from sssi_exudyn.muscle_forces.forces import JOINTS, MUSCLED, muscle_forces
from sssi_exudyn.muscle_forces.of_result import MuscleRun, joint_forces, muscle_figures, muscles_of
from sssi_exudyn.muscle_forces.static_optimisation import LEAST, optimise, reach
from sssi_exudyn.results.stored import StoredRun
from sssi_exudyn.results.summary import Summary
from sssi_exudyn.simulation.assembly import Parts

HALF = 161
"""Number of muscles of a side; the right ones come first."""


def level() -> Model:
    return replace(gliding.model(), inclination=0.0)


def run_of(lead: float = 0.0) -> StoredRun:
    model = level()
    series = standing.standing(model, lead=lead).to_frame(slope_to_enu(0.0, 0.0))
    return StoredRun(Summary(), series, model, geometry=standing.geometry())


@pytest.fixture(scope="module")
def still() -> MuscleRun:
    return muscles_of(run_of(), folder=Path())


def total(run: MuscleRun, group: str, side: str) -> float:
    """Return the force (N) of a group at the first sample."""
    return sum(
        float(run.forces.force[0, k])
        for k, named in enumerate(run.skier.named)
        if named.group == group and named.side == side
    )


def of_back(run: MuscleRun) -> float:
    """Return the force (N) of all extensors of the lumbar spine."""
    return sum(total(run, group, side) for group in ("erector_spinae", "multifidus") for side in ("left", "right"))


@pytest.mark.parametrize(("power", "exponent"), [(2, 1.0), (3, 0.5)])
def test_two_muscles_share_as_the_closed_form_says(power: int, exponent: float) -> None:
    """Minimise Σ aᵖ with Σ c a = b: Lagrange's condition is aᵖ⁻¹ ∝ c."""
    c, wanted = np.array([30.0, 10.0]), 20.0
    shares = c**exponent
    closed = wanted * shares / (c @ shares)
    optimum = optimise(np.tile(c, (3, 1, 1)), np.full((3, 1), wanted), power)
    # the reserve takes what a step in it is worth: 2 r / r₀² = λ, some 1e-3 N m of 20; the solver's own 1e-6
    assert np.allclose(optimum.activation, closed, atol=1e-4)


def test_bounds_and_what_is_missing() -> None:
    strong, weak = optimise(np.array([[[30.0, -10.0]]]), np.array([[20.0]])), np.array([[[30.0, -10.0]]])
    # the antagonist stays as low as it may
    assert strong.activation[0, 1] == pytest.approx(LEAST, abs=1e-6)
    weak_optimum = optimise(weak, np.array([[50.0]]))
    assert np.allclose(weak_optimum.activation, [[1.0, LEAST]], atol=1e-6)  # the solver's precision
    assert weak_optimum.reserve[0, 0] == pytest.approx(50.0 - 30.0 + 10.0 * LEAST, abs=1e-4)


def test_activations_at_a_corner_satisfy_the_conditions_of_optimality() -> None:
    """Take many muscles and joints: the gradient 2 a − Aᵀ λ is zero inside, and points outwards at bounds."""
    rng = np.random.default_rng(2)
    at_full = rng.normal(0.0, 20.0, (1, 5, 40)) * (rng.random((1, 5, 40)) < 0.4)
    wanted = at_full[0] @ rng.random(40)
    optimum = optimise(at_full, wanted[None])
    a, multiplier = optimum.activation[0], 2.0 * optimum.reserve[0] / 0.3**2
    slope = 2.0 * a - at_full[0].T @ multiplier
    inside = (a > LEAST + 1e-6) & (a < 1.0 - 1e-6)
    # the solver's 1e-6 in r / 50 N m becomes 1e-3 in λ, and that times moments of 20 N m
    assert np.max(np.abs(slope[inside])) < 1e-2
    assert np.all(slope[a <= LEAST + 1e-6] > -1e-2)
    assert np.allclose(at_full[0] @ a + optimum.reserve[0], wanted, atol=1e-3)


@pytest.mark.parametrize("power", [2, 3])
def test_where_the_solver_gives_up_the_active_set_takes_over(power: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take many muscles, half of them at a bound: both methods give the same activations."""
    rng = np.random.default_rng(4)
    at_full = rng.normal(0.0, 20.0, (3, 5, 40)) * (rng.random((3, 5, 40)) < 0.4)
    wanted = at_full @ np.where(rng.random(40) < 0.5, 1.0, LEAST)
    usual = optimise(at_full, wanted, power)
    monkeypatch.setattr(static_optimisation, "MAX_ITERATIONS", 1)
    by_active_set = optimise(at_full, wanted, power)
    # the first solver's precision, and that of Newton's steps
    assert np.allclose(by_active_set.activation, usual.activation, atol=5e-4)
    assert np.allclose(by_active_set.reserve, usual.reserve, atol=1e-2)


def test_activation_rises_and_falls_by_its_time_constants() -> None:
    """Switch a moment on and off: activation follows 1 − e^(−t/10 ms) and e^(−t/40 ms)."""
    time = 0.002 * np.arange(100)
    wanted = np.where((time > 0.05) & (time < 0.1), 1000.0, 0.0)[:, None]  # more than the muscle has
    activation = optimise(np.full((100, 1, 1), 30.0), wanted, time=time).activation[:, 0]
    first = int(np.argmax(wanted > 0.0))
    rise = 1.0 - (1.0 - LEAST) * np.exp(-(time[first : first + 20] - time[first - 1]) / 0.010)
    assert np.allclose(activation[first : first + 20], rise, atol=1e-5)  # the solver's precision, step by step
    last = int(np.flatnonzero(wanted)[-1])
    fall = LEAST + (activation[last] - LEAST) * np.exp(-(time[last:] - time[last]) / 0.040)
    assert np.allclose(activation[last:], fall, atol=1e-5)
    free = optimise(np.full((100, 1, 1), 30.0), wanted).activation[:, 0]
    assert free[first] == pytest.approx(1.0)
    assert free[last + 1] == pytest.approx(LEAST, abs=1e-6)


def test_a_muscle_that_cannot_let_go_is_held_by_its_antagonist() -> None:
    """Reverse the moment from one sample to the next: more of the other muscle makes it."""
    time, at_full = np.array([0.0, 0.007]), np.tile([30.0, -30.0], (2, 1, 1))
    optimum = optimise(at_full, np.array([[12.0], [-3.0]]), time=time)
    assert optimum.activation[1, 0] == pytest.approx(reach(optimum.activation[0], 0.007)[0][0], abs=1e-6)
    assert np.allclose(optimum.reserve, 0.0, atol=1e-2)
    assert optimum.activation[1, 1] - optimum.activation[1, 0] == pytest.approx(0.1, abs=1e-3)


def test_another_power_is_refused() -> None:
    with pytest.raises(ValueError, match="power is 4"):
        optimise(np.ones((1, 1, 2)), np.ones((1, 1)), 4)


def test_curves() -> None:
    one = np.array([1.0])
    # the numbers are given to sixteen digits; OpenSim chose them so that these hold
    assert force_length(one)[0] == pytest.approx(1.0, abs=1e-12)
    assert force_velocity(np.array([0.0, -1.0])) == pytest.approx([1.0, 0.0], abs=1e-12)
    lengths = np.linspace(0.3, 1.8, 151)
    assert lengths[np.argmax(force_length(lengths))] == pytest.approx(1.0, abs=0.02)  # De Groote et al., fig. 2
    speeds = np.linspace(-1.0, 1.0, 21)
    assert np.all(np.diff(force_velocity(speeds)) > 0.0)
    assert 1.4 < force_velocity(one)[0] < 1.9  # lengthening fibres hold half as much again and more


def test_fibre_of_a_rigid_tendon() -> None:
    optimal, slack, pennation = 0.1, 0.2, 0.3
    length = np.array([[slack + optimal * np.cos(pennation)]])
    muscle = (np.array([500.0]), np.array([optimal]), np.array([slack]), np.array([pennation]))
    at_rest = fibres(length, np.zeros((1, 1)), *muscle)
    assert at_rest.length[0, 0] == pytest.approx(1.0, rel=1e-12)
    assert at_rest.force[0, 0] == pytest.approx(500.0 * np.cos(pennation), rel=1e-12)
    # the fibre's speed is the derivative of its length
    step, speed = 1e-6, 0.05
    ahead, behind = (fibres(length + sign * step * speed, np.zeros((1, 1)), *muscle).length for sign in (1.0, -1.0))
    per_second = (ahead - behind)[0, 0] / (2.0 * step)
    moving = fibres(length, np.full((1, 1), speed), *muscle).speed[0, 0] * 10.0  # ten optimal lengths a second
    assert moving == pytest.approx(per_second, rel=1e-6)  # rounding over the step


def test_symmetric_posture_symmetric_forces(still: MuscleRun) -> None:
    force = still.forces.force
    # the solver's 1e-6 of activation on muscles of up to 5 kN
    assert np.allclose(force[:, :HALF], force[:, HALF:], atol=0.05)
    contact = {name: still.forces.contact[:, k] for k, name in enumerate(JOINTS)}
    for joint in ("hip", "knee", "ankle"):
        assert np.allclose(contact[f"{joint}_r"], contact[f"{joint}_l"] * [1.0, -1.0, 1.0], atol=0.5)


def test_more_weight_on_one_leg_more_force_in_it() -> None:
    leaning = muscles_of(run_of(lead=0.15), folder=Path())
    assert total(leaning, "quadriceps_femoris", "right") > 1.3 * total(leaning, "quadriceps_femoris", "left")


def test_moments_are_made(still: MuscleRun) -> None:
    """Let him stand, which needs less than the muscles can: they make every moment, to 0.1 % of the largest."""
    assert np.max(np.abs(still.forces.reserve)) < 1e-3 * np.max(np.abs(still.forces.wanted))
    figures = muscle_figures(still)
    assert figures.lacking == ()
    assert figures.strong_enough_share == 1.0
    assert np.allclose(still.forces.made + still.forces.reserve, still.forces.wanted)


def test_a_stretch_boundary_changes_nothing(still: MuscleRun) -> None:
    """Let him stand still: all samples are equal."""
    # the solver's 1e-6 on muscles of up to 5 kN
    assert np.allclose(still.forces.force, still.forces.force[0], atol=0.05)


def by_hand() -> tuple[float, float, float, float]:
    """Return the moments (N m) and forces (N) that half the weight makes on a knee and the trunk on the lumbar spine.

    Plane statics: the snow's force goes up under the centre of mass; what is beyond a joint hangs on it.
    """
    model, chain = level(), standing.geometry()
    result = standing.standing(model)
    parts = Parts(model, spline_motion(chain, 0.0, result.time, np.tile(standing.angles(), (len(result.time), 1))))
    bend = standing.CROUCH
    # from the knee down to the ankle the shank leans forward by the ankle's angle, the foot being flat
    shank = chain.joint_in_parent[SEGMENT["talus_r"]]
    ankle = np.array([-np.sin(bend["ankle_angle"]), -np.cos(bend["ankle_angle"])]) * -shank[2]
    thigh_leans = bend["knee_angle"] - bend["ankle_angle"]  # backwards
    hip = np.array([-np.sin(thigh_leans), np.cos(thigh_leans)]) * 0.3958
    com = result.com[0, 0] - float(np.mean([chain.joint_in_parent[SEGMENT[f"femur_{s}"]][0] for s in "rl"]))
    ground = 0.5 * parts.mass * 9.81 - 0.5 * (parts.mass - parts.body_mass) * 9.81
    under = (hip[0] + com) * ground  # forward of the knee
    shank_part, foot_parts = parts.inertias[SEGMENT["tibia_r"]], ("talus_r", "calcn_r", "toes_r")
    below = shank_part.mass * 9.81 * 0.44 * ankle[0]  # de Leva: 44 % of its length from the knee
    foot = sum(parts.inertias[SEGMENT[name]].mass for name in foot_parts) * 9.81
    knee = -(under - below - foot * (ankle[0] + 0.02))
    upper = [part for name, part in zip(SEGMENT, parts.inertias, strict=True) if name in ABOVE]
    weight = sum(part.mass for part in upper) * 9.81
    return knee, weight, ground, foot + shank_part.mass * 9.81


ABOVE = ("torso", "head", *(f"{name}_{side}" for name in ("humerus", "ulna", "radius", "hand") for side in "rl"))


def test_quadriceps_against_a_calculation_by_hand(still: MuscleRun) -> None:
    """Divide the moment of the snow's force about the knee by the patellar tendon's lever."""
    moment, _, _, _ = by_hand()
    # the hand's foot is a point 2 cm before the ankle
    assert -run_of().series["knee_angle_r_moment_Nm"].iloc[0] == pytest.approx(moment, rel=0.02)
    # the tibia slides by some millimetres a radian, under half the weight: a tenth of this moment
    assert -float(still.forces.wanted[0, MUSCLED.index("knee_angle_r")]) == pytest.approx(moment, rel=0.1)
    arms = muscle_paths(still.skier.model, standing.angles()[None], ["knee_angle_r"]).moment_arm[0, :, 0]
    lever = np.mean([-arms[k] for k, n in enumerate(still.skier.named) if n.group == "quadriceps_femoris"][:4])
    by_lever = moment / lever
    quadriceps = total(still, "quadriceps_femoris", "right")
    # hamstrings and gastrocnemii, which hips and ankles need, bend the knee: the quadriceps do more, not half more
    assert by_lever < quadriceps < 1.5 * by_lever


def test_erector_spinae_against_a_calculation_by_hand(still: MuscleRun) -> None:
    """Divide the upper body's moment by the extensors' lever: 5 to 7 cm for fascicles that span the whole lumbar spine,
    and half that for those that cross some of its joints only.
    """
    moment = float(still.forces.wanted[0, MUSCLED.index("lumbar_extension")])
    extensors = of_back(still)
    assert moment / 0.07 < extensors < moment / 0.03


def test_a_tuck_against_a_calculation_by_hand() -> None:
    """Level the trunk over the thighs: the back holds the upper body's weight at its lever, a knee half of what stands
    above it at its own.  The quadriceps' pull presses tibia and femur together.
    """
    model, chain = level(), standing.geometry()
    stood = standing.standing(model, bend=standing.TUCK)
    series = stood.to_frame(slope_to_enu(0.0, 0.0))
    run = muscles_of(StoredRun(Summary(), series, model, geometry=chain), Path())
    parts = Parts(model, spline_motion(chain, 0.0, stood.time, stood.coordinates[:, 3:]))
    poses = forward_kinematics(chain, stood.coordinates[:1], 0.0)

    def weight_and_place(names: Sequence[str]) -> tuple[float, float]:
        segments = [SEGMENT[name] for name in names]
        mass = np.array([parts.inertias[i].mass for i in segments])
        ahead = [(poses.origin[0, i] + poses.rotation[0, i] @ parts.inertias[i].com)[0] for i in segments]
        return float(mass.sum()) * 9.81, float(mass @ ahead / mass.sum())

    upper, ahead = weight_and_place(ABOVE)
    lumbar = upper * (ahead - poses.origin[0, SEGMENT["torso"], 0])
    assert series["lumbar_extension_moment_Nm"].iloc[0] == pytest.approx(lumbar, rel=1e-6)  # rounding
    below, shank_forward = weight_and_place([f"{name}_r" for name in ("tibia", "talus", "calcn", "toes")])
    knee = poses.origin[0, SEGMENT["tibia_r"], 0]
    ground = 0.5 * parts.body_mass * 9.81
    extension = ground * (knee - stood.com[0, 0]) - below * (knee - shank_forward)
    assert -series["knee_angle_r_moment_Nm"].iloc[0] == pytest.approx(extension, rel=1e-6)
    wanted, reserve = run.forces.wanted[0], np.abs(run.forces.reserve[0])
    strong = [k for k, name in enumerate(MUSCLED) if not name.startswith("hip_")]
    assert np.all(reserve[strong] < 0.5)  # the hips' extensors have lost their levers at 120° of flexion
    quadriceps, hamstrings = (total(run, group, "right") for group in ("quadriceps_femoris", "hamstrings"))
    assert quadriceps > -float(wanted[MUSCLED.index("knee_angle_r")]) / 0.06  # the longest lever of a bent knee
    knee_load = float(np.linalg.norm(run.forces.contact[0, list(JOINTS).index("knee_r")]))
    assert quadriceps < knee_load < ground + 1.5 * quadriceps + hamstrings + total(run, "triceps_surae", "right")
    # trunk level: extensors of 3 to 7 cm of lever press L5/S1 by ten times the upper body's weight and less
    assert lumbar / 0.07 < of_back(run) < lumbar / 0.03


def test_loads_without_muscles_are_the_weights(still: MuscleRun) -> None:
    """Leave the muscles out: each joint carries what stands on it; the joints of the pelvis add up to its weight."""
    run = run_of()
    angles = np.radians(run.series[[f"{name}_deg" for name in PRESCRIBED]].to_numpy(dtype=float))
    motion = spline_motion(standing.geometry(), 0.0, run.time, angles)
    _, rates, accelerations = motion.evaluate(run.time)
    parts = Parts(run.model, motion)
    force = joint_forces(run, parts, angles, rates, accelerations)
    _, weight, ground, below = by_hand()
    size = np.linalg.norm(force[0], axis=1)
    assert size[SEGMENT["torso"]] == pytest.approx(weight, rel=1e-9)  # rounding, and the spline's accelerations
    assert size[SEGMENT["tibia_r"]] == pytest.approx(ground - below, rel=1e-9)
    around = force[0, [SEGMENT[name] for name in ("torso", "femur_l", "femur_r")]].sum(axis=0)
    pelvis = parts.inertias[SEGMENT["pelvis"]].mass * 9.81
    assert np.linalg.norm(around) == pytest.approx(pelvis, rel=1e-9)


def test_what_acts_on_the_body_goes_through_the_joints_by_mass() -> None:
    """Push by 200 N up, by no known force: trunk and knee carry the share of the mass beyond them."""
    model = replace(level(), terms=(*level().terms, UnexplainedForce(force_n=200.0, t0=-5.0, t1=5.0)))
    pushed = replace(run_of(), model=model)
    angles = np.radians(pushed.series[[f"{name}_deg" for name in PRESCRIBED]].to_numpy(dtype=float))
    motion = spline_motion(standing.geometry(), 0.0, pushed.time, angles)
    _, rates, accelerations = motion.evaluate(pushed.time)
    loads = [joint_forces(run, Parts(run.model, motion), angles, rates, accelerations)[0] for run in (run_of(), pushed)]
    parts = Parts(level(), motion)
    change = np.linalg.norm(loads[1] - loads[0], axis=1)
    for segment, beyond in (("torso", ABOVE), ("tibia_r", ("tibia_r", "talus_r", "calcn_r", "toes_r"))):
        mass = sum(parts.inertias[SEGMENT[name]].mass for name in beyond)
        assert change[SEGMENT[segment]] == pytest.approx(200.0 * mass / parts.body_mass, rel=1e-9)  # rounding


def test_contact_is_weight_and_muscles(still: MuscleRun) -> None:
    """Check that the knee carries its weight and, along the shank, the pull of patellar tendon and hamstrings."""
    size = np.linalg.norm(still.forces.contact[0], axis=1)
    loads = dict(zip(JOINTS, size, strict=True))
    _, weight, ground, _ = by_hand()
    quadriceps = total(still, "quadriceps_femoris", "right")
    assert ground < loads["knee_r"] < ground + 2.0 * quadriceps
    extensors = of_back(still)
    assert 0.5 * extensors < loads["L5_S1"] < weight + 2.0 * extensors


def test_moments_turned_round_are_lacking() -> None:
    """Ask 2 kN m of a hip: it is reported to lack what its muscles do not have."""
    model, chain = level(), standing.geometry()
    skier = skier_muscles(chain)
    q = standing.angles()[None]
    moments: Array = np.zeros((1, len(PRESCRIBED)))
    moments[0, PRESCRIBED.index("hip_flexion_r")] = -2000.0
    forces = muscle_forces(skier, chain, np.zeros(1), q, np.zeros_like(q), moments, np.zeros((1, len(SEGMENT), 3)))
    run = MuscleRun(np.zeros(1), skier, "full", forces, model.skier.mass * 9.81, 2, 0.0)
    (missing,) = (joint.worst_Nm for joint in muscle_figures(run).lacking if joint.coordinate == "hip_flexion_r")
    assert missing < -1000.0
    made_moment = float(forces.made[0, MUSCLED.index("hip_flexion_r")])
    assert made_moment + missing == pytest.approx(-2000.0)
    # it cannot do more than all its muscles at once
    arms = muscle_paths(skier.model, q, ["hip_flexion_r"]).moment_arm[0, :, 0]
    most = sum(
        arm * muscle.max_isometric_force for arm, muscle in zip(arms, skier.model.muscles, strict=True) if arm < 0
    )
    assert most < made_moment < 0.0


def test_a_pole_goes_through_hand_arm_and_trunk() -> None:
    """Push by 100 N up at the left hand: left shoulder and trunk's joint carry all of it, the right shoulder none."""
    pole = PolePlant(up=100.0 * np.sqrt(2.0 * np.pi), t=0.2, width=1.0, side=1.0)
    planted = replace(run_of(), model=replace(level(), terms=(*level().terms, pole)))
    angles = np.radians(planted.series[[f"{name}_deg" for name in PRESCRIBED]].to_numpy(dtype=float))
    motion = spline_motion(standing.geometry(), 0.0, planted.time, angles)
    _, rates, accelerations = motion.evaluate(planted.time)
    row = int(np.argmin(np.abs(planted.time - 0.2)))
    loads = [
        joint_forces(run, Parts(run.model, motion), angles, rates, accelerations)[row] for run in (run_of(), planted)
    ]
    change = np.linalg.norm(loads[1] - loads[0], axis=1)
    for segment in ("hand_l", "humerus_l", "torso"):
        assert change[SEGMENT[segment]] == pytest.approx(100.0, rel=1e-9)  # rounding
    for segment in ("hand_r", "humerus_r", "femur_l", "tibia_r"):
        assert change[SEGMENT[segment]] == pytest.approx(0.0, abs=1e-9)
