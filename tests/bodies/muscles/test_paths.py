"""Muscle paths against closed forms, and moment arms against differences of the length."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import osim_example
import pytest
from scipy.special import ellipeinc

from sssi_exudyn.bodies.muscles.bones import Bone, Bones, Drive
from sssi_exudyn.bodies.muscles.curves import line, polygon, spline
from sssi_exudyn.bodies.muscles.osim import read_osim
from sssi_exudyn.bodies.muscles.paths import Muscle, MuscleModel, PathPoint, Surface, Wrap, muscle_paths
from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array

ONE_BONE = Bones(
    (Bone("ground", None), Bone("arm", "ground", turns=(Drive(np.array([0.0, 0, 1]), line(1.0), "q"),))), ("q",)
)


def over(kind: str, size: list[float], a: list[float], b: list[float], axis: int = 0, sign: float = 0.0) -> MuscleModel:
    """Return a muscle from ``a`` on the ground to ``b`` on an arm that turns about z, over a surface at the origin."""
    surface = Surface("s", "ground", kind, np.zeros(3), np.eye(3), np.array(size), axis, sign)
    points = (PathPoint("ground", np.array(a)), PathPoint("arm", np.array(b)))
    muscle = Muscle("m", points, 1.0, 0.1, 0.1, 0.0, (Wrap("s", 0, 1),))
    return MuscleModel("one", ONE_BONE, (muscle,), (surface,), np.zeros(1))


def length(model: MuscleModel, q: float = 0.0) -> float:
    return float(muscle_paths(model, np.array([[q]])).length[0, 0])


@pytest.mark.parametrize("climb", [0.0, 0.03])
def test_around_a_cylinder_against_the_closed_form(climb: float) -> None:
    radius, far = 0.05, 0.13
    # from (-far, 0) to (far, 0): two tangents and what lies between, unrolled one straight line
    straight = math.sqrt(far**2 - radius**2)
    flat = 2.0 * straight + radius * (math.pi - 2.0 * math.acos(radius / far))
    model = over("cylinder", [radius, 1.0, 0.0], [-far, 1e-12, 0.0], [far, 0.0, climb])
    assert length(model) == pytest.approx(math.hypot(flat, climb), rel=1e-12)  # rounding


def test_a_side_sends_the_path_the_long_way_round() -> None:
    radius, a, b = 0.05, [-0.13, -0.03, 0.0], [0.13, -0.03, 0.0]
    free = length(over("cylinder", [radius, 1.0, 0.0], a, b))
    held = length(over("cylinder", [radius, 1.0, 0.0], a, b, axis=1, sign=1.0))
    far = math.hypot(a[0], a[1])
    end_angle, opening = math.atan2(b[1], b[0]), math.acos(radius / far)
    over_the_top = 2.0 * math.sqrt(far**2 - radius**2) + radius * (math.pi - 2.0 * end_angle - 2.0 * opening)
    assert free < held == pytest.approx(over_the_top, rel=1e-12)  # rounding


def test_around_a_sphere_on_a_great_circle() -> None:
    radius, a, b = 0.05, np.array([-0.13, 0.01, 0.02]), np.array([0.11, 0.015, -0.02])
    far = np.linalg.norm([a, b], axis=1)
    angle = math.acos(a @ b / far.prod()) - np.arccos(radius / far).sum()
    closed = np.sqrt(far**2 - radius**2).sum() + radius * angle
    # the plane is found to 1e-6 rad, and the length is least there: its error is of second order
    assert length(over("sphere", [radius] * 3, list(a), list(b))) == pytest.approx(closed, rel=1e-10)


def test_around_an_ellipsoid_in_its_plane_of_symmetry() -> None:
    """Take half axes 1 : 2, the third large: the shortest plane is that of symmetry, its arc an elliptic integral."""
    p, q, far = 0.04, 0.08, 0.12
    model = over("ellipsoid", [p, q, 1.0], [-far, 1e-12, 0.0], [far, 0.0, 0.0])
    x = p**2 / far  # where the tangent from (far, 0) touches
    touching_angle = math.acos(x / p)  # (p cos φ, q sin φ)
    touching = math.hypot(far - x, q * math.sin(touching_angle))
    # ∫ sqrt(p² sin² + q² cos²) = q E(φ, 1 − p²/q²) from 0
    quarter, start = (q * ellipeinc(phi, 1.0 - p**2 / q**2) for phi in (math.pi / 2.0, touching_angle))
    # 14 Gauss points on an arc of a third of a turn
    assert length(model) == pytest.approx(2.0 * (touching + quarter - start), rel=1e-8)


def test_no_wrap_where_the_line_misses_the_surface() -> None:
    a, b = [-0.1, 0.06, 0.0], [0.1, 0.06, 0.0]
    for kind, size in (("cylinder", [0.05, 1.0, 0.0]), ("sphere", [0.05] * 3), ("ellipsoid", [0.05, 0.05, 0.2])):
        assert length(over(kind, size, a, b)) == pytest.approx(0.2, rel=1e-15)  # rounding


def test_a_short_cylinder_is_missed() -> None:
    a, b = [-0.1, 0.0, 0.3], [0.1, 0.0, 0.3]
    assert length(over("cylinder", [0.05, 0.2, 0.0], a, b)) == pytest.approx(0.2, rel=1e-15)  # rounding


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> MuscleModel:
    path = tmp_path_factory.mktemp("osim") / "leg.osim"
    path.write_text(osim_example.version_3(), encoding="utf-8")
    return read_osim(path)


def postures(model: MuscleModel) -> Array:
    rng = np.random.default_rng(5)
    low, high = {"hip_flexion": (-0.3, 1.2), "knee": (-1.8, 0.1)}, (-0.3, 0.3)
    ranges = [low.get(name, high) for name in model.bones.coordinates]
    return np.stack([rng.uniform(*bounds, 40) for bounds in ranges], axis=1)


def test_moment_arms_are_minus_the_derivative_of_the_length(leg: MuscleModel) -> None:
    q = postures(leg)
    paths = muscle_paths(leg, q)
    step = 1e-6
    for c, name in enumerate(paths.coordinates):
        if name == "rolling":  # follows the knee
            assert np.all(paths.moment_arm[:, :, c] == 0.0)
            continue
        ahead, behind = q.copy(), q.copy()
        ahead[:, c] += step
        behind[:, c] -= step
        slope = (muscle_paths(leg, ahead).length - muscle_paths(leg, behind).length) / (2.0 * step)
        # rounding of lengths around 0.3 m over 2e-6 rad is 1e-10, the step's own error 1e-12; on the ellipsoid the
        # plane's angle is found to 1e-6 rad
        assert np.max(np.abs(slope + paths.moment_arm[:, :, c])) < 1e-6


def test_every_kind_of_point_and_surface_is_met(leg: MuscleModel) -> None:
    """Check that paths do wrap and conditional points come and go here; else the test above shows nothing."""
    q = postures(leg)
    paths = muscle_paths(leg, q)
    bare = MuscleModel(
        leg.name,
        leg.bones,
        tuple(Muscle(m.name, m.points, 1.0, 0.1, 0.1, 0.0) for m in leg.muscles),
        (),
        leg.defaults,
    )
    longer = paths.length - muscle_paths(bare, q).length
    for k, muscle in enumerate(leg.muscles):
        assert np.any(longer[:, k] > 1e-4) == bool(muscle.wraps)
    knee = q[:, leg.bones.coordinates.index("knee")]
    assert np.any(knee < -0.8)
    assert np.any(knee > -0.8)


def test_speed_is_the_derivative_along_a_movement(leg: MuscleModel) -> None:
    rates = np.array([[0.7, -0.4, 1.1, 0.0]])
    q = np.array([[0.4, 0.1, -0.5, 0.0]])
    step = 1e-6
    change = muscle_paths(leg, q + step * rates).length - muscle_paths(leg, q - step * rates).length
    # rounding over the step
    assert np.allclose(muscle_paths(leg, q).speed(rates), change / (2.0 * step), atol=1e-8)


def test_pull_on_a_group_balances_that_on_the_rest(leg: MuscleModel) -> None:
    q = postures(leg)[:3]
    upper, lower = muscle_paths(leg, q, groups=(("ground", "pelvis", "femur"), ("shank",))).pull.transpose(2, 0, 1, 3)
    assert np.allclose(upper, -lower, atol=1e-12)  # rounding
    # a straight muscle that does not reach the shank does not pull it, one that does pulls with its tension
    assert np.allclose(lower[:, 0], 0.0)
    assert np.allclose(np.linalg.norm(lower[:, 1], axis=-1), 1.0)


def test_versions_3_and_4_say_the_same(leg: MuscleModel, tmp_path: Path) -> None:
    path = tmp_path / "leg.osim"
    path.write_text(osim_example.version_4(), encoding="utf-8")
    newer = read_osim(path)
    assert [m.name for m in newer.muscles] == [m.name for m in leg.muscles]
    assert newer.bones.coordinates == leg.bones.coordinates
    q = postures(leg)
    assert np.allclose(muscle_paths(newer, q).length, muscle_paths(leg, q).length, rtol=1e-14)  # rounding


def _without(text: str, part: str) -> str:
    assert part in text
    return text.replace(part, "")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda text: "not xml", "broken XML"),
        (lambda text: "<a/>", "this is not an OpenSim model"),
        (lambda text: _without(text, "<max_isometric_force>500"), "broken XML"),
        (lambda text: text.replace("0.1</pennation", "x</pennation"), "'x' are not numbers"),
        (lambda text: text.replace("<body>shank</body>", "<body>foot</body>"), "no 'foot'"),
        (lambda text: text.replace("<wrap_object>ball", "<wrap_object>cube"), "no wrap object 'cube'"),
        (lambda text: text.replace("<coordinate>knee", "<coordinate>elbow"), "no 'elbow'"),
        (lambda text: text.replace("SimmSpline", "Sine"), "the function Sine is not known"),
        (lambda text: text.replace("-2 -1.2 -0.5", "-2 -1.2 -1.5"), "x that grow"),
        (lambda text: text.replace("<parent_body>femur", "<parent_body>shank"), "hangs on nothing"),
    ],
)
def test_a_bad_file_is_one_clear_line(spoil: Callable[[str], str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "leg.osim"
    path.write_text(spoil(osim_example.version_3()), encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        read_osim(path)
    assert "\n" not in str(caught.value)


def test_curves() -> None:
    x, y = np.array([-1.0, 0.0, 0.7, 2.0, 2.5]), np.array([0.3, -0.1, 0.4, 0.2, 0.0])
    points = np.linspace(-2.0, 4.0, 61)
    smooth = spline(x, y)
    assert np.allclose(smooth(x)[0], y)
    inside = (points > -1.0) & (points < 2.5)
    # the end conditions are a cubic's own, so a cubic is met exactly
    cubic = spline(x, x**3 - x)
    assert np.allclose(cubic(points[inside])[0], points[inside] ** 3 - points[inside])
    assert np.allclose(np.diff(smooth(points[points > 2.6])[0], 2), 0.0)  # straight beyond the ends
    slope = smooth(points)[1]
    step = 1e-6
    # third derivatives of order 10 times the step squared, and rounding over the step
    assert np.allclose(slope, (smooth(points + step)[0] - smooth(points - step)[0]) / (2.0 * step), atol=1e-9)
    for curve in (smooth, polygon(x, y), line(2.0, 1.0)):
        for stretch, factor in ((2.0, 3.0), (-0.5, 0.7)):
            assert np.allclose(curve.scale(stretch, factor)(points * stretch)[0], factor * curve(points)[0])
        assert np.allclose(curve.lift(0.25)(points)[0], curve(points)[0] + 0.25)
