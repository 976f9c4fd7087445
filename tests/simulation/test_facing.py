"""What a skier shows the air: ellipsoids one by one, one behind the other, and whole postures against wind tunnels."""

from dataclasses import replace

import gliding
import numpy as np
import pytest

from sssi_exudyn.bodies.skier.anthropometry import body_inertia
from sssi_exudyn.bodies.skier.chain import PRESCRIBED, SEGMENT, Poses, average_geometry, forward_kinematics
from sssi_exudyn.contact.maths import FloatMath
from sssi_exudyn.contact.registry import PAPER_TERMS, combine_terms
from sssi_exudyn.contact.term import SegmentState
from sssi_exudyn.contact.terms.air import AirDrag, PostureAir, ShownAreas
from sssi_exudyn.core.frames import Array
from sssi_exudyn.simulation.facing import facing
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.reduced.prepared import prepare
from sssi_exudyn.simulation.reduced.run import simulate_reduced

HEIGHT = 1.75
CHAIN = average_geometry(HEIGHT)
INERTIAS = body_inertia(CHAIN, 75.0, "male", boot_mass=1.9, binding_mass=0.6)
SHOWN = {name: np.array(areas) for name, areas in ShownAreas().of_height(HEIGHT).items()}
UPRIGHT: dict[str, float] = {}
MIDDLE = {
    "knee_angle": 60.0, "hip_flexion": 65.0, "ankle_angle": 20.0, "lumbar_extension": -15.0,
    "arm_flex": 40.0, "elbow_flex": 60.0, "arm_add": -25.0,
}  # fmt: skip
TUCK = {
    "knee_angle": 110.0, "hip_flexion": 135.0, "ankle_angle": 25.0, "lumbar_extension": -30.0,
    "arm_flex": 90.0, "elbow_flex": 110.0, "arm_add": 30.0,
}  # fmt: skip
ARMS_OUT = TUCK | {"arm_flex": 60.0, "elbow_flex": 10.0, "arm_add": -80.0}


def posed(bent: dict[str, float]) -> Poses:
    """The skier with joints bent by so many degrees on both sides, on feet that are flat."""
    q = np.zeros((1, 3 + len(PRESCRIBED)))
    for i, name in enumerate(PRESCRIBED):
        q[0, 3 + i] = np.radians(bent.get(name.removesuffix("_r").removesuffix("_l"), 0.0))
    tilt = bent.get("knee_angle", 0.0) - bent.get("hip_flexion", 0.0) - bent.get("ankle_angle", 0.0)
    q[0, 3 + PRESCRIBED.index("pelvis_tilt")] = np.radians(tilt)
    return forward_kinematics(CHAIN, q, 0.0)


def force(bent: dict[str, float], speed: float = 1.0) -> Array:
    """(3,) N at a speed straight ahead, divided by ½ ρ v²: drag area backwards, lift area upwards (m²)."""
    law = PostureAir()
    total = np.zeros(3)
    for matrix in facing(posed(bent), INERTIAS, SHOWN)[0]:
        state = SegmentState((speed, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, tuple(matrix[np.triu_indices(3)]))
        total += law.force(FloatMath(), state)
    return total / (0.5 * law.rho * speed**2)


def moved(poses: Poses, segment: str, place: Array) -> Poses:
    """The poses with a segment's centre of mass put to a place."""
    i = SEGMENT[segment]
    origin = poses.origin.copy()
    origin[0, i] = place - poses.rotation[0, i] @ INERTIAS[i].com
    return replace(poses, origin=origin)


def shares(gap: Array) -> Array:
    """How much of two equal balls' areas counts, the second ``gap`` (3,) m from the first."""
    poses = moved(moved(posed(UPRIGHT), "hand_l", np.zeros(3)), "hand_r", gap)
    matrices = facing(poses, INERTIAS, dict.fromkeys(("hand_l", "hand_r"), np.full(3, 0.04)))[0]
    return np.sqrt(matrices[:, 0, 0]) / 0.04


def test_an_ellipsoid_shows_the_area_of_its_shadow() -> None:
    """Its shadow by counting: points on a grid across the direction that a ray through the ellipsoid meets."""
    areas = np.array([0.055, 0.060, 0.023])
    poses = posed({"hip_flexion": 37.0, "knee_angle": 10.0})
    matrix = facing(poses, INERTIAS, {"femur_r": areas})[0, 0]
    turn = poses.rotation[0, SEGMENT["femur_r"]]
    half = np.sqrt(np.prod(areas) / np.pi) / areas
    towards = np.array([0.8, 0.36, 0.48])
    across = np.linalg.svd(towards[None])[2][1:]
    line = np.linspace(-0.3, 0.3, 601)
    points = (line[:, None, None] * across[0] + line[None, :, None] * across[1]) @ turn / half
    ray = towards @ turn / half
    meets = (points @ ray) ** 2 >= (ray @ ray) * (np.sum(points**2, axis=-1) - 1.0)
    counted = np.count_nonzero(meets) * (line[1] - line[0]) ** 2
    assert np.sqrt(towards @ matrix @ towards) == pytest.approx(counted, rel=2e-3)  # 600 cells across


def test_a_segment_behind_another_is_shielded_and_one_next_to_it_is_not() -> None:
    assert np.allclose(shares(np.array([-0.5, 0.0, 0.0])), [1.0, 0.0], atol=0.05)  # its edge is smooth
    assert np.allclose(shares(np.array([0.5, 0.0, 0.0])), [0.0, 1.0], atol=0.05)
    assert np.allclose(shares(np.array([0.0, 0.6, 0.0])), 1.0)
    # two discs of one radius, centres a radius apart, share 2/3 − √3/2π of their area
    radius = float(np.sqrt(0.04 / np.pi))
    seen = shares(np.array([-0.5, radius, 0.0]))
    assert seen[1] == pytest.approx(1.0 - (2.0 / 3.0 - np.sqrt(3.0) / (2.0 * np.pi)), abs=0.05)  # 37 points


def test_shielding_comes_and_goes_without_a_jump() -> None:
    gaps = np.linspace(-0.3, 0.3, 121)
    seen = np.array([shares(np.array([-0.5, y, 0.0]))[1] for y in gaps])
    # over a diameter of 0.23 m it falls by 1: 0.022 a step of 5 mm, at a disc's edge and with its smooth rim twice that
    assert np.max(np.abs(np.diff(seen))) < 0.06


@pytest.mark.parametrize(("bent", "measured", "spread"), [(UPRIGHT, 0.66, 0.09), (TUCK, 0.23, 0.03)])
def test_drag_areas_are_those_of_wind_tunnels(bent: dict[str, float], measured: float, spread: float) -> None:
    """Appl. Sci. 12 (2022) 902: means and standard deviations of ten skiers, m², with one coefficient for both ends."""
    assert -force(bent)[0] == pytest.approx(measured, abs=spread)


def test_a_tuck_is_a_tuck() -> None:
    """Watanabe & Ohtsuki 1977: raised trunk, then arms stretched out, each make more drag; lift is upwards."""
    upright, middle, out, tuck = (-force(bent)[0] for bent in (UPRIGHT, MIDDLE, ARMS_OUT, TUCK))
    assert upright > middle > out > 1.2 * tuck
    for bent in (MIDDLE, TUCK):
        assert 0.0 < force(bent)[2] < 0.21  # the largest that they measured: 113.7 N at 30 m/s


def test_a_ball_drags_as_by_the_papers_formula() -> None:
    ball = SegmentState((9.0, -2.0, 1.0), (1.0, 3.0, 0.0), 0.05, (0.0025, 0.0, 0.0, 0.0025, 0.0, 0.0025))
    law, papers = PostureAir(c_d=0.9, c_l=0.3), AirDrag(c_l=0.3)
    assert law.force(FloatMath(), ball) == pytest.approx(papers.force(FloatMath(), ball), rel=1e-9)  # ``STILL``


def test_what_is_wholly_shielded_feels_nothing() -> None:
    state = SegmentState((9.0, -2.0, 1.0), (0.0, 0.0, 0.0), 0.05)
    assert PostureAir().force(FloatMath(), state) == (0.0, 0.0, 0.0)


def test_a_plate_is_pushed_along_its_normal() -> None:
    """As much at every incidence, as plates are beyond some 40° (Hoerner 1965, 3-16)."""
    normal = np.array([0.6, 0.0, 0.8])
    matrix = 0.1**2 * np.outer(normal, normal)
    for velocity in (np.array([7.0, 0.0, 0.0]), np.array([0.0, 0.0, 7.0]), 7.0 * normal):
        state = SegmentState(tuple(velocity), (0.0, 0.0, 0.0), 0.0, tuple(matrix[np.triu_indices(3)]))
        pushed = np.array(PostureAir(c_d=1.0, rho=1.0).force(FloatMath(), state))
        assert pushed == pytest.approx(-0.5 * 0.1 * 49.0 * normal, rel=1e-6)


@pytest.mark.long
def test_full_and_reduced_model_slow_down_alike_by_what_the_posture_shows() -> None:
    """A crouched skier at 20 m/s, by the paper's constant areas and by those of his posture."""
    motion, speeds = gliding.standing(1.0), []
    for terms in (PAPER_TERMS, combine_terms(PAPER_TERMS, (PostureAir(c_d=0.9),))):
        model = gliding.model(terms, speed=20.0)
        prepared = prepare(model, motion)
        both = [
            float(run.pelvis_velocity[-1, 0]) for run in (simulate_reduced(model, prepared), simulate(model, motion))
        ]
        assert both[0] == pytest.approx(both[1], abs=2e-3)  # the skis' higher modes
        speeds.append(both[0])
    shown = np.sqrt(prepared.exposed_facing[0, :, 0, 0]).sum()
    less = 0.5 * 0.9 * 1.05 * (prepared.area.sum() - shown) * 20.0**2 / prepared.mass
    # the speed changes by 2 % on the way, and the lift takes some of the friction off
    assert speeds[1] - speeds[0] == pytest.approx(less * 1.0, rel=0.1)
