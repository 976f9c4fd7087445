"""Poles: what they do at the hand, by hand; a pole that stands in the snow."""

from dataclasses import replace

import numpy as np
import pytest
from gliding import INCLINATION, model, standing

from sssi_exudyn.bodies.skier.anthropometry import GRIP, POLE_CENTRE, body_inertia
from sssi_exudyn.bodies.skier.chain import SEGMENT, average_geometry
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.term import BodyState, hand_forces
from sssi_exudyn.contact.terms.body_forces import PlantedPole, PolePlant
from sssi_exudyn.core.frames import Array
from sssi_exudyn.fitting.balance import balance_of
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced
from sssi_exudyn.simulation.result import SimulationResult

SEEN = average_geometry(1.75)
UPPER_ARM, FOREARM = 0.186 * 1.75, 0.146 * 1.75
HAND = GRIP * 0.108 * 1.75
WIDTH = 2.0 * 0.129 * 1.75
PUSH = PolePlant(forward=-12.0, up=9.0, t=0.2, width=0.05)


def arms_ahead(seconds: float = 0.5) -> Motion:
    """Upper arms hanging, forearms level to the front."""
    return standing(seconds, elbow_flex_l=np.pi / 2.0, elbow_flex_r=np.pi / 2.0)


def pushed(side: float) -> SimulationResult:
    start = model((*PAPER_TERMS, replace(PUSH, side=side)))
    start = replace(start, solver=replace(start.solver, elements=20))
    return simulate(start, arms_ahead(), stop=0.4)


@pytest.fixture(scope="module")
def left() -> SimulationResult:
    return pushed(1.0)


@pytest.fixture(scope="module")
def right() -> SimulationResult:
    return pushed(-1.0)


@pytest.mark.long
def test_a_pole_moves_the_skier_the_same_in_either_hand(left: SimulationResult, right: SimulationResult) -> None:
    np.testing.assert_array_equal(left.com, right.com)
    np.testing.assert_array_equal(left.foot_load, right.foot_load)
    assert left.pole_force is not None
    assert right.pole_force is not None
    np.testing.assert_array_equal(left.pole_force, right.pole_force[:, ::-1])
    np.testing.assert_array_equal(left.pole_force[:, 1], 0.0)
    impulse = np.trapezoid(left.pole_force[:, 0], left.time, axis=0)
    # the run begins and ends four widths from the middle; steps of 7 ms against 50
    assert impulse == pytest.approx([PUSH.forward, 0.0, PUSH.up], abs=0.01)


@pytest.mark.long
def test_moments_of_arm_and_trunk_by_hand(left: SimulationResult, right: SimulationResult) -> None:
    """A push F at a hand that is ahead of the elbow by its forearm and as far below the shoulder as the upper arm."""
    assert left.pole_force is not None
    forward, up = left.pole_force[:, 0, 0], left.pole_force[:, 0, 2]
    change = {name: (left.joint_moments - right.joint_moments)[:, i] for i, name in enumerate(left.moment_names)}
    ahead = FOREARM + HAND
    # what drives a joint is opposite to what the push does to it; flexion swings the hand forwards and up
    peak = np.abs(up).max()
    expected = {
        "elbow_flex_l": -ahead * up,
        "arm_flex_l": -(ahead * up + UPPER_ARM * forward),
        "arm_flex_r": ahead * up + UPPER_ARM * forward,
        "lumbar_rotation": WIDTH * forward,  # to the left: a push back on the left hand turns the trunk to the left
        "pelvis_rotation": WIDTH * forward,
        "knee_angle_l": 0.0 * up,
        "ankle_angle_r": 0.0 * up,
    }
    for name, moment in expected.items():
        if name == "pelvis_rotation":  # about the plumb line, which the slope tilts
            moment = np.cos(INCLINATION) * WIDTH * forward + np.sin(INCLINATION) * WIDTH * up
        np.testing.assert_allclose(change[name], moment, atol=1e-6 * peak, err_msg=name)


@pytest.mark.long
def test_the_pole_takes_the_energy_of_its_hand(left: SimulationResult) -> None:
    # 0.5 %: as for a run without poles in steps of 7 ms
    assert left.closure_percent < 0.5


@pytest.mark.long
def test_the_moment_left_over_knows_the_hand() -> None:
    """The push moved from the left to the right hand turns the body by its width; the reduced model's balance."""
    motion = arms_ahead()
    residuals: list[Array] = []
    for side in (1.0, -1.0):
        start = model((*PAPER_TERMS, replace(PUSH, side=side)))
        prepared = prepare(start, motion)
        run = simulate_reduced(start, prepared)
        residuals.append(balance_of(start, motion, prepared, run).residual(run, prepared))
    pulse = np.exp(-0.5 * ((run.time - PUSH.t) / PUSH.width) ** 2) / (PUSH.width * np.sqrt(2.0 * np.pi))
    # what is left over is what the pelvis would have to be held with: minus (w, to the left) x F
    np.testing.assert_allclose((residuals[0] - residuals[1])[:, 0], -WIDTH * PUSH.up * pulse, atol=0.01)
    np.testing.assert_allclose((residuals[0] - residuals[1])[:, 2], WIDTH * PUSH.forward * pulse, atol=0.01)


def test_a_planted_pole_by_hand() -> None:
    """Half-way, the hand over the tip, all of the force is up; before, it brakes; the tip stands still."""
    pole = PlantedPole(press=80.0, t0=1.0, t1=1.4, ahead=0.8, length=1.2, side=1.0)
    speed = 4.0
    over = 1.0 + 0.8 / speed

    def force(t: float) -> Array:
        state = BodyState(t=t, f=0.0, l=0.0, velocity=(0.0, speed, 0.0))
        return np.array([float(part) for part in pole.force(FloatMath(), state)])

    # 1e-3: the least speed that has a direction, 0.1 m/s, in squares
    assert force(over) == pytest.approx([0.0, 0.0, 80.0], abs=0.1)
    assert force(0.99).tolist() == [0.0, 0.0, 0.0]
    assert force(1.41).tolist() == [0.0, 0.0, 0.0]
    early, late = force(1.1), force(1.3)
    assert early[1] < 0.0 < late[1]
    assert early[0] == late[0] == 0.0
    tips = []
    for t in np.linspace(1.02, 1.38, 10):
        pushed = force(t)
        shape = 0.5 * (1.0 - np.cos(2.0 * np.pi * (t - 1.0) / 0.4))
        assert np.linalg.norm(pushed) == pytest.approx(80.0 * shape, rel=1e-3)
        hand = speed * t  # on its way to the left
        tips.append(hand - 1.2 * pushed[1] / np.linalg.norm(pushed))
    assert tips == pytest.approx([speed * 1.0 + 0.8] * 10, abs=1e-3)
    share = hand_forces(FloatMath(), [pole], BodyState(t=over, f=0.0, l=0.0, velocity=(0.0, speed, 0.0)))
    assert share[0][2] == pytest.approx(80.0, rel=1e-3)
    assert share[1] == (0.0, 0.0, 0.0)


def test_poles_weigh_on_the_hands() -> None:
    mass, length = 0.25, 1.2
    bare, held = (body_inertia(SEEN, 70.0, "male", pole=pole) for pole in ((0.0, length), (mass, length)))
    for letter in "lr":
        hand, with_pole = bare[SEGMENT[f"hand_{letter}"]], held[SEGMENT[f"hand_{letter}"]]
        assert with_pole.mass == pytest.approx(hand.mass + mass)
        pole = (with_pole.mass * with_pole.com - hand.mass * hand.com) / mass
        # in the middle of the hand, the tip behind an arm that hangs
        assert pole == pytest.approx([-POLE_CENTRE * length, 0.0, -HAND], abs=1e-12)
        # a rod of 1.2 m and 0.25 kg alone has 0.03 kg m² about its middle
        assert with_pole.inertia[1, 1] > 0.03
    assert bare[SEGMENT["torso"]].mass == held[SEGMENT["torso"]].mass
